"""A pytest plugin for runs on mutants: few tests, the likeliest first, and nothing shared.

mutmut names the mutant in MUTANT_UNDER_TEST and passes every test that reaches the function.  Here
they are put in order (the file named after the module first, then the fastest) and cut where their
time exceeds MUTANTS_BUDGET seconds, so that a survivor costs seconds, too.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

WORK = Path(os.environ["MUTANTS_WORK"])
BUDGET = float(os.environ.get("MUTANTS_BUDGET", "15"))
MEMORY = 6 << 30
SLOW = 1.5  # processor seconds: a test that takes longer is left out
# Tests about the source text, the installation or other programs; mutants are none of theirs.
LEFT_OUT = ("architecture", "readme", "concealed", "plots", "datasets", "interrupts", "public_api",
            "no_traces", "study", "test_cli.py", "cli_identify", "cli_mistakes", "cli_process",
            "compiled_cache", "diagnosis_memory", "kan_build", "kan_paper", "pinn",
            "pikan.py", "reading", "mlp", "excitation", "slosh_recording", "units",
            "contributing", "hostile", "unforeseen", "excerpt")
_durations: dict[str, float] = {}


def mutant() -> str:
    """The mutant's name; empty while mutmut collects or runs the tests of the code as it is."""
    name = os.environ.get("MUTANT_UNDER_TEST", "")
    return name if "__mutmut_" in name else ""


def pytest_configure(config: pytest.Config) -> None:
    """A cache of compiled models for each mutant: what one has spoilt is not found by the next."""
    template, own = WORK / "cache", WORK / "scratch" / str(os.getpid())
    if mutant():
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
        own.mkdir(parents=True, exist_ok=True)
        if template.is_dir() and not mutant().startswith("pikanid.simulation."):
            shutil.copytree(template, own, dirs_exist_ok=True)
    os.environ["PIKANID_CACHE"] = str(own if mutant() else template)
    known = Path("mutmut-stats.json")
    if known.exists():
        _durations.update(json.loads(known.read_text())["duration_by_test"])
    if mutant():  # before files are read: most are not needed
        config.args = _affordable(config.args)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the mutant's cache."""
    if mutant():
        shutil.rmtree(WORK / "scratch" / str(os.getpid()), ignore_errors=True)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Test files that see no mutant of the sample, or not those that are asked for."""
    name, only = collection_path.name, os.environ.get("MUTANTS_FILES")
    if not name.startswith("test_"):
        return None
    out = any(word in name for word in LEFT_OUT)
    return True if out or (only and not any(w in name for w in only.split(","))) else None


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Order, and cut at the budget; no test that the first run has left out."""
    without = set(_lines("left_out"))
    config.hook.pytest_deselected(items=[i for i in items if i.nodeid in without])
    items[:] = [i for i in items if i.nodeid not in without]
    if os.environ.get("MUTANT_UNDER_TEST", "") in ("stats", "list_all_tests", "fail"):
        return
    chosen = _affordable([i.nodeid for i in items])
    place = {nodeid: n for n, nodeid in enumerate(chosen)}
    config.hook.pytest_deselected(items=[i for i in items if i.nodeid not in place])
    items[:] = sorted((i for i in items if i.nodeid in place), key=lambda i: place[i.nodeid])


def _affordable(tests: list[str]) -> list[str]:
    """Tests of the file named after the module, then the fastest, up to the budget."""
    parts = mutant().partition(".x")[0].split(".")
    ranked = sorted(tests, key=lambda t: (
        Path(t.partition("::")[0]).stem.removeprefix("test_") not in parts, _time(t)))
    spent = 0.0
    for n, test in enumerate(ranked):
        spent += _time(test)
        if n > 0 and spent > BUDGET:
            return ranked[:n]
    return ranked


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A limit in processor seconds, not those of the clock: other programs run beside."""
    if mutant():
        _, hard = resource.getrlimit(resource.RLIMIT_CPU)
        wanted = int(time.process_time() + 10 * _time(item.nodeid) + 20)
        limit = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, hard))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """In the first run, of the code as it is: note what runs, and end and note what is slow."""
    if os.environ.get("MUTANT_UNDER_TEST") != "stats":
        return (yield)

    def too_long(*_: Any) -> None:
        _leave_out(item)
        pytest.skip(f"takes more than {SLOW:g} s")

    (WORK / "now").write_text(f"{item.nodeid}\n")
    before = signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, SLOW)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: Any) -> Iterator[None]:
    """A test that fails without any mutant, among copies of the files, says nothing of mutants."""
    report: Any = yield
    if report.failed and not mutant() and "MUTANTS_FIRST" in os.environ:
        _leave_out(item)
        report.outcome, report.longrepr = "skipped", (str(item.path), 0, "left out")
    return report


def _leave_out(item: pytest.Item) -> None:
    with (WORK / "left_out").open("a") as file:
        file.write(f"{item.nodeid}\n")


def _lines(name: str) -> list[str]:
    return (WORK / name).read_text().splitlines() if (WORK / name).exists() else []


def _time(test: str) -> float:
    return _durations.get(test, 0.1)
