"""Sentences for users: one for each failure, wherever it is written."""

from __future__ import annotations

import pkgutil
import re
from importlib import import_module
from pathlib import Path
from types import FunctionType

import pytest

from pikanid import errors

FILES = [
    file.name
    for file in pkgutil.iter_modules(errors.__path__)
    if file.name not in ("classes", "wording")
]


@pytest.mark.parametrize("file", FILES)
def test_every_sentence_is_reached_by_its_name_alone(file: str) -> None:
    """None hides another of the same name, and none escapes the rule that values are made brief."""
    module = import_module(f"pikanid.errors.{file}")
    for name, sentence in vars(module).items():
        if isinstance(sentence, FunctionType) and sentence.__module__ == module.__name__:
            assert getattr(errors, name).__wrapped__ is sentence


def test_every_sentence_is_said_somewhere() -> None:
    package = Path(errors.__file__).parents[1]
    said = {name for path in package.rglob("*.py") if path.parent.name != "errors"
            for name in re.findall(r"\berrors\.(\w+)", path.read_text(encoding="utf-8"))}
    sentences = {name for name, member in vars(errors).items() if hasattr(member, "__wrapped__")}
    assert sentences - said == set()


def test_a_sentence_stays_short_and_on_one_line() -> None:
    said = errors.missing_channel("a\nb" * 1000, "x" * 10**6, (f"c{k}" for k in range(10**4)))
    assert len(said) < 2000
    assert said.isprintable()
