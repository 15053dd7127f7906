"""Do verdicts survive when an internal threshold is a quarter smaller or larger?

    python benchmarks/diagnosis_thresholds.py [--work build/diagnosis] [--cases 8] [--workers 2]

Every number that a module of the diagnosis names counts as a threshold unless `LEFT_OUT` says why
it is none.  One at a time is scaled, and recordings of the open sets are diagnosed again.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import functools
import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

from remembering import Memory

import pikanid as pk
from pikanid.errors import PikanidError
from pikanid.mismatch import case
from pikanid.mismatch import diagnose as api
from pikanid.mismatch.beyond import formulas as symbols
from pikanid.mismatch.search import search
from pikanid.mismatch.steps import reporting
from pikanid.noise import level as noise
from pikanid.storage.outputs import atomically
from pikanid.strategies.nls import NLS
from pikanid.validation.concealed.score import judge

FACTORS = (0.75, 1.25)
FEW = 3  # cases of each set that thresholds inside fits are tried on: nothing can be remembered
FOLDER = Path(api.__file__).parent
PACKAGE = api.__package__
MODULES = {path.stem: path for path in sorted(FOLDER.rglob("*.py")) if path.stem != "__init__"}
# a threshold that is looked up nowhere else changes no result of what is remembered
OUTSIDE = {"case", "confirming", "doubt", "noise_level", "outliers", "preparation", "screen",
           "search", "searching", "formulas", "verdict"}
REMEMBERED = ((noise, "estimate"), (NLS, "fit"), (search, "fitted"), (search, "Screen"),
              (symbols, "name_curve"), (case, "residual_tests"), (case, "held_out"),
              (api, "force_shape"))
# takes time and says nothing about the verdict
SKIPPED: Mapping[Any, Mapping[str, Any]] = {
    api: {"patch": None}, reporting: {"advice": "", "force_over_time": None, "smallest": {}}}
AFTERWARDS = "says where, how large or what next once the verdict stands"
BEFOREHAND = "plans experiments, diagnoses none"
LONGER = "acts on longer recordings only"
REPEATED = "acts on repeated experiments only"
STEPS = "iterations or steps of a numerical method"
LEFT_OUT: Mapping[str, Mapping[str, str]] = {
    AFTERWARDS: {"advice": "*", "force_shape": "ADEQUATE OWN", "latent_force": "*", "locate": "*",
                 "patch": "*", "penalised": "*"},
    BEFOREHAND: {"confusable": "*", "next_experiment": "*", "profiles": "*",
                 "response": "*", "sizing": "*"},
    LONGER: {"case": "SEARCHED", "preparation": "LONG FINE MOST", "remainder": "MOST_ROWS"},
    REPEATED: {"repeats": "*"},
    STEPS: {"searching": "RELEVELLED", "confirming": "ASKED", "case": "AGAIN",
            "descent": "HOPS COARSE RENEWED",
            "progressive_horizon": "SHARES LIMIT HURRIED", "hypothesis": "LIMIT HURRIED",
            "prediction": "AGAIN", "least_squares": "PATIENCE", "tangent": "*",
            "whitened": "FINEST"},
    "number of threads": {"parallel": "*"},
    "far above rounding and far below what decides anything": {"decisions": "*"},
    "number of draws, points or knots": {
        "residual_tests": "DRAWS BATCH", "force_shape": "INTERVALS DEGREE GRID TYPICAL"},
    "where fits begin": {"beginning": "SHARE", "channels": "LAGS", "late_inputs": "SHIFTS"},
    "acts without a held-out recording only": {"preparation": "ASIDE LEAST"}}


@dataclass(frozen=True)
class Threshold:
    """A named number (or several) of one module, and the modules that look it up."""

    module: str
    name: str
    users: frozenset[str]

    @property
    def inside_fits(self) -> bool:
        """Whether it may change a fit or a test."""
        return not self.users <= OUTSIDE

    @property
    def value(self) -> Any:
        """As it stands."""
        return getattr(imported(self.module), self.name)

    def __str__(self) -> str:
        return f"{self.module}.{self.name}"


def imported(module: str) -> ModuleType:
    """The module of the diagnosis that has this name, whichever room it stands in."""
    return import_module(
        ".".join([PACKAGE, *MODULES[module].relative_to(FOLDER).with_suffix("").parts]))


def scaled(value: Any, factor: float) -> Any:
    """A number, or each of several, times a factor; whole ones move by one at least.

    >>> scaled(8, 0.75), scaled(2, 1.25), scaled((0.5, 1.0), 0.75)
    (6, 3, (0.375, 0.75))
    """
    if isinstance(value, tuple):
        return tuple(scaled(v, factor) for v in value)
    if isinstance(value, int):
        step = max(round(abs(value * (factor - 1))), 1)
        return value + step if factor > 1 else value - step
    return value * factor


@functools.cache
def named_numbers() -> tuple[Threshold, ...]:
    """All that the modules of the diagnosis name, whether thresholds or not."""
    trees = {module: ast.parse(path.read_text()) for module, path in MODULES.items()}
    users: dict[tuple[str, str], set[str]] = {}
    for module, tree in trees.items():
        for node in ast.walk(tree):
            dotted = node.module or "" if isinstance(node, ast.ImportFrom) else ""
            if isinstance(node, ast.ImportFrom) and dotted.startswith(PACKAGE):
                for alias in node.names:
                    users.setdefault((dotted.split(".")[-1], alias.name), set()).add(module)
    found = []
    for module, tree in trees.items():
        names = [n.id for node in tree.body if isinstance(node, ast.Assign)
                 for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
        for name in names:
            own = Threshold(module, name, frozenset(
                {module} | users.get((module, name), set())))
            if name.isupper() and name != "INF" and _numeric(own.value):
                found.append(own)
    return tuple(found)


def _numeric(value: Any) -> bool:
    parts = value if isinstance(value, tuple) else (value,)
    return all(type(v) in (int, float) for v in parts)


def reason(threshold: Threshold) -> str:
    """Why a named number is not varied; empty for a threshold."""
    return next((why for why, modules in LEFT_OUT.items()
                 if {"*", threshold.name} & set(modules.get(threshold.module, "").split())), "")


def thresholds() -> list[Threshold]:
    """The named numbers that are varied."""
    return [t for t in named_numbers() if not reason(t)]


@contextlib.contextmanager
def changed(threshold: Threshold, factor: float) -> Iterator[None]:
    """The package with one threshold scaled, wherever it is looked up."""
    value = scaled(threshold.value, factor)
    with contextlib.ExitStack() as stack:
        for user in threshold.users:
            stack.enter_context(patch.object(
                imported(user), threshold.name, value))
        yield


def diagnosed(train: pk.Recording, other: pk.Recording, memory: Memory) -> dict[str, Any]:
    """What a diagnosis answers, as far as it is judged."""
    with contextlib.ExitStack() as stack:
        for where, name in REMEMBERED:
            stack.enter_context(patch.object(where, name, memory.of(getattr(where, name))))
        for where, names in SKIPPED.items():
            for name, nothing in names.items():
                stack.enter_context(patch.object(where, name, return_value=nothing))
        try:
            dx = pk.diagnose(pk.systems.sloshing(), train, other, workers=1)
        except PikanidError as failure:
            return {"verdict": f"failed: {failure}", "mismatch": False, "hypotheses": []}
    return {"verdict": dx.verdict, "mismatch": dx.mismatch, "hypotheses": [
        {"effects": [{"ids": list(e.ids)} for e in h.effects], "probability": h.relative_weight}
        for h in dx.hypotheses]}


Answers = dict[str, dict[str, Any]]
BASE = "unchanged"


def answers(job: tuple[Path, str, Path, bool]) -> Answers:
    """Of one case, by threshold and factor; each is kept as a file."""
    recordings, case, kept, thoroughly = job
    kept.mkdir(parents=True, exist_ok=True)
    train, other = (pk.Recording.read(f"{recordings}/{case}_{part}.csv")
                    for part in ("train", "held_out"))
    memory = Memory()

    def answer(key: str, remembered: Memory) -> dict[str, Any]:
        file = kept / f"{key}.json"
        if not file.exists():
            atomically(file, json.dumps(diagnosed(train, other, remembered)).encode())
        kept_answer: dict[str, Any] = json.loads(file.read_text())
        return kept_answer

    found = {BASE: answer(BASE, memory)}
    for threshold in sorted(thresholds(), key=lambda t: t.inside_fits):
        for factor in FACTORS if thoroughly or not threshold.inside_fits else ():
            key = f"{threshold} x {factor}"
            with changed(threshold, factor):
                found[key] = answer(key, Memory() if threshold.inside_fits else memory.fork())
    return found


def explained(answer: Mapping[str, Any]) -> tuple[str, frozenset[Any]]:
    """The verdict, and the ids of every hypothesis."""
    return answer["verdict"], frozenset(
        tuple(sorted(tuple(sorted(e["ids"])) for e in h["effects"]))
        for h in answer["hypotheses"])


@dataclass(frozen=True)
class Tried:
    """One case: its name, entry of the truth file, and answers."""

    name: str
    truth: Mapping[str, Any]
    answers: Answers

    def outcome(self, key: str) -> str:
        """What the score makes of an answer."""
        answer = self.answers[key]
        return ("failed" if answer["verdict"].startswith("failed")
                else judge(self.truth, answer).outcome)

    def survives(self, key: str) -> bool:
        """Whether verdict and hypotheses are those of the unchanged thresholds."""
        return explained(self.answers[key]) == explained(self.answers[BASE])


def tried(cases: int, work: Path, workers: int, sets: Sequence[str] | None) -> list[Tried]:
    """The first cases of each set that lies in the work folder."""
    jobs, truths = [], []
    for file in sorted(work.glob("*/truth.json")):
        name = file.parent.name
        if sets is None or name in sets:
            for k, case in enumerate(json.loads(file.read_text())["cases"][:cases]):
                truths.append((f"{name} {case['id']}", case))
                jobs.append((file.parent / "recordings", case["id"],
                             work / "thresholds" / name / case["id"], k < FEW))
    with ProcessPoolExecutor(workers) as pool:
        return [Tried(name, truth, found) for (name, truth), found in zip(
            truths, pool.map(answers, jobs), strict=True)]


def section(cases: int, work: Path, workers: int, sets: Sequence[str] | None = None) -> str:
    """The table: verdicts and outcomes that each threshold changes."""
    found = tried(cases, work, workers, sets)
    rows: list[str] = []
    harmless: dict[int, list[str]] = {}
    moved: dict[str, dict[str, None]] = {}
    for threshold in thresholds():
        lines, counts, touched = zip(*(_row(threshold, f, found) for f in FACTORS), strict=True)
        for name in itertools.chain(*touched):
            moved.setdefault(name, {})[f"`{threshold}`"] = None
        if any(touched):
            rows += lines
        else:
            harmless.setdefault(counts[0], []).append(f"`{threshold}` ({_told(threshold.value)})")
    missing = sum(c.answers[BASE]["mismatch"] for c in found)
    few = min(FEW, cases) * len({c.name.split()[0] for c in found})
    parts = [
        f"\n## Thresholds a quarter smaller and larger, {len(found)} cases\n",
        f"The first cases of each set ({missing} of them with something missing), diagnosed again "
        "with one threshold changed; whole numbers move by one at least. Thresholds that act "
        f"inside fits and tests are tried on {few} of them. A verdict survives if it and the ids "
        "of all its hypotheses stay the same; an outcome is what the score makes of it. Numbers "
        "that the code gives no name, bounds and starting values among them, are not varied.\n",
        f"Verdicts that survive every change: {len(found) - len(moved)} of {len(found)}. "
        f"Outcomes that do: {sum(_same_outcomes(c) for c in found)} of {len(found)}.\n"]
    if rows:
        parts += ["| threshold | value | changed verdicts | changed outcomes | became wrong |",
                  "| --- | --- | --- | --- | --- |", *rows, "", "Verdicts that do not survive: "
                  + "; ".join(f"{c} ({', '.join(by)})" for c, by in moved.items()) + ".\n"]
    parts += [f"No verdict of {own} depends on {', '.join(names)}.\n"
              for own, names in sorted(harmless.items(), reverse=True)]
    parts += ["Not varied:\n", *(f"- {why}: " + ", ".join(
        f"`{t}`" for t in named_numbers() if reason(t) == why) + "." for why in LEFT_OUT)]
    return "\n".join(parts) + "\n"


def _row(threshold: Threshold, factor: float, found: Sequence[Tried]
         ) -> tuple[str, int, list[str]]:
    """A row of the table, how many cases were tried, and those whose verdict changes."""
    key = f"{threshold} x {factor}"
    own = [c for c in found if key in c.answers]
    touched = [c for c in own if not c.survives(key)]
    outcomes = [c for c in touched if c.outcome(key) != c.outcome(BASE)]
    wrong = [c.name for c in outcomes if c.outcome(key) in ("wrong", "failed")]
    return (f"| `{threshold}` | {_told(threshold.value)} → {_told(scaled(threshold.value, factor))}"
            f" | {len(touched)} of {len(own)} | {len(outcomes)} of {len(own)} | "
            f"{', '.join(wrong) or '-'} |", len(own), [c.name for c in touched])


def _same_outcomes(case: Tried) -> bool:
    return {case.outcome(key) for key in case.answers} == {case.outcome(BASE)}


def _told(value: Any) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(_told(v) for v in value) + ")"
    return f"{value:.4g}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("build/diagnosis"))
    parser.add_argument("--cases", type=int, default=8)
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args()
    print(section(chosen.cases, chosen.work, chosen.workers))
