"""Writes golden files: compact JSON with a header and numbers that round trip."""

import json
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

GOLDEN_DIR = Path(__file__).resolve().parents[2] / "crates" / "patchlock" / "tests" / "golden"
MAX_BYTES = 1_000_000


def header(packages: list[str], what: str, **more: Any) -> dict[str, Any]:
    """Records which software made the file and what it holds. Paths in the command lose their folders."""
    script = Path(sys.argv[0]).name
    arguments = [Path(a).name if "/" in a else a for a in sys.argv[1:]]
    made_by = [f"{name} {version(name)}" for name in packages]
    made_by += [
        f"Python {platform.python_version()}",
        f"tools/oracles/{script}",
        " ".join(["python", script, *arguments]),
    ]
    return {"made_by": ", ".join(made_by), "what": what, **more}


def f32s(values: Any) -> Any:
    """Nested lists whose numbers are the shortest decimals that parse back to the same f32."""
    array = np.asarray(values, dtype=np.float32)
    if array.ndim > 0:
        return [f32s(row) for row in array]
    shortest = float(str(array[()]))
    assert np.float32(shortest) == array[()], "shortest f32 decimal does not round trip"
    return int(shortest) if shortest == int(shortest) else shortest


def f64s(values: Any, digits: int = 17) -> Any:
    """Nested lists of f64 with `digits` significant digits; 17 is exact."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 0:
        return [f64s(row, digits) for row in array]
    value = float(array[()])
    assert np.isfinite(value), "JSON has no NaN or infinity"
    return value if digits >= 17 else float(f"{value:.{digits}g}")


def as_f32(values: Any) -> np.ndarray:
    """The values rounded to f32, as a solver in f32 receives them, but stored as f64."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)


def write(name: str | Path, content: dict[str, Any]) -> None:
    """Writes to the golden folder if `name` is a bare name, else to that path."""
    path = GOLDEN_DIR / name
    text = json.dumps(content, separators=(",", ":"), allow_nan=False) + "\n"
    if path.parent == GOLDEN_DIR:
        assert len(text) < MAX_BYTES, f"{name} would be {len(text)} bytes"
    path.write_text(text)
    print(f"wrote {path.name}: {len(text)} bytes")
