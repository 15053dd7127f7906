"""Do the tests see a wrong line?  mutmut plants them, one at a time, in a sample of the code.

Usage: python benchmarks/mutants.py run [JOBS [PATTERN...]]
       python benchmarks/mutants.py again [JOBS] [PATTERN [TESTS...]]
       python benchmarks/mutants.py carry OTHER_CHECKOUT
       python benchmarks/mutants.py report FOLDER

`run` makes the mutants of the sample below mutants/ and tries those that have no verdict, so an
interrupted run goes on.  `again` tries survivors in processes of their own, where a mutant is there
when modules are imported, with more of the tests that reach them.  `carry` takes over from another
checkout what was killed there by the same change in a function of the same name: after a redesign
few functions are as they were.  `report` writes FOLDER/mutants.md.  Whether a mutation belongs to
the sample depends on SEED, its file, function and number in the function only, so edits elsewhere
do not move it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatch
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
WORK, MUTANTS = ROOT / "build" / "mutants", ROOT / "mutants"
CARRIED = WORK / "carried.json"
REASONS = ROOT / "benchmarks" / "mutants_survivors.toml"
SEED = 1
# Share of each room's mutations; "objective" is what builds residuals and judges them.
SHARES = {"discrepancy": 0.021, "equivalence": 0.012, "mismatch": 0.0095, "noise": 0.05,
          "objective": 0.035, "optimise": 0.021, "simulation": 0.016, "symbolic": 0.018,
          "uncertainty": 0.065}


def room(path: str) -> str:
    """The room of a file, as in CONTRIBUTING; of one in `validation`, the room inside it."""
    first, *rest = Path(path).relative_to("pikanid").parts
    return rest[0] if first == "validation" else first


def in_sample(path: str, function: str, number: int) -> bool:
    """Whether mutation `number` of a function is tried."""
    digest = hashlib.sha256(f"{SEED} {path} {function} {number}".encode()).digest()
    return int.from_bytes(digest[:8]) < SHARES.get(room(path), 0.0) * 2.0**64


def idle(node: Any, mutated: Any) -> bool:
    """Changes that no run of the package can show: the check of `zip`, the type of a `cast`."""
    import libcst as cst

    if not isinstance(node, cst.Call) or not isinstance(mutated, cst.Call):
        return False
    if isinstance(node.func, cst.Name) and node.func.value == "cast":
        return True
    return [_value(a) for a in node.args if not _strict(a)] == [
        _value(a) for a in mutated.args if not _strict(a)]


def strict_flags(module: Any) -> set[int]:
    """The values of the `strict` flags in a module, by identity."""
    import libcst.matchers as m

    return {_value(a) for a in m.findall(module, m.Arg(keyword=m.Name("strict")))}


def _strict(argument: Any) -> bool:
    return argument.keyword is not None and argument.keyword.value == "strict"


def _value(argument: Any) -> int:
    return id(argument.value)


def only_the_sample() -> None:
    """Let mutmut make no other mutants than those of the sample."""
    from mutmut.mutation import file_mutation

    make = file_mutation.create_mutations

    def sampled(filename: str, *arguments: Any) -> Any:
        module, mutations, *rest = make(filename, *arguments)
        seen: Counter[str] = Counter()
        kept, flags = [], strict_flags(module)
        for mutation in mutations:
            function = mutation.contained_by_top_level_function
            name = getattr(getattr(function, "name", None), "value", None)
            if name is None or idle(mutation.original_node, mutation.mutated_node):
                continue
            seen[name] += 1
            # counted even so, as the sample depends on numbers
            if in_sample(filename, name, seen[name]) and id(mutation.original_node) not in flags:
                kept.append(mutation)
        return module, kept, *rest

    file_mutation.create_mutations = sampled


def prepare() -> None:
    """Surroundings of every test process; results of another sample are dropped."""
    os.chdir(ROOT)
    os.environ |= {"MUTANTS_WORK": str(WORK), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
                   "MKL_NUM_THREADS": "1"}
    WORK.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(WORK / "scratch", ignore_errors=True)
    sample, note = json.dumps([SEED, SHARES]), WORK / "sample.json"
    if not note.exists() or note.read_text() != sample:
        shutil.rmtree(MUTANTS, ignore_errors=True)
        note.write_text(sample)
    # A module that was moved must not be found where it was.
    for copy in MUTANTS.glob("*/**/*.py"):
        if not (ROOT / copy.relative_to(MUTANTS)).exists():
            copy.unlink()


def run(jobs: int, patterns: Sequence[str] = ()) -> None:
    """Every mutant of the sample that has no verdict and is asked for."""
    prepare()
    only_the_sample()
    from mutmut.__main__ import _run

    os.environ["MUTANTS_FIRST"] = "1"  # tests that fail without a mutant are left out
    left = [name for _, name, verdict in verdicts() if verdict == "not checked"
            and any(fnmatch(name, p) for p in patterns)]
    _run(left or patterns, jobs)


def verdicts() -> Iterator[tuple[Any, str, str]]:
    """Each mutant: mutmut's data of its file, its name and its verdict."""
    from mutmut.mutation.data import SourceFileMutationData
    from mutmut.stats import status_by_exit_code
    from mutmut.utils.file_utils import walk_mutatable_files

    for path in sorted(walk_mutatable_files()):
        data = SourceFileMutationData(path=path)
        data.load()
        for name, code in data.exit_code_by_key.items():
            yield data, name, status_by_exit_code[code]


def again(jobs: int, pattern: str = "*", tests: Sequence[str] = ()) -> None:
    """Survivors once more, each in a process of its own; and what a busy machine may have stopped,
    since the limit is of processor seconds here.
    """
    prepare()
    from mutmut.__main__ import tests_for_mutant_names
    from mutmut.stats import load_stats
    from mutmut.utils.file_utils import copy_also_copy_files

    load_stats()
    copy_also_copy_files()
    alive = [(data, name) for data, name, verdict in verdicts()
             if verdict in ("survived", "no tests", "timeout", "not checked")
             and fnmatch(name, pattern)]

    def once(found: tuple[Any, str]) -> tuple[Any, str, int]:
        data, name = found
        return data, name, _in_a_process(
            name, tests or sorted(tests_for_mutant_names([name])) or named_after(name))

    with ThreadPoolExecutor(jobs) as pool:
        for data, name, code in pool.map(once, alive):
            print(f"{code:4d}  {name}", flush=True)
            data.load()
            data.exit_code_by_key[name] = 33 if code in (4, 5) else code
            data.save()


def named_after(name: str) -> list[str]:
    """The test file that is named after a mutant's module, or its room."""
    modules = name.partition(".x")[0].split(".")[:0:-1]
    files = [f"tests/test_{module}.py" for module in modules]
    return [f for f in files if (MUTANTS / f).exists()][:1]


def _in_a_process(name: str, tests: Sequence[str]) -> int:
    """The exit code of pytest; a test that fails without the mutant, too, kills nothing."""
    if not tests:
        return 5
    code, failed = _tested(name, tests)
    while code == 1 and failed and _tested("", failed[-1:])[0] != 0:
        code, more = _tested(name, tests, failed)
        failed = [*failed, *more]
    return code


def _tested(name: str, tests: Sequence[str], without: Sequence[str] = ()
            ) -> tuple[int, list[str]]:
    """pytest's exit code with a mutant, or without any, and the test that failed."""
    environment = os.environ | {
        "MUTANT_UNDER_TEST": name, "PYTHONPATH": f"{MUTANTS}{os.pathsep}{ROOT / 'benchmarks'}",
        "PY_IGNORE_IMPORTMISMATCH": "1", "MUTANTS_BUDGET": os.environ.get("MUTANTS_BUDGET", "25")}
    words = [sys.executable, "-m", "pytest", "--rootdir=.", "-x", "-q", "--tb=no", "-rfE",
             "-p", "mutants_session", "-p", "no:cacheprovider", *tests,
             *(f"--deselect={test}" for test in without)]
    done = subprocess.run(words, cwd=MUTANTS, env=environment, capture_output=True, text=True,
                          check=False)
    return done.returncode, re.findall(
        r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE)


def carry(other: str) -> None:
    """Verdicts of another checkout, for mutants that have none here."""
    prepare()

    def table() -> dict[tuple[str, str], tuple[Any, str, str]]:
        return {(place(name).rpartition(".")[2], change(data, name)): (data, name, verdict)
                for data, name, verdict in verdicts()}

    here = table()
    os.chdir(other)
    there = {key for key, (_, _, verdict) in table().items() if verdict in ("killed", "timeout")}
    os.chdir(ROOT)
    taken = [(data, name) for key, (data, name, verdict) in here.items()
             if verdict == "not checked" and key in there]
    for data, name in taken:
        data.load()
        data.exit_code_by_key[name] = 1
        data.save()
    CARRIED.write_text(json.dumps([name for _, name in taken]))
    print(f"{len(taken)} verdicts taken over")


def change(data: Any, name: str) -> str:
    """What a mutant alters: lines of before, an arrow, lines of after."""
    from mutmut.mutation.diff_apply import get_diff_for_mutant

    lines = get_diff_for_mutant(name, path=data.path).splitlines()[3:]
    before, after = ([line[1:].strip() for line in lines if line.startswith(sign)]
                     for sign in "-+")
    return f"{' '.join(before)} → {' '.join(after)}"


def place(name: str) -> str:
    """module.function or module.Class.method of a mutant."""
    module, _, function = name.partition("__mutmut_")[0].rpartition(".x")
    return f"{module}.{function[1:].replace('ǁ', '.')}"


def report(folder: str) -> None:
    """Write FOLDER/mutants.md from mutmut's verdicts and the reasons given for survivors."""
    prepare()
    from provenance import provenance

    from pikanid.pieces.sheet import Sheet

    reasons = tomllib.loads(REASONS.read_text(encoding="utf-8"))
    counts: dict[str, Counter[str]] = {}
    alive = []
    for data, name, verdict in verdicts():
        own = counts.setdefault(room(str(data.path)), Counter())
        own[verdict if verdict in GROUPS else "crashed"] += 1
        if verdict in ("survived", "no tests"):
            key = f"{place(name)}: {change(data, name)}"
            alive.append((place(name), f"`{change(data, name)}`", reasons.get(key, "open")))
    rows = [(name, *_row(counts[name])) for name in sorted(counts)]
    rows.append(("all", *_row(sum(counts.values(), Counter()))))
    sheet = Sheet(("room", *HEADERS), tuple(rows), HEADERS)
    left = Sheet(("where", "before → after", "why it lives"), tuple(sorted(alive)))
    (Path(folder) / "mutants.md").write_text(TEXT.format(
        tool=version("mutmut"), seed=SEED, provenance=provenance(), sheet=sheet.to_markdown(),
        shares=", ".join(f"{name} {share:.1%}" for name, share in SHARES.items()),
        carried=_carried(), left=left.to_markdown()), encoding="utf-8")


def _carried() -> str:
    """A sentence on verdicts that are of an earlier state; empty where all are of this one."""
    if not CARRIED.exists() or not (count := len(json.loads(CARRIED.read_text()))):
        return ""
    return (f" Of the killed, {count} were killed in an earlier state of their functions, by the "
            "same change; the others in this one.")


def _row(found: Counter[str]) -> tuple[str, ...]:
    tried = found.total() - found["not checked"]
    dead = tried - found["survived"] - found["no tests"]
    return (str(found.total()), *(str(found[g]) for g in GROUPS),
            f"{dead / tried:.1%}" if tried else "")


GROUPS = ("killed", "timeout", "crashed", "survived", "no tests", "not checked")
HEADERS = ("mutants", *GROUPS, "dead")
TEXT = """# Wrong lines that the tests see

Written by `benchmarks/mutants.py` (`make mutants`) with mutmut {tool}; {provenance}. Seed {seed}; \
share of each room's mutations that is tried: {shares}.

mutmut changes one thing in one function (an operator, a number, a condition, an argument, an \
assignment) and runs the quick tests that reach the function. A mutant is dead when a test fails \
(killed), never ends (timeout) or takes the interpreter down (crashed); the last column is the \
share of those tried.  Where mutants are "not checked" the run was ended before it came to them: \
`make mutants` goes on with them.  A survivor that is "open" has no reason yet, and no \
test.{carried}

{sheet}

Not mutated: functions with a decorator other than `staticmethod` and `classmethod` (properties, \
cached values, functions that numba compiles), the kernels' texts, statements outside functions, \
drawings, the `strict` flag of `zip` and the type in a `cast`. Left out of the tests: slow ones, \
docstrings' examples, and those about source text, installation, files, the command line and \
networks' training; those that take more than a second or two, too.

## Survivors

{left}
"""


if __name__ == "__main__":
    what, *words = sys.argv[1:]
    if what == "run":
        run(int(words[0]) if words else 2, words[1:])
    elif what == "again":
        again(int(words[0]) if words else 2, *words[1:2], tests=words[2:])
    elif what == "carry":
        carry(words[0])
    elif what == "report":
        report(words[0])
