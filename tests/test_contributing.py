"""What CONTRIBUTING.md says is so: its recipes work to the letter, and its places are there."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from pikanid.recording import Recording

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
# An instruction, and the block that it is about.
STEP = re.compile(
    r"^(?:New file `(?P<new>[^`]+)`"
    r"|At the end of `(?P<end>[^`]+)`"
    r"|In `(?P<inside>[^`]+)`, below\s+`(?P<line>[^`]+)`"
    r"):\n\n```python\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Copy:
    """A copy of the package with a recipe followed in it, and a folder to work in."""

    def __init__(self, folder: Path, recipe: str) -> None:
        self.folder = folder / "work"
        self.folder.mkdir()
        self.source = folder / "source"
        shutil.copytree(ROOT / "pikanid", self.source / "pikanid")
        self.changed: list[Path] = []
        _, self.recipe = TEXT.split(f"### {recipe}\n")
        self.recipe = re.split(r"^##", self.recipe, maxsplit=1, flags=re.MULTILINE)[0]
        assert self.recipe.count("```python") == len(STEP.findall(self.recipe)) > 0
        for step in STEP.finditer(self.recipe):
            self._follow(step)

    def _follow(self, step: re.Match[str]) -> None:
        path = self.source / (step["new"] or step["end"] or step["inside"])
        self.changed.append(path)
        if step["new"]:
            assert not path.exists()
            path.write_text(step["code"], encoding="utf-8")
            return
        before = path.read_text(encoding="utf-8")
        if step["end"]:
            path.write_text(f"{before}\n\n{step['code']}", encoding="utf-8")
            return
        lines = before.splitlines(keepends=True)
        (at,) = (k for k, line in enumerate(lines) if line.strip() == step["line"])
        path.write_text("".join([*lines[: at + 1], step["code"], *lines[at + 1 :]]), "utf-8")

    def python(self, *words: str) -> str:
        """What a process with the copied package prints."""
        done = subprocess.run(
            [sys.executable, *words], cwd=self.folder, capture_output=True, text=True, timeout=300,
            env={**os.environ, "PYTHONPATH": str(self.source), "COLUMNS": "200"})
        assert done.returncode == 0, done.stderr
        return done.stdout

    def commands(self) -> list[str]:
        """What the recipe's own commands print, one after the other in one process."""
        (block,) = CONSOLE.findall(self.recipe)
        words = [shlex.split(line.removeprefix("$ pikanid ")) for line in block.splitlines()]
        return self.run(*words)

    def run(self, *commands: Sequence[str]) -> list[str]:
        """What commands print."""
        told = self.python("-c", "from pikanid.cli import main\n"
                           f"for words in {list(map(list, commands))!r}:\n"
                           "    assert main(words) == 0, words\n    print(chr(12))")
        return told.split(chr(12))[:-1]

    def lint(self) -> None:
        """The recipe's code keeps to the rules."""
        shutil.copy(ROOT / "pyproject.toml", self.source)
        self.python("-m", "ruff", "check", "--no-cache", *map(str, self.changed))


def test_a_strategy(tmp_path: Path) -> None:
    copy = Copy(tmp_path, "Adding a strategy")
    copy.lint()
    _, told = copy.commands()
    assert "simplex estimate of sloshing" in told and "explains the recording" in told
    assert "simplex" in copy.run(["identify", "--help"])[0]
    seen = copy.python("-c", "import pikanid as pk; print(pk.SIMPLEX(tolerance=1e-3).tolerance, "
                       "'SIMPLEX' in dir(pk))")
    assert seen.split() == ["0.001", "True"]


def test_an_effect(tmp_path: Path) -> None:
    copy = Copy(tmp_path, "Adding an effect")
    copy.lint()
    (told,) = copy.commands()
    lines = [line.split()[0] for line in told.splitlines()[1:]]
    assert lines[lines.index("amplitude_damping") + 1] == "cubic_drag"
    assert re.search(r"^cubic_drag +c_v3 > \S+ s/\(rad\)\^2", told, re.MULTILINE)


def test_a_file_format(tmp_path: Path) -> None:
    copy = Copy(tmp_path, "Adding a file format")
    copy.lint()
    _, told = copy.commands()
    assert "nls estimate of sloshing" in told and "explains the recording" in told
    text = (copy.folder / "run.log").read_text()
    assert text.startswith("LOGGER\nt [s],u_x [m/s^2],theta [rad]\n0.0,")
    (shown,) = copy.run(["identify", "--help"])
    assert "MAT, NPZ or Logger" in shown
    (copy.folder / "wrong.csv").write_text(text)
    refused = copy.python("-c", "from pikanid.cli import main\n"
                          "import sys; sys.stderr = sys.stdout\n"
                          "print(main(['identify', 'wrong.csv', '--model', 'sloshing']))")
    assert "'wrong.csv' is a logger's file, not text (CSV)" in refused and "2" in refused.split()


def test_an_excitation(tmp_path: Path) -> None:
    copy = Copy(tmp_path, "Adding an excitation")
    copy.lint()
    copy.commands()
    values = Recording.read(copy.folder / "run.csv")["u_x"].values
    assert values[:50].tolist() == [0.0] * 50 and set(values[50:]) == {1.0}
    assert "multisine, step" in copy.run(["simulate", "--help"])[0]
    seen = copy.python("-c", "import pikanid as pk; print(pk.excitation.step(1.0).name)")
    assert seen.split() == ["step"]


def test_every_recipe_is_followed() -> None:
    recipes = re.findall(r"^### (Adding .*)$", TEXT, re.MULTILINE)
    followed = set(re.findall(r'Copy\(tmp_path, "(.*?)"\)', Path(__file__).read_text("utf-8")))
    assert set(recipes) == followed and len(recipes) == 4


def places() -> Iterator[tuple[str, Path]]:
    """Change and place of every row of the table; a bare file name stands beside the one before."""
    rows = TEXT.split("| change | place |")[1].split("\n\n")[0].splitlines()[2:]
    for row in rows:
        _, change, place, _ = row.split("|")
        found = ROOT / "pikanid"
        for name in re.findall(r"`([^`]+)`", place):
            found = found.parent / name if "/" not in name else ROOT / "pikanid" / name
            yield change.strip(), found


def test_places_of_changes_are_there() -> None:
    assert [f"{change}: {path}" for change, path in places() if not path.exists()] == []
    assert len({change for change, _ in places()}) >= 10
