"""The command `patchlock`, also `python -m patchlock`; it runs the same code as the Rust binary."""

from __future__ import annotations

import signal
import sys

from patchlock import _patchlock


def main() -> None:
    """Runs the command with the arguments of this process, then exits."""
    # Python's own handler only sets a flag, which Rust code never checks. Subcommands that shut down cleanly
    # install their own handler.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_patchlock.run(["patchlock", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
