"""Numbers that decide are fields of settings; all others say what they are."""

from __future__ import annotations

import ast
import re

import pytest
from test_architecture import floor, modules, within

# A number with an upper-case name is none of these and no field of settings: it decides unseen.
MARKS = ("numerical",  # a tolerance or a constant of an algorithm
         "limit",  # of size, depth or time: what is larger is refused, cut or kept in pieces
         "layout",  # of drawings and pages
         "definition")  # units, formats, published tables, positions in an array


def unexplained_numbers(source: str) -> list[str]:
    """Upper-case names that hold numbers, and no comment on the last line that says one of the
    marks, and why.
    """
    lines, found = source.splitlines(), []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [n.id for target in targets for n in ast.walk(target)
                 if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        numbers = any(isinstance(n, ast.Constant) and type(n.value) in (int, float)
                      for n in ast.walk(node.value))
        explained = re.search(rf"# ({'|'.join(MARKS)}): \S.{{7,}}$",
                              lines[(node.end_lineno or 1) - 1])
        if numbers and not explained and any(n.isupper() and len(n) > 1 for n in names):
            found += names
    return found


PLAIN = {0.0, 0.5, 1.0, 2.0, 10.0}  # halves, doubles, decades
ROUNDING = 1e-9  # what is smaller keeps a division, or a logarithm, finite


def unnamed_numbers(source: str) -> list[float]:
    """Decimal numbers inside functions, but for defaults of their arguments, which are described,
    and for what a line's mark explains.
    """
    lines, found = source.splitlines(), []
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef):
            found += [n for statement in function.body for n in ast.walk(statement)
                      if isinstance(n, ast.Constant) and type(n.value) is float
                      and n.value not in PLAIN and n.value > ROUNDING
                      and not re.search(rf"# ({'|'.join(MARKS)}): ", lines[n.lineno - 1])]
    return [float(str(n.value)) for n in found]


@pytest.mark.parametrize(("planted", "seen"), [
    ("def f(x):\n    return x < 0.25", [0.25]), ("def f(x):\n    if x:\n        x *= 1e-4", [1e-4]),
    ("def f(x, y=0.3):\n    return 0.5 * x / max(x, 1e-300)", []), ("SHARE = 0.3", []),
    ("def f(x):\n    return x < 0.25  # numerical: of a step, any would do", [])])
def test_a_planted_unnamed_number_is_seen(planted: str, seen: list[float]) -> None:
    assert unnamed_numbers(planted) == seen


def test_a_diagnosis_decides_by_numbers_with_names() -> None:
    """Laws of the catalogue and what is drawn or written have numbers of their own."""
    found = {name: numbers for name, path in modules().items()
             if within(name, "pikanid.mismatch") and path.stem != "figure"
             and floor(name)[2] not in ("mismatch.catalogue", "mismatch.report")
             and (numbers := unnamed_numbers(path.read_text("utf-8")))}
    assert found == {}, f"make it a field of settings, or a constant marked by one of {MARKS}"


@pytest.mark.parametrize("planted", [
    "CLEAR = 5.0", "CLEAR = 5.0  # standard errors that make an effect clear",
    "CLEAR: float = 5.0", "CLEAR, FAINT = 5.0, 1.0", "CLEAR = (5.0, 6.0)  # numerical:",
    "CLEAR = np.array([5.0])", "CLEAR = 5.0  # limit:", "CLEAR = 5.0  # chosen: as it works best",
    "def f():\n    CLEAR = 5\n", "class A:\n    CLEAR = -5\n"])
def test_a_planted_number_is_seen(planted: str) -> None:
    assert "CLEAR" in unexplained_numbers(planted)


def test_numbers_that_mean_something_are_settings() -> None:
    """What decides in a result is a field of settings; any other number says why it is none."""
    assert unexplained_numbers("DAMPING = 1e-3  # numerical: of a first step, any would do") == []
    assert unexplained_numbers("NAME = 'a 5'\nSTEPS = steps(settings)\ncount = 3") == []
    assert unexplained_numbers("mode[CLEAR] = 5") == []
    found = {name: numbers for name, path in modules().items()
             if (numbers := unexplained_numbers(path.read_text("utf-8")))}
    assert found == {}, f"make it a field of settings, or end its line in one of {MARKS}, and why"
