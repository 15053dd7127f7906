"""Do verdicts survive when a setting is a quarter smaller or larger?

    python benchmarks/diagnosis_thresholds.py [--work build/diagnosis] [--cases 8] [--workers 2]

Every field of `pikanid.Settings` is varied unless `LEFT_OUT` says why not.  One at a time is
scaled, and recordings of the open sets are diagnosed again.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from remembering import Memory

import pikanid as pk
from pikanid.errors import PikanidError
from pikanid.mismatch import case
from pikanid.mismatch import diagnose as api
from pikanid.mismatch.beyond import formulas as symbols
from pikanid.mismatch.data import noise_level
from pikanid.mismatch.search import screen, search
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.mismatch.steps import reporting
from pikanid.storage.outputs import atomically
from pikanid.strategies.nls import NLS
from pikanid.validation.concealed.score import judge

FACTORS = (0.75, 1.25)
FEW = 3  # cases of each set that settings inside fits are tried on: nothing can be remembered
REMEMBERED = ((noise_level, "estimate"), (NLS, "fit"), (search, "fitted"), (search, "Screen"),
              (screen, "Screen"), (symbols, "name_curve"), (case, "residual_tests"),
              (case, "held_out"), (api, "force_shape"))
# settings that no function of these looks up, nor what it returned: a change of one of them
# changes no result of what is remembered
UNREAD = frozenset({
    "alpha", "power", "refusal", "refusal_together", "needless", "noise_excess", "noise_conflict",
    "search.promising", "search.kept", "search.much", "search.equal",
    *(name for name, _ in DEFAULTS.items() if name.startswith(("quiet.", "noise.", "verdict."))
      and name not in ("verdict.linear", "verdict.missed")),
    *(f"budget.{name}" for name in (
        "singles", "pairs", "beside_one", "beside_more", "leading", "effects", "carried",
        "carried_far", "effort", "setup", "rivals", "asked_again", "tested", "predicted"))})
# takes time and says nothing about the verdict
SKIPPED: tuple[tuple[Any, str, Any], ...] = (
    (reporting, "advice", ""), (reporting, "force_over_time", None), (api, "patch", None),
    (reporting, "smallest", {}), (reporting, "local_force", None))
LEFT_OUT: Mapping[str, tuple[str, ...]] = {
    "says where, how large or what next once the verdict stands": (
        "band", "beyond.own", "beyond.line", "beyond.inside", "beyond.knots_a_period",
        "beyond.resolved", "beyond.rows_a_knot", "beyond.louder", "beyond.unexplained",
        "beyond.idle", "beyond.clean", "verdict.sensitive", "uncertainty.far",
        "uncertainty.far_from_zero", "uncertainty.condition", "budget.force_passes",
        "budget.force_knots", "budget.slow_knots", "budget.windows", "beyond.least_window"),
    "plans experiments, diagnoses none": (
        "confusion", "signs", "budget.planned_refits", "budget.planned_sizes", "budget.finalists",
        "budget.compared", "budget.profile", "budget.profile_rate", "reached", "budget.smaller"),
    "acts on longer recordings only": (
        "budget.samples", "budget.put_together", "budget.samples_a_period", "budget.fastest",
        "budget.rows_searched", "budget.rows_tested", "budget.carried_far"),
    "acts on much shorter recordings only": ("noise.least_spectrum", "noise.least_alone"),
    "acts on rounded recordings only": ("rounding.changes", "rounding.dwell"),
    "acts on repeated experiments only": (
        "noise_refusal", "noise.driven_alike", "noise.moved_alike", "noise.covered", "noise.flat",
        "noise.caution", "budget.modes"),
    "acts without a held-out recording only": ("noise.aside", "noise.least_aside"),
    "iterations or steps of a numerical method": (
        "budget.relevelled", "budget.rechecked", "budget.iterations", "budget.hurried",
        "budget.hop_iterations", "budget.several_starts", "budget.patience", "budget.noise_refit",
        "budget.hops", "budget.finer", "budget.relinearised", "budget.levels", "budget.held_out",
        "budget.beginnings", "formulas.searched", "formulas.starts", "formulas.iterations"),
    "acts where noise is not known from the recording": ("adequacy.samples", "adequacy.far"),
    "acts where nothing oscillates": ("detection.spans",),
    "number of threads": ("budget.threads",),
    "number of draws": ("budget.draws",),
}


@dataclass(frozen=True)
class Threshold:
    """A setting, by its name in `Settings.items`."""

    name: str
    value: Any

    @property
    def inside_fits(self) -> bool:
        """Whether it may change a fit or a test."""
        return self.name not in UNREAD

    def __str__(self) -> str:
        return self.name


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


def reason(threshold: Threshold) -> str:
    """Why a setting is not varied; empty where it is."""
    return next((why for why, names in LEFT_OUT.items() if threshold.name in names), "")


def all_settings() -> list[Threshold]:
    """Every field, whether it is varied or not."""
    return [Threshold(name, value) for name, value in DEFAULTS.items()]


def thresholds() -> list[Threshold]:
    """The settings that are varied."""
    return [t for t in all_settings() if not reason(t)]


def changed(threshold: Threshold, factor: float) -> Settings | None:
    """The defaults with one setting scaled; None where it can have no such value."""
    try:
        return DEFAULTS.with_values({threshold.name: scaled(threshold.value, factor)})
    except PikanidError:  # shares of 1, and probabilities, cannot all be larger
        return None


def diagnosed(train: pk.Recording, other: pk.Recording, settings: Settings, memory: Memory
              ) -> dict[str, Any]:
    """What a diagnosis answers, as far as it is judged."""
    with contextlib.ExitStack() as stack:
        for where, name in REMEMBERED:
            stack.enter_context(patch.object(where, name, memory.of(getattr(where, name))))
        for where, name, nothing in SKIPPED:
            stack.enter_context(patch.object(where, name, return_value=nothing))
        try:
            dx = pk.diagnose(pk.systems.sloshing(), train, other, settings=settings, workers=1)
        except PikanidError as failure:
            return {"verdict": f"failed: {failure}", "mismatch": False, "hypotheses": []}
    return {"verdict": dx.verdict, "mismatch": dx.mismatch, "hypotheses": [
        {"effects": [{"ids": list(e.ids)} for e in h.effects], "probability": h.probability}
        for h in dx.hypotheses]}


Answers = dict[str, dict[str, Any]]
BASE = "unchanged"


def answers(job: tuple[Path, str, Path, bool]) -> Answers:
    """Of one case, by threshold and factor; each is kept as a file."""
    recordings, case, kept, thoroughly = job
    kept.mkdir(parents=True, exist_ok=True)
    train, other = (pk.Recording.read(f"{recordings}/{case}_{part}.csv")
                    for part in ("train", "held_out"))
    memory = Memory(UNREAD)

    def answer(key: str, settings: Settings, remembered: Memory) -> dict[str, Any]:
        file = kept / f"{key}.json"
        if not file.exists():
            atomically(file, json.dumps(diagnosed(train, other, settings, remembered)).encode())
        kept_answer: dict[str, Any] = json.loads(file.read_text())
        return kept_answer

    found = {BASE: answer(BASE, DEFAULTS, memory)}
    for threshold in sorted(thresholds(), key=lambda t: t.inside_fits):
        for factor in FACTORS if thoroughly or not threshold.inside_fits else ():
            settings = changed(threshold, factor)
            if settings is not None:
                key = f"{threshold} x {factor}"
                found[key] = answer(key, settings,
                                    Memory() if threshold.inside_fits else memory.fork())
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
        """Whether verdict and hypotheses are those of the default settings."""
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
        f"\n## Settings a quarter smaller and larger, {len(found)} cases\n",
        f"The first cases of each set ({missing} of them with something missing), diagnosed again "
        "with one setting changed; whole numbers move by one at least. Settings that act "
        f"inside fits and tests are tried on {few} of them. A verdict survives if it and the ids "
        "of all its hypotheses stay the same; an outcome is what the score makes of it. Numerical "
        "tolerances, bounds and starting values, which are no settings, are not varied.\n",
        f"Verdicts that survive every change: {len(found) - len(moved)} of {len(found)}. "
        f"Outcomes that do: {sum(_same_outcomes(c) for c in found)} of {len(found)}.\n"]
    if rows:
        parts += ["| setting | value | changed verdicts | changed outcomes | became wrong |",
                  "| --- | --- | --- | --- | --- |", *rows, "", "Verdicts that do not survive: "
                  + "; ".join(f"{c} ({', '.join(by)})" for c, by in moved.items()) + ".\n"]
    parts += [f"No verdict of {own} depends on {', '.join(names)}.\n"
              for own, names in sorted(harmless.items(), reverse=True)]
    parts += ["Not varied:\n", *(f"- {why}: " + ", ".join(
        f"`{t}`" for t in all_settings() if reason(t) == why) + "." for why in LEFT_OUT)]
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
