"""Do verdicts survive when a setting is a quarter smaller or larger?

Every field of `pikanid.Settings` is varied unless `LEFT_OUT` says why not.  One at a time is
scaled, and recordings of the open sets are diagnosed again.
"""

from __future__ import annotations

import contextlib
import itertools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
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
from pikanid.validation.concealed.score import Share, judge

FACTORS = (0.75, 1.25)
BAD = ("wrong", "failed")
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
                found[key_of(threshold, factor)] = answer(
                    key_of(threshold, factor), settings,
                    Memory() if threshold.inside_fits else memory.fork())
    return found


def key_of(threshold: Threshold, factor: float) -> str:
    """Of an answer."""
    return f"{threshold} x {factor}"


def explained(answer: Mapping[str, Any]) -> tuple[str, frozenset[Any]]:
    """The verdict, and the ids of every hypothesis."""
    return answer["verdict"], frozenset(
        tuple(sorted(tuple(sorted(e["ids"])) for e in h["effects"]))
        for h in answer["hypotheses"])


@dataclass(frozen=True)
class Tried:
    """What became of one case.

    Attributes:
        name: Of its set, and its own.
        made: When, and by which versions.
        mismatch: Whether something is missing by the default settings.
        outcome: What the score makes of that answer.
        tried: Names of the settings that were changed.
        changed: Outcome where the verdict, or the ids of a hypothesis, became others, by key.
    """

    name: str
    made: str
    mismatch: bool
    outcome: str
    tried: tuple[str, ...]
    changed: Mapping[str, str]

    def was(self, threshold: Threshold, factor: float) -> str | None:
        """The outcome with a setting changed; None where that was not tried."""
        if threshold.name not in self.tried or changed(threshold, factor) is None:
            return None
        return self.changed.get(key_of(threshold, factor), self.outcome)


def compared(name: str, made: str, truth: Mapping[str, Any], found: Answers) -> Tried:
    """The answers of one case with that of the default settings."""
    def outcome(answer: Mapping[str, Any]) -> str:
        return ("failed" if answer["verdict"].startswith("failed")
                else judge(truth, answer).outcome)

    base = found[BASE]
    own = [t.name for t in thresholds() if any(key_of(t, f) in found for f in FACTORS)]
    return Tried(name, made, base["mismatch"], outcome(base), tuple(own), {
        key: outcome(answer) for key, answer in found.items()
        if explained(answer) != explained(base)})


def tried(cases: int, thorough: int, work: Path, workers: int, sets: Sequence[str] | None,
          made: str) -> dict[str, dict[str, Any]]:
    """The first cases of each set that lies in the work folder, `Tried` as dicts by name; of the
    first `thorough` ones of each set, settings that act inside fits and tests are changed as well.
    """
    jobs, truths = [], []
    for file in sorted(work.glob("*/truth.json")):
        name = file.parent.name
        if sets is None or name in sets:
            for k, case in enumerate(json.loads(file.read_text())["cases"][:cases]):
                truths.append((f"{name} {case['id']}", case))
                jobs.append((file.parent / "recordings", case["id"],
                             work / "thresholds" / name / case["id"], k < thorough))
    with ProcessPoolExecutor(workers) as pool:
        return {name: asdict(compared(name, made, truth, found)) for (name, truth), found in zip(
            truths, pool.map(answers, jobs), strict=True)}


def section(kept: Mapping[str, Mapping[str, Any]]) -> str:
    """The table: verdicts and outcomes that each threshold changes.

    Args:
        kept: What `tried` has found, in any number of runs.
    """
    found = [Tried(**{**one, "tried": tuple(one["tried"])}) for one in kept.values()]
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
    each = [(c, c.was(t, f), key_of(t, f) in c.changed)
            for c in found for t in thresholds() for f in FACTORS if c.was(t, f) is not None]
    missing = sum(c.mismatch for c in found)
    few = sum(any(t.inside_fits and t.name in c.tried for t in thresholds()) for c in found)
    parts = [
        f"\n## Settings a quarter smaller and larger, {len(found)} cases\n",
        f"The first cases of several sets ({missing} of them with something missing), diagnosed "
        "again with one setting changed; whole numbers move by one at least. Settings that act "
        f"inside fits and tests are tried on {few} of them. A verdict survives if it and the ids "
        "of all its hypotheses stay the same; an outcome is what the score makes of it. Numerical "
        "tolerances, bounds and starting values, which are no settings, are not varied.\n",
        f"Verdicts that survive: {Share(sum(not moves for *_, moves in each), len(each))}; "
        f"outcomes: {Share(sum(was == c.outcome for c, was, _ in each), len(each))}; became wrong: "
        f"{sum(was in BAD and c.outcome not in BAD for c, was, _ in each)}.\n",
        f"Cases whose verdict survives every change: {len(found) - len(moved)} of {len(found)}; "
        "whose outcome does: "
        f"{sum(set(c.changed.values()) <= {c.outcome} for c in found)} of {len(found)}.\n"]
    if rows:
        parts += ["| setting | value | changed verdicts | changed outcomes | became wrong |",
                  "| --- | --- | --- | --- | --- |", *rows, "", "Verdicts that do not survive: "
                  + "; ".join(f"{c} ({', '.join(by)})" for c, by in moved.items()) + ".\n"]
    parts += [f"No verdict of {own} depends on {', '.join(names)}.\n"
              for own, names in sorted(harmless.items(), reverse=True)]
    parts += ["Not varied:\n", *(f"- {why}: " + ", ".join(
        f"`{t}`" for t in all_settings() if reason(t) == why) + "." for why in LEFT_OUT)]
    parts += ["\nMade with:\n", *(f"- {made} ({', '.join(c.name for c in found if c.made == made)})"
                                  for made in sorted({c.made for c in found}))]
    return "\n".join(parts) + "\n"


def _row(threshold: Threshold, factor: float, found: Sequence[Tried]
         ) -> tuple[str, int, list[str]]:
    """A row of the table, how many cases were tried, and those whose verdict changes."""
    key = key_of(threshold, factor)
    own = [c for c in found if c.was(threshold, factor) is not None]
    touched = [c for c in own if key in c.changed]
    outcomes = [c for c in touched if c.changed[key] != c.outcome]
    wrong = [c.name for c in outcomes if c.changed[key] in BAD]
    return (f"| `{threshold}` | {_told(threshold.value)} → {_told(scaled(threshold.value, factor))}"
            f" | {len(touched)} of {len(own)} | {len(outcomes)} of {len(own)} | "
            f"{', '.join(wrong) or '-'} |", len(own), [c.name for c in touched])


def _told(value: Any) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(_told(v) for v in value) + ")"
    return f"{value:.4g}"
