"""Runs the Python code of the documentation as written, page by page, in order, and follows its links.

Code that needs a dataset or a cluster is skipped if a comment such as `<!-- not run: needs OTB -->` is on the
line before it.
"""

from __future__ import annotations

import csv
import importlib.util
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
FOLDERS = ["", "benchmarks/", "benchmarks/record/", "crates/*/", "docs/", "joss/", "tools/*/"]
MARKDOWN = sorted(page for folder in FOLDERS for page in ROOT.glob(f"{folder}*.md"))
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


def parts(page: Path) -> set[str]:
    """What a link may name in a page: its headings, as GitHub and mkdocs write them."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", MARKDOWN, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_within_the_repository_lead_somewhere(page):
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    links = re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r"^\[[^]]+\]:\s+(\S+)", text, re.MULTILINE)
    for link in links:
        # Pages of the site and of packages name files of the repository by their address.
        place = re.sub(r"^https://github.com/patchlock/patchlock/blob/main/", f"{ROOT}/", link)
        if re.match(r"[a-z]+:", place):
            continue
        path, _, part = place.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), f"{link}: there is no such file"
        assert not part or part in parts(file), f"{link}: the page has no such heading"


def test_figures_of_the_readme_are_those_of_the_records():
    readme, record = (ROOT / name for name in ("README.md", "benchmarks/record/results.md"))

    def figures(page, row):
        line = next(line for line in page.read_text().splitlines() if re.match(rf"\| \W*{row}", line))
        return [float(cell) for cell in re.findall(r"\| \W*?(\.\d+)", line)]

    for ours, theirs in [("all 40 dev", "these 40"), ("39 targets", "unseen, 39")]:
        assert figures(readme, ours) == figures(record, theirs) != []
    with (ROOT / "benchmarks/record/key-frames.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["frames"]]
    words = " ".join(readme.read_text().split())
    said = r"On (\d+) development targets this takes \[(\S+) key frames.*? takes (\S+), and .*? CSRT (\S+)\. "
    count, *means = re.search(said, words).groups()
    assert int(count) == len(rows)
    for mean, column in zip(means, ("patchlock", "interpolation", "csrt")):
        assert float(mean) == pytest.approx(sum(float(row[column]) for row in rows) / len(rows), abs=0.05)


def test_remedies_are_settings_that_users_change():
    page = (ROOT / "docs/symptoms.md").read_text()
    named = set(re.findall(r"`(?:--set )?(\w+)=[\w.]+`", page))
    assert {"search", "found_above", "sigma_x"} <= named <= {parameter.name for parameter in patchlock.parameters()}


def test_the_site_has_the_help_of_every_command():
    spec = importlib.util.spec_from_file_location("command_line", ROOT / "tools/python/command_line.py")
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    page = hook.page()
    assert page.startswith("# The command line\n")
    for command in ("track", "studio", "export", "bench", "man"):
        block = page.split(f"\n## {command}\n\n```text\n")[1].split("```")[0]
        assert f"Usage: patchlock {command} " in block and "EXAMPLES:" in block
    assert page.count("\n## ") > 10 and page.count("```") == 2 * page.count("```text")


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
