"""Do verdicts survive when a setting is a quarter smaller or larger?

Every field of `pikanid.Settings` is varied unless `LEFT_OUT` says why not.  One at a time is
scaled, and recordings of the open sets are diagnosed again, unless the other value would have
decided nothing otherwise (`watched`).
"""

from __future__ import annotations

import contextlib
import copy
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

from remembering import Memory
from watched import Watched, lifted

import pikanid as pk
from pikanid import settings as ranges
from pikanid.errors import PikanidError
from pikanid.mismatch import case
from pikanid.mismatch import diagnose as api
from pikanid.mismatch.beyond import formulas as symbols
from pikanid.mismatch.data import noise_level
from pikanid.mismatch.fitting import decisions
from pikanid.mismatch.search import screen, search
from pikanid.mismatch.settings import thresholds as rates
from pikanid.mismatch.settings import verdict
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.mismatch.steps import reporting, surely
from pikanid.objective import adequacy
from pikanid.storage.outputs import atomically
from pikanid.strategies import nls
from pikanid.strategies.nls import NLS

FACTORS = (0.75, 1.25)
REMEMBERED = ((noise_level, "estimate"), (NLS, "fit"), (search, "fitted"), (search, "Screen"),
              (screen, "Screen"), (symbols, "name_curve"), (case, "residual_tests"),
              (case, "held_out"), (api, "force_shape"))
# settings that no function of these looks up, nor what it returned: a change of one of them
# changes no result of what is remembered
UNREAD = frozenset({
    "alpha", "power", "refusal", "refusal_together", "needless", "noise_excess", "noise_conflict",
    "search.promising", "search.kept", "search.much", "search.equal",
    *(name for name, _ in DEFAULTS.items()
      if name.startswith(("quiet.", "noise.", "verdict.", "part."))
      and name not in ("verdict.linear", "verdict.missed")),
    *(f"budget.{name}" for name in (
        "singles", "nominal_again", "pairs", "beside_one", "beside_more", "leading", "effects",
        "carried", "carried_far", "effort", "setup", "rivals", "asked_again", "tested",
        "predicted"))})
# takes time and says nothing about the verdict
SKIPPED: tuple[tuple[Any, str, Any], ...] = (
    (reporting, "advice", ""), (reporting, "force_over_time", None), (api, "patch", None),
    (reporting, "smallest", {}), (reporting, "local_force", None), (surely, "sure_channels", ()),
    (nls, "changed", {}))
# functions of settings that return a number, or decide, and do nothing else
LIFTED = (*((rates, name) for name in ("quantile", "least_proof", "visible", "separated", "excess",
                                       "contradiction", "dominance", "odds_against")),
          (verdict, "dominance"), (verdict, "odds_against"), (adequacy, "_decides"),
          (decisions, "isfinite"))
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
        return _diagnosed(train, other, settings)


def _diagnosed(train: pk.Recording, other: pk.Recording, settings: Settings) -> dict[str, Any]:
    with contextlib.ExitStack() as stack:
        for where, name, nothing in SKIPPED:
            stack.enter_context(patch.object(where, name, return_value=nothing))
        try:
            dx = pk.diagnose(pk.systems.sloshing(), train, other, settings=settings, workers=1)
        except PikanidError as failure:
            return {"verdict": f"failed: {failure}", "mismatch": False, "hypotheses": []}
    return {"verdict": dx.verdict, "mismatch": dx.mismatch, "hypotheses": [
        {"effects": [{"ids": list(e.ids)} for e in h.effects], "probability": h.probability}
        for h in dx.hypotheses]}


def watched(noted: set[str]) -> Settings:
    """The defaults, whose changes are noted, by `key_of`, if they may lead to another answer."""
    settings = copy.copy(DEFAULTS)
    groups: dict[str, Any] = {"": settings}
    for threshold in thresholds():
        others = {key_of(threshold, f): scaled(threshold.value, f) for f in FACTORS
                  if changed(threshold, f) is not None}
        value: Any = Watched(threshold.value, others, noted)
        if isinstance(threshold.value, tuple):
            value = tuple(Watched(entry, {key: other[k] for key, other in others.items()}, noted)
                          for k, entry in enumerate(threshold.value))
        group, _, name = threshold.name.rpartition(".")
        if group not in groups:
            groups[group] = copy.copy(getattr(DEFAULTS, group))
            # past their checks, which want numbers
            object.__setattr__(settings, group, groups[group])
        object.__setattr__(groups[group], name, value)
    return settings


def decisive(train: pk.Recording, other: pk.Recording) -> tuple[dict[str, Any], set[str]]:
    """What a diagnosis answers, and the changes, by `key_of`, that may lead to another answer."""
    noted: set[str] = set()
    with contextlib.ExitStack() as stack:
        for where, name in LIFTED:
            stack.enter_context(patch.object(where, name, lifted(getattr(where, name))))
        # settings made of these are not checked either
        stack.enter_context(patch.object(ranges, "check", return_value=None))
        return _diagnosed(train, other, watched(noted)), noted


Answers = dict[str, dict[str, Any]]
BASE = "unchanged"


def answers(job: tuple[Path, str, Path]) -> Answers:
    """Of one case, by threshold and factor: those that may differ; each is kept as a file."""
    recordings, case, kept = job
    kept.mkdir(parents=True, exist_ok=True)
    train, other = (pk.Recording.read(f"{recordings}/{case}_{part}.csv")
                    for part in ("train", "held_out"))

    @cache
    def usual() -> Memory:
        memory = Memory(UNREAD)
        if diagnosed(train, other, DEFAULTS, memory) != base:
            raise RuntimeError(f"watched settings changed the diagnosis of {recordings}/{case}")
        return memory

    def kept_as(name: str, make: Callable[[], Any]) -> Any:
        file = kept / f"{name}.json"
        if not file.exists():
            atomically(file, json.dumps(make()).encode())
        return json.loads(file.read_text())

    def watch() -> tuple[dict[str, Any], list[str]]:
        answer, noted = decisive(train, other)
        return answer, sorted(noted)

    base, noted = kept_as("watched", watch)
    found = {BASE: base}
    for threshold in sorted(thresholds(), key=lambda t: t.inside_fits):
        for factor in FACTORS:
            settings, key = changed(threshold, factor), key_of(threshold, factor)
            if settings is not None and key in noted:
                found[key] = kept_as(key, partial(
                    diagnosed, train, other, settings,
                    Memory() if threshold.inside_fits else usual().fork()))
    return found


def key_of(threshold: Threshold, factor: float) -> str:
    """Of an answer."""
    return f"{threshold} x {factor}"
