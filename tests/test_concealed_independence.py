"""The examiner shares no code with the examined: the concealed room imports nothing but errors and
plumbing, which computes nothing.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOM = Path(__file__).resolve().parents[1] / "pikanid" / "validation" / "concealed"
# Keeping compiled code, reading and writing files, checking types and ending workers says nothing
# about any motion.
PLUMBING = ("pikanid.storage",)
ALLOWED = ("pikanid.errors", *PLUMBING, "pikanid.validation.concealed")


def imported(tree: ast.AST) -> set[str]:
    """Every module of pikanid that a file names in an import, wherever in the file it stands."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide what is meant"
            base = node.module or ""
            found |= {f"{base}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(
                ("import_module", "__import__")):
            found.add(ast.unparse(node.args[0]).strip("'\""))
    return {name for name in found if name.split(".")[0] == "pikanid"}


def allowed(name: str) -> bool:
    return any(name == room or name.startswith(f"{room}.") for room in ALLOWED)


FILES = [*sorted(ROOM.rglob("*.py")),
         *sorted((ROOM.parents[1] / "storage").glob("*.py"))]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_only_errors_and_plumbing_are_shared(path: Path) -> None:
    foreign = {n for n in imported(ast.parse(path.read_text("utf-8"))) if not allowed(n)}
    assert foreign == set()


@pytest.mark.parametrize("statement", [
    "from pikanid.simulation import simulate", "import pikanid.model",
    "from pikanid import noise",
    "import importlib; importlib.import_module('pikanid.model.systems')",
    "def f():\n    from pikanid.mismatch import catalogue"])
def test_the_rule_catches(statement: str) -> None:
    assert not all(allowed(name) for name in imported(ast.parse(statement)))


def test_making_a_set_loads_nothing_else() -> None:
    code = (
        "import sys\n"
        "from pikanid.validation.concealed.generate import orders_of\n"
        "from pikanid.validation.concealed.case import make\n"
        "from pikanid.validation.concealed.seal import Settings, secret\n"
        "make(orders_of(Settings(1, 'two_pulse', 1e-3, {'nothing': 1.0}), secret(0))[0])\n"
        "print(*sorted(name for name in sys.modules if name.startswith('pikanid.')))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    foreign = {name for name in done.stdout.split() if not allowed(name)}
    # the front door, and the package around it
    assert foreign <= {"pikanid.strategies", "pikanid.validation"}
