"""Live sources in `track` and `Frames`, and `select_box`."""

from __future__ import annotations

import base64
import io
import json
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time
import types
import urllib.parse
import urllib.request
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from conftest import QUICK

import patchlock
from patchlock import Frames, select_box, track

ffmpeg = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
"""Marks tests of real streams."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


@ffmpeg
def test_a_stream_is_tracked_with_its_newest_frames() -> None:
    port = free_port()
    source = ["-re", "-f", "lavfi", "-i", "testsrc2=size=160x120:rate=25"]
    output = ["-c:v", "mpeg4", "-g", "10", "-f", "mpegts", f"udp://127.0.0.1:{port}?pkt_size=1316"]
    with subprocess.Popen(["ffmpeg", "-v", "error", "-nostdin", *source, *output]) as server:
        try:
            estimates = track(f"udp://127.0.0.1:{port}", (40, 30, 30, 30), config=QUICK, reconnect=0)
            # The stream has no end, so a busy machine takes longer and misses more frames.
            frames = [estimate.frame for estimate in islice(estimates, 5)]
        finally:
            server.kill()
    assert frames == sorted(set(frames)) and len(frames) == 5


@ffmpeg
def test_what_is_not_there_is_an_os_error() -> None:
    with pytest.raises(OSError, match=r"cannot open tcp://127\.0\.0\.1:1: .*refused"):
        next(iter(Frames("tcp://127.0.0.1:1")))
    if not Path("/dev/video97").exists() and os.name == "posix":
        with pytest.raises(OSError, match="cannot open 97"):
            next(track(97, (1, 1, 5, 5)))


def test_what_only_files_can_do_is_refused() -> None:
    with pytest.raises(ValueError, match=r"reverse is for files; rtsp://u:\*\*\*@h/a is live"):
        Frames("rtsp://u:secret@h/a", reverse=True)
    with pytest.raises(ValueError, match="stride is for files; 0 is live"):
        Frames(0, stride=2)
    with pytest.raises(ValueError, match="reconnect is -1"):
        Frames(0, reconnect=-1)
    with pytest.raises(ValueError, match="source is -1; cameras count from 0"):
        Frames(-1)
    with pytest.raises(TypeError, match="must be the name of a source, or the number of a camera"):
        Frames(1.5)  # type: ignore[arg-type]
    with pytest.raises(OSError, match="gopher://h/a is not an address that can be opened"):
        Frames("gopher://h/a")


PROXY = "https://hub.example.org/user/me/proxy/{port}/"
BOX = (10, 20, 30, 40)
BOXES = {"boxes": {"frame": 0, "boxes": [BOX]}}


def answer(address: str, message: object, host: str | None = None) -> None:
    """Says this on the page of the address, as its script does, also through the proxy at a host."""
    url = urllib.parse.urlsplit(address)
    with socket.create_connection((url.hostname, url.port), timeout=300) as stream:
        key = base64.b64encode(os.urandom(16)).decode()
        stream.sendall(
            (
                f"GET /api/frames HTTP/1.1\r\nHost: {host or url.netloc}\r\nUpgrade: websocket\r\n"
                f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                f"Sec-WebSocket-Protocol: patchlock, {url.fragment}\r\n\r\n"
            ).encode()
        )
        assert b" 101 " in stream.recv(1 << 16)
        data = json.dumps(message).encode()
        head = struct.pack("!BB", 0x81, 0x80 | len(data)) if len(data) < 126 else b""
        # A mask of zeros leaves the text as it is.
        stream.sendall(head + bytes(4) + data)
        heard = b""
        while b'"taken"' not in heard:
            heard += (more := stream.recv(1 << 16))
            assert more and b'"error"' not in heard, heard


def printed(stderr: io.StringIO, pattern: str) -> re.Match[str]:
    """What is printed on standard error, once it is there."""
    while (found := re.search(pattern, stderr.getvalue())) is None:
        time.sleep(0.01)
    return found


@pytest.mark.parametrize(
    ("message", "box"), [(BOXES, BOX), ("cancel", None)]
)
def test_a_box_is_drawn_on_a_page(
    message: object, box: tuple[int, ...] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("sys.stderr", stderr := io.StringIO())
    frame = np.zeros((100, 120, 3), np.uint8)

    def person() -> None:
        # What is printed may end within the address.
        answer(printed(stderr, r"http://\S+(?=\s)")[0], message)

    # If it fails the test waits for a box that nobody draws, until its time is over.
    thread = threading.Thread(target=person, daemon=True)
    thread.start()
    if box is None:
        with pytest.raises(RuntimeError, match="no box was drawn"):
            select_box(frame)
    else:
        assert select_box(frame) == patchlock.Box(*box)
    thread.join()
    # The browser's arguments are seen by all users, so they hold a code and not the token.
    assert len(opened) == 1 and "#once-" in opened[0]


def test_the_page_behind_a_proxy_is_asked_at_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("sys.stderr", stderr := io.StringIO())

    def person() -> None:
        port, token = printed(stderr, r"https://hub.example.org/user/me/proxy/(\d+)/#(\w+)\s").groups()
        answer(f"http://127.0.0.1:{port}/#{token}", BOXES, host="hub.example.org")

    thread = threading.Thread(target=person, daemon=True)
    thread.start()
    assert select_box(np.zeros((100, 120, 3), np.uint8), address=PROXY) == patchlock.Box(*BOX)
    thread.join()
    # The browser is on another machine.
    assert opened == []


@pytest.mark.parametrize("address", [None, PROXY])
def test_a_notebook_shows_the_page_and_says_how_it_is_reached(
    address: str | None, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    display = types.ModuleType("IPython.display")
    monkeypatch.setattr(display, "IFrame", lambda page, **_: page, raising=False)
    monkeypatch.setattr(display, "display", shown.append, raising=False)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setitem(sys.modules, "IPython", types.ModuleType("IPython"))
    monkeypatch.setattr("patchlock._select._in_notebook", lambda: True)
    port = free_port()
    policy: list[str] = []

    def person() -> None:
        while not shown:
            time.sleep(0.01)
        token = shown[0].partition("#")[2]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/") as page:
            policy.append(page.headers["Content-Security-Policy"])
        answer(f"http://127.0.0.1:{port}/#{token}", BOXES)

    thread = threading.Thread(target=person, daemon=True)
    thread.start()
    frame = np.zeros((100, 120, 3), np.uint8)
    assert select_box(frame, port=port, address=address) == patchlock.Box(*BOX)
    thread.join()
    said = capfd.readouterr().out
    outside = f"https://hub.example.org/user/me/proxy/{port}/#"
    assert shown[0].startswith(outside if address else f"http://127.0.0.1:{port}/#")
    assert (f"ssh -N -L {port}:localhost:{port} " in said) == (address is None)
    assert ("https://hub.example.org:*" in policy[0].partition("frame-ancestors")[2]) == (address is not None)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("hub.example.org/{port}/", "it must be http://HOST/PATH/"),
        ("ftp://hub.example.org/", "it must be http://HOST/PATH/"),
        ("https:///{port}/", "it must be http://HOST/PATH/"),
        ("https://hub.example.org/#x", "it must be http://HOST/PATH/"),
        ("https://me:word@hub.example.org/", "is not a host"),
    ],
)
def test_an_address_that_is_none_is_refused(address: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        select_box(np.zeros((100, 120, 3), np.uint8), address=address)


def test_a_frame_that_is_none_is_refused() -> None:
    with pytest.raises(TypeError, match="a frame is a numpy array"):
        select_box("frame.png")  # type: ignore[arg-type]
