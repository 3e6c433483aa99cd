"""Runs the Python code of the documentation as written, page by page, in order.

Code that needs a dataset or a cluster is skipped if a comment such as `<!-- not run: needs OTB -->` is on the
line before it.
"""

from __future__ import annotations

import inspect
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import patchlock

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "README.md", ROOT / "crates/patchlock-py/README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
CODE = re.compile(r"(?<! -->\n\n)^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LEFT_OUT = re.compile(r"^<!-- not run: \S.* -->\n\n```python$", re.MULTILINE)


@pytest.fixture(scope="module")
def video(tmp_path_factory) -> Path:
    """The file `video.mp4` that the pages refer to."""
    folder = tmp_path_factory.mktemp("video")
    scene = patchlock.Scene("simple")
    for k in range(8):
        Image.fromarray(scene[k]).save(folder / f"{k}.png")
    options = ["--box", "46,58,48,40", "--video", str(folder / "video.mp4"), "--quiet"]
    options += ["--save", str(folder / "track.csv")]
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


@pytest.mark.parametrize(
    "documented",
    [patchlock.Box, patchlock.Config, patchlock.VideoWriter, patchlock.read_track, patchlock.track],
    ids=lambda documented: documented.__name__,
)
def test_the_code_of_a_docstring_runs(documented, video, tmp_path, monkeypatch):
    for name in ("video.mp4", "track.csv"):
        (tmp_path / name).write_bytes((video.parent / name).read_bytes())
    monkeypatch.chdir(tmp_path)
    code = CODE.findall(inspect.cleandoc(documented.__doc__))
    assert code
    for part in code:
        exec(compile(part, documented.__name__, "exec"), {"patchlock": patchlock})


def run(page: Path) -> dict[str, Any]:
    """Runs the code of a page in the working directory; returns what it has defined."""
    text = page.read_text()
    names: dict[str, Any] = {"__name__": "page"}
    for match in CODE.finditer(text):
        line = text.count("\n", 0, match.start(1))
        exec(compile("\n" * line + match.group(1), str(page), "exec"), names)
    return names


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_code_is_skipped_without_a_reason(page):
    text = page.read_text()
    assert text.count("```python") == len(CODE.findall(text)) + len(LEFT_OUT.findall(text))


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_notebooks_are_kept_with_their_outputs(file):
    """As `tools/python/notebooks.sh` stores them."""
    text = file.read_text()
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    for cell in cells:
        source = "".join(cell["source"])
        last = source.rstrip().splitlines()[-1]
        assert all(output["output_type"] != "error" for output in cell["outputs"]), source
        kinds = {kind for output in cell["outputs"] for kind in output.get("data", {})}
        if "plt.subplots(" in source or "plt.figure(" in source:
            assert "image/jpeg" in kinds, source
        elif re.match(r"[\w.]+$|table\.", last):
            assert "text/plain" in kinds, source
    # Small, and without paths of the machine on which they ran.
    assert len(text) < 200_000
    assert str(Path.home()) not in text and str(ROOT) not in text and sys.prefix not in text
