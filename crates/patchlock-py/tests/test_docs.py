"""Runs the Python code of the documentation as written, page by page, in order.

Code that needs a dataset or a cluster is skipped if a comment such as `<!-- not run: needs OTB -->` is on the
line before it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

import patchlock

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "README.md", ROOT / "crates/patchlock-py/README.md", *sorted((ROOT / "docs").glob("*.md"))]
CODE = re.compile(r"(?<! -->\n)^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LEFT_OUT = re.compile(r"^<!-- not run: \S.* -->\n```python$", re.MULTILINE)


@pytest.fixture(scope="module")
def video(tmp_path_factory) -> Path:
    """The file `video.mp4` that the pages refer to."""
    folder = tmp_path_factory.mktemp("video")
    scene = patchlock.Scene("simple")
    for k in range(8):
        Image.fromarray(scene[k]).save(folder / f"{k}.png")
    options = ["--box", "46,58,48,40", "--video", str(folder / "video.mp4"), "--quiet"]
    subprocess.run([sys.executable, "-m", "patchlock", "track", str(folder), *options], check=True)
    return folder / "video.mp4"


@pytest.mark.parametrize(
    "page", [page for page in PAGES if CODE.search(page.read_text())], ids=lambda page: page.stem
)
def test_the_code_of_a_page_runs(page, video, tmp_path, monkeypatch):
    (tmp_path / "video.mp4").write_bytes(video.read_bytes())
    monkeypatch.chdir(tmp_path)
    run(page)


def test_pages_can_be_followed_one_after_the_other_in_one_folder(video, tmp_path, monkeypatch):
    """The pages that store results do so beside each other."""
    (tmp_path / "video.mp4").write_bytes(video.read_bytes())
    monkeypatch.chdir(tmp_path)
    for page in ("many-clips", "benchmark"):
        run(ROOT / "docs" / f"{page}.md")
    # Also where the folder is that of the command at the top of the page.
    command = [sys.executable, "-m", "patchlock", "bench", "mine", "--out", "out", "--quiet"]
    subprocess.run(command, check=True)


def run(page: Path) -> None:
    """Runs the code of a page in the working directory."""
    text = page.read_text()
    names = {"__name__": "page"}
    for match in CODE.finditer(text):
        line = text.count("\n", 0, match.start(1))
        exec(compile("\n" * line + match.group(1), str(page), "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_code_is_skipped_without_a_reason(page):
    text = page.read_text()
    assert text.count("```python") == len(CODE.findall(text)) + len(LEFT_OUT.findall(text))
