"""Where nothing explains a recording at all: is it the wrong columns, or the wrong unit of time?

A wrong sign is in the catalogue; columns that were exchanged and times in milliseconds are not.
Each is tried by one fit of the nominal model, and told only where that leaves far less.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, islice

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate, Fit
from pikanid.mismatch.case import Case
from pikanid.mismatch.data.preparation import with_sigma
from pikanid.mismatch.design.response import decay_rate, natural_frequency
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS

POOR = 0.3  # numerical: share of what the outputs do, left by a fit that explains too little
TIMES = 16.0  # numerical: as much as another reading leaves, for a hint: a quarter of the RMSE
PAIRS = 6  # limit: of columns that are exchanged
FINE, LONG = 0.2, 0.5  # limit: periods or time constants between samples, and in a recording
COARSER = 2.0  # numerical: times as long between an input's samples, which makes a difference
THOUSAND = (("divided", 1e-3), ("multiplied", 1e3))  # definition: milliseconds, and their contrary


def mislabelled(case: Case) -> list[str]:
    """Sentences about recordings that the nominal model explains far better when read otherwise:
    with the columns of two outputs of one unit, or of two inputs, exchanged, or with times of
    another unit.

    Empty where the nominal model explains most of what is measured; a few fits elsewhere.
    """
    left = _left(case.before)
    if left < POOR:
        return []
    records = case.records.beginning(case.settings.budget.rows_searched)
    model = case.model.with_values(case.records.guess)
    given = with_sigma(records, case.model)
    found = []
    tried = [(_refitted(model, [_exchanged(r, a, b) for r in given]), a, b)
             for a, b in islice(_alike(model, given[0]), PAIRS)]
    other, a, b = min(tried, default=(float("inf"), "", ""))
    if other * TIMES < left and other < POOR:
        found.append(errors.columns_exchanged(a, b, left, other))
    for word, factor in THOUSAND:
        if _fits(model, given, factor) and not _fits(model, given, 1.0):
            other = _refitted(model, [_stretched(r, factor) for r in given])
            if other * TIMES < left and other < POOR:
                found.append(errors.times_in_another_unit(word, left, other))
    return found


def sampled_otherwise(case: Case) -> list[str]:
    """Sentences about inputs that the held-out recordings sample far more coarsely, or finely, than
    the recordings do: what an input does between samples is another motion.
    """
    later = case.later.recordings if case.later is not None else ()
    found = []
    for u in case.model.input_names:
        steps = [[r[u].interval for r in some if u in r] for some in (
            case.records.recordings, later)]
        if all(steps):
            one, other = map(max, steps)
            if not 1 / COARSER < other / one < COARSER:
                found.append(errors.sampled_otherwise(u, one, other))
    return found


def _left(fit: Estimate) -> float:
    """Share of what the outputs do that a fit leaves, each output in units of its noise: one that
    rests counts for nothing.
    """
    def weighted(f: Fit, values: np.ndarray) -> float:
        return float(np.sum((values / (1.0 if f.sigma is None else f.sigma)) ** 2))

    left = sum(weighted(f, f.residual) for f in fit.fits)
    return left / max(sum(weighted(f, f.measured - f.measured.mean()) for f in fit.fits), 1e-300)


def _refitted(model: Model, recordings: Sequence[Recording]) -> float:
    """What the model leaves of recordings when fitted to them; infinite where it cannot be."""
    try:
        return _left(NLS().fit(model, recordings))
    except errors.PikanidError:
        return float("inf")


def _alike(model: Model, recording: Recording) -> Iterator[tuple[str, str]]:
    """Outputs of one unit, and recorded inputs: what drives is often written without units."""
    inputs = (n for n in model.input_names if n in recording)
    yield from ((a.name, b.name) for a, b in combinations(model.outputs, 2) if a.unit == b.unit)
    yield from combinations(inputs, 2)


def _exchanged(recording: Recording, a: str, b: str) -> Recording:
    """The recording with the values of two channels exchanged, each as the other's name and unit
    say.
    """
    one, other = recording[a], recording[b]
    return recording.with_channels(replace(one, name=b, unit=other.unit),
                                   replace(other, name=a, unit=one.unit))


def _stretched(recording: Recording, factor: float) -> Recording:
    return recording.with_channels(*(
        replace(ch, time=ch.time * factor) for ch in recording.channels.values()))


def _fits(model: Model, recordings: Sequence[Recording], factor: float) -> bool:
    """Whether a model moves neither faster than the samples nor slower than the recording."""
    rate = natural_frequency(model) or decay_rate(model)
    times = recordings[0][model.output_names[0]].time
    if rate is None or len(times) < 2:
        return False
    step, whole = float(np.median(np.diff(times))), float(times[-1] - times[0])
    return rate * factor * step <= FINE and rate * factor * whole >= LONG
