"""The rules that keep the package readable: direction of imports, lazy libraries, short files."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "pikanid"



def _tables(text: str) -> Iterator[list[list[str]]]:
    """The names in the first column of every table of a Markdown text, row by row."""
    rows: list[list[str]] = []
    for line in [*text.splitlines(), ""]:
        if line.startswith("| "):
            rows.append(re.findall(r"`([a-z_]+)`", line.split("|")[1]))
        elif rows:
            yield rows[2:]  # head and rule
            rows = []


_ROOMS = (ROOT / "CONTRIBUTING.md").read_text("utf-8").split("## Rooms")[1]
_HOUSE, _MISMATCH = list(_tables(_ROOMS))[:2]
# From the ground up: a module may import from its own room and from the rows before it.
ROWS = tuple(map(tuple, reversed(_HOUSE)))
INSIDE = tuple(map(tuple, _MISMATCH))

# Seconds to import, or optional: never at the top of a module that `import pikanid` can reach.
HEAVY = ("torch", "kan", "pandas", "matplotlib", "pint", "numba", "sklearn", "pyarrow", "h5py",
         "xarray", "asammdf", "rosbags", "nptdms", "cv2")

# Where a library may be named at all.
ONLY_IN = {
    "kan": ("pikanid.approximators.kan",),
    "torch": (
        "pikanid.approximators.kan",
        "pikanid.approximators.mlp",
        "pikanid.optimise.gradient",
        "pikanid.validation.equivalence",
        "pikanid.simulation.torch",
    ),
}

LONGEST = {"pikanid": 300, "tests": 350, "benchmarks": 350}  # lines of a file
MEDIAN = 150  # of all of them


@dataclass(frozen=True)
class Import:
    """One imported module, seen from one place."""

    importer: str
    imported: str
    line: int
    deferred: bool  # inside a function, or for type checkers only


def modules() -> dict[str, Path]:
    """Dotted name -> file, for every module of the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def _walk(node: ast.AST, deferred: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    for child in ast.iter_child_nodes(node):
        inside = deferred or _is_type_checking(child)
        inside = inside or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        yield child, inside
        yield from _walk(child, inside)


def _named(node: ast.AST, importer: str, is_package: bool, known: frozenset[str]) -> list[str]:
    """The modules that a statement or an `import_module("...")` call names."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            up = importer.split(".")
            up = up[: len(up) - node.level + is_package]
            base = ".".join([*up, base] if base else up)
        names = [f"{base}.{alias.name}" for alias in node.names]
        return [name if name in known else base for name in names]
    if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
        first = node.args[0]
        return [str(first.value)] if isinstance(first, ast.Constant) else []
    return []


@cache
def imports() -> tuple[Import, ...]:
    """Every import of the package, the deferred ones too."""
    found: list[Import] = []
    known = frozenset(modules())
    for importer, path in modules().items():
        is_package = path.name == "__init__.py"
        for node, deferred in _walk(ast.parse(path.read_text(encoding="utf-8"))):
            for name in _named(node, importer, is_package, known):
                found.append(Import(importer, name, getattr(node, "lineno", 0), deferred))
    return tuple(found)


def floor(module: str) -> tuple[int, int, str]:
    """Row of the room of a module, row inside `mismatch`, and the room; -1 where there is none."""
    room, *rest = module.split(".")[1:]
    height = next((k for k, names in enumerate(ROWS) if room in names), -1)
    if room != "mismatch" or not rest:
        return height, 0, room
    inner = next((k for k, names in enumerate(INSIDE) if rest[0] in names), -1)
    return height, inner, f"{room}.{rest[0]}"


def within(module: str, folder: str) -> bool:
    return module == folder or module.startswith((f"{folder}.", f"{folder}_"))


def test_every_module_has_a_row() -> None:
    homeless = [name for name in modules() if name != "pikanid" and min(floor(name)[:2]) < 0]
    assert homeless == [], "give the room a row in CONTRIBUTING.md"


def test_every_room_is_there() -> None:
    named = [name for names in (*ROWS, *INSIDE) for name in names]
    there = {part for name in modules() for part in name.split(".")[1:3]}
    assert set(named) <= there
    for rows in (ROWS, INSIDE):
        assert len(set(sum(rows, ()))) == len(sum(rows, ()))


def test_imports_go_downwards_only() -> None:
    upwards = [
        f"{i.importer}:{i.line} imports {i.imported}"
        for i in imports()
        if i.importer != "pikanid"  # the front door names everything
        and i.imported.startswith("pikanid.")
        and floor(i.imported)[2] != floor(i.importer)[2]
        and floor(i.imported)[:2] >= floor(i.importer)[:2]
        and i.importer != "pikanid.__main__"
    ]
    assert upwards == []


def test_no_module_needs_the_front_door() -> None:
    through = [
        f"{i.importer}:{i.line}"
        for i in imports()
        if i.imported == "pikanid" and i.importer != "pikanid"
        and floor(i.importer)[2] not in ("commands", "cli", "__main__")
    ]
    assert through == []


def test_no_circle_of_imports() -> None:
    """Imports inside functions and for type checkers count as well."""
    known = modules()
    graph: dict[str, set[str]] = {name: set() for name in known}
    for i in imports():
        if i.imported in known and i.imported != i.importer:
            graph[i.importer].add(i.imported)
    del graph["pikanid"]  # the front door names everything, and reads the version for all
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as cycle:
        pytest.fail(" -> ".join(cycle.args[1]))


@pytest.mark.parametrize("library", ONLY_IN)
def test_library_stays_in_its_rooms(library: str) -> None:
    outside = [
        f"{i.importer}:{i.line}"
        for i in imports()
        if i.imported.split(".")[0] == library
        and not any(within(i.importer, room) for room in ONLY_IN[library])
    ]
    assert outside == []


def test_pykan_is_imported_late() -> None:
    early = [
        f"{i.importer}:{i.line}"
        for i in imports()
        if i.imported.split(".")[0] == "kan" and not i.deferred
    ]
    assert early == []


def loaded_by(statements: str) -> set[str]:
    """Top-level modules that a fresh interpreter has loaded after running `statements`."""
    code = f"{statements}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    return set(done.stdout.split())


# Which libraries are loaded says more than a stopwatch, and says it on a busy machine too.
def test_import_pikanid_is_light() -> None:
    loaded = loaded_by("import pikanid")
    assert loaded.isdisjoint({*HEAVY, "numpy", "scipy", "sympy"})


@pytest.mark.parametrize(
    "statements",
    [
        "import pikanid as pk\nfor name in pk.__all__: getattr(pk, name)",
        "import pikanid.cli",
        "import pikanid.approximators",
    ],
    ids=["public names", "cli", "approximators"],
)
def test_no_heavy_library_before_it_is_needed(statements: str) -> None:
    assert loaded_by(statements).isdisjoint(HEAVY)


def test_files_are_short() -> None:
    lengths = {path.relative_to(ROOT): len(path.read_text("utf-8").splitlines())
               for folder in LONGEST for path in (ROOT / folder).rglob("*.py")}
    long = {str(name): n for name, n in lengths.items() if n > LONGEST[name.parts[0]]}
    assert long == {}, f"a file is one idea, at most {LONGEST} lines"
    assert median(lengths.values()) <= MEDIAN


def test_docstrings_have_one_style() -> None:
    """Google's: `Args:`, `Returns:`, `Raises:`; underlined headings are another one."""
    found = [f"{path.relative_to(PACKAGE)}:{number}" for path in PACKAGE.rglob("*.py")
             for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
             if re.fullmatch(r"\s+-{4,}", line)]
    assert found == []


def test_what_type_checkers_are_told_to_ignore_has_a_reason() -> None:
    found = [f"{path.relative_to(ROOT)}:{number}" for folder in ("pikanid", "benchmarks")
             for path in (ROOT / folder).rglob("*.py")
             for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
             if "# type: ignore" in line and not re.search(r"type: ignore\[[\w, -]+\]  # \S", line)]
    assert found == []


def test_no_package_defines_a_function_that_a_module_of_it_is_named_like() -> None:
    """Importing the module, whenever that is, would put it in the function's place."""
    found = [f"{package.relative_to(PACKAGE)}: {node.name}"
             for package in PACKAGE.rglob("__init__.py")
             for node in ast.parse(package.read_text("utf-8")).body
             if isinstance(node, ast.FunctionDef | ast.ClassDef)
             and ((package.parent / node.name).is_dir()
                  or (package.parent / f"{node.name}.py").exists())]
    assert found == []
