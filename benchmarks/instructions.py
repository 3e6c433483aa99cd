#!/usr/bin/env python3
"""Instructions that each stage of a frame takes, counted by callgrind and compared with the recorded ones.

    python3 benchmarks/instructions.py check     # fails where a stage takes over 5 % more than recorded
    python3 benchmarks/instructions.py record    # writes them anew, to benchmarks/record/instructions.json

Counts do not depend on how busy or fast the machine is, so they show a change of a few per cent that no clock shows. They do depend on compiler, libraries and
instructions: AVX2, as valgrind knows no AVX-512. So it needs x86-64 with AVX2 and a program `valgrind`; where these are missing `check` says so and passes, or fails
with PATCHLOCK_COUNTS=required. The stages are those of crates/patchlock/benches/instructions.rs. A stage that has become cheaper by more than the margin passes
too, with the advice to record.
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
STAGES = ["warp", "cut", "codes", "dictionary", "update", "learn"]
MARGIN = 0.05


def why_not() -> str | None:
    """What is missing here for counting."""
    cpuinfo = Path("/proc/cpuinfo")
    if platform.machine() != "x86_64" or not cpuinfo.is_file() or " avx2 " not in cpuinfo.read_text():
        return "this is no x86-64 Linux with AVX2"
    return None if shutil.which("valgrind") else "there is no program valgrind"


def build() -> Path:
    """The benchmark's program."""
    words = [
        "cargo",
        "bench",
        "--locked",
        "--package",
        "patchlock",
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
    """Instructions of one turn of a stage."""
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
        sys.exit(f"error: callgrind counted nothing of {stage}:\n{result.stderr}")
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
            f"{', '.join(cheap)}: cheaper than recorded. Record it: python3 benchmarks/instructions.py record"
        )
    if dear:
        here = first_line("rustc", "--version")
        sys.exit(
            f"error: {', '.join(dear)}: over {MARGIN:.0%} more instructions than in {RECORD.relative_to(ROOT)}, which was made with {recorded['rustc']} (here: {here})\n"
            "hint: if that is meant, or comes from another compiler, record it: python3 benchmarks/instructions.py record"
        )


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["check"]:
            check()
        case ["record"]:
            record()
        case _:
            sys.exit(__doc__)
