"""A table and a summary for each clip, made from its complete run."""

from __future__ import annotations

import json
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Any

from patchlock.batch.summary import replace

if TYPE_CHECKING:
    from patchlock.batch.task import Task

COLUMNS = "frame,x,y,w,h,score,ms,status"
"""The columns of a table, as `patchlock track --save` names and fills them."""


def write(folder: Path, task: Task) -> None:
    """Writes `<folder>/<clip>.csv` and `<clip>.json` for a run that is stored."""
    stored = Path(task.store.folder) / "ope" / task.name / task.run.removeprefix("seed ")
    manifest = json.loads(stored.with_name(f"{stored.name}.json").read_text(encoding="utf-8"))
    boxes = stored.with_name(f"{stored.name}.txt").read_text(encoding="utf-8").splitlines()
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / f"{task.name}.csv", table(boxes, manifest))
    replace(folder / f"{task.name}.json", json.dumps(summary(manifest), indent=2) + "\n")


def table(boxes: list[str], manifest: dict[str, Any]) -> str:
    """The rows of a run; positions count from 0."""
    lines = [COLUMNS]
    rows = zip(_frames(manifest), boxes, manifest["score"], manifest["seconds"], manifest["status"], strict=True)
    for frame, box, score, seconds, status in rows:
        x, y, w, h = map(float, box.split(","))
        origin = manifest["origin"]
        numbers = [round(number, 6) for number in (x - origin, y - origin, w, h, score)]
        lines.append(",".join([str(frame), *map(_number, numbers), _number(round(1e3 * seconds, 3)), status]))
    return "\n".join(lines) + "\n"


def summary(manifest: dict[str, Any]) -> dict[str, Any]:
    """The statistics of a run, as `patchlock track --summary` names them."""
    statuses, seconds = manifest["status"], manifest["seconds"]
    counts = {f"frames_{status}": statuses.count(status) for status in ("tracked", "uncertain", "lost")}
    return {
        "source": manifest["clip"]["source"],
        "seed": manifest["seed"],
        "frames": len(statuses),
        **counts,
        "losses": _losses(_frames(manifest), statuses),
        "tracking_fps": round(len(seconds) / max(sum(seconds), 1e-9), 3),
        "ms_median": round(1e3 * statistics.median(seconds), 3),
    }


def _frames(manifest: dict[str, Any]) -> list[int]:
    """The numbers of the frames in the source."""
    clip = manifest["clip"]
    return [clip["start"] + clip["stride"] * k for k in range(manifest["frames"])]


def _losses(frames: list[int], statuses: list[str]) -> list[dict[str, int | None]]:
    """Each loss, with the frame in which the target was back."""
    losses: list[dict[str, int | None]] = []
    before = "tracked"
    for frame, status in zip(frames, statuses, strict=True):
        if status == "lost" and before != "lost":
            losses.append({"lost_frame": frame, "return_frame": None})
        elif status != "lost" and before == "lost":
            losses[-1]["return_frame"] = frame
        before = status
    return losses


def _number(value: float) -> str:
    """A number as in other tables: 12 and not 12.0."""
    return repr(value).removesuffix(".0")
