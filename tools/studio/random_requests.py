#!/usr/bin/env python3
"""Random folders and requests against the studio, for as long as one likes.

    python3 tools/studio/random_requests.py PROGRAM --seconds 7200 [--seed 1]

Each round makes a folder of clips with damaged projects, links, pipes and strange names, starts the
program on it, and sends random requests, with and without the token, whole and broken, for half a
minute. It ends with 1, and leaves the folder, if

- the program ends, or prints a panic;
- the program has been up to an answer for 30 s, or does not start in 30 s;
- something of the interface is answered without the token;
- the program holds more than 1 GiB;
- a file outside the folder has changed;
- the program does not end within 10 s of Ctrl-C.

These seconds are the program's own: while one of its threads, or of a process that it started, runs or
waits for a processor, the processor time that they get counts; otherwise the clock. So a busy machine,
where an upload that starts ffmpeg may take a minute, breaks nothing, and a hang does: it sleeps or runs.
Ten times as long by the clock is too long in any case.

Requires Linux and only Python 3.11 or newer.
"""

import argparse
import contextlib
import http.client
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROUND = 30.0
ANSWER = 30.0
END = 10.0
CLOCK = 10.0
LOOK = 0.25
TICKS = os.sysconf("SC_CLK_TCK")
MEMORY = 1 << 30
SECRET = b"this belongs to somebody else\n"
WORDS = ["0", "1", "2", "-1", "99999999999999999999", "%00", "..", "%2e%2e", "a" * 3000, "\u00e9", "NaN", ""]
METHODS = ["GET", "POST", "PUT", "DELETE", "HEAD", "OPTIONS", "TRACE", "X"]


class PropertyViolation(Exception):
    """What must not happen."""


class TimeLimit:
    """Raises `PropertyViolation` in its block when a session of processes has taken too long for what it does."""

    def __init__(self, session: int, what: str, limit: float):
        self.session, self.what, self.limit = session, what, limit

    def __enter__(self) -> "TimeLimit":
        self.begun = self.seen = time.monotonic()
        self.own, self.used = 0.0, None
        signal.signal(signal.SIGALRM, lambda *_: self.count())
        signal.setitimer(signal.ITIMER_REAL, LOOK)
        return self

    def __exit__(self, *_) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0)
        self.clock = time.monotonic() - self.begun

    def count(self) -> None:
        (used, wants), now = self.look(), time.monotonic()
        passed = now - self.seen
        # Most answers are there before the first look, which so costs them nothing.
        got = passed if self.used is None else max(used - self.used, 0.0)
        self.own += min(passed, got) if wants else passed
        self.seen, self.used, clock = now, used, now - self.begun
        if self.own > self.limit or clock > CLOCK * self.limit:
            raise PropertyViolation(f"{self.what} took {self.own:.0f} s, {clock:.0f} s by the clock")
        signal.setitimer(signal.ITIMER_REAL, LOOK)

    def look(self) -> tuple[float, bool]:
        """The processor time that they had so far in seconds, and whether one of their threads runs or could run."""
        used, wants = 0, False
        for process in Path("/proc").glob("[0-9]*"):
            try:
                fields = after_name(process)
                if int(fields[3]) == self.session:
                    # Of all threads, and of processes that it has started and that have ended.
                    used += sum(map(int, fields[11:15]))
                    wants |= any(after_name(task)[0] == "R" for task in process.glob("task/*"))
            except OSError:  # It has ended.
                continue
        return used / TICKS, wants


def after_name(task: Path) -> list[str]:
    """What the system says of a process or thread, from its state on."""
    return (task / "stat").read_text().rpartition(")")[2].split()


def image(width: int, height: int, draws: random.Random) -> bytes:
    """A BMP of one colour with a square in it."""
    row = (3 * width + 3) // 4 * 4
    head = b"BM" + (54 + row * height).to_bytes(4, "little") + bytes(4) + (54).to_bytes(4, "little")
    head += (40).to_bytes(4, "little") + width.to_bytes(4, "little") + height.to_bytes(4, "little")
    head += (1).to_bytes(2, "little") + (24).to_bytes(2, "little") + bytes(24)
    pixels = bytearray(bytes([draws.randrange(256)]) * (row * height))
    x, y = draws.randrange(width - 8), draws.randrange(height - 8)
    for line in range(y, y + 8):
        pixels[line * row + 3 * x : line * row + 3 * x + 24] = bytes(draws.randrange(256) for _ in range(24))
    return head + bytes(pixels)


def damaged(content: bytes, draws: random.Random) -> bytes:
    """The bytes with a few changes."""
    content = bytearray(content or b"{}")
    for _ in range(draws.randrange(1, 8)):
        at = draws.randrange(len(content))
        kind = draws.randrange(3)
        if kind == 0:
            content[at] = draws.randrange(256)
        elif kind == 1:
            del content[at : at + draws.randrange(1, 40)]
            content = content or bytearray(b"0")
        else:
            content[at:at] = draws.choice([b"[" * 2000, b"1e999", b"-1", b'"\\u0000"', b"99999999999999"])
    return bytes(content)


def make_folder(folder: Path, outside: Path, draws: random.Random) -> list[Path]:
    """A folder of a stranger; returns the clips in it that are worth opening."""
    clips = []
    for k in range(draws.randrange(1, 4)):
        clip = folder / draws.choice([f"clip{k}", f"c l i p {k}", f"<b>{k}<img src=x>", f"clip{k}\u202e", f"-{k}"])
        clip.mkdir()
        for frame in range(draws.randrange(1, 9)):
            (clip / f"{frame:04}.bmp").write_bytes(image(64, 48, draws))
        clips.append(clip)
        project = folder / f"{clip.name}.patchlock.json"
        box = {"x": 5.0, "y": 4.0, "w": 12.0, "h": 9.0}
        text = json.dumps({"format": "patchlock-project", "version": 1, "video": clip.name, "box": box}).encode()
        kind = draws.randrange(5)
        if kind == 0:
            project.write_bytes(damaged(text, draws))
        elif kind == 1:
            project.symlink_to(outside / "secret")
        elif kind == 2:
            (folder / f"{clip.name}.patchlock.json.lock").symlink_to(outside / "secret")
        elif kind == 3:
            (folder / f"{clip.name}.patchlock.json.part").symlink_to(outside / "secret")
    labels = folder / "patchlock-labels.json"
    kind = draws.randrange(4)
    if kind == 0:
        labels.write_bytes(damaged(b'{"format":"patchlock-labels","version":2,"labels":[]}', draws))
    elif kind == 1:
        labels.symlink_to(outside / "secret")
    elif kind == 2:
        os.mkfifo(labels)
    if draws.random() < 0.3:
        (folder / "uploads").symlink_to(outside / "empty")
    if draws.random() < 0.3:
        os.mkfifo(clips[0] / "0099.png")
    if draws.random() < 0.3:
        (clips[0] / "0098.png").symlink_to(outside / "secret")
    return clips


def path(draws: random.Random) -> str:
    """An address of the interface, or nearly."""
    part = lambda: draws.choice(["1", "1", "1", "2", "3", draws.choice(WORDS)])
    rest = draws.choice(
        [
            "", "/api/clips", "/api/export", f"/api/clips/{part()}", f"/api/clips/{part()}/frames/{part()}",
            f"/api/clips/{part()}/edits", f"/api/clips/{part()}/undo", f"/api/clips/{part()}/redo",
            f"/api/clips/{part()}/track", f"/api/clips/{part()}/stop", f"/api/clips/{part()}/doubts",
            f"/api/clips/{part()}/look", f"/api/clips/{part()}/import", f"/api/clips/{part()}/export",
            f"/api/clips/{part()}/video", f"/api/clips/{part()}/targets/{part()}/clip", f"/{part()}",
            f"/api/camera/recordings/{part()}/{part()}", f"/api/{part()}",
        ]
    )  # fmt: skip
    names = ["frame", "format", "target", "name", "width", "from", "to", "val", "images", "x", "y", "preset"]
    query = "&".join(f"{draws.choice(names)}={draws.choice(WORDS)}" for _ in range(draws.randrange(3)))
    address = (rest or "/") + (f"?{query}" if query else "")
    return address.encode("ascii", "replace").decode()


def edits(draws: random.Random) -> list[dict]:
    """Changes to a project, whole and broken."""
    number = lambda: draws.choice([0, 1, 2, 3, -1, 1 << 40, 1e300, 5.5])
    box = {"x": number(), "y": number(), "w": number(), "h": number()}
    good = {"edit": "add_target", "label": "target", "frame": 0, "box": {"x": 9.0, "y": 8.0, "w": 12.0, "h": 9.0}}
    any_of = [
        {"edit": "add_target", "label": "target", "frame": number(), "box": box},
        {"edit": "set_key", "target": number(), "frame": number(), "box": box, "occluded": False},
        {"edit": "set_key", "target": draws.randrange(1, 4), "frame": draws.randrange(8), "box": good["box"]},
        {"edit": "delete_target", "target": number()},
        {"edit": "add_label", "name": draws.choice(WORDS), "colour": "#ff0000"},
        {"edit": "set_label", "name": "target", "new_name": draws.choice(WORDS)},
        {"edit": "declare", "label": "target", "attributes": [{"name": "a", "kind": "checkbox"}]},
        {"edit": "set_value", "target": 1, "name": "a", "frame": number(), "value": "true"},
        {"edit": "split", "target": draws.randrange(1, 4), "frame": draws.randrange(8)},
        {"edit": "hide", "target": draws.randrange(1, 4), "from": number(), "to": number()},
        {"edit": "add_remark", "frame": number(), "target": 1, "verdict": "rejected", "text": draws.choice(WORDS)},
        {"edit": "set_done", "done": draws.random() < 0.5},
    ]
    return draws.choice([[good], [draws.choice(any_of)], [draws.choice(any_of)], draws.sample(any_of, 3)])


def body(draws: random.Random) -> bytes:
    """Annotations, or nonsense."""
    content = json.dumps(draws.choice([edits(draws), {"target": 1, "frame": 0}, "frame,id,x,y,w,h\n0,1,1,2,3,4\n"])).encode()
    kind = draws.randrange(3)
    if kind == 0:
        return damaged(content, draws)
    if kind == 1:
        return b"<annotations>" + b"<a>" * draws.randrange(5000)
    return content


def work(draws: random.Random, revision: int) -> tuple[str, str, bytes]:
    """What the page would send, of this revision of the project or of another."""
    revision = revision if draws.random() < 0.9 else draws.randrange(20)
    clip = "/api/clips/1"
    request = draws.choice(
        [
            {"target": draws.randrange(1, 4), "from": draws.randrange(8), "direction": draws.choice(["forward", "both"])},
            {"target": draws.randrange(1, 4), "around": draws.randrange(8)},
        ]
    )
    where, content = draws.choice(
        [
            ("edits", {"revision": revision, "edits": edits(draws)}),
            ("edits", {"revision": revision, "edits": edits(draws)}),
            ("track", request),
            (draws.choice(["stop", "undo", "undo", "redo"]), {}),
        ]
    )
    return "POST", f"{clip}/{where}", json.dumps(content).encode()


class Studio:
    """The program on a folder."""

    # The longest that an answer of any has taken, by the clock and as it counts.
    clock = own = 0.0
    # How many edits and orders to track were taken.
    edited = tracked = 0

    def __init__(self, program: str, folder: Path, clips: list[Path], log: Path):
        self.log = log
        command = [program, "studio", "--no-open", "--uploads", str(folder / "uploads"), "--"]
        self.errors = log.open("wb")
        self.process = subprocess.Popen(
            [*command, *map(str, clips)], stdout=subprocess.PIPE, stderr=self.errors, cwd=folder, start_new_session=True
        )
        os.set_blocking(self.process.stdout.fileno(), False)
        self.address = None
        # Of the first clip, as the last answer said.
        self.revision = 0

    def start(self) -> None:
        """Waits for the address of the page; the program may end instead."""
        text = b""
        with TimeLimit(self.process.pid, "the start", ANSWER):
            while self.process.poll() is None:
                text += self.process.stdout.read() or b""
                if found := re.search(rb"http://127\.0\.0\.1:(\d+)/#(\S+)", text + self.log.read_bytes()):
                    self.address = int(found[1]), found[2].decode()
                    return
                time.sleep(0.05)

    def check(self) -> None:
        if self.process.poll() is not None:
            raise PropertyViolation(f"the program ended with {self.process.returncode}")
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        if (held := int(re.search(r"VmRSS:\s+(\d+)", status)[1]) << 10) > MEMORY:
            raise PropertyViolation(f"the program holds {held >> 20} MiB")

    def send(self, draws: random.Random) -> int:
        """Sends one request; the status of the answer, 0 for a broken one."""
        port, token = self.address
        if draws.random() < 0.5:
            method, where, content = work(draws, self.revision)
        else:
            method, where, content = draws.choice(METHODS[: draws.choice([2, 2, 2, 8])]), path(draws), body(draws)
        kind = draws.randrange(12)
        if kind == 0:  # A client that breaks off, or speaks something else.
            nonsense = damaged(f"{method} {where} HTTP/1.1\r\nHost: x\r\n\r\n".encode(), draws) * 20
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 5) as raw:
                raw.sendall(nonsense)
            return 0
        known = kind > 2
        headers = {"Authorization": f"Bearer {token}"} if known else {"Authorization": draws.choice(["", "Bearer x"])}
        client = http.client.HTTPConnection("127.0.0.1", port)
        try:
            with TimeLimit(self.process.pid, f"the answer to {method} {where}", ANSWER) as wait:
                client.request(method, where, content if method != "GET" else None, headers)
                answer = client.getresponse()
                text = answer.read(8 << 20) if "/events" not in where else b""
        except (http.client.HTTPException, OSError):
            return 0
        finally:
            client.close()
        Studio.clock, Studio.own = max(Studio.clock, wait.clock), max(Studio.own, wait.own)
        if answer.status == 200 and (found := re.search(rb'"revision": ?(\d+)', text[:200])):
            self.revision = int(found[1])
            Studio.edited += where.endswith("/edits")
        Studio.tracked += answer.status == 200 and where.endswith("/track")
        if not known and where.startswith("/api") and answer.status < 400:
            raise PropertyViolation(f"{method} {where} is answered with {answer.status} without the token")
        return answer.status

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)
        try:
            with TimeLimit(self.process.pid, "the end after Ctrl-C", END):
                self.process.wait()
        finally:
            self.process.kill()
            self.errors.close()
        if b"panicked" in self.log.read_bytes():
            raise PropertyViolation("the program panicked")


def one_round(program: str, root: Path, draws: random.Random, seconds: float) -> dict[int, int]:
    """A folder, a program, requests; how often each status was answered."""
    outside, folder = root / "outside", root / "folder"
    (outside / "empty").mkdir(parents=True)
    (outside / "secret").write_bytes(SECRET)
    folder.mkdir()
    clips = make_folder(folder, outside, draws)
    studio = Studio(program, folder, clips, root / "errors.txt")
    answers: dict[int, int] = {}
    try:
        studio.start()
        if studio.address is None:
            if studio.process.poll() in (101, -6, -11):
                raise PropertyViolation(f"the program does not start: {studio.process.poll()}")
            # It has refused the folder, with a reason.
            return {-1: 1}
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            status = studio.send(draws)
            answers[status] = answers.get(status, 0) + 1
            studio.check()
        studio.stop()
    finally:
        studio.process.kill()
    found = sorted(str(file.relative_to(outside)) for file in outside.rglob("*"))
    if (outside / "secret").read_bytes() != SECRET or [name for name in found if not name.startswith("empty")] != ["secret"]:
        raise PropertyViolation(f"what is outside the folder has changed: {found}")
    return answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="PROGRAM", help="the program patchlock")
    parser.add_argument("--seconds", type=float, default=120.0, help="how long [default: 120]")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers [default: 1]")
    args = parser.parse_args()
    program, answers, rounds = shutil.which(args.program), {}, 0
    if program is None:
        parser.error(f"there is no program {args.program}")
    program = os.path.realpath(program)
    end = time.monotonic() + args.seconds
    while (left := end - time.monotonic()) > 1:
        root = Path(tempfile.mkdtemp(prefix="patchlock-random-"))
        seed = args.seed * 1_000_000 + rounds
        try:
            for status, count in one_round(program, root, random.Random(seed), min(ROUND, left)).items():
                answers[status] = answers.get(status, 0) + count
        except PropertyViolation as broken:
            sys.exit(f"round {rounds} (seed {seed}): {broken}; see {root}")
        shutil.rmtree(root)
        rounds += 1
    print(f"{rounds} rounds, answers by status (0: cut off, -1: folder refused): {dict(sorted(answers.items()))}")
    print(f"of these, {Studio.edited} changed a project and {Studio.tracked} began to track")
    print(f"the longest answer: {Studio.clock:.1f} s by the clock, {Studio.own:.1f} s as it counts")


if __name__ == "__main__":
    main()
