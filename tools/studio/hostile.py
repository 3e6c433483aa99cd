#!/usr/bin/env python3
"""Files and clients that are made to break something, and what the program does with them.

    python3 tools/studio/hostile.py PROGRAM

Each is given to the program as its user would. The table says how the program ends, how much processor
time and memory it and the processes that it starts take, and what it says. The script ends with 1 if
anything takes more than 10 s of processor time or 1 GiB, panics, changes or copies a file that is not
its own, or ends in another way than it should.

Requires Linux and only Python 3.11 or newer.
"""

import http.client
import json
import os
import re
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from random_requests import SECRET, Studio, image
from random import Random

SECONDS = 10.0
MEMORY = 1 << 30
HANGS = 120.0


@dataclass
class Case:
    """A command, the exit codes that are right, and the file that it is about."""

    name: str
    arguments: list[str]
    codes: tuple[int, ...]
    file: Path | None = None
    # What it must not write.
    absent: Path | None = None


def jpeg(width: int, height: int) -> bytes:
    """A grey image of one colour: each block is two bits."""
    part = lambda mark, content: struct.pack(">BBH", 0xFF, mark, len(content) + 2) + content
    table = lambda kind: bytes([kind, 1]) + bytes(15) + b"\0"
    head = b"\xff\xd8" + part(0xDB, b"\0" + b"\1" * 64)
    head += part(0xC0, struct.pack(">BHHB", 8, height, width, 1) + b"\1\x11\0")
    head += part(0xC4, table(0x00)) + part(0xC4, table(0x10)) + part(0xDA, b"\1\1\0\0\x3f\0")
    return head + bytes(width * height // 64 // 4) + b"\xff\xd9"


def tiff(width: int, height: int, strips: int, content: bytes) -> bytes:
    """An image of this size whose strips all are the same JPEG."""
    offset, tags = 8 + 2 + 9 * 12 + 4, []
    places = [offset + 8 * strips] * strips
    lengths = [len(content)] * strips
    lists = struct.pack(f"<{2 * strips}I", *places, *lengths)
    where = (offset, offset + 4 * strips) if strips > 1 else (places[0], lengths[0])
    rows = max(height // strips, 1)
    for tag, kind, count, value in [
        (256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 8), (259, 3, 1, 7), (262, 3, 1, 1),
        (273, 4, strips, where[0]), (277, 3, 1, 1), (278, 4, 1, rows), (279, 4, strips, where[1]),
    ]:  # fmt: skip
        tags.append(struct.pack("<HHII", tag, kind, count, value))
    head = b"II*\0" + struct.pack("<IH", 8, len(tags)) + b"".join(tags) + bytes(4)
    return head + lists + content


def webp(canvas: int, side: int) -> bytes:
    """A canvas of one size around a lossless image of another, all of whose pixels have no bits."""
    bits = (side - 1) | (side - 1) << 14
    # No transform, no colour cache, no groups of codes; five codes of the one symbol 0.
    codes = sum(0b0001 << (3 + 4 * k) for k in range(5))
    image = b"\x2f" + struct.pack("<I", bits) + codes.to_bytes(4, "little")
    chunk = lambda name, content: name + struct.pack("<I", len(content)) + content + bytes(len(content) % 2)
    canvas_size = (canvas - 1).to_bytes(3, "little") * 2
    body = b"WEBP" + chunk(b"VP8X", bytes(4) + canvas_size) + chunk(b"VP8L", image)
    return b"RIFF" + struct.pack("<I", len(body)) + body


def lists_of_files(private: Path) -> Iterator[tuple[str, bytes]]:
    """Lists that a decoder might take for videos."""
    uri = f"file://{private}"
    yield "playlist.webm", f"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n{uri}\n#EXT-X-ENDLIST\n".encode()
    yield "manifest.mp4", (
        '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011"><Period><AdaptationSet>'
        f"<Representation><BaseURL>{uri}</BaseURL></Representation></AdaptationSet></Period></MPD>"
    ).encode()
    yield "list.mkv", f"ffconcat version 1.0\nfile '{private}'\n".encode()


def frames(folder: Path, count: int) -> Path:
    folder.mkdir(parents=True)
    for k in range(count):
        (folder / f"{k:04}.bmp").write_bytes(image(160, 120, Random(k)))
    return folder


def cases(root: Path, outside: Path) -> Iterator[Case]:
    """All that are commands."""
    secret = outside / "secret"

    def file(name: str, content: bytes) -> Path:
        (root / name).write_bytes(content)
        return root / name

    box, out = ["--box", "20,20,30,30", "--save", str(root / "t.csv"), "--overwrite"], str(root / "out.png")
    clip = frames(root / "clip", 4)
    (root / "clip.patchlock.json.lock").symlink_to(secret)
    project = ["--project", str(root / "clip.patchlock.json")]
    yield Case("link in place of a lock", ["track", str(clip), *box, *project], (1, 2))
    for name, content in lists_of_files(secret):
        listed = file(name, content)
        yield Case(f"list of files, {name}", ["frame", str(listed), "--out", out], (1,), listed, Path(out))
    inner = jpeg(16384, 16384)
    images = [
        ("1 x 1 around JPEG of 16384 x 16384", "nested.tif", tiff(1, 1, 1, inner)),
        ("2000 strips that are one JPEG", "strips.tif", tiff(1024, 16_000, 2000, jpeg(1024, 8))),
        ("1 x 1 around WebP of 12000 x 12000", "nested.webp", webp(1, 12000)),
        ("WebP of 12000 x 12000", "large.webp", webp(12000, 12000)),
        ("JPEG of 16384 x 16384", "large.jpg", inner),
    ]
    for title, name, content in images:
        one = root / f"of {name}"
        one.mkdir()
        (one / name).write_bytes(content)
        yield Case(title, ["frame", str(one), "--out", out], (1, 2), one / name, Path(out))
    y4m = file("huge.y4m", b"YUV4MPEG2 W99999999 H99999999 F25:1 C420\nFRAME\n")
    yield Case("Y4M of 10^16 pixels", ["frame", str(y4m), "--out", out], (1, 2), y4m, Path(out))

    stolen = frames(root / "stolen", 2)
    (stolen / "0001.bmp").unlink()
    (stolen / "0001.bmp").symlink_to(secret)
    table = file("two.csv", b"frame,id,x,y,w,h\n0,1,2,2,9,9\n1,1,2,2,9,9\n")
    size = ["--size", "160x120"]
    export = lambda name: ["export", str(table), "--format", "yolo", *size, "--images", name, "--out", str(root / "yolo")]
    yield Case("link to a key among images", export(str(stolen)), (1,), None, root / "yolo")
    (stolen / "0001.bmp").unlink()
    os.mkfifo(stolen / "0001.bmp")
    yield Case("pipe among images", export(str(stolen)), (1,), None, root / "yolo")
    same = ["export", str(table), "--format", "mot", "--out", str(table), "--overwrite"]
    yield Case("an output that is its input", same, (2,))
    rows = "".join(f"{k},0,{k % 90},{k % 70},9,9\n" for k in range(10_000))
    many = file("many.csv", f"id,frame,x,y,w,h\n{rows}".encode())
    save = ["--save", str(root / "m.csv")]
    yield Case("10,000 targets", ["track", str(clip), "--boxes", str(many), *save], (2,), many, root / "m.csv")
    far = file("far.csv", b"frame,id,x,y,w,h\n18446744073709551615,1,2,2,9,9\n")
    yield Case("frame 2^64 - 1", ["export", str(far), "--format", "mot", "--out", out], (1, 2), far, Path(out))
    paper = ["track", str(clip), "--preset", "paper", *save, "--overwrite", "--box"]
    yield Case("paper, 1 x 1 pixel", [*paper, "20,20,1,1"], (1,))
    yield Case("paper, 4 x 4 pixels, 4 frames", [*paper, "20,20,4,4"], (0,))
    os.mkfifo(root / "pipe.mp4")
    for name in [str(root / "pipe.mp4"), "/dev/zero", "/proc/kmsg", "/proc/self/environ"]:
        yield Case(Path(name).name, ["frame", name, "--out", out], (1, 2), None, Path(out))


def run(program: str, case: Case) -> tuple[int, float, int, str]:
    """The exit code, processor time in seconds, peak of memory in bytes, and what it says."""
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen([program, *case.arguments], stdout=said, stderr=said, stdin=subprocess.DEVNULL)
        end = time.monotonic() + HANGS
        while (ended := os.wait4(process.pid, os.WNOHANG))[0] == 0:
            if time.monotonic() > end:
                process.kill()
            time.sleep(0.01)
        _, status, used = ended
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode(errors="replace")
    return process.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss << 10, text


def broken(case: Case, code: int, seconds: float, memory: int, text: str) -> str | None:
    """What is wrong."""
    if "panicked" in text:
        return "panicked"
    if code not in case.codes:
        return f"ended with {code}"
    if seconds > SECONDS:
        return f"took {seconds:.1f} s"
    if memory > MEMORY:
        return f"took {memory >> 20} MiB"
    if case.absent is not None and case.absent.exists():
        return f"wrote {case.absent.name}"
    return None


def asked(studio: Studio, method: str, where: str, content: bytes | None = None) -> tuple[int, str]:
    port, token = studio.address
    client = http.client.HTTPConnection("127.0.0.1", port, timeout=HANGS)
    client.request(method, where, content, {"Authorization": f"Bearer {token}"})
    answer = client.getresponse()
    return answer.status, answer.read(1 << 20).decode(errors="replace")


def imports() -> Iterator[tuple[str, bytes]]:
    """Annotations of another tool."""
    attributes = "".join(f' a{k}="1"' for k in range(80_000))
    yield "CVAT, 80,000 attributes", f"<annotations><track{attributes}></track></annotations>".encode()
    spaces = "".join(f' xmlns:n{k}="u{k}"' for k in range(5000))
    yield "CVAT, 5000 namespaces, 5000 children", f"<annotations{spaces}>{'<a/>' * 5000}</annotations>".encode()
    yield "CVAT, a million nested elements", b"<annotations>" + b"<a>" * 1_000_000


def memory_of(studio: Studio) -> int:
    status = Path(f"/proc/{studio.process.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) << 10


def time_of(studio: Studio) -> float:
    fields = Path(f"/proc/{studio.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def clients(program: str, root: Path) -> Iterator[tuple[str, int, str, float, int, str]]:
    """What is sent to the studio: name, bytes, end, seconds, memory, and the answer or what is wrong."""
    (root / "studio").mkdir()
    clip = frames(root / "studio/clip", 4)
    studio = Studio(program, root / "studio", [clip], root / "errors.txt")
    try:
        studio.start()
        for name, content in imports():
            begun = time_of(studio)
            status, text = asked(studio, "POST", "/api/clips/1/import?format=cvat", content)
            yield name, len(content), str(status), time_of(studio) - begun, memory_of(studio), text
        begun, port = time_of(studio), studio.address[0]
        opened = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(520)]
        for client in opened:
            client.setblocking(False)
            try:
                client.send(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 400)
            except OSError:
                pass
        status, _ = asked(studio, "GET", "/api/clips")
        text = "a client with the token is answered meanwhile"
        yield "520 clients that do not read", 0, str(status), time_of(studio) - begun, memory_of(studio), text
        for client in opened:
            client.close()
        added = {"edit": "add_target", "label": "target", "frame": 0, "box": {"x": 9, "y": 9, "w": 20, "h": 20}}
        status, text = asked(studio, "POST", "/api/clips/1/edits", json.dumps({"revision": 0, "edits": [added]}).encode())
        assert status == 200, text
        studio.stop()
    finally:
        studio.process.kill()


def claim(program: str, root: Path) -> Iterator[tuple[str, int, str, float, int, str]]:
    """The project of [`clients`], changed to say that its video is very long."""
    path = root / "studio/clip.patchlock.json"
    project = json.loads(path.read_text())
    project["video"]["frames"] = 100_000_000
    project["targets"][0]["hidden"] = [[1, 99_999_999]]
    path.write_text(json.dumps(project))
    name, size = "project of 100 million frames", path.stat().st_size
    for arguments in [
        ["studio", "--no-open", str(root / "studio/clip")],
        ["export", str(path), "--format", "csv", "--out", str(root / "claim.csv")],
    ]:
        code, seconds, memory, text = run(program, Case(name, arguments, (1, 2)))
        yield f"{name}, {arguments[0]}", size, str(code), seconds, memory, text


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit("usage: hostile.py PROGRAM")
    program, wrong = os.path.realpath(sys.argv[1]), []
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print("| input | bytes | ends with | s | MB | says |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="patchlock-hostile-") as folder:
        root, outside = Path(folder) / "gift", Path(folder) / "outside"
        for made in (root, outside):
            made.mkdir()
        (outside / "secret").write_bytes(SECRET)

        def row(name: str, size: int, ends: str, seconds: float, memory: int, text: str) -> None:
            said = next((line for line in text.splitlines() if line.strip()), "").replace(str(root), "")
            print(f"| {name} | {size} | {ends} | {seconds:.2f} | {memory / 1e6:.0f} | {said[:110]} |", flush=True)

        for case in cases(root, outside):
            code, seconds, memory, text = run(program, case)
            size = case.file.stat().st_size if case.file else 0
            row(case.name, size, str(code), seconds, memory, text)
            if (what := broken(case, code, seconds, memory, text)) is not None:
                wrong.append(f"{case.name}: {what}")
            if (outside / "secret").read_bytes() != SECRET:
                sys.exit(f"{case.name}: a file outside has changed")
        for name, size, ends, seconds, memory, text in chain(clients(program, root), claim(program, root)):
            row(name, size, ends, seconds, memory, text)
            if seconds > SECONDS or memory > MEMORY or int(ends) not in (1, 2, 200, 400):
                wrong.append(f"{name}: {ends}, {seconds:.1f} s, {memory >> 20} MiB")
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
