"""Exports, read back by the tools for which they are made."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import QUICK

import patchlock

SIZE = (240, 180)
HIDDEN = (np.zeros((3, 3), bool), np.zeros((13, 13), bool))


def estimate(
    frame: int, box: tuple[float, float, float, float], status: Any = "tracked"
) -> patchlock.Estimate:
    x, y, w, h = (float(value) for value in box)
    corners = [[x - 0.5, y - 0.5], [x + w - 0.5, y - 0.5], [x + w - 0.5, y + h - 0.5], [x - 0.5, y + h - 0.5]]
    return patchlock.Estimate((x, y, w, h), corners, 1.0, status, HIDDEN, frame=frame)


FRAMES: list[dict[int, patchlock.Estimate]] = [
    {1: estimate(0, (10, 20, 30, 40))},
    {1: estimate(1, (12.5, 21, 30, 40)), 2: estimate(1, (100, 50, 64, 32))},
    {1: estimate(2, (15, 22.25, 31, 41)), 2: estimate(2, (104, 52, 64, 32))},
    {2: estimate(3, (108, 54, 66, 33.5))},
    {2: estimate(4, (110, 55, 66, 33))},
]
"""A synthetic sequence in which one target leaves and another appears."""
BOXES = {(e.frame, i): tuple(e.box) for frame in FRAMES for i, e in frame.items()}
"""The boxes, by frame and target."""
FORMATS = list(patchlock.export_formats())


@pytest.fixture
def images(tmp_path: Path) -> Path:
    """The frames of the sequence, as files."""
    from PIL import Image

    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(len(FRAMES)):
        Image.fromarray(np.full((SIZE[1], SIZE[0], 3), 40 * k, np.uint8)).save(folder / f"{k:04}.jpg")
    return folder


def export(format: str, out: Path, **options) -> Path:
    patchlock.export(FRAMES, format, out, label="car", **options)
    return out


# ---- arguments


def test_estimates_of_one_target_are_exported(scene, film, tmp_path):
    estimates = list(patchlock.track(film[:4], scene.truth(0), progress=False, config=QUICK))
    assert patchlock.export(iter(estimates), "mot", tmp_path / "a.txt") == 1
    lines = [line.split(",") for line in (tmp_path / "a.txt").read_text().splitlines()]
    assert [line[:2] for line in lines] == [["1", "1"], ["2", "1"], ["3", "1"], ["4", "1"]]
    found = np.array([line[2:7] for line in lines], float)
    expected = [[e.box.x + 1, e.box.y + 1, e.box.w, e.box.h, e.score] for e in estimates]
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_estimates_of_many_targets_are_exported(scene, film, tmp_path):
    tracker = patchlock.MultiTracker(config=QUICK)
    tracker.add(film[0], scene.truth(0))
    tracker.add(film[0], (40, 30, 36, 30))
    patchlock.export([tracker.update(frame) for frame in film[1:4]], "mot", tmp_path / "a.txt")
    lines = (tmp_path / "a.txt").read_text().splitlines()
    assert [line.split(",")[:2] for line in lines] == [[str(f), str(i)] for f in (2, 3, 4) for i in (1, 2)]


@pytest.mark.parametrize("format", FORMATS)
def test_the_command_writes_the_same_from_a_table(tmp_path, format):
    table = tmp_path / "film.csv"
    table.write_text(
        "frame,id,x,y,w,h,score,x1,y1,x2,y2,x3,y3,x4,y4\n"
        "0,1,10,20,30,40,1,10,20,40,20,40,60,10,60\n"
        "1,2,12,21,30.5,40,0.25,12,21,42,21,42,61,12,61\n"
    )
    options = ["--label", "car", "--size", "240x180"]
    patchlock.export(str(table), format, tmp_path / "ours", label="car", size=SIZE)
    from patchlock import _patchlock

    assert (
        _patchlock.run(
            [
                "patchlock",
                "export",
                str(table),
                "--format",
                format,
                "--out",
                str(tmp_path / "theirs"),
                *options,
            ]
        )
        == 0
    )

    def content(place: Path) -> dict[str, bytes]:
        return {str(f.relative_to(place)): f.read_bytes() for f in [place, *place.rglob("*")] if f.is_file()}

    assert content(tmp_path / "ours") == content(tmp_path / "theirs") != {}


@pytest.mark.parametrize(
    ("options", "error", "says"),
    [
        ({"format": "vot"}, ValueError, 'no format "vot"; the formats are mot, kitti, coco'),
        ({"format": "coco"}, ValueError, "needs the frame size"),
        ({"format": "coco", "size": (0, 5)}, ValueError, "0 x 5"),
        ({"format": "mot", "key_frames": 5}, ValueError, "no key frames"),
        ({"format": "mot", "label": "a/b"}, ValueError, "the label is"),
        ({"track": []}, ValueError, "no boxes"),
        ({"track": [FRAMES[0], FRAMES[0]]}, ValueError, "target 1 appears twice in frame 0"),
        ({"track": "none.csv"}, OSError, "cannot read none.csv"),
        ({"out": "no/such/folder.txt"}, ValueError, "there is no folder"),
    ],
)
def test_errors_name_their_cause(tmp_path, options, error, says):
    arguments = {"track": FRAMES, "format": "mot", "out": tmp_path / "out", **options}
    with pytest.raises(error, match=says):
        patchlock.export(**arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_replaced_only_when_asked(tmp_path):
    out = export("mot", tmp_path / "a.txt")
    with pytest.raises(ValueError, match="exists already"):
        export("mot", out)
    export("mot", out, overwrite=True)


def test_the_status_is_exported(tmp_path):
    statuses = ["tracked", "lost", "uncertain"]
    track = [estimate(k, (10 + k, 20, 30, 40), status) for k, status in enumerate(statuses)]
    patchlock.export(track, "mot", tmp_path / "a.txt")
    confidence = [line.split(",")[6] for line in (tmp_path / "a.txt").read_text().splitlines()]
    assert confidence == ["1.0000", "0.0000", "1.0000"]
    patchlock.export(track, "coco", tmp_path / "a.json", size=SIZE, status=statuses)
    annotations = json.loads((tmp_path / "a.json").read_text())["annotations"]
    assert [annotation["attributes"]["status"] for annotation in annotations] == statuses
    # A table has the same.
    table = tmp_path / "table.csv"
    patchlock.to_dataframe(track).to_csv(table)
    patchlock.export(table, "mot", tmp_path / "b.txt")
    assert (tmp_path / "b.txt").read_text() == (tmp_path / "a.txt").read_text()


def test_boxes_are_chosen_and_what_is_left_out_by_default_is_a_warning(tmp_path):
    statuses = ["tracked", "lost", "uncertain", "tracked", "tracked"]
    track = [estimate(k, (10 + k, 20, 30, 40), status) for k, status in enumerate(statuses)]

    def frames(name: str, **options) -> list[str]:
        patchlock.export(track, "yolo", tmp_path / name, size=SIZE, **options)
        return sorted(file.stem[-1] for file in (tmp_path / name / "labels/train").iterdir())

    with pytest.warns(UserWarning, match="left out 2 of 5 boxes: 1 uncertain, 1 lost. Give status") as said:
        assert frames("a") == ["0", "3", "4"]
    assert said[0].filename.endswith("test_export.py")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert frames("b", status="tracked") == ["0", "3", "4"]
        assert frames("c", status=["tracked", "uncertain"]) == ["0", "2", "3", "4"]
        assert frames("d", status="tracked,uncertain", every=2) == ["0", "2", "4"]
        assert frames("e", status="tracked", min_score=1) == ["0", "3", "4"]
        patchlock.export(track, "mot", tmp_path / "f.txt")
    with pytest.raises(ValueError, match="there is no status 'gone'|there is no status \"gone\""):
        frames("x", status="gone")
    with pytest.raises(ValueError, match="the least score is 2"):
        frames("x", min_score=2)


def test_few_key_frames_keep_the_overlap(tmp_path):
    track = [estimate(k, (10 + 3 * k, 20, 30, 40)) for k in range(20)]
    patchlock.export(track, "cvat", tmp_path / "a.xml", size=SIZE, key_frames=0.9)
    boxes = ElementTree.parse(tmp_path / "a.xml").getroot().findall("track/box")
    assert [box.get("frame") for box in boxes] == ["0", "19"]
    patchlock.export(track, "cvat", tmp_path / "b.xml", size=SIZE, key_frames=5)
    assert len(ElementTree.parse(tmp_path / "b.xml").getroot().findall("track/box")) == 5
    with pytest.raises(ValueError, match="1.5 cannot be the number for key frames"):
        patchlock.export(track, "cvat", tmp_path / "c.xml", size=SIZE, key_frames=1.5)


def test_the_formats_are_listed():
    formats = patchlock.export_formats()
    assert {"mot", "cvat-obb", "label-studio"} <= set(formats)
    assert all(content for content in formats.values())


# ---- read back by others


def test_motmetrics_reads_mot_and_finds_no_fault(tmp_path):
    motmetrics = pytest.importorskip("motmetrics", reason="needs the extra export")
    found = motmetrics.io.loadtxt(export("mot", tmp_path / "a.txt"), fmt="mot15-2D")
    # motmetrics converts positions to 0-based, but not frames.
    assert {
        (frame - 1, i): tuple(row)
        for (frame, i), row in zip(found.index, found[["X", "Y", "Width", "Height"]].values, strict=True)
    } == BOXES
    assert list(found["Confidence"]) == [1.0] * len(BOXES)
    # Against a copy shifted by one pixel, every box is matched and no id is switched.
    moved = tmp_path / "moved.txt"
    patchlock.export(
        [{i: estimate(e.frame, (e.box.x + 1, *e.box[1:])) for i, e in frame.items()} for frame in FRAMES],
        "mot",
        moved,
    )
    read = motmetrics.io.loadtxt(moved, fmt="mot15-2D")
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for k in range(1, len(FRAMES) + 1):
        ours, theirs = found.loc[k], read.loc[k]
        # Its own distance function requires numpy before version 2.
        distances = abs(ours["X"].to_numpy()[:, None] - theirs["X"].to_numpy()) / 30
        accumulator.update(list(ours.index), list(theirs.index), np.where(distances < 0.5, distances, np.nan))
    names = ["num_matches", "num_switches", "num_false_positives", "num_misses", "mota"]
    summary = motmetrics.metrics.create().compute(accumulator, metrics=names)
    assert tuple(summary.iloc[0]) == (len(BOXES), 0, 0, 0, 1.0)


def test_pycocotools_reads_coco_and_finds_every_box(tmp_path):
    coco = pytest.importorskip("pycocotools.coco", reason="needs the extra export")
    evaluation = pytest.importorskip("pycocotools.cocoeval")
    out = export("coco", tmp_path / "a.json", size=SIZE)
    truth = coco.COCO(str(out))
    frames = {image["id"]: image["frame_id"] for image in truth.loadImgs(truth.getImgIds())}
    annotations = truth.loadAnns(truth.getAnnIds())
    assert {(frames[a["image_id"]], a["track_id"]): tuple(a["bbox"]) for a in annotations} == BOXES
    for annotation in annotations:
        # The outline, rasterised by pycocotools, has the area of the box.
        mask = truth.annToMask(annotation)
        assert mask.shape == SIZE[::-1]
        assert mask.sum() == pytest.approx(annotation["area"], rel=0.05)
    found = truth.loadRes(
        [{k: a[k] for k in ("image_id", "category_id", "bbox", "score")} for a in annotations]
    )
    judge = evaluation.COCOeval(truth, found, "bbox")
    judge.evaluate()
    judge.accumulate()
    judge.summarize()
    assert judge.stats[0] == pytest.approx(1.0)


# ---- rotated boxes


def turned(frame: int, degrees: float) -> patchlock.Estimate:
    """A box of 40 x 20 pixels around 100, 80, turned clockwise."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = np.array([[-20, -10], [20, -10], [20, 10], [-20, 10]]) @ turn + (99.5, 79.5)
    return patchlock.Estimate((80, 70, 40, 20), corners.tolist(), 1.0, "tracked", HIDDEN, frame=frame)


TURNED = [turned(k, degrees) for k, degrees in enumerate([0, 30, 90, 200, 359])]


def test_yolo_obb_has_the_corners(tmp_path, images):
    patchlock.export(TURNED, "yolo-obb", tmp_path / "data", images=images, label="car")
    for estimate in TURNED:
        text = (tmp_path / "data" / "labels" / "train" / f"{estimate.frame:04}.txt").read_text()
        label, *numbers = text.split()
        corners = np.array(numbers, float).reshape(4, 2) * SIZE
        assert label == "0"
        np.testing.assert_allclose(corners, np.array(estimate.corners) + 0.5, atol=1e-3)
        assert (tmp_path / "data" / "images" / "train" / f"{estimate.frame:04}.jpg").exists()
    assert '0: "car"' in (tmp_path / "data" / "data.yaml").read_text()


def test_cvat_obb_has_the_box_and_its_rotation(tmp_path):
    patchlock.export(TURNED, "cvat-obb", tmp_path / "a.xml", size=SIZE)
    boxes = list(ElementTree.parse(tmp_path / "a.xml").iter("box"))
    assert [box.get("rotation") for box in boxes] == [None, "30", "90", "200", "359"]
    for box in boxes:
        sides = [float(box.attrib[side]) for side in ("xtl", "ytl", "xbr", "ybr")]
        np.testing.assert_allclose(sides, [80, 70, 120, 90], atol=1e-3)


# ---- datumaro, which reads five of the formats


def read_by_datumaro(path: Path, format: str):
    datumaro = pytest.importorskip("datumaro", reason="needs the extra export")
    dataset = datumaro.Dataset.import_from(str(path), format)
    labels = dataset.categories().get(datumaro.AnnotationType.label)
    return dataset, [label.name for label in labels] if labels else []


def boxes_in(dataset) -> list[tuple[str, int | None, list[float]]]:
    """Item id, target and box of every box inside the frame."""
    return sorted(
        (item.id, annotation.attributes.get("track_id"), annotation.get_bbox())
        for item in dataset
        for annotation in item.annotations
        if annotation.type.name == "bbox" and not annotation.attributes.get("outside")
    )


def test_datumaro_reads_mot(tmp_path):
    dataset, _ = read_by_datumaro(export("mot", tmp_path / "a.txt"), "mot_seq")
    assert boxes_in(dataset) == [
        (f"{k + 1}", i, [x + 1, y + 1, w, h]) for (k, i), (x, y, w, h) in BOXES.items()
    ]


def test_datumaro_reads_cvat(tmp_path):
    dataset, labels = read_by_datumaro(export("cvat", tmp_path / "a.xml", size=SIZE), "cvat")
    assert boxes_in(dataset) == [(f"frame_{k:06}", i, list(box)) for (k, i), box in BOXES.items()]
    assert labels == ["car"]
    # The frame after the first target's last box marks it as outside.
    left = [
        (item.id, a.attributes["track_id"])
        for item in dataset
        for a in item.annotations
        if a.attributes["outside"]
    ]
    assert left == [("frame_000003", 1)]


def test_datumaro_reads_cvat_with_a_loss(tmp_path):
    statuses = ["tracked", "lost", "lost", "uncertain"]
    track = [estimate(k, (10, 20, 30, 40), status) for k, status in enumerate(statuses)]
    patchlock.export(track, "cvat", tmp_path / "a.xml", size=SIZE)
    dataset, _ = read_by_datumaro(tmp_path / "a.xml", "cvat")
    found = {item.id: a.attributes for item in dataset for a in item.annotations}
    assert [(name, a["outside"], a["occluded"]) for name, a in sorted(found.items())] == [
        ("frame_000000", False, False),
        ("frame_000001", True, False),
        ("frame_000003", False, True),
    ]


def test_datumaro_reads_coco(tmp_path, images):
    # datumaro requires annotations/ and images/ in the same folder.
    (tmp_path / "annotations").mkdir()
    images.rename(tmp_path / "images")
    export("coco", tmp_path / "annotations" / "instances_train.json", images=tmp_path / "images")
    dataset, labels = read_by_datumaro(tmp_path, "coco_instances")
    assert labels == ["car"]
    assert boxes_in(dataset) == sorted((f"{k:04}", i, list(box)) for (k, i), box in BOXES.items())


def test_datumaro_reads_yolo(tmp_path, images):
    dataset, labels = read_by_datumaro(export("yolo", tmp_path / "data", images=images), "yolo")
    found = [(name, box) for name, _, box in boxes_in(dataset)]
    wanted = sorted((f"{k:04}", list(box)) for (k, _), box in BOXES.items())
    assert [name for name, _ in found] == [name for name, _ in wanted]
    # Written with six digits, relative to the frame.
    np.testing.assert_allclose([box for _, box in found], [box for _, box in wanted], atol=1e-3)
    assert labels == ["car"]


def test_datumaro_reads_voc(tmp_path, images):
    dataset, labels = read_by_datumaro(export("voc", tmp_path / "data", images=images), "voc")
    found = [(name, box) for name, _, box in boxes_in(dataset)]
    wanted = sorted((f"{k:04}", list(box)) for (k, _), box in BOXES.items())
    assert [name for name, _ in found] == [name for name, _ in wanted]
    # Whole pixels, counted from 1; datumaro takes right minus left as the width, which is one less.
    found_sides = np.array([[x - 1, y - 1, w + 1, h + 1] for _, (x, y, w, h) in found])
    np.testing.assert_allclose(found_sides, [box for _, box in wanted], atol=1)
    assert labels == ["car"]


# ---- supervision


def test_supervision_reads_voc(tmp_path, images):
    supervision = pytest.importorskip("supervision", reason="needs the extra export")
    out = export("voc", tmp_path / "data", images=images)
    dataset = supervision.DetectionDataset.from_pascal_voc(str(out / "JPEGImages"), str(out / "Annotations"))
    assert dataset.classes == ["car"]
    found = {int(Path(path).stem): detections.xyxy for path, _, detections in dataset}
    assert sorted(found) == list(range(len(FRAMES)))
    for (k, i), (x, y, w, h) in BOXES.items():
        sides = found[k][list(FRAMES[k]).index(i)]
        # Rounded to whole pixels.
        np.testing.assert_allclose(sides, [x, y, x + w, y + h], atol=0.5)
