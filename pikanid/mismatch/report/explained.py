"""Hypotheses as they are reported."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.same_law import Names
from pikanid.mismatch.report.findings import Explanation, NamedEffect
from pikanid.mismatch.report.part import values_of
from pikanid.model.parts import Parameter

EVEN = 0.5  # layout: difference of the criterion that is rounded to nothing
UNKNOWN = 10.0  # layout: times a value, or where it began, that the error of one not told exceeds


def explanations(answer: Answer, evidence: Evidence, overdispersion: float,
                 spread: Mapping[str, float], time: str
                 ) -> tuple[tuple[Explanation, ...], tuple[Explanation, ...]]:
    """Given and rejected hypotheses, for reports.

    Args:
        answer: That is reported.
        evidence: By which hypotheses are compared.
        overdispersion: That variances of parameters are multiplied by.
        spread: By name, whose square is added to those of what is given.
        time: Unit in which parameters are told.
    """
    pool = [*answer.given, *answer.others]
    if not pool:
        return (), ()

    asks = evidence.settings.verdict
    # where even these leave something, it is nearly sure that something else acts
    elsewhere = asks.unforeseen if any(
        evidence.adequate(evidence.test(h).p_value) for h in answer.given) else (
            1 - asks.unforeseen)
    scores = np.array([*map(evidence.total, (*answer.given, *answer.rivals))] or [0.0])
    weights = np.exp(-0.5 * (scores - scores.min()))
    weights *= (1 - elsewhere) / weights.sum()

    def one(h: Hypothesis, probability: float, why: str) -> Explanation:
        table = answer.twins.get(h.key, {})
        named = [table.get(e.key, Names(e.names, (e.name,))) for e in h.effects]
        effects = tuple(NamedEffect(
            names.ids, " or ".join(names.words), e.expression,
            values_of(_told(e, h), h.values, h.std, overdispersion,
                      spread if h in answer.given else {}, time), e.channel, e.site.v, e.absent)
            for e, names in zip(h.effects, named, strict=True))
        p = evidence.predict(h) if h in answer.given else None
        return Explanation(effects, probability, h.model.with_values(
            {n: v for n, v in h.values.items()}), evidence.score(h),
            evidence.test(h).p_value if h in answer.given else None,
            None if p is None else p.detection.p_value, why)

    given = tuple(one(h, float(w), "") for h, w in zip(answer.given, weights, strict=False))
    best = evidence.score(pool[0])
    others = tuple(one(h, 0.0, answer.reasons.get(h.key) or _behind(
        evidence.score(h) - best, bool(answer.given))) for h in answer.others)
    return given, others


def _told(e: Candidate, h: Hypothesis) -> tuple[Parameter, ...]:
    """The parameters of an effect, but what only says how a recording begins and is not known."""
    return tuple(p for p in e.parameters if p.name not in e.begins
                 or h.std[p.name] < UNKNOWN * max(abs(h.values[p.name]), abs(p.value)))


def _behind(gap: float, given: bool) -> str:
    """Why a hypothesis is not given whose criterion exceeds that of the first one given by `gap`,
    or of the first of all where none is `given`.

    >>> _behind(12.3, given=True)
    'chi-squared with the penalty for its parameters is higher by 12'
    >>> _behind(-0.2, given=True)
    'explains the recording no better than what is given'
    >>> _behind(-40.0, given=True)
    'explains the recording better, and nothing has confirmed it'
    >>> _behind(0.0, given=False)
    'nothing has confirmed it'
    """
    if not given and gap < EVEN:
        return "nothing has confirmed it"
    if gap < -EVEN:
        return "explains the recording better, and nothing has confirmed it"
    if gap < EVEN:
        return "explains the recording no better than what is given"
    return f"chi-squared with the penalty for its parameters is higher by {gap:.0f}"
