"""Tests of VideoWriter and of the video of track: those of the command, from frames and estimates of Python."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import patchlock
from patchlock import Frames, VideoWriter, track

BOX = (70, 60, 40, 30)
BOXES = [BOX, (40, 30, 36, 30)]


@pytest.fixture(scope="module")
def folder(film, tmp_path_factory):
    folder = tmp_path_factory.mktemp("frames")
    for k, frame in enumerate(film):
        Image.fromarray(frame).save(folder / f"{k}.png")
    return folder


def command(source, video, *options, boxes=BOXES[:1]):
    """The bytes of the video that the command writes."""
    words = [word for box in boxes for word in ("--box", ",".join(map(str, box)))]
    command = ["track", source, *words, "--video", video, "--quiet", *options]
    subprocess.run([sys.executable, "-m", "patchlock", *map(str, command)], check=True)
    return video.read_bytes()


def pixels(video):
    """The frames of a video as one array."""
    return np.stack([frame for _, frame in Frames(video)])


def test_a_video_is_that_of_the_command(folder, film, tmp_path):
    expected = command(folder, tmp_path / "command.mp4")
    list(track(folder, BOX, video=tmp_path / "track.mp4"))
    assert (tmp_path / "track.mp4").read_bytes() == expected
    with VideoWriter(tmp_path / "writer.mp4", count=12) as video:
        for frame, estimate in zip(film, track(film, BOX), strict=True):
            video.write(frame, estimate)
        assert not (tmp_path / "writer.mp4").exists()
    assert (tmp_path / "writer.mp4").read_bytes() == expected
    assert sorted(path.name for path in tmp_path.iterdir()) == ["command.mp4", "track.mp4", "writer.mp4"]


def test_many_targets_ranges_and_times_are_those_of_the_command(folder, tmp_path):
    film = tmp_path / "film.mp4"
    command(folder, film)
    expected = command(film, tmp_path / "command.mp4", "--start", "1", "--stride", "3", boxes=BOXES)
    list(track(film, boxes=BOXES, start=1, stride=3, video=tmp_path / "track.mp4"))
    assert (tmp_path / "track.mp4").read_bytes() == expected
    frames = Frames(tmp_path / "track.mp4")
    assert (frames.count, frames.rate, frames.time) == (4, 10.0, None)
    times = [frames.time for _ in frames]
    assert times == pytest.approx([0, 0.1, 0.2, 0.3])


def test_channels_rates_and_panels(film, tmp_path):
    estimates = list(track(film, BOX))

    def written(name, frames, **options):
        with VideoWriter(tmp_path / name, **options) as video:
            for frame, estimate in zip(frames, estimates, strict=True):
                video.write(frame, estimate)
        return tmp_path / name

    rgb = written("rgb.mp4", film)
    bgr = written("bgr.mp4", [frame[..., ::-1] for frame in film], channels="bgr")
    images = written("images.mp4", [Image.fromarray(frame) for frame in film], channels="bgr")
    assert bgr.read_bytes() == images.read_bytes() == rgb.read_bytes()
    for rate in (25, 23.976, 30000 / 1001, 0.5):
        assert Frames(written("rate.mp4", film, rate=rate, overwrite=True)).rate == pytest.approx(rate)
    plain, coarse = written("plain.mp4", film, panel=False), written("coarse.mp4", film, quality=45)
    assert coarse.stat().st_size < plain.stat().st_size
    # Panels are in corners; the box is drawn in both.
    difference = np.abs(pixels(plain).astype(int) - pixels(rgb)).max(axis=(0, 3))
    x, y, w, h = map(int, BOX)
    assert difference[:12].max() > 100 and difference[y : y + h, x : x + w].max() < 60


def test_frames_of_given_times_last_from_one_to_the_other(film, tmp_path):
    tracker = patchlock.Tracker(film[0], BOX)
    times = [0, 0.5, 0.75, 2]
    with VideoWriter(tmp_path / "out.mp4", rate=10) as video:
        for frame, time in zip(film, times, strict=False):
            video.write(frame, tracker.estimate, time=time)
    frames = Frames(tmp_path / "out.mp4")
    assert [frames.time for _ in frames] == pytest.approx(times)


def test_what_was_written_is_kept(film, folder, tmp_path):
    out = tmp_path / "out.mp4"
    with pytest.raises(KeyError), VideoWriter(out) as video:
        video.write(film[0], {})
        raise KeyError
    assert Frames(out).count == 1
    estimates = track(folder, BOX, video=out, overwrite=True)
    next(estimates), next(estimates)
    estimates.close()
    assert Frames(out).count == 2
    # Nothing is replaced by a video without frames, nor left of it.
    with VideoWriter(out, overwrite=True):
        pass
    track(folder, BOX, video=tmp_path / "none.mp4")
    assert Frames(out).count == 2 and list(tmp_path.iterdir()) == [out]


def test_errors_name_the_argument(film, folder, tmp_path):
    out = tmp_path / "out.mp4"
    for options, error, says in [
        ({"file": tmp_path / "out.avi"}, ValueError, "out.avi: only .mp4 can be written"),
        ({"file": tmp_path / "no/out.mp4"}, OSError, "there is no folder .*no"),
        ({"rate": 0}, ValueError, "rate is 0; allowed: 0.001 to 1000 frames per second"),
        ({"rate": float("nan")}, ValueError, "rate is NaN"),
        ({"quality": 52}, ValueError, "quality is 52; allowed: 0 to 51"),
        ({"channels": "hsv"}, ValueError, "channels is 'hsv'"),
    ]:
        with pytest.raises(error, match=says):
            VideoWriter(**{"file": out, **options})
    estimate = patchlock.Tracker(film[0], BOX).estimate
    with VideoWriter(out) as video:
        video.write(film[0], estimate)
        for frame, found, error, says in [
            (film[0][:-2], estimate, ValueError, "240x178 pixels, but the frames before it are 240x180"),
            ("frame", estimate, TypeError, "a frame is a numpy array"),
            (film[0], BOX, TypeError, r"an Estimate, or a dictionary .*; not \(70, 60"),
            (film[0], {1: BOX}, TypeError, "a dictionary of an Estimate for each id"),
            (film[0], {"car": estimate}, TypeError, "a dictionary of an Estimate for each id"),
        ]:
            with pytest.raises(error, match=says):
                video.write(frame, found)
        with pytest.raises(ValueError, match="time is -1; allowed: 0 to 1e9 seconds"):
            video.write(film[0], estimate, time=-1)
    video.close()
    with pytest.raises(ValueError, match="the video is closed"):
        video.write(film[0], estimate)
    assert Frames(out).count == 1
    with pytest.raises(ValueError, match=r"out.mp4 already exists \(overwrite=True replaces it\)") as found:
        VideoWriter(out)
    assert "--" not in str(found.value)
    with pytest.raises(ValueError, match="out.mp4 already exists"):
        track(folder, BOX, video=out)
    with pytest.raises(ValueError, match="out.mp4, the source, and would replace it"):
        track(out, BOX, video=os.path.relpath(out), overwrite=True)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_leaves_the_file_alone(film, tmp_path):
    estimate = patchlock.Tracker(film[0], BOX).estimate
    video = VideoWriter(tmp_path / "out.mp4")
    video.write(film[0], estimate)
    if (child := os.fork()) == 0:
        try:
            video.write(film[1], estimate)
        except RuntimeError:
            del video
            os._exit(0)
        os._exit(1)
    assert os.waitpid(child, 0)[1] == 0
    video.write(film[1], estimate)
    video.close()
    assert Frames(tmp_path / "out.mp4").count == 2
