"""Small videos as phones and editors write them, and what OpenCV shows of them.

Makes the videos in `crates/patchlock-media/tests/data` with ffmpeg, and `shown.txt` there with OpenCV: per
video a line `name frames width height`, then per frame a line of its time in milliseconds and the mean red,
green and blue of 3 x 3 cells, row by row.
"""

import platform
import subprocess
import sys
from pathlib import Path

import cv2

DATA = Path(__file__).resolve().parents[2] / "crates" / "patchlock-media" / "tests" / "data"
H264 = "-c:v libx264 -bf 2 -g 8 -crf 30 -pix_fmt yuv420p -x264-params no-info=1".split()
# A clock of 30000 ticks, on which frames last 1001, 3003 or 1500 ticks.
UNEVEN = "setpts='if(lt(N,8),N*1001,if(lt(N,14),8008+(N-8)*3003,26026+(N-14)*1500))/30000/TB'"


def source(size: str, seconds: float) -> list[str]:
    return ["-f", "lavfi", "-i", f"testsrc=size={size}:rate=25:duration={seconds}"]


def ffmpeg(program: str, *args: str) -> None:
    subprocess.run([program, "-v", "error", "-y", "-nostdin", *args], check=True, cwd=DATA)


def make(program: str) -> list[str]:
    sound = ["-f", "lavfi", "-i", "sine=duration=0.5:sample_rate=8000", "-c:a", "aac", "-b:a", "16k"]
    exact = ["-fflags", "+bitexact", "-flags:v", "+bitexact"]
    ffmpeg(program, *source("96x64", 0.8), *H264, *exact, "plain.mp4")
    ffmpeg(program, *source("96x64", 0.5), *sound, *H264, *exact, "sound.mp4")
    turned = ["-c", "copy", "-fflags", "+bitexact"]
    ffmpeg(program, "-display_rotation", "-90", "-i", "sound.mp4", *turned, "turned.mov")
    ffmpeg(program, "-ss", "0.3", "-i", "plain.mp4", "-t", "0.3", *turned, "trimmed.mp4")
    ffmpeg(program, "-i", "turned.mov", *turned, "-movflags", "frag_keyframe+empty_moov", "fragments.mp4")
    uneven = ["-vf", UNEVEN, "-fps_mode", "passthrough", "-video_track_timescale", "30000"]
    ffmpeg(program, *source("96x64", 0.8), *uneven, *H264, *exact, "uneven.mp4")
    deep = ["-c:v", "libx265", "-x265-params", "log-level=error:keyint=8:info=0", "-crf", "28"]
    deep += ["-pix_fmt", "yuv420p10le", "-tag:v", "hvc1", *exact]
    ffmpeg(program, *source("96x64", 0.4), *deep, "upright.mp4")
    ffmpeg(program, "-display_rotation", "180", "-i", "upright.mp4", *turned, "deep.mp4")
    odd = [*H264[:-4], "-pix_fmt", "yuv444p", *H264[-2:]]
    ffmpeg(program, *source("97x63", 0.4), *odd, *exact, "odd.mp4")
    # Not shown by OpenCV in a golden file, but read from every frame on.
    reordered = ["-c:v", "libx264", "-pix_fmt", "yuv420p", *exact, "-x264-params"]
    reordered += ["open-gop=1:keyint=10:bframes=2:no-info=1"]
    ffmpeg(program, *source("96x64", 1.2), *reordered, "open.mp4")
    for scratch in ["plain.mp4", "sound.mp4", "upright.mp4"]:
        (DATA / scratch).unlink()
    return ["turned.mov", "trimmed.mp4", "uneven.mp4", "fragments.mp4", "deep.mp4", "odd.mp4"]


def frames(name: str) -> list[str]:
    capture = cv2.VideoCapture(str(DATA / name))
    rows = []
    shape = (0, 0)
    while True:
        there, frame = capture.read()
        if not there:
            return [f"{name} {len(rows)} {shape[1]} {shape[0]}", *rows]
        shape = frame.shape[:2]
        cells = cv2.resize(frame, (3, 3), interpolation=cv2.INTER_AREA)[..., ::-1].reshape(-1)
        time = capture.get(cv2.CAP_PROP_POS_MSEC)
        rows.append(" ".join([f"{time:.3f}", *(str(value) for value in cells)]))


def main() -> None:
    program = sys.argv[1] if len(sys.argv) > 1 else "ffmpeg"
    version = subprocess.run([program, "-version"], check=True, capture_output=True, text=True)
    version = " ".join(version.stdout.split()[:3])
    names = make(program)
    python = platform.python_version()
    made_by = f"# made by OpenCV {cv2.__version__} (Python {python}), tools/oracles/videos.py"
    lines = [made_by, f"# videos by {version}", *(row for name in names for row in frames(name))]
    (DATA / "shown.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
