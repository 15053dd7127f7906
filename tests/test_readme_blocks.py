"""Every block of the README, pasted in order into an empty folder, runs as it stands."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
INSTALL = ("pip install", "make ")
# The same commands with fewer seeds and cases, of which whoever reads chooses the number.
FEWER = {"benchmark --seeds 100": "benchmark --seeds 2",
         "--strategy ipda --seeds 50": "--strategy ipda --seeds 3", "--seeds 200": "--seeds 5",
         "--cases 4": "--cases 2",
         "--out recordings --truth truth.json": "--out recordings --truth truth.json --cases 4"}
# What other tests run from end to end, a minute or two each.
ELSEWHERE = ("pikanid equivalence", "pikanid study")


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its text, the line it begins at."""

    language: str
    text: str
    line: int


def blocks(text: str) -> list[Block]:
    """All of them, in their order."""
    return [Block(found[1], found[2], text.count("\n", 0, found.start()) + 1)
            for found in re.finditer(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)]


def commands(text: str) -> list[str]:
    """The lines of a shell block; one that ends in a backslash goes on."""
    whole = text.replace("\\\n", " ")
    return [line.strip() for line in whole.splitlines() if line.strip()]


def fewer(command: str) -> str:
    """The command with less to do."""
    for many, few in FEWER.items():
        command = command.replace(many, few)
    return command


README = (ROOT / "README.md").read_text(encoding="utf-8")


def paste(folder: Path) -> list[str]:
    """Run what there is; returns what was left out."""
    (folder / "bin").mkdir()
    tool = folder / "bin" / "pikanid"
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pikanid "$@"\n', encoding="utf-8")
    tool.chmod(0o755)
    work = folder / "work"
    work.mkdir()
    (work / "pikanid").mkdir()  # of a checkout, the recordings that the first command names
    shutil.copytree(ROOT / "pikanid/recording/data", work / "pikanid/recording/data")
    paths = {"PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
             "PYTHONPATH": str(ROOT), "PYTHONSAFEPATH": "1"}
    names: dict[str, Any] = {}
    left_out = []
    here = Path.cwd()
    os.chdir(work)
    try:
        for block in blocks(README):
            if block.language == "toml":
                first = block.text.splitlines()[0]
                Path(first.removeprefix("# ")).write_text(block.text, encoding="utf-8")
            elif block.language == "python":
                exec(compile(block.text, f"README.md:{block.line}", "exec"), names)
            else:
                for command in commands(block.text):
                    if command.startswith((*INSTALL, *ELSEWHERE)):
                        left_out.append(command)
                        continue
                    ran = subprocess.run(["sh", "-c", fewer(command)], capture_output=True,
                                         text=True, env=os.environ | paths, check=False)
                    # fitted, but something hides in the recording, or the README says so
                    misfit = "_train.csv --model" in command or "exit code 3" in command
                    assert ran.returncode in ((0, 3) if misfit else (0,)), (
                        command, ran.returncode, ran.stderr)
    finally:
        os.chdir(here)
    return left_out


@pytest.mark.slow
@pytest.mark.kan
def test_every_block_runs(tmp_path: Path) -> None:
    for extra in ("asammdf", "kan"):
        pytest.importorskip(extra)
    assert {" ".join(command.split()[:2]) for command in paste(tmp_path)} == {
        "pip install", "make study", "make test", *ELSEWHERE}


def test_less_is_done_of_what_the_readme_says() -> None:
    assert all(many in README.replace("\\\n    ", "") for many in FEWER)


def test_a_shell_block_is_read_as_a_shell_reads_it() -> None:
    assert commands("a b \\\n   c   # why\n\nd\n") == ["a b     c   # why", "d"]
    assert [b.language for b in blocks("```sh\na\n```\n\n```python\nb\n```\n")] == ["sh", "python"]
