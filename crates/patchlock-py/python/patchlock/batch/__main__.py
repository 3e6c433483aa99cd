"""The command: `python -m patchlock.batch MANIFEST --out DIR`."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from pathlib import Path

from patchlock import PRESETS
from patchlock.batch.manifest import write_truth
from patchlock.batch.run import bench, run
from patchlock.batch.summary import FILE, Summary

EXAMPLES = """\
examples:
  python -m patchlock.batch clips.csv --out out
      every clip of the list on the processors of this machine
  python -m patchlock.batch clips.csv --out out --engine ray --address 10.0.0.1:6379
      the same on the machines of a Ray cluster, which find the clips under the same paths
  python -m patchlock.batch OTB --out out --seeds 3
      a folder is a benchmark's dataset: what patchlock bench makes of it
  patchlock score out --truth truth
      then: the scores, where --truth-to truth gathered the truth of the clips

Columns of the list, of which only source and a box (x, y, w, h or truth) must be there:
  source            a folder of images, a pattern, a glob or a video, from the folder of the list on
  x, y, w, h        the target in the first tracked frame, counted from 0; or all four in one column, box
  truth             a file with a box a line, counted from 1: the box comes from it where there is none, and scores
  name              of the results; by default the last part of the source
  start, end, stride  a part of the source
  seed              of the random numbers
  settings          that differ, as particles=200; small_step=4

The same command goes on where it was stopped. Exit codes: 0 done, 1 clips failed, 2 wrong use, 130 stopped by Ctrl-C.
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m patchlock.batch",
        description="Tracks many clips side by side, and keeps the boxes as patchlock bench does.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("manifest", help="list of clips (.csv or .jsonl), or the folder of a benchmark's dataset")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    parser.add_argument("--engine", choices=["local", "ray"], default="local", help="who does the work (default: local)")
    parser.add_argument("--address", metavar="HOST:PORT", help="the Ray cluster (default: the one that this machine is part of)")
    parser.add_argument("--jobs", type=int, metavar="N", help="runs side by side on this machine (default: one for each processor)")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="threads of each run (default: 1)")
    parser.add_argument("--preset", default="paper", choices=PRESETS, help="the settings to begin with (default: paper)")
    parser.add_argument("--config", metavar="FILE.toml", help="settings that differ; see patchlock config")
    parser.add_argument("--name", help="name of the results (default: that of the settings file, or of the preset)")
    parser.add_argument("--seeds", type=int, metavar="K", help="of a dataset: number of seeds to run each target with (default: 1)")
    parser.add_argument("--retries", type=int, default=2, metavar="N", help="tries more for a clip whose process or machine went away (default: 2)")
    parser.add_argument("--truth-to", metavar="DIR", help="of a list: gather the truth of the clips there, for patchlock score")
    parser.add_argument("--json", action="store_true", help="the summary as JSON")
    parser.add_argument("--quiet", "-q", action="store_true", help="no progress bar")
    return parser


def _work(arguments: argparse.Namespace) -> Summary:
    common = {
        name: getattr(arguments, name)
        for name in ("engine", "address", "jobs", "threads", "preset", "config", "name", "retries")
    }
    common["progress"] = False if arguments.quiet else None
    if Path(arguments.manifest).is_dir():
        if arguments.truth_to is not None:
            raise ValueError("--truth-to is for lists of clips: patchlock score takes the dataset itself")
        return bench(arguments.manifest, arguments.out, seeds=1 if arguments.seeds is None else arguments.seeds, **common)
    if arguments.seeds is not None:
        raise ValueError("--seeds is for datasets: in a list, each clip has its seed")
    if arguments.truth_to is not None:
        write_truth(arguments.manifest, arguments.truth_to)
    return run(arguments.manifest, arguments.out, **common)


def main() -> int:
    """Runs the command; gives the exit code."""
    arguments = _parser().parse_args()
    try:
        # Ray says on standard output that a node is gone; that is for the summary alone.
        with contextlib.redirect_stdout(sys.stderr):
            summary = _work(arguments)
    except KeyboardInterrupt:
        print(f"stopped; the same command goes on there ({Path(arguments.out) / FILE})", file=sys.stderr)
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
