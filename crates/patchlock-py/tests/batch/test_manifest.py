"""Tests of manifests: valid ones, and the errors for invalid ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from patchlock.batch import Clip, ClipError, ManifestError, write_truth
from patchlock.batch.manifest import InvalidRow, read


def csv(folder: Path, text: str) -> Path:
    path = folder / "clips.csv"
    path.write_text(text)
    return path


def clip(row: Any) -> Clip:
    assert isinstance(row, Clip), row
    return row


def test_csv_and_json_give_the_same_clips(tmp_path: Path) -> None:
    by_columns = csv(
        tmp_path,
        "source,x,y,w,h,name,start,end,stride,seed,settings\n"
        "a/b.mp4,1,2.5,30,40,,3,9,2,7,particles=20; gamma=one\n",
    )
    lines = tmp_path / "clips.jsonl"
    fields = {"source": "a/b.mp4", "box": [1, 2.5, 30, 40], "start": 3, "end": 9, "stride": 2, "seed": 7}
    lines.write_text(json.dumps({**fields, "settings": {"particles": 20, "gamma": "one"}}) + "\n\n")
    expected = Clip(
        "a/b.mp4", (1, 2.5, 30, 40), None, "b", 3, 9, 2, 7, {"particles": 20, "gamma": "one"}, tmp_path
    )
    assert read(by_columns) == read(lines) == [expected]
    assert expected.path == str(tmp_path / "a" / "b.mp4")
    [row] = read(csv(tmp_path, '\ufeffsource, box\na.mp4, "1, 2, 30, 40"\n'))
    assert clip(row).first_box() == (1, 2, 30, 40)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("source,boxes\na,1\n", "no column 'boxes'"),
        ("box\n1 2 3 4\n", "source is missing"),
        ("source,box\n", "no clips"),
        ("source,box\na.mp4,1 2 3 4\na.mp4,1 2 3 5\n", "two clips have the name a"),
        ("source,name\na.mp4,Car.1\nb.mp4,car-1\n", "one when they are scored"),
    ],
)
def test_invalid_manifests_are_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ManifestError, match=said):
        read(csv(tmp_path, text))


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match=r"unknown extension; use \.csv, \.jsonl"):
        read(tmp_path / "clips.txt")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with pytest.raises(ManifestError, match="is a folder, a pipe or a device"):
        read(tmp_path / "zero.csv")
    (tmp_path / "a.jsonl").write_text('{"source": "a"}\nno json\n')
    with pytest.raises(ManifestError, match="line 2, is not JSON"):
        read(tmp_path / "a.jsonl")
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "nowhere.csv")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (",1 2 3 4,,", "no source"),
        ("a.mp4,1 2 3,,", "not four numbers"),
        ("a.mp4,1 2 x 4,,", "not four numbers"),
        ("a.mp4,1 2 3 4,1.5,", "start is '1.5'"),
        ("a.mp4,1 2 3 4,,particles", "not name=value"),
        ("a.mp4,1 2 3 4,,x=1,more", "more cells"),
    ],
)
def test_invalid_lines_are_reported_with_their_name(tmp_path: Path, line: str, said: str) -> None:
    bad, good = read(csv(tmp_path, f"source,box,start,settings\n{line}\nb.mp4,1 2 3 4,,\n"))
    assert isinstance(bad, InvalidRow) and said in bad.message and "line 2" in bad.message
    assert clip(good).name == "b"


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({}, "neither a box nor a truth file"),
        ({"box": (1, 2, 0.5, 4)}, "at least 1 pixel"),
        ({"box": (1, 2, float("nan"), 4)}, "four finite numbers"),
        ({"box": (1, 2, 3, 4), "name": "a/b"}, "folder of results"),
        ({"box": (1, 2, 3, 4), "name": ".a"}, "folder of results"),
        ({"box": (1, 2, 3, 4), "name": "a\x1b[31m"}, "folder of results"),
        ({"box": (1, 2, 3, 4), "name": "n" * 300}, "longer than 200 bytes"),
        ({"box": (1, 2, 3, 4), "source": "-"}, "standard input"),
        ({"box": (1, 2, 3, 4), "start": 5, "end": 5}, "no frame"),
        ({"box": (1, 2, 3, 4), "stride": 0}, "no frame"),
        ({"box": (1, 2, 3, 4), "seed": -1}, "seed is -1"),
    ],
)
def test_invalid_clips_are_refused(fields: dict[str, Any], said: str) -> None:
    with pytest.raises(ClipError, match=said):
        made = Clip(**{"source": "a.mp4", **fields})
        made.check()
        made.first_box()


def test_truth_gives_the_box_and_is_collected(tmp_path: Path) -> None:
    rows = ["11,21,30,40", "NaN,NaN,NaN,NaN", "13,21,30,40", "14\t21\t30\t40", "15,21,30,40"]
    (tmp_path / "truth.txt").write_text("\n".join(rows))
    manifest = csv(
        tmp_path,
        "source,truth,name,start,stride\na.mp4,truth.txt,a,2,2\nb.mp4,truth.txt,b,1,\nc.mp4,none.txt,c,,\n",
    )
    first, second, third = map(clip, read(manifest))
    assert first.first_box() == (12, 20, 30, 40)
    with pytest.raises(ClipError, match="no box for frame 1"):
        second.first_box()
    with pytest.raises(OSError, match=r"none\.txt"):
        third.first_box()
    assert write_truth([first, second], tmp_path / "truth") == 2
    assert (tmp_path / "truth" / "a.txt").read_text() == "13.0,21.0,30.0,40.0\n15.0,21.0,30.0,40.0\n"
    assert (tmp_path / "truth" / "b.txt").read_text().startswith("NaN,NaN,NaN,NaN\n13.0")
