"""Adds the page of the command line to the documentation: the help of the program in the installed package."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import Any


def said(*words: str) -> str:
    """The help of the program or of a command, as on a terminal of 80 columns."""
    command = [sys.executable, "-m", "patchlock", *words, "--help"]
    environment = {**os.environ, "COLUMNS": "80"}
    answer = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return "".join(f"{line.rstrip()}\n" for line in answer.stdout.splitlines())


def page() -> str:
    """The page in Markdown: the overview, then each of its commands."""
    overview = said()
    rows = overview.split("\nCommands:\n", 1)[1].split("\n\n", 1)[0]
    commands = [name for name in re.findall(r"^  (\S+)", rows, re.MULTILINE) if name != "help"]
    text = f"# The command line\n\nWhat `patchlock --help` prints:\n\n```text\n{overview}```\n"
    return text + "".join(f"\n## {name}\n\n```text\n{said(name)}```\n" for name in commands)


def on_files(files: Any, *, config: Any) -> Any:
    """Called by mkdocs when it has listed its pages."""
    from mkdocs.structure.files import File  # the tests use `page` where mkdocs is not installed

    files.append(File.generated(config, "command-line.md", content=page()))
    return files
