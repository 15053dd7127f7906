"""A hypothesis is fitted: from where, how far, and in which reading of its effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.descent import (
    Start,
    basin_hopping,
    descended,
    per_row,
    place,
    renewed,
)
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.progressive_horizon import hits, lost, progressive_horizon
from pikanid.mismatch.settings.thresholds import price
from pikanid.model import Model


def fitted(nominal: Model, effects: Sequence[Candidate], records: Records,
           starts: Sequence[Start | Mapping[str, float]], choices: int,
           closest: Closest | None = None, settled: frozenset[str] = frozenset()
           ) -> Hypothesis | None:
    """Refit the nominal model with effects added.

    Args:
        nominal: Without effects.
        effects: To add.
        records: To fit.
        starts: From where; parameters not named begin at the model's values.
        choices: Number of effects to choose from.
        closest: χ² of the closest fit so far: one that stays far above is not carried through, and
            simulations need not be much more accurate than it is.
        settled: Keys of effects that need not be looked for beyond the hills about the start.

    Returns:
        The best local fit, or None where no start can be simulated or no model holds all effects.
    """
    model = _together(nominal, effects)
    if model is None:
        return None
    whitened = Whitened(model, records)
    rows = max(whitened.rows, 1)
    closest = closest or Closest()
    fits, budget = records.settings.fits, records.settings.budget
    limit = closest.ask(
        lambda chi2: budget.iterations if per_row(chi2, rows) < fits.gross else budget.hurried)

    def beyond(size: float) -> bool:
        return closest.ask(lambda chi2: size > fits.far * (chi2 + rows))

    best = descended(whitened, starts, closest, limit, beyond)
    hilly = [e for e in effects if (e.other_minima or e.absent) and e.key not in settled]
    failed_search = hits(hilly) and bool(starts) and (
        best is None or (lost(best.chi2, rows, records.settings) and (
            len(effects) == 1 or not beyond(best.chi2))))
    whole = progressive_horizon(
        whitened, hilly, place(whitened, starts[0])) if failed_search else None
    if whole is not None and (best is None or whole.chi2 < best.chi2):
        best = whole
    elif best is not None and not beyond(best.chi2):
        for effect in hilly:
            best = basin_hopping(whitened, best, effect, limit)
    if hilly:
        best = renewed(whitened, best, closest, limit, beyond)
    if best is None:
        return None
    free = sum(max(len(e.parameters), 1) for e in effects)
    penalty = price(free, len(effects), whitened.rows, choices, records.settings.choice_weight)
    found = Hypothesis(tuple(effects), model, whitened, best, penalty)
    for otherwise in (turned, read_otherwise):
        other = otherwise(found.effects)
        if other != found.effects and not beyond(found.minimum.chi2):
            found = _instead(found, other, nominal, closest, limit, beyond) or found
    return found


def _instead(found: Hypothesis, effects: tuple[Candidate, ...], nominal: Model, closest: Closest,
             limit: int, beyond: Callable[[float], bool]) -> Hypothesis | None:
    """The fit with the same effects put together in another way, where that is closer."""
    model = _together(nominal, effects)
    if model is None:
        return None
    whitened = Whitened(model, found.whitened.records)
    theta, least = place(whitened, found.point), whitened.settings.fits.other_order
    if not closest.choose_steps(whitened, theta, partial(per_row, rows=max(whitened.rows, 1))) or \
            abs(whitened.chi2(theta) - found.minimum.chi2) < least:
        return None
    best = descended(whitened, [found.point], closest, limit, beyond)
    if best is None or best.chi2 > found.minimum.chi2 - least:
        return None
    return Hypothesis(effects, model, whitened, best, found.penalty)


def _together(nominal: Model, effects: Sequence[Candidate]) -> Model | None:
    """The model with effects added in this order, if it can hold them so."""
    try:
        return extended(nominal, effects)
    except (errors.BadUnit, errors.BadModel):
        return None


def read_otherwise(effects: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """Several effects, those with another reading in that one."""
    return tuple(replace(e, extend=e.other, other=e.extend)
                 if e.other is not None and len(effects) > 1 else e for e in effects)


def turned(effects: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """What happens to inputs, and to outputs, in the opposite order: a sensor that bends and drifts
    may bend first.
    """
    last = {channel: [e for e in effects if e.channel == channel]
            for channel in ("input", "sensor")}
    return tuple(last[e.channel].pop() if e.channel in last else e for e in effects)
