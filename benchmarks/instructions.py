#!/usr/bin/env python3
"""Counts the instructions of each stage of a frame with callgrind and compares them with the recorded counts.

    python3 benchmarks/instructions.py check     # fails if a stage takes over 5 % more than recorded
    python3 benchmarks/instructions.py record    # records new counts in benchmarks/record/instructions.json

Counts do not depend on load or clock speed, so they reveal changes of a few per cent that timings do not.
They do depend on the compiler, the libraries and the instruction set; AVX2 is used, as valgrind does not
support AVX-512. This needs x86-64 with AVX2 and `valgrind`. If one is missing, `check` prints SKIPPED and
passes, or fails with PATCHLOCK_COUNTS=required. The stages are those of
crates/patchlock/benches/instructions.rs. If a stage has become cheaper by more than the margin, `check`
passes and suggests recording the new counts.
"""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks/record/instructions.json"
STAGES = ["warp", "cut", "codes", "dictionary", "update", "learn", "robust"]
MARGIN = 0.05


def why_not() -> str | None:
    """Why instructions can't be counted on this machine; `None` if they can."""
    cpuinfo = Path("/proc/cpuinfo")
    if platform.machine() != "x86_64" or not cpuinfo.is_file() or " avx2 " not in cpuinfo.read_text():
        return "this is not x86-64 Linux with AVX2"
    return None if shutil.which("valgrind") else "valgrind is not installed"


def build() -> Path:
    """Builds the benchmark; returns the path of its program."""
    words = [
        "cargo",
        "bench",
        "--locked",
        # With the features of the tests, which share this build.
        "--profile",
        "release",
        "--workspace",
        "--bench",
        "instructions",
        "--no-run",
        "--message-format",
        "json",
    ]
    output = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, check=True, text=True).stdout
    messages = (json.loads(line) for line in output.splitlines() if line.startswith("{"))
    programs = [
        m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "instructions"
    ]
    return Path(programs[0])


def count(program: Path, stage: str) -> int:
    """Instructions of one execution of a stage."""
    with tempfile.TemporaryDirectory() as folder:
        words = [
            "valgrind",
            "--tool=callgrind",
            f"--callgrind-out-file={folder}/out",
            "--toggle-collect=instructions::counted*",
            str(program),
            stage,
        ]
        result = subprocess.run(
            words, env={**os.environ, "PATCHLOCK_SIMD": "avx2"}, capture_output=True, text=True
        )
    found = re.search(r"Collected : (\d+)", result.stderr)
    if result.returncode or not found or int(found[1]) == 0:
        sys.exit(f"error: callgrind counted no instructions of {stage}:\n{result.stderr}")
    return int(found[1])


def count_all() -> dict[str, int]:
    program = build()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(STAGES, pool.map(lambda stage: count(program, stage), STAGES)))


def first_line(*words: str) -> str:
    return subprocess.run(words, stdout=subprocess.PIPE, check=True, text=True).stdout.splitlines()[0]


def record() -> None:
    counts = count_all()
    facts = {
        "written by": "python3 benchmarks/instructions.py record",
        "rustc": first_line("rustc", "--version"),
        "valgrind": first_line("valgrind", "--version"),
        "instructions": counts,
    }
    RECORD.write_text(json.dumps(facts, indent=2) + "\n")
    print(RECORD.read_text(), end="")


def check() -> None:
    if reason := why_not():
        if os.environ.get("PATCHLOCK_COUNTS") == "required":
            sys.exit(f"error: instructions must be counted, but {reason}")
        print(f"SKIPPED, instructions are not counted: {reason}")
        return
    recorded = json.loads(RECORD.read_text())
    dear, cheap = [], []
    for stage, now in count_all().items():
        before = recorded["instructions"][stage]
        change = now / before - 1
        print(f"{stage:<12} {now:>14,} {change:+8.2%}")
        dear += [stage] if change > MARGIN else []
        cheap += [stage] if change < -MARGIN else []
    if cheap:
        print(
            f"{', '.join(cheap)}: cheaper than recorded. To record the new counts: "
            "python3 benchmarks/instructions.py record"
        )
    if dear:
        here = first_line("rustc", "--version")
        sys.exit(
            f"error: {', '.join(dear)}: over {MARGIN:.0%} more instructions than in "
            f"{RECORD.relative_to(ROOT)}, which was made with {recorded['rustc']} (here: {here})\n"
            "hint: if that is intended, or due to another compiler, record the new counts: "
            "python3 benchmarks/instructions.py record"
        )


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["check"]:
            check()
        case ["record"]:
            record()
        case _:
            sys.exit(__doc__)
