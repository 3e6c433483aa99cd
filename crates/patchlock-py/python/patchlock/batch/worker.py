"""A process that makes runs: jobs come in on standard input, a line each, and their outcomes go out the same way.

It ends with its standard input, so with whoever started it, even in the middle of a run.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from dataclasses import asdict

from patchlock.batch.task import make


def main() -> None:
    """Makes runs until there are no more."""
    # Ctrl-C reaches all processes of a terminal. Who started this one decides what becomes of it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What anybody prints must not get between the outcomes.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    jobs: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=[jobs], daemon=True).start()
    while True:
        outcome = make(jobs.get())
        answers.write(json.dumps(asdict(outcome)) + "\n")
        answers.flush()


def _listen(jobs: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        jobs.put(line)
    os._exit(0)


if __name__ == "__main__":
    main()
