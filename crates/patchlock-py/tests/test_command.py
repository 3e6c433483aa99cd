"""The command that is installed with the package."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest
from PIL import Image

import patchlock

COMMAND = Path(sysconfig.get_path("scripts")) / ("patchlock.exe" if os.name == "nt" else "patchlock")


def run(*arguments, **options) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(COMMAND), *map(str, arguments)], capture_output=True, text=True, **options)


def test_the_command_is_installed_with_the_package():
    assert COMMAND.exists()
    version = run("--version").stdout
    assert version.startswith(f"patchlock {patchlock.__version__} (build ")
    module = subprocess.run([sys.executable, "-m", "patchlock", "--version"], capture_output=True, text=True)
    assert module.stdout == version


def test_exit_codes_are_those_of_the_binary(tmp_path):
    assert run("config").returncode == 0
    assert run("--help").returncode == 0 and "EXAMPLES" in run("--help").stdout
    wrong = run("track", "x", "--box", "1,2,3")
    assert wrong.returncode == 2 and "not four numbers" in wrong.stderr
    assert run("no-such-command").returncode == 2
    missing = run("track", tmp_path / "none", "--box", "1,2,30,40")
    assert missing.returncode == 1 and "there is no file or folder" in missing.stderr


def test_standard_output_is_complete_in_a_pipe():
    """The output is complete: Rust's buffer is flushed before Python exits."""
    text = run("config").stdout
    assert text.endswith("\n") and "score_lost = 0.5" in text


def test_file_names_need_not_be_unicode(tmp_path):
    if sys.platform != "linux":
        pytest.skip("only Linux allows arbitrary bytes in file names")
    name = os.fsencode(tmp_path) + b"/\xff.toml"
    Path(os.fsdecode(name)).write_text("particles = 0\n")
    wrong = subprocess.run(
        [os.fsencode(COMMAND), b"track", b"x", b"--box", b"1,2,3,4", b"--config", name], capture_output=True
    )
    assert wrong.returncode == 2 and b"particles" in wrong.stderr


@pytest.mark.skipif(os.name == "nt", reason="needs signals")
def test_ctrl_c_leaves_complete_files(tmp_path, scene):
    for k in range(40):
        Image.fromarray(scene[k]).save(tmp_path / f"{k:03}.png")
    (tmp_path / "slow.toml").write_text("[paper]\nparticles = 3000\n")
    box = ",".join(map(str, scene.truth(0)))
    arguments = [
        "track",
        tmp_path,
        "--box",
        box,
        "--config",
        tmp_path / "slow.toml",
        "--save",
        tmp_path / "out.csv",
    ]
    process = subprocess.Popen([COMMAND, *arguments], stderr=subprocess.PIPE, text=True)
    wait_for(lambda: any(tmp_path.glob(".*")) or any(tmp_path.glob("*.part")))
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "the files are complete up to that frame" in said
    rows = (tmp_path / "out.csv").read_text().splitlines()
    assert 1 < len(rows) < 41 and rows[0].startswith("frame,x,y")


@pytest.mark.skipif(os.name == "nt", reason="needs a terminal")
def test_the_last_lines_fit_a_terminal_of_80_columns(tmp_path):
    import pty

    scene = patchlock.Scene("demo")
    for k in range(60, 100):
        Image.fromarray(scene[k]).save(tmp_path / f"{k:03}.png")
    box = ",".join(map(str, scene.truth(60)))
    ours, theirs = pty.openpty()
    arguments = ["track", str(tmp_path), "--box", box, "--save", str(tmp_path / "out.csv")]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "80"}
    process = subprocess.Popen([COMMAND, *arguments], stderr=theirs, env=environment)
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # Linux says so at the end
        pass
    os.close(ours)
    assert process.wait(timeout=60) == 0
    # After the bar, which is drawn with escape sequences.
    last = said.decode().rsplit("\x1b[2K", 1)[-1].split("\r\n")
    assert last[0].lstrip("\r").startswith("tracked 40 frames at "), last
    assert last[1].startswith("lost in frame ") and "not back" in last[1], last
    assert max(map(len, last)) <= 80 and "\\n" not in "".join(last), last


@pytest.mark.skipif(os.name == "nt", reason="needs a terminal")
@pytest.mark.parametrize("given", [[], ["--select"], ["--box", "70,60,40,30"]])
def test_a_box_is_drawn_if_none_is_given_on_a_terminal(tmp_path, scene, given):
    import pty

    Image.fromarray(scene[0]).save(tmp_path / "0.png")
    ours, theirs = pty.openpty()
    arguments = [COMMAND, "track", str(tmp_path), "--no-open", "--save", str(tmp_path / "out.csv"), *given]
    process = subprocess.Popen(arguments, stdin=theirs, stderr=theirs, start_new_session=True)
    os.close(theirs)
    said = b""
    try:
        while b"draw a box" not in said and (part := os.read(ours, 4096)):
            said += part
    except OSError:  # Linux says so at the end
        pass
    if "--box" not in given:
        assert b"the page is at http://127.0.0.1:" in said and b"draw a box around the target there" in said
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 130
        os.close(ours)
        return
    os.close(ours)
    assert process.wait(timeout=60) == 0 and b"page" not in said


def wait_for(condition) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_the_demo_writes_pictures_and_suggests_a_command(tmp_path):
    demo = run("demo", "--quiet", "--out", tmp_path / "demo")
    assert demo.returncode == 0, demo.stderr
    assert {"demo.mp4", "demo.csv", "strip.png"} <= {path.name for path in (tmp_path / "demo").iterdir()}
    # The suggested command names the program, not the Python interpreter that runs it.
    assert f"  patchlock track {tmp_path / 'demo' / 'input.mp4'} --box" in demo.stdout
