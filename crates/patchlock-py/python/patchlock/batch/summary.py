"""What came of a batch, in numbers and in words."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

FILE = "batch.json"
"""Name of the summary in the folder of the results."""
_SHOWN = 20


@dataclass(frozen=True)
class Failure:
    """A run that was not possible."""

    name: str
    """The name of the clip."""
    run: str
    """Which run on it, such as `seed 0`; empty where the whole clip is meant."""
    message: str
    """The reason."""

    def __str__(self) -> str:
        return f"{self.name}{f' ({self.run})' if self.run else ''}: {self.message}"


@dataclass
class Summary:
    """What came of a batch."""

    engine: str
    """Name of the engine."""
    side_by_side: int
    """How many runs went on side by side."""
    done: int = 0
    """Runs that were made."""
    kept: int = 0
    """Runs that were there already, complete."""
    failed: list[Failure] = field(default_factory=list)
    """Runs that were not possible; the next start tries them again."""
    left: int = 0
    """Runs that were not made because the work was stopped."""
    frames: int = 0
    """Frames that were tracked."""
    seconds: float = 0.0
    """Time that it took, by the clock on the wall."""
    folders: list[str] = field(default_factory=list)
    """The folders of the trackers, one for each configuration."""

    @property
    def fps(self) -> float:
        """Frames a second of all runs together, with decoding and everything else."""
        return self.frames / self.seconds if self.seconds > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """All of it for JSON."""
        return {**asdict(self), "fps": self.fps}

    def write(self, out: Path) -> None:
        """Puts it into the folder of the results, whole or not at all."""
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=out, prefix=".patchlock-", suffix=".part", delete=False, encoding="utf-8") as file:
            json.dump(self.to_dict(), file, indent=2)
            file.write("\n")
        os.chmod(file.name, 0o644)
        os.replace(file.name, out / FILE)

    def __str__(self) -> str:
        """As the command prints it."""
        counts = [f"{self.done} done", f"{self.kept} there already", f"{len(self.failed)} failed"]
        if self.left:
            counts.append(f"{self.left} left")
        lines = [
            ", ".join(counts),
            f"{self.frames} frames in {self.seconds:.1f} s, {self.fps:.1f} frames a second, {self.side_by_side} side by side ({self.engine})",
        ]
        lines += [f"failed: {failure}" for failure in self.failed[:_SHOWN]]
        if len(self.failed) > _SHOWN:
            lines.append(f"and {len(self.failed) - _SHOWN} more, all in {FILE}")
        lines += [f"results: {folder}" for folder in self.folders]
        return "\n".join(lines)
