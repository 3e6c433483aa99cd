"""A worker process: reads jobs from standard input, one per line, and writes their outcomes likewise.

It exits as soon as standard input is closed, even during a run, and so does not outlive its parent.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from dataclasses import asdict

from patchlock import _patchlock
from patchlock.batch.task import execute


def main() -> None:
    """Executes runs until standard input ends."""
    # Ctrl-C reaches all processes of a terminal; the parent decides when this one stops.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Other output must not mix with the outcomes, so it goes to standard error.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    jobs: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=[jobs], daemon=True).start()
    while True:
        outcome = execute(jobs.get())
        answers.write(json.dumps(asdict(outcome)) + "\n")
        answers.flush()


def _listen(jobs: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        jobs.put(line)
    _patchlock.abandon_files()
    os._exit(0)


if __name__ == "__main__":
    main()
