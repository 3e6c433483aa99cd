"""Registers Patchlock with the VOT toolkit: `pip install vot-toolkit`.

```sh
python -m patchlock.toolkits.vot > trackers.ini    # in the workspace
vot test patchlock
vot evaluate patchlock
```

The toolkit starts `patchlock trax` and communicates with it through the TraX protocol.
"""

from __future__ import annotations

import argparse
import configparser
import io
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from patchlock._onnxruntime import library
from patchlock._patchlock import PRESETS

__all__ = ["command", "main", "registry"]


def command(
    *,
    preset: str = "robust",
    config: str | Path | None = None,
    model: str | Path | None = None,
    runtime: str | Path | None = None,
    seed: int | None = None,
    threads: int | None = None,
    protocol: int = 4,
) -> list[str]:
    """The command that starts the TraX server of this installation.

    Args:
        preset: The preset to start from.
        config: A TOML file with settings that differ from the preset; `patchlock config` writes one. Paths
            are made absolute, because the toolkit starts trackers in other working directories.
        model: The network, as for `patchlock.track`: `"patchnet"` (the default), `"none"`, a folder with its
            ONNX files, or its only file.
        runtime: `"onnxruntime"` for the library of the installed package, or the path of a library of
            onnxruntime; `None` for the built-in runtime.
        seed: Seed of the random numbers; `None` for the seed in the settings.
        threads: Number of threads; `None` for one per core.
        protocol: Version of TraX: 4 (many targets) or 3 (one target).

    Raises:
        FileNotFoundError: There is no file `config`, `model` or `runtime`.
        ImportError: `runtime` is `"onnxruntime"`, which is not installed.
    """
    words = [sys.executable, "-m", "patchlock", "trax", "--protocol", str(protocol), "--preset", preset]
    if runtime == "onnxruntime":
        runtime = library()
    for option, given in (("config", config), ("model", model), ("runtime", runtime)):
        if option == "model" and given in ("patchnet", "none"):
            words += ["--model", str(given)]
        elif given is not None:
            path = Path(given).resolve()
            if not path.exists():
                raise FileNotFoundError(f"{option} is {given}; there is no such file")
            words += [f"--{option}", str(path)]
    if seed is not None:
        words += ["--seed", str(seed)]
    if threads is not None:
        words += ["--threads", str(threads)]
    return words


def registry(words: Sequence[str], *, name: str = "patchlock", label: str = "Patchlock") -> str:
    """The text of a `trackers.ini` with one tracker.

    Args:
        words: The command that starts the tracker; see `command`.
        name: Name of the tracker in the toolkit's commands: letters, digits, `-` and `_`.
        label: Name of the tracker in the toolkit's reports.

    Raises:
        ValueError: The toolkit does not accept the name.
    """
    if not re.fullmatch(r"[a-zA-Z0-9_-]+", name):
        raise ValueError(f"name is {name!r}; allowed: letters, digits, - and _")
    file = configparser.ConfigParser(interpolation=None)
    file[name] = {"label": label, "protocol": "trax", "command": shlex.join(words)}
    # The toolkit interpolates %.
    for key, value in file[name].items():
        file[name][key] = value.replace("%", "%%")
    text = io.StringIO()
    file.write(text)
    return text.getvalue().rstrip() + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Writes `trackers.ini` to standard output, with the options of `command` and `registry`."""
    parser = argparse.ArgumentParser(
        prog="python -m patchlock.toolkits.vot",
        description="Writes a trackers.ini that registers this Patchlock with the VOT toolkit.",
    )
    parser.add_argument("--name", default="patchlock", help="name for vot test and vot evaluate")
    parser.add_argument("--label", default="Patchlock", help="name in reports")
    parser.add_argument("--preset", default="robust", help=f"{', '.join(PRESETS)} (default: robust)")
    parser.add_argument("--config", help="TOML file with settings that differ; see patchlock config")
    parser.add_argument("--model", help="the network: patchnet (the default), none, a folder or a file")
    parser.add_argument("--runtime", help="onnxruntime, or a library of it, instead of the built-in runtime")
    parser.add_argument("--seed", type=int, help="seed of the random numbers")
    parser.add_argument("--threads", type=int, help="number of threads")
    parser.add_argument("--protocol", type=int, choices=(3, 4), default=4, help="version of TraX")
    options = vars(parser.parse_args(arguments))
    name, label = options.pop("name"), options.pop("label")
    try:
        text = registry(command(**options), name=name, label=label)
    except (OSError, ValueError, ImportError) as error:
        parser.error(str(error))
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
