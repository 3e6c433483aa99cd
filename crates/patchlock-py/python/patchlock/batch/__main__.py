"""The command: `python -m patchlock.batch MANIFEST --out DIR`."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from pathlib import Path

from patchlock import PRESETS, Config
from patchlock.batch.manifest import write_truth
from patchlock.batch.run import bench, run
from patchlock.batch.summary import FILE, Summary

EXAMPLES = """\
examples:
  python -m patchlock.batch clips.csv --out out
      tracks every clip of the manifest on all cores of this machine
  python -m patchlock.batch clips.csv --out out --engine ray --address 10.0.0.1:6379
      the same on a Ray cluster whose machines have the clips under the same paths
  python -m patchlock.batch OTB --out out --seeds 3
      a folder is a benchmark dataset; gives the same results as patchlock bench
  patchlock score out --truth truth
      scores the results, after --truth-to truth has collected the truth of the clips

Columns of the manifest; only source and a box (x, y, w, h, or box, or truth) are required:
  source            a folder of images, a pattern, a glob or a video, relative to the manifest
  x, y, w, h        the target in the first tracked frame, counted from 0; or all four in one column, box
  truth             a file with one box per line, counted from 1, for scoring; it gives the first box if
                    there is no other
  name              name of the results; default: the last part of the source
  start, end, stride  range of frames
  seed              seed of the random numbers
  settings          settings that differ, such as particles=200; small_step=4

An interrupted command can be repeated; it continues where it stopped.
Exit codes: 0 done, 1 clips failed, 2 usage error, 130 stopped by Ctrl-C.
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m patchlock.batch",
        description="Tracks many clips in parallel and stores the results in the format of patchlock bench.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "manifest", help="list of clips (.csv or .jsonl), or the folder of a benchmark dataset"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--engine", choices=["local", "ray"], default="local", help="where the runs execute (default: local)"
    )
    parser.add_argument(
        "--address",
        metavar="HOST:PORT",
        help="the Ray cluster (default: the cluster of this machine)",
    )
    parser.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        help="parallel runs on this machine (default: as many as the cores allow)",
    )
    parser.add_argument(
        "--threads", type=int, default=1, metavar="N", help="threads of each run (default: 1)"
    )
    parser.add_argument(
        "--preset", default="robust", choices=PRESETS, help=f"{', '.join(PRESETS)} (default: robust)"
    )
    parser.add_argument(
        "--config", metavar="FILE.toml", help="settings that differ from the preset; see patchlock config"
    )
    parser.add_argument(
        "--model",
        metavar="NAME|DIR|FILE",
        help="the network: patchnet (the default), none, a folder with its ONNX files, or its only file",
    )
    parser.add_argument(
        "--runtime",
        metavar="onnxruntime|FILE",
        help="run the network with the installed package onnxruntime, or with this library of onnxruntime",
    )
    parser.add_argument(
        "--name", help="name of the results (default: that of the settings file, or of the preset)"
    )
    parser.add_argument(
        "--seeds",
        type=int,
        metavar="K",
        help="for a dataset: number of seeds for each target (default: 1)",
    )
    parser.add_argument(
        "--retries",
        type=int,
        default=2,
        metavar="N",
        help="how often to retry a clip whose process or machine died (default: 2)",
    )
    parser.add_argument(
        "--truth-to",
        metavar="DIR",
        help="for a manifest: collect the truth of the clips in this folder, for patchlock score",
    )
    parser.add_argument(
        "--tables",
        metavar="DIR",
        help="for a manifest: write a table CLIP.csv and a summary CLIP.json of each clip to this folder",
    )
    parser.add_argument(
        "--videos",
        metavar="DIR",
        help="for a manifest: write a video CLIP.mp4 of each clip to this folder, with the track drawn in",
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    parser.add_argument("--quiet", "-q", action="store_true", help="no progress bar")
    return parser


def _work(arguments: argparse.Namespace) -> Summary:
    common = {
        name: getattr(arguments, name)
        for name in ("engine", "address", "jobs", "threads", "name", "retries")
    }
    common["progress"] = False if arguments.quiet else None
    if Path(arguments.manifest).is_dir():
        if arguments.truth_to is not None:
            raise ValueError(
                "--truth-to is for manifests; patchlock score reads the truth of a dataset itself"
            )
        if arguments.tables is not None:
            raise ValueError("--tables is for manifests; patchlock report shows the runs of a dataset")
        if arguments.videos is not None:
            raise ValueError("--videos is for manifests; patchlock track draws a sequence of a dataset")
        return bench(
            arguments.manifest,
            arguments.out,
            seeds=1 if arguments.seeds is None else arguments.seeds,
            preset=arguments.preset,
            file=arguments.config,
            model=arguments.model,
            runtime=arguments.runtime,
            **common,
        )
    if arguments.seeds is not None:
        raise ValueError("--seeds is for datasets; in a manifest, each clip has its own seed")
    if arguments.truth_to is not None and not write_truth(arguments.manifest, arguments.truth_to):
        raise ValueError(
            f"--truth-to {arguments.truth_to}: no clip of {arguments.manifest} has truth; "
            "name its file in the column truth"
        )
    if arguments.config is not None:
        common["name"] = arguments.name or Path(arguments.config).stem
    config = Config(
        arguments.preset, arguments.config, model=arguments.model, runtime=arguments.runtime
    )
    folders = {"tables": arguments.tables, "videos": arguments.videos}
    return run(arguments.manifest, arguments.out, config=config, **folders, **common)


def main() -> int:
    """Runs the command; returns the exit code."""
    arguments = _parser().parse_args()
    try:
        # Ray prints on standard output when a node dies; standard output is for the summary only.
        with contextlib.redirect_stdout(sys.stderr):
            summary = _work(arguments)
    except KeyboardInterrupt:
        print(f"stopped; repeat the command to continue ({Path(arguments.out) / FILE})", file=sys.stderr)
        return 130
    except (ValueError, TypeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (OSError, ImportError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(json.dumps(summary.to_dict(), indent=2) if arguments.json else summary)
    return 1 if summary.failed else 0


if __name__ == "__main__":
    sys.exit(main())
