"""Tests `patchlock trax` with an independent client, that of libtrax (vot-trax)."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import made_up
import numpy as np
import pytest

import patchlock

FRAMES = 6
PROTOCOLS = [3, 4]
LOGS: list[Any] = []


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("trax") / "color"
    made_up.save_frames(folder, FRAMES, "%02d.png")
    return sorted(folder.iterdir())


@pytest.fixture
def trax() -> Any:
    return made_up.toolkit("trax")


@contextmanager
def running(protocol: int, *options: str) -> Iterator[Any]:
    """A server, which is killed at the end in any case."""
    command = [sys.executable, "-m", "patchlock", "trax", "--protocol", str(protocol), *options]
    pipes = {name: subprocess.PIPE for name in ("stdin", "stdout", "stderr")}
    with subprocess.Popen(command, **pipes) as server:  # type: ignore[call-overload]
        try:
            yield server
        finally:
            server.kill()


@contextmanager
def client(tmp_path: Path, protocol: int) -> Iterator[Any]:
    """A client of libtrax with its own server, which must exit when the client does."""
    from trax.client import Client

    settings = tmp_path / "quick.toml"
    settings.write_text(made_up.SETTINGS)
    with running(protocol, "--config", str(settings)) as server:
        # This version of the client requires a log, and its destructor writes to it.
        peer = Client(stream=(server.stdin.fileno(), server.stdout.fileno()), log=lambda line: None)
        LOGS.append(peer._clogger)
        yield peer
        server.stdin.close()
        server.wait(timeout=60)


def corners(k: int) -> list[tuple[float, float]]:
    x, y, w, h = made_up.box(k)
    return [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]


def numbers(region: Any) -> list[float]:
    """The coordinates of a rectangle or a polygon."""
    return (
        list(region.bounds())
        if region.type == "rectangle"
        else [value for point in region for value in point]
    )


def follow(client: Any, images: list[Any], region: Any) -> list[tuple[Any, dict[str, str]]]:
    """The state in each image: region and properties."""
    states = []
    for k, image in enumerate(images):
        objects, _ = (
            client.frame({"color": image}, objects=[])
            if k
            else client.initialize({"color": image}, [(region, {})], {})
        )
        assert len(objects) == 1
        states.append((objects[0][0], dict(objects[0][1])))
    return states


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_rectangles_and_polygons(trax: Any, protocol: int, images: list[Path], tmp_path: Path) -> None:
    files = [trax.FileImage.create(str(image)) for image in images]
    with client(tmp_path, protocol) as peer:
        assert (peer.tracker_name, peer.tracker_family) == ("Patchlock", "sparse appearance")
        assert (peer.region_formats, peer.get("multiobject")) == (["rectangle", "polygon"], protocol == 4)
        assert sorted(peer.image_formats) == ["buffer", "memory", "path"]
        in_boxes = follow(peer, files, trax.Rectangle.create(*made_up.box(0)))
        # A client may restart at any time, also with the other type of region.
        in_polygons = follow(peer, files, trax.Polygon.create(corners(0)))
        peer.quit()

    alone = patchlock.Tracker(made_up.frame(0), made_up.box(0), made_up.CONFIG)
    for k, ((box, of_box), (polygon, of_polygon)) in enumerate(zip(in_boxes, in_polygons, strict=True)):
        estimate = alone.update(made_up.frame(k)) if k else alone.estimate
        assert (box.type, polygon.type) == ("rectangle", "polygon")
        # libtrax uses single precision.
        np.testing.assert_allclose(numbers(box), estimate.box, rtol=1e-5)
        # In TraX pixel 0 spans 0 to 1; our corners count from the centre of pixel 0.
        outline = estimate.corners.ravel() + 0.5
        np.testing.assert_allclose(numbers(polygon), outline, rtol=1e-5)
        assert of_box == of_polygon, "the track does not depend on the type of region"
        assert float(of_box["confidence"]) == estimate.score
        assert of_box["status"] == estimate.status
        np.testing.assert_allclose(
            [float(value) for value in of_box["region"].split(",")], outline, rtol=1e-12
        )


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_images_in_every_form(trax: Any, protocol: int, images: list[Path], tmp_path: Path) -> None:
    forms: list[Callable[[int], Any]] = [
        lambda k: trax.FileImage.create(str(images[k])),
        lambda k: trax.MemoryImage.create(made_up.frame(k)),
        lambda k: trax.BufferImage.create(images[k].read_bytes()),
    ]
    with client(tmp_path, protocol) as peer:
        tracks = [
            follow(peer, [form(k) for k in range(FRAMES)], trax.Rectangle.create(*made_up.box(0)))
            for form in forms
        ]
    for track in tracks:
        assert [properties for _, properties in track] == [properties for _, properties in tracks[0]]


def test_many_targets(trax: Any, images: list[Path], tmp_path: Path) -> None:
    files = [trax.FileImage.create(str(image)) for image in images]
    first, other = trax.Rectangle.create(*made_up.box(0)), trax.Rectangle.create(40, 30, 40, 40)
    with client(tmp_path, 4) as peer:
        alone = follow(peer, files, first)
        peer.initialize({"color": files[0]}, [(first, {}), (other, {})], {})
        objects, _ = peer.frame({"color": files[1]}, objects=[])
        assert numbers(objects[0][0]) == numbers(alone[1][0]), "another target beside it changes nothing"
        assert len(objects) == 2
        # A third target is added with a frame.
        objects, _ = peer.frame({"color": files[2]}, objects=[(first, {})])
        assert len(objects) == 3 and numbers(objects[0][0]) == numbers(alone[2][0])
        assert numbers(objects[2][0]) == numbers(first), "the first state of a target is its given region"


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_errors_reach_the_client(trax: Any, protocol: int, images: list[Path], tmp_path: Path) -> None:
    here, nowhere = trax.FileImage.create(str(images[0])), trax.FileImage.create(str(tmp_path / "none.png"))
    box, outside = trax.Rectangle.create(*made_up.box(0)), trax.Rectangle.create(5000, 5000, 9, 9)
    for image, region, reason in [
        (nowhere, box, "cannot read the image .*none.png"),
        (here, outside, "lies outside the frame"),
    ]:
        with client(tmp_path, protocol) as peer:
            with pytest.raises(trax.TraxException, match=reason):
                peer.initialize({"color": image}, [(region, {})], {})


@pytest.mark.parametrize("hears", [True, False], ids=["input closed", "output closed"])
def test_a_client_that_is_gone_ends_the_server(hears: bool, images: list[Path]) -> None:
    with running(3) as server:
        assert server.stdout.readline().startswith(b"@@TRAX:hello")
        if hears:
            server.stdin.close()
        else:
            # The server's input stays open: it must notice that its output is closed.
            server.stdout.close()
            box = ",".join(str(value) for value in made_up.box(0))
            server.stdin.write(f"@@TRAX:initialize file://{images[0]} {box}\n".encode())
            server.stdin.flush()
        assert server.wait(timeout=120) == 0
        assert server.stderr.read() == b""


def test_a_server_of_libtrax_in_our_bench(trax: Any, tmp_path: Path) -> None:
    """The TraX server in docs/toolkits.md, which wraps our tracker, gives the boxes of our tracker."""
    sequence = tmp_path / "data" / "Badge"
    made_up.save_frames(sequence / "img", FRAMES, "%04d.png")
    boxes = np.array([made_up.box(k) for k in range(FRAMES)]) + [1, 1, 0, 0]
    np.savetxt(sequence / "groundtruth_rect.txt", boxes, delimiter=",", fmt="%.17g")
    (tmp_path / "my_tracker.py").write_text(made_up.snippet("python", "trax.Server"))
    bench = [sys.executable, "-m", "patchlock", "bench", "data", "--out", "out", "--quiet"]
    command = shlex.join([sys.executable, "my_tracker.py"])
    for options in [["--name", "mine", "--cmd", command], ["--name", "own"]]:
        subprocess.run([*bench, *options], cwd=tmp_path, check=True)
    mine, own = [
        np.loadtxt(tmp_path / "out" / name / "ope/Badge/0.txt", delimiter=",") for name in ["mine", "own"]
    ]
    # libtrax writes four decimal places.
    np.testing.assert_allclose(mine, own, atol=1e-4)
    assert len(own) == FRAMES and not np.array_equal(own[0], own[-1])
