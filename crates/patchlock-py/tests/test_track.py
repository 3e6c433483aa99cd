"""Tests of `track` on every kind of source, compared with the command; its table; its progress bar."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import QUICK, SETTINGS, configured, numbers
from PIL import Image

import patchlock
from patchlock import Frames, to_dataframe, track

TOML = "".join(f"{name} = {value!r}\n" for name, value in SETTINGS.items())


@pytest.fixture(scope="module")
def folder(film, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    for k, frame in enumerate(film):
        Image.fromarray(frame).save(folder / f"{k}.png")
    return folder


@pytest.fixture(scope="module")
def video(folder, scene) -> Path:
    """The frames as an MP4; the command writes it, with the track drawn in."""
    command(folder, scene.truth(0), "--video", folder / "film.mp4")
    return folder / "film.mp4"


def command(source, box, *options) -> pd.DataFrame:
    """The table that `patchlock track` saves."""
    config = Path(source).parent / "quick.toml"
    config.write_text(TOML)
    saved = Path(source).parent / "saved.jsonl"
    box = ",".join(map(repr, map(float, box)))
    arguments = [
        "track",
        source,
        "--box",
        box,
        "--preset",
        "paper",
        "--config",
        config,
        "--save",
        saved,
        "--overwrite",
        "--quiet",
        *options,
    ]
    subprocess.run([sys.executable, "-m", "patchlock", *map(str, arguments)], check=True)
    return pd.DataFrame([json.loads(line) for line in saved.read_text().splitlines()]).set_index("frame")


UNKNOWN = ["frame_w", "frame_h", "time"]
"""The columns of the command's table that an estimate does not know; images have no time."""


def same(table: pd.DataFrame, expected: pd.DataFrame) -> None:
    """The tables are equal to the six decimal places that the command writes."""
    expected = expected.drop(columns=UNKNOWN, errors="ignore")
    assert list(table.columns) == list(expected.columns)
    both = (table.drop(columns="ms"), expected.drop(columns="ms"))
    pd.testing.assert_frame_equal(both[0].round(6), both[1], check_exact=True, check_index_type=False)


def test_a_folder_gives_the_boxes_of_the_command(folder, scene):
    box = scene.truth(0)
    same(to_dataframe(track(folder, box, config=QUICK)), command(folder, box))


def test_a_video_gives_the_boxes_of_the_command(video, scene):
    box = scene.truth(0)
    table = to_dataframe(track(str(video), box, config=configured("paper", **SETTINGS, seed=3)))
    assert len(table) == 12
    same(table, command(video, box, "--seed", "3"))
    assert (Frames(video).count, Frames(video).rate) == (12, 30.0)


def test_ranges_strides_and_reverse_are_those_of_the_command(folder, film, scene):
    part = {"start": 1, "end": 11, "stride": 3}
    for reverse in (False, True):
        box = scene.truth(10 if reverse else 1)
        options = ["--start", "1", "--end", "11", "--stride", "3", *(["--reverse"] if reverse else [])]
        expected = command(folder, box, *options)
        assert list(expected.index) == ([10, 7, 4, 1] if reverse else [1, 4, 7, 10])
        same(to_dataframe(track(folder, box, reverse=reverse, **part, config=QUICK)), expected)
        same(to_dataframe(track(film, box, reverse=reverse, **part, config=QUICK)), expected)
        same(to_dataframe(track(np.stack(film), box, reverse=reverse, **part, config=QUICK)), expected)


def test_all_iterables_give_the_same(folder, film, scene):
    box = scene.truth(0)
    expected = [numbers(estimate) for estimate in track(folder, box, config=QUICK)]
    sources = {
        "list": film,
        "generator": (frame for frame in film),
        "array": np.stack(film),
        "images": [Image.open(folder / f"{k}.png") for k in range(12)],
        "frames": (frame for _, frame in Frames(folder)),
        "pattern": str(folder / "%d.png"),
        "glob": str(folder / "*.png"),
    }
    for name, source in sources.items():
        assert [numbers(estimate) for estimate in track(source, box, config=QUICK)] == expected, name
    bgr = (frame[..., ::-1] for frame in film)
    assert [numbers(estimate) for estimate in track(bgr, box, channels="bgr", config=QUICK)] == expected


def test_a_scene_is_a_source(scene):
    estimates = list(track(scene, scene.truth(0), end=5, config=QUICK))
    assert [estimate.frame for estimate in estimates] == [0, 1, 2, 3, 4]
    assert np.array_equal(scene[-1], scene[39]) and len(scene) == 40
    assert scene.hidden(0) == 0.0 and patchlock.Scene("occluded").hidden(30) > 0.3
    with pytest.raises(IndexError, match="frame 40 of a scene of 40"):
        scene[40]


def test_the_table_has_the_columns_of_the_command(film, scene):
    table = to_dataframe(track(film, scene.truth(0), config=QUICK))
    names = "x y w h score visible_large visible_small x1 y1 x2 y2 x3 y3 x4 y4 ms status"
    assert list(table.columns) == names.split() and table.index.name == "frame"
    assert table.loc[0, "status"] == "tracked"
    assert table.loc[0, ["x", "y", "w", "h"]].to_list() == pytest.approx(scene.truth(0))
    assert to_dataframe([]).empty


def test_a_settings_file_gives_the_boxes_of_the_command(folder, scene, tmp_path):
    box = scene.truth(0)
    config = tmp_path / "my.toml"
    config.write_text(TOML)
    settings = patchlock.Config("paper", config)
    assert settings == QUICK
    same(to_dataframe(track(folder, box, config=settings)), command(folder, box))
    config.write_text("particels = 9\n")
    with pytest.raises(ValueError, match="my.toml: .*particels"):
        patchlock.Config("paper", file=config)
    with pytest.raises(OSError, match="cannot read the settings"):
        patchlock.Config(file=tmp_path / "none.toml")


BOXES = {7: (70, 60, 40, 30), 2: (40, 30, 36, 30), 5: (120, 90, 30, 30)}


def test_many_boxes_are_followed_in_one_pass(film, folder):
    alone = {number: list(track(film, box, config=QUICK)) for number, box in BOXES.items()}
    expected = [{number: alone[number][k] for number in BOXES} for k in range(12)]
    passes = []
    frames = (passes.append(k) or frame for k, frame in enumerate(film))
    found = list(track(frames, boxes=BOXES, config=QUICK))
    assert found == expected and [list(each) for each in found] == [list(BOXES)] * 12
    assert passes == list(range(12))
    listed = [dict(enumerate(each.values(), 1)) for each in expected]
    for boxes in (list(BOXES.values()), np.array(list(BOXES.values())), iter(BOXES.values())):
        assert list(track(film, boxes=boxes, config=QUICK)) == listed
    part = {"start": 1, "end": 11, "stride": 3, "reverse": True}
    many = list(track(folder, boxes={np.int64(4): BOXES[7]}, **part, config=QUICK))
    one = list(track(folder, BOXES[7], **part, config=QUICK))
    assert many == [{4: estimate} for estimate in one] and many[0][4].frame == 10


def test_many_boxes_are_shown_and_exported(film, tmp_path, capfd):
    found = list(track(film, boxes=BOXES, progress=True))
    assert "3 targets" in capfd.readouterr().err
    assert patchlock.export(found, "mot", tmp_path / "track.txt") == 1
    assert len((tmp_path / "track.txt").read_text().splitlines()) == 36


def test_the_progress_bar_is_shown_on_request(film, scene, capfd, monkeypatch):
    # Also on a terminal there is none unless it is asked for: it would mix with what the loop prints.
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    list(track(film, scene.truth(0), config=QUICK))
    assert capfd.readouterr().err == ""
    list(track(film, scene.truth(0), progress=True, config=QUICK))
    assert "12/12" in capfd.readouterr().err
    list(track((f for f in film), scene.truth(0), progress=False, config=QUICK))
    assert capfd.readouterr().err == ""


def test_frames_are_read_lazily(film, scene):
    asked = []
    source = (asked.append(k) or frame for k, frame in enumerate(film))
    estimates = track(source, scene.truth(0), config=QUICK)
    next(estimates)
    next(estimates)
    assert asked == [0, 1]


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"source": "nowhere.mp4"}, FileNotFoundError, "no file or folder nowhere.mp4"),
        ({"source": "nowhere/%d.png"}, OSError, "nowhere"),
        ({"start": -1}, ValueError, "frames count from 0"),
        ({"start": 12}, ValueError, "start=12 is beyond the end: there are 12 frames"),
        ({"stride": 0}, ValueError, "at least 1"),
        ({"start": 3, "end": 3}, ValueError, "end=3 is not after start=3"),
        ({"preset": "best"}, ValueError, "unknown preset `best`"),
        ({"config": 3}, TypeError, "config is a patchlock.Config, not 3"),
        ({"config": configured("paper", large_patch=128)}, ValueError, "`large_patch` is 128; .*template_side"),
        ({"source": iter([]), "reverse": True}, TypeError, "can be indexed"),
        ({"box": None}, TypeError, "either box, of one target, or boxes"),
        ({"boxes": [(1, 2, 30, 40)]}, TypeError, "either box, of one target, or boxes"),
        ({"box": None, "boxes": {}}, ValueError, "boxes is empty"),
        ({"box": None, "boxes": [(1, 2, 30)]}, ValueError, r"four numbers x, y, w, h: .*; not \(1, 2, 30\)"),
        ({"box": None, "boxes": (1, 2, 30, 40)}, TypeError, "four numbers x, y, w, h: .*; not 1"),
        ({"box": None, "boxes": {"car": (1, 2, 30, 40)}}, TypeError, "the id 'car'; an id is a whole number"),
        ({"box": None, "boxes": {-1: (1, 2, 30, 40)}}, TypeError, "the id -1; an id is a whole number"),
        ({"video": "out.avi"}, ValueError, "out.avi: only .mp4 can be written"),
    ],
)
def test_usage_errors_are_raised_before_the_first_frame(film, change, error, says):
    with pytest.raises(error, match=says):
        track(**{"source": film, "box": (70, 60, 40, 30), **change})


def test_errors_of_files_name_the_argument_or_the_file(folder, tmp_path):
    with pytest.raises(ValueError, match="^start=99 is beyond the end: the source has 12 frames"):
        track(folder, (70, 60, 40, 30), start=99)
    with pytest.raises(ValueError, match=r"^end=3 is not after start=3: .*\(end is the first frame") as found:
        track(folder, (70, 60, 40, 30), start=3, end=3)
    assert "--" not in str(found.value)
    with pytest.raises(ValueError, match="^stride is 0; .*stride=1 takes every frame"):
        track(folder, (70, 60, 40, 30), stride=0)
    (tmp_path / "0.png").write_bytes((folder / "0.png").read_bytes())
    (tmp_path / "1.png").write_bytes(b"no image")
    estimates = track(tmp_path, (70, 60, 40, 30), config=QUICK)
    assert next(estimates).frame == 0
    with pytest.raises(OSError, match="cannot read frame 1, .*1.png"):
        next(estimates)
    with pytest.raises(ValueError, match="no frames"):
        list(track([], (70, 60, 40, 30)))


def test_a_printed_box_fits_a_line_and_its_repr_is_exact():
    box = patchlock.Box(46.61571345319628, 158.561945343746835, 48.0, 1 / 3)
    assert str(box) == f"{box}" == "Box(x=46.62, y=158.56, w=48.00, h=0.33)"
    assert eval(repr(box), {"Box": patchlock.Box}) == box
