"""What a stranger may write into any place of a file, and watching that none of it is evaluated."""

from __future__ import annotations

import builtins
import copy
import datetime
import pickle
import sys
from collections.abc import Iterator
from typing import Any

import pint  # noqa: F401 - imports dask where there is one, which pickles
import pytest
import sympy
import sympy.parsing.sympy_parser

MARK = "hostile_mark"
CODE = f"__import__('pathlib').Path('{MARK}').write_text('x')"
Path = tuple[Any, ...]


def _nested(depth: int, kind: type) -> Any:
    value: Any = CODE
    for _ in range(depth):
        value = [value] if kind is list else {"a": value}
    return value


VALUES: dict[str, Any] = {
    "code": CODE,
    "a list of code": [CODE],
    "a list of two of code": [CODE, CODE],
    "a table of code": {"unit": CODE, CODE: CODE},
    "nothing": None,
    "an empty list": [],
    "an empty table": {},
    "an empty text": "",
    "a list of a number": [1],
    "a list of lists": [[1.0, 2.0], [3.0]],
    "true": True,
    "a date": datetime.date(2020, 2, 29),
    "NaN": float("nan"),
    "infinity": float("inf"),
    "a huge number": 1e308,
    "a huge integer": 10**400,
    "a huge negative integer": -(10**400),
    "zero": 0,
    "minus one": -1,
    "a half": 0.5,
    "an escape sequence": f"\x1b]0;{MARK}\x07",
    "a lone surrogate": "\ud800",
    "a long formula": "1+" * 500_000 + "1",
    "a long name": "a" * 1_000_000,
    "a long list": [CODE] * 20_000,
    "deep lists": _nested(500, list),
    "deep tables": _nested(500, dict),
}
JSON_VALUES = {name: value for name, value in VALUES.items() if name != "a date"}


def places(content: Any, path: Path = ()) -> Iterator[Path]:
    """The path of every subtree and leaf, the whole content first; of long lists the ends."""
    yield path
    if isinstance(content, dict):
        for key, value in content.items():
            yield from places(value, (*path, key))
    elif isinstance(content, list):
        for k in sorted({0, len(content) - 1} & set(range(len(content)))):
            yield from places(content[k], (*path, k))


def replaced(content: Any, path: Path, value: Any) -> Any:
    """The content with another value at one place."""
    if not path:
        return value
    changed = copy.deepcopy(content)
    inside = changed
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = value
    return changed


def without(content: Any, path: Path) -> Any:
    """The content without one key or element."""
    changed = copy.deepcopy(content)
    inside = changed
    for key in path[:-1]:
        inside = inside[key]
    del inside[path[-1]]
    return changed


def extended(content: Any, path: Path, value: Any) -> Any:
    """The content with one more key or element at a place, None where it can hold none."""
    changed = copy.deepcopy(content)
    inside = changed
    for key in path:
        inside = inside[key]
    if isinstance(inside, dict):
        inside[f"{MARK}_key"] = value
    elif isinstance(inside, list):
        inside.append(value)
    else:
        return None
    return changed


def walk(content: Any, value: Any) -> Iterator[tuple[Path, Any]]:
    """The content with `value` put at every place, and added to every table and list."""
    for path in places(content):
        yield path, replaced(content, path, value)
        longer = extended(content, path, value)
        if longer is not None:
            yield (*path, "+"), longer


def cut(content: Any) -> Iterator[tuple[Path, Any]]:
    """The content without each of its entries."""
    for path in places(content):
        if path:
            yield path, without(content, path)


@pytest.fixture
def nothing_evaluated(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fails the test where text from a file reaches a function that evaluates it."""
    reached: list[str] = []

    def watch(holder: Any, name: str) -> None:
        original = getattr(holder, name)

        def watched(source: Any, *args: Any, **named: Any) -> Any:
            # the containers too: SymPy evaluates the texts in lists and tables
            if not isinstance(source, sympy.Basic) and MARK in str(source)[:10_000]:
                reached.append(f"{name}({str(source)[:80]})")
                raise AssertionError(f"{name} was given a text from the file")
            if holder is builtins and not args:  # they take their caller's names
                caller = sys._getframe(1)
                args = (caller.f_globals, caller.f_locals)
            return original(source, *args, **named)

        monkeypatch.setattr(holder, name, watched)

    def refuse(holder: Any, name: str) -> None:
        def refused(*args: Any, **named: Any) -> Any:
            reached.append(name)
            raise AssertionError(f"{name} was called")

        monkeypatch.setattr(holder, name, refused)

    watch(builtins, "eval")
    watch(builtins, "exec")
    watch(sympy, "sympify")
    watch(sympy.parsing.sympy_parser, "parse_expr")
    watch(sympy.parsing.sympy_parser, "eval_expr")
    refuse(pickle, "load")
    refuse(pickle, "loads")
    yield
    assert reached == []
