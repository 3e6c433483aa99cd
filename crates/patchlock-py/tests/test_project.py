"""Projects: annotations of a video, from Python."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import QUICK
from PIL import Image

import patchlock

BOX = (10.0, 12.0, 30.0, 20.0)


@pytest.fixture
def video(tmp_path: Path) -> Path:
    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(10):
        Image.fromarray(np.full((64, 96), 10 * k, np.uint8)).save(folder / f"{k:04}.png")
    return folder


@pytest.fixture
def project(tmp_path: Path, video: Path) -> patchlock.Project:
    return patchlock.Project(tmp_path / "frames.patchlock.json", video)


def estimate(frame: int, status: str = "tracked") -> patchlock.Estimate:
    x, y, w, h = BOX
    corners = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
    return patchlock.Estimate(BOX, corners, 0.75, status, None, frame=frame)  # type: ignore[arg-type]


def test_a_video_of_too_many_pixels_begins_no_project(tmp_path: Path, video: Path):
    path = tmp_path / "frames.patchlock.json"
    with pytest.raises(OSError, match="96 x 64 pixels are more than the 6143 that are accepted"):
        patchlock.Project(path, video, max_pixels=6143)
    Image.new("L", (6001, 6000)).save(video / "0000.png")
    with pytest.raises(OSError, match="6001 x 6000 pixels are more than the 36000000"):
        patchlock.Project(path, video)
    large = patchlock.Project(path, video, max_pixels=36_006_000)
    assert large.size == (6001, 6000)


def test_a_project_is_begun_changed_saved_and_opened(project: patchlock.Project, video: Path):
    assert (project.frames, project.size, project.targets, project.changed) == (10, (96, 64), [], None)
    assert project.video == video and not project.path.exists()
    car = project.add_target("car", 0, BOX)
    project.set_key(car, 9, np.array(BOX), occluded=True)
    project.set_tracked(car, [estimate(k, "lost" if k == 3 else "tracked") for k in range(1, 10)])
    project.hide(car, 5, 6)
    project.save()
    again = patchlock.Project(project.path)
    assert again.targets == [car] and again.label(car) == "car" and again.attributes(car) == {}
    assert [name for name, colour in again.labels] == ["target", "car"]
    assert again.keys(car) == {
        0: {"box": BOX, "occluded": False, "truncated": False},
        9: {"box": BOX, "occluded": True, "truncated": False},
    }
    assert isinstance(again.keys(car)[0]["box"], patchlock.Box)
    assert list(again.tracked(car)) == [1, 2, 3, 4, 7, 8]
    found = again.tracked(car)[3]
    assert found == {"box": BOX, "score": 0.75, "status": "lost", "visible": None, "agreement": None}
    assert list(again.boxes(car)) == [0, 1, 2, 4, 7, 8, 9]
    assert again.hidden(car) == [(5, 6)]
    assert repr(again).endswith("frames.patchlock.json': 1 target>")


def test_any_edit_can_be_undone(project: patchlock.Project):
    first = project.add_target("target", 2, BOX)
    project.set_tracked(first, [estimate(k) for k in range(3, 8)])
    project.edit([
        {"edit": "split", "target": first, "frame": 5},
        {"edit": "set_target", "target": first, "attributes": {"colour": "red"}},
    ])
    assert project.targets == [1, 2] and project.attributes(1) == {"colour": "red"}
    light = {"name": "light", "kind": "select", "values": ["off", "on"], "mutable": True}
    label = project.label(1)
    change = {"edit": "set_value", "target": 1, "name": "light", "frame": 3, "value": "on"}
    project.edit([{"edit": "declare", "label": label, "attributes": [light]}, change])
    assert project.attributes(1, 2) == {"colour": "red", "light": "off"}
    assert project.attributes(1, frame=3) == {"colour": "red", "light": "on"}
    assert project.attributes(1) == {"colour": "red"}
    with pytest.raises(ValueError, match="allowed: off, on"):
        project.edit([{**change, "value": "red"}])
    assert project.undo()
    assert project.undo() and project.targets == [1]
    assert project.redo() and project.targets == [1, 2]
    project.delete_target(2)
    assert project.undo() and project.undo() and project.undo() and project.undo() and not project.undo()
    assert project.targets == []


def test_a_clip_is_marked_as_done(project: patchlock.Project):
    assert not project.done
    project.done = True
    project.save()
    assert patchlock.Project(project.path).done
    assert project.undo() and not project.done
    assert project.redo() and project.done


def test_projects_are_exported_and_files_imported(project: patchlock.Project, tmp_path: Path):
    target = project.add_target("dog", 0, BOX)
    project.set_tracked(target, [estimate(k) for k in range(1, 10)])
    for format in ("csv", "mot", "cvat", "coco"):
        out = tmp_path / f"out.{format}"
        assert project.export(format, out) == 1
        with pytest.raises(ValueError, match="exists already"):
            project.export(format, out)
        [new] = project.import_file(out, format)
        found, expected = project.boxes(new), project.boxes(target)
        assert list(found) == list(expected), format
        np.testing.assert_allclose(list(found.values()), list(expected.values()), atol=1e-3)
        assert project.label(new) == ("target" if format == "mot" else "dog")
        project.delete_target(new)
    assert json.loads((tmp_path / "out.coco").read_text())["videos"][0]["name"] == "frames"
    project.export("yolo", tmp_path / "yolo", frames=True)
    assert len(list((tmp_path / "yolo" / "images" / "train").iterdir())) == 10
    # Boxes of images are targets of their own.
    new = project.import_file(tmp_path / "yolo", "yolo")
    assert [list(project.boxes(each)) for each in new] == [[k] for k in range(10)]


def test_a_key_frame_may_have_an_outline(project: patchlock.Project):
    corners = [(30.0, 10.0), (50.0, 20.0), (40.0, 40.0), (20.0, 30.0)]
    dog = project.add_target("dog", 0, outline=corners)
    project.set_key(dog, 9, (20, 10, 30, 30), outline=np.array(corners[:3] + [(20.0, 40.0)]))
    assert project.boxes(dog)[0] == (20, 10, 30, 30)
    keys = project.keys(dog)
    assert [len(keys[frame]["outline"]) for frame in (0, 9)] == [4, 4], keys
    with pytest.raises(ValueError, match="the box is 1,1,5,5"):
        project.set_key(dog, 5, (1, 1, 5, 5), outline=corners)
    with pytest.raises(ValueError, match="two numbers x, y"):
        project.set_key(dog, 5, outline=[(1, 2, 3)])
    with pytest.raises(ValueError, match="outline"):
        project.set_key(dog, 5, outline=corners[:2])
    with pytest.raises(ValueError, match="a box or an outline"):
        project.set_key(dog, 5)


def test_what_is_wrong_is_said(project: patchlock.Project, tmp_path: Path, video: Path):
    with pytest.raises(ValueError, match="frame 10 is not in the video"):
        project.add_target("car", 10, BOX)
    assert [name for name, colour in project.labels] == ["target"]
    target = project.add_target("car", 0, BOX)
    with pytest.raises(ValueError, match="the box is"):
        project.set_key(target, 0, (0, 0, 0, 5))
    with pytest.raises(ValueError, match="unknown variant"):
        project.edit([{"edit": "fly"}])
    with pytest.raises(ValueError, match="no estimates"):
        project.set_tracked(target, [])
    with pytest.raises(KeyError, match="no target 7"):
        project.keys(7)
    with pytest.raises(ValueError, match="there is no format"):
        project.export("xls", tmp_path / "x")
    with pytest.raises(ValueError, match="cannot import"):
        project.import_file(video / "0000.png", "csv")
    with pytest.raises(OSError, match="cannot read"):
        project.import_file(tmp_path / "none.csv", "csv")
    with pytest.raises(OSError, match="cannot read"):
        patchlock.Project(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(ValueError, match="not a valid project"):
        patchlock.Project(tmp_path / "bad.json")


def test_a_video_that_only_the_file_names_is_read_in_its_folder_only(tmp_path: Path, video: Path):
    folder = tmp_path / "from somebody else"
    folder.mkdir()
    path = folder / "a.json"
    project = patchlock.Project(path, video)
    project.add_target("dog", 0, BOX)
    project.save()
    opened = patchlock.Project(path)
    for format in ("yolo", "voc", "lasot", "got10k", "coco"):
        with pytest.raises(ValueError, match="names a video outside its folder.*video="):
            opened.export(format, tmp_path / "out", frames=True)
        assert not (tmp_path / "out").exists()
    assert "outside its folder" in str(opened.changed)
    opened.export("yolo", tmp_path / "boxes")
    given = patchlock.Project(path, video)
    given.export("yolo", tmp_path / "named", frames=True)
    assert given.changed is None
    assert len(list((tmp_path / "named" / "images" / "train").iterdir())) == 1


def test_who_saves_second_is_told(project: patchlock.Project, video: Path):
    project.save()
    one, two = patchlock.Project(project.path), patchlock.Project(project.path)
    one.add_target("target", 0, BOX)
    two.add_target("target", 1, BOX)
    one.save()
    with pytest.raises(OSError, match="changed by another program"):
        two.save()
    (video / "0003.png").write_bytes((video / "0003.png").read_bytes() + b"x")
    assert "the video has changed: it had" in str(project.changed)


def test_the_command_and_python_share_a_project(project: patchlock.Project, video: Path):
    frame = np.asarray(Image.open(video / "0000.png"))
    tracker = patchlock.Tracker(frame, BOX, QUICK)
    target = project.add_target("target", 0, BOX)
    project.set_tracked(target, [tracker.estimate, tracker.update(frame)])
    assert list(project.tracked(target)) == [1], "the key stays"
