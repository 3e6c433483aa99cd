"""The command `patchlock`, the same code as the binary: `patchlock ...` or `python -m patchlock ...`."""

from __future__ import annotations

import signal
import sys

from patchlock import _patchlock


def main() -> None:
    """Runs the command with the arguments of this process, and ends it."""
    # Python's own handler would only take a note: it can't interrupt a verb at work. Those that end in order set their own.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_patchlock.run(["patchlock", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
