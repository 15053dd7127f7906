"""From an answer to what is reported of it: what is surely there, what is left, what is near."""

from __future__ import annotations

import numpy as np
from scipy.signal import periodogram

from pikanid.mismatch.case import Case
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.partial import Doubtful, Part
from pikanid.mismatch.judge.partial import Present as Sure
from pikanid.mismatch.report.findings import Proof
from pikanid.mismatch.report.locate import loud_windows
from pikanid.mismatch.report.part import Closest, Present, Remainder, values_of


def present(answer: Answer, time: str) -> tuple[Present, ...]:
    """What is surely there, with standard errors that count the remainder, in a unit of time."""
    if answer.part is None:
        return ()
    h, counts = answer.part.hypothesis, answer.part.overdispersion
    found = []
    for p in answer.part.present:
        values, wider = (values_of(p.effect.parameters, h.values, h.std, by, spread, time)
                         for by, spread in ((1.0, {}), (counts, answer.part.spread)))
        found.append(Present(
            p.family, p.names, _name(p), p.effect.expression, p.alternatives, p.probability,
            p.probability_family, _finite(p.dominance), _finite(p.dominance_within), p.share,
            values, {n: v.std for n, v in wider.items()},
            p.instead.kind.family if p.instead else "", _places(p)))
    return tuple(found)


def _places(p: Sure) -> tuple[str, ...]:
    """Where one family acts of which the equation is not sure."""
    if p.instead is None or p.instead.kind.family != p.family:
        return ()
    return p.kind.place, p.instead.kind.place


def _name(p: Sure) -> str:
    """Of the effect, with those of twins where that is sure."""
    return " or ".join(dict.fromkeys((p.effect.name, *(t.name for t in p.twins if p.names))))


def remainder(case: Case, answer: Answer, proof: Proof | None) -> Remainder | None:
    """What a partial answer leaves."""
    if answer.part is None or proof is None:
        return None
    h, counts = answer.part.hypothesis, answer.part.overdispersion
    seen, worst = proof.curves[proof.worst], proof.of_worst
    before, after, rows = case.base.minimum.chi2, h.minimum.chi2, h.whitened.rows
    return Remainder(
        answer.part.share, 1 - max(after - rows, 0.0) / max(before - rows, 1e-12),
        proof.worst, worst.before, worst.after, worst.moved, worst.noise, worst.unit,
        proof.p_value, counts, rows * max(after / rows, 1.0) / counts,
        median_frequency(seen.t, seen.measured - seen.after), loud_windows(h),
        _doubts(answer.part))


def closest(answer: Answer) -> Closest | None:
    """What explains a part of what is missing, of which nothing is sure."""
    part = answer.closest
    if part is None or not part.hypothesis.effects or part.share <= 0:
        return None
    effects = part.hypothesis.effects
    return Closest(tuple(e.name for e in effects), tuple(e.ids for e in effects), part.share,
                   _doubts(part))


def _doubts(part: Part) -> tuple[tuple[str, str], ...]:
    return tuple((d.family, _where(d) + d.why) for d in part.doubtful)


def _where(doubtful: Doubtful) -> str:
    """In which of several coordinates a law of a state is not sure."""
    site = doubtful.effect.site
    return f"on {site.moving[0]}: " if site.suffix and doubtful.kind.place else ""


def median_frequency(t: np.ndarray, values: np.ndarray) -> float:
    """[Hz] below which half of the power of values (N,) at times t (N,) [s] lies.

    >>> t = np.arange(400) / 100
    >>> round(median_frequency(t, np.sin(2 * np.pi * 5 * t)), 1)
    5.0
    """
    even = np.linspace(t[0], t[-1], len(t))
    frequencies, power = periodogram(
        np.interp(even, t, values), (len(t) - 1) / (t[-1] - t[0]), detrend=False)
    total = np.cumsum(power)
    return float(frequencies[np.searchsorted(total, total[-1] / 2)])


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
