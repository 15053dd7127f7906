"""What users can reach is listed once, documented, and shown to type checkers."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Iterator
from importlib.metadata import entry_points, version
from pathlib import Path
from types import ModuleType

import pytest

import pikanid as pk

PACKAGE = Path(pk.__file__).parent
# Pieces of generated modules are no modules; a function of errors/ is its own sentence.
FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "kernels"]
SENTENCES = PACKAGE / "errors"

# Methods that another library calls by these names and documents.
PROTOCOL = {"eval", "fdiff"}

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def _names_for_type_checkers() -> set[str]:
    def shown(file: Path) -> set[str]:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        block = next(node for node in tree.body if isinstance(node, ast.If))
        return {
            alias.asname or alias.name
            for node in ast.walk(block)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }

    own = shown(PACKAGE / "__init__.py")
    assert "*" in own  # the strategies, all that their own list names
    behind = shown(PACKAGE / "strategies" / "__init__.py") - {"Strategy"}
    assert behind == set(pk.strategies.__all__)
    return (own - {"*"}) | behind


def _public(body: Iterable[ast.stmt]) -> Iterator[Definition]:
    """Public functions and classes, and the public methods of those classes."""
    for node in body:
        if isinstance(node, Definition) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body)


def test_version_is_the_installed_one() -> None:
    assert pk.__version__ == version("pikanid")


def test_names_agree() -> None:
    assert set(pk.__all__) - {"__version__"} == _names_for_type_checkers()
    assert dir(pk) == sorted(pk.__all__)


@pytest.mark.parametrize("name", [name for name in pk.__all__ if name != "__version__"])
def test_public_name_exists_and_is_documented(name: str) -> None:
    thing = getattr(pk, name)
    assert thing is getattr(pk, name)
    assert inspect.getdoc(thing), f"pikanid.{name} has no docstring"
    if not isinstance(thing, ModuleType):
        assert thing.__name__ == name


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Nonsense'"):
        _ = pk.Nonsense


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_every_public_symbol_has_a_docstring(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    bare = [
        f"{path.name}:{node.lineno} {node.name}"
        for node in _public(tree.body)
        if not ast.get_docstring(node)
        and node.name not in PROTOCOL
        and not (path.parent == SENTENCES and isinstance(node, ast.FunctionDef))
    ]
    if not ast.get_docstring(tree) and tree.body:
        bare.insert(0, f"{path.name} itself")
    assert bare == []


def test_command_is_installed() -> None:
    (command,) = entry_points(group="console_scripts", name="pikanid")
    assert command.value == "pikanid.cli:main"
