"""The summary of a batch."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

FILE = "batch.json"
"""Name of the summary file in the results folder."""
_SHOWN = 20


def replace(path: Path, text: str) -> None:
    """Writes a file, which gets its name when it is complete."""
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, prefix=".patchlock-", suffix=".part", delete=False, encoding="utf-8"
    ) as file:
        file.write(text)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


@dataclass(frozen=True)
class Failure:
    """A run that failed."""

    name: str
    """The name of the clip."""
    run: str
    """Which of its runs, such as `seed 0`; empty for the whole clip."""
    message: str
    """The reason."""

    def __str__(self) -> str:
        return f"{self.name}{f' ({self.run})' if self.run else ''}: {self.message}"


@dataclass
class Summary:
    """The outcome of a batch."""

    engine: str
    """Name of the engine."""
    side_by_side: int
    """Number of parallel runs."""
    done: int = 0
    """Runs that were executed."""
    kept: int = 0
    """Runs that were complete before."""
    failed: list[Failure] = field(default_factory=list)
    """Runs that failed; repeating the call retries them."""
    left: int = 0
    """Runs that were not executed because the batch was interrupted."""
    frames: int = 0
    """Frames that were tracked."""
    seconds: float = 0.0
    """Wall-clock time in seconds."""
    folders: list[str] = field(default_factory=list)
    """The results folders, one per configuration."""

    @property
    def fps(self) -> float:
        """Frames per second of all runs together, including decoding and overhead."""
        return self.frames / self.seconds if self.seconds > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """All fields and `fps`, for JSON."""
        return {**asdict(self), "fps": self.fps}

    def write(self, out: Path) -> None:
        """Writes the summary into the results folder, atomically."""
        out.mkdir(parents=True, exist_ok=True)
        replace(out / FILE, json.dumps(self.to_dict(), indent=2) + "\n")

    def __str__(self) -> str:
        """The text that the command prints."""
        counts = [f"{self.done} done", f"{self.kept} already done", f"{len(self.failed)} failed"]
        if self.left:
            counts.append(f"{self.left} left")
        lines = [
            ", ".join(counts),
            f"{self.frames} frames in {self.seconds:.1f} s, {self.fps:.1f} frames per second, "
            f"{self.side_by_side} parallel runs ({self.engine})",
        ]
        lines += [f"failed: {failure}" for failure in self.failed[:_SHOWN]]
        if len(self.failed) > _SHOWN:
            lines.append(f"and {len(self.failed) - _SHOWN} more, all in {FILE}")
        lines += [f"results: {folder}" for folder in self.folders]
        return "\n".join(lines)
