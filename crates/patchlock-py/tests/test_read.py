"""Tests of read_track and read_tracks on tables that the command saves."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import patchlock
from patchlock import read_track, read_tracks, to_dataframe

BOXES = [(70, 60, 40, 30), (40, 30, 36, 30)]


@pytest.fixture(scope="module")
def folder(film, tmp_path_factory):
    folder = tmp_path_factory.mktemp("frames")
    for k, frame in enumerate(film):
        Image.fromarray(frame).save(folder / f"{k}.png")
    return folder


def saved(folder, file, *options, boxes=BOXES[:1]):
    """A table that the command saves."""
    words = [word for box in boxes for word in ("--box", ",".join(map(str, box)))]
    command = ["track", folder, *words, "--save", file, "--quiet", "--start", "2", *options]
    subprocess.run([sys.executable, "-m", "patchlock", *map(str, command)], check=True)
    return file


def near(found, expected):
    """The estimates are equal to the six decimal places of a table, which has no maps of patches."""
    assert [(e.frame, e.status, e.visibility) for e in found] == [(e.frame, e.status, None) for e in expected]
    for ours, theirs in zip(found, expected, strict=True):
        assert ours.box == pytest.approx(theirs.box, abs=1e-6)
        assert ours.corners == pytest.approx(theirs.corners, abs=1e-6)
        assert ours.score == pytest.approx(theirs.score, abs=1e-6)


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
def test_a_saved_track_is_read_back(folder, tmp_path, ending):
    expected = list(patchlock.track(folder, BOXES[0], start=2))
    file = saved(folder, tmp_path / f"track.{ending}")
    found = read_track(file)
    near(found, expected)
    assert all(estimate.ms > 0 for estimate in found)
    assert [list(each) for each in read_tracks(str(file))] == [[1]] * 10
    # What takes estimates takes these.
    assert list(to_dataframe(found).index) == list(range(2, 12))
    assert patchlock.export(found, "mot", tmp_path / "track.txt") == 1


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
def test_many_saved_targets_are_read_back(folder, tmp_path, ending):
    expected = list(patchlock.track(folder, boxes=BOXES, start=2))
    file = saved(folder, tmp_path / f"all.{ending}", boxes=BOXES)
    found = read_tracks(file)
    assert [list(each) for each in found] == [[1, 2]] * 10
    for number in (1, 2):
        near([each[number] for each in found], [each[number] for each in expected])
    with pytest.raises(ValueError, match=f"all.{ending} has 2 targets: 1, 2; patchlock.read_tracks reads all"):
        read_track(file)


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
def test_a_lost_target_has_its_last_known_box(tmp_path, ending):
    scene = patchlock.Scene("demo")
    frames = tmp_path / "frames"
    frames.mkdir()
    for k in range(12):
        # It is gone from the fourth frame on.
        frame = scene[k] if k < 4 else np.full_like(scene[0], 90)
        Image.fromarray(frame).save(frames / f"{k}.png")
    box = scene.truth(2)
    kept, blank = (
        read_track(saved(frames, tmp_path / f"{lost}.{ending}", "--lost", lost, boxes=[box]))
        for lost in ("keep", "blank")
    )
    assert [e.status for e in kept] == [e.status for e in blank] and blank[-1].status == "lost"
    first = next(k for k, estimate in enumerate(blank) if estimate.status == "lost")
    assert first > 0
    assert all(estimate.box == blank[first - 1].box for estimate in blank[first:])
    assert [e.box for e in kept[:first]] == [e.box for e in blank[:first]]


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.txt", "1,2,3,4\n", r"a.txt: a .txt file has boxes only, .*numpy.loadtxt"),
        ("a.xls", "", r"a.xls: unknown extension; allowed: .csv, .jsonl"),
        ("a.csv", "frame,x,y,w,h,status\n0,1,2,3,4,tracked\n", "target 1 has no score in frame 0"),
        ("a.csv", "frame,x,y,w,h,score\n7,1,2,3,4,1\n", "target 1 has no status in frame 7"),
        ("a.csv", "frame,x,y,w,h,score,status\n0,1,2,3,4,1,lost\n1,,,,,1,tracked\n", "no box in frame 1"),
        ("a.csv", "frame,x,y,w,h,score,status\n0,1,2,3,4,7,lost\n", "line 2: the score is 7"),
        ("a.csv", "frame,x,y,w,h\n", "a.csv: the track has no boxes"),
        ("a.jsonl", "{}\n", "a.jsonl, line 1"),
    ],
)
def test_errors_name_the_file_and_what_it_lacks(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    for read in (read_track, read_tracks):
        with pytest.raises(ValueError, match=says):
            read(tmp_path / name)
    with pytest.raises(OSError, match="none.csv"):
        read_track(tmp_path / "none.csv")
