"""From ranked hypotheses to an answer: which are given, and how sure one may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from pikanid.mismatch.catalogue.candidate import Channel
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.decisions import below, in_order, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.doubt import Predict, gained, speaks, why_not
from pikanid.mismatch.judge.partial import Part
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.judge.same_law import Names, integer_laws, merged_twins, signature
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.settings.verdict import VerdictSettings

Test = Callable[[Hypothesis], Detection]
NO_ENTRY = "holds a law of no catalogue: others may do the same"

Verdict = Literal["none", "named", "set", "partial", "unconfirmed", "unnamed"]


@dataclass(frozen=True)
class Answer:
    """Verdict, hypotheses given (most probable first) and the closest ones not given.

    `twins` lists, for a hypothesis given, the effects that stand for each other in it; `reasons`
    why others are not given, and `doubt` what keeps the first one from being confirmed.  `rivals`
    are laws outside the catalogue that explain all as well, but are not likely enough to be given.
    `part` is what is surely there although something is left, `closest` what comes closest where
    nothing is, and `channels` are those in which something is, whatever it is.
    """

    verdict: Verdict
    given: tuple[Hypothesis, ...]
    others: tuple[Hypothesis, ...]
    twins: dict[frozenset[str], dict[str, Names]] = field(default_factory=dict)
    reasons: dict[frozenset[str], str] = field(default_factory=dict)
    doubt: str = ""
    rivals: tuple[Hypothesis, ...] = ()
    part: Part | None = None
    closest: Part | None = None
    channels: tuple[Channel, ...] = ()


def settle(ranked: Sequence[Hypothesis], scale: float, test: Test, predict: Predict, checked: bool,
           proves: bool, settings: Settings,
           ahead: Callable[[Sequence[Callable[[], object]]], None] = lambda jobs: None) -> Answer:
    """Choose what is given.

    Args:
        ranked: All hypotheses, best first.
        scale: That divides χ².
        test, predict: Adequacy on the train and on the held-out recordings.
        checked: Whether there is anything held out.
        proves: Whether that is a recording of its own.
        settings: What counts as evidence.
        ahead: Given work that is all needed, before it is: to do it side by side.
    """
    reasons: dict[frozenset[str], str] = {}
    spare: dict[frozenset[str], str] = {}
    asks, budget, adequate = settings.verdict, settings.budget, settings.adequate
    within = asks.indistinct
    tried = [h for h in ranked if h.effects]
    base = next(h for h in ranked if not h.effects)
    if not tried or not below(tried[0].score(scale), base.score(scale)):
        return Answer("unnamed", (), tuple(tried[:3]))
    lowest = min(_handicapped(h, scale, asks) for h in tried)
    close = [h for h in tried
             if below(h.score(scale) - h.assumed, lowest + within)][:budget.tested]
    near = integer_laws(close, asks)
    for h in (h for h in close if h not in near):
        spare[h.key] = "its exponent is a whole number: that law has a name of its own"
    ahead([partial(ask, h) for h in near for ask in (predict, test)])

    def total(h: Hypothesis) -> float:
        return criterion(h, predict(h), scale, asks) if predict(h) or not checked else np.inf

    def passes(h: Hypothesis) -> bool:
        if h.blurred:
            reasons[h.key] = "what it calls dry friction rises with all speeds of the motion"
        elif smaller(test(h).p_value, adequate):
            reasons[h.key] = "leaves something unexplained in the recording"
        elif checked and ((seen := predict(h)) is None
                          or smaller(seen.detection.p_value, adequate)):
            reasons[h.key] = "does not predict the held-out recording"
        return h.key not in reasons

    def explains_all(h: Hypothesis) -> bool:
        seen = predict(h)
        if checked and seen and (both := seen.together) and smaller(
                both.p_value, settings.refusal_together):
            reasons[h.key] = "leaves something unexplained in all recordings together"
        return h.key not in reasons

    if checked:
        ahead([partial(getattr, seen, "detection") for h in near
               if not smaller(test(h).p_value, adequate) and (seen := predict(h))])
    given = [h for h in near if passes(h)]
    needless = [h for h in given if _needless(h, near, given, scale, asks)]
    spare |= {h.key: "holds more than is needed" for h in needless}
    given, near = ([h for h in some if h not in needless] for some in (given, near))
    if checked:
        # what the recording speaks against a little may predict better
        best = min(map(total, near))
        behind = [h for h in tried if h not in near
                  and below(_handicapped(h, scale, asks), lowest + asks.behind * within)
                  ][:budget.predicted]
        given += [h for h in behind if below(total(h), best) and passes(h)]
        for h in [h for h in given if any(
                o.key < h.key and below(total(o), total(h)) and speaks(o, h, predict)
                for o in given)]:
            reasons[h.key] = "the held-out recording speaks against one of its effects"
            given.remove(h)
    adequate_known = [h for h in given if h.known]
    if checked and len(given) > 1:
        given = _by_evidence(given, total, reasons, asks)
    if checked:
        ahead([partial(getattr, seen, "together") for h in given if (seen := predict(h))])
    given = [h for h in given if explains_all(h)]
    outside = [h for h in given if not h.known]
    known = [h for h in given if h.known]
    if not known:
        reasons |= {h.key: NO_ENTRY for h in given}
        rest = tuple(given) + tuple(h for h in near if h not in given)
        most = _largest_part(base, tried, scale, predict, settings) if not given else ()
        if most:
            merged, twins = merged_twins(list(most), tried, asks)
            return Answer("unconfirmed", _most_probable_first(merged, predict, scale, asks),
                          tuple(h for h in rest if h not in most)[:5], twins, reasons)
        return Answer("unnamed", (), rest[:5], {}, reasons)
    doubt = why_not(known[0], ranked, predict, scale, settings) if proves else ""
    if doubt and not outside:
        # what it holds may be sure by itself, whatever may be there besides
        reach = total(known[0]) + asks.behind * within
        simplest = min((h for h in adequate_known if _within(h, known[0])
                        and (h is known[0] or below(total(h), reach))),
                       key=lambda h: len(h.effects))
        sure = not why_not(simplest, ranked, predict, scale, settings)
        if sure and all(h is not simplest for h in known):
            reasons.pop(simplest.key, None)  # that more predicts better is not sure
            sure = explains_all(simplest)
            known += [simplest] if sure else []
        doubt = "" if sure else doubt
    merged, twins = merged_twins(known, tried, asks)
    # laws outside the catalogue that would do as well are for the reader to know
    lowest = min(map(total, known))
    open_to, more = merged_twins([h for h in outside if below(total(h), lowest + within)],
                                 tried, asks)
    merged, twins = merged + open_to, {**twins, **more}
    if proves and not known[0].symbolic and any(below(total(h), lowest) for h in outside):
        doubt = "a law outside the catalogue is more probable"
    if proves and any(below(total(h), lowest - within) for h in near if h.key in reasons):
        doubt = doubt or "what explains it far better leaves something unexplained"
    # where one law outside the catalogue does what several effects do, another one may do it
    if proves and any(not h.known and len(h.effects) < len(known[0].effects) for h in near):
        doubt = doubt or "fewer laws, one of them in no catalogue, explain the recording as well"
    laws = [h for h in merged if not h.next_form]  # a name's next form is of one kind with it
    apart = sum(not any(o.key < h.key for o in laws) for h in laws)
    weak = below(gained(known[0], base, predict, scale), asks.minor_strong)
    if proves and (apart > asks.crowd) + any(not h.known for h in laws) + weak > 1:
        doubt = doubt or "where all of these would do, a law that nobody has listed may"
    verdict: Verdict = ("unconfirmed" if doubt or not proves
                        else "named" if len(merged) == 1 else "set")
    told = set(map(signature, merged))
    others = [h for h in tried if signature(h) not in told][:5]
    return Answer(verdict, _most_probable_first(merged, predict, scale, asks), tuple(others), twins,
                  {**spare, **reasons}, doubt,
                  tuple(h for h in outside if not any(h is o for o in merged)))


def _largest_part(base: Hypothesis, tried: Sequence[Hypothesis], scale: float,
                  predict: Predict, settings: Settings) -> tuple[Hypothesis, ...]:
    """The smallest known hypotheses that predict held-out data as well as any, and far better than
    nothing does, though not down to the noise: part of what is missing, given as unconfirmed.
    """
    asks = settings.verdict
    # what happens once takes up much of any misfit, and no other recording can confirm it
    lasting = [h for h in tried if h.known and not any(e.absent for e in h.effects)]
    count = settings.budget.predicted
    known = in_order(lasting, lambda h: h.score(scale), Hypothesis.place)[:count]
    closest = in_order(tried, lambda h: _handicapped(h, scale, asks), Hypothesis.place)[0]
    nominal = predict(base)
    if not known or nominal is None or (
            not closest.known and scale < settings.fits.gross
            and below(_handicapped(closest, scale, asks), known[0].score(scale))):
        return ()
    found = {h.key: p.misfit for h in known if (p := predict(h)) is not None}
    lowest = min(found.values(), default=np.inf)
    if smaller(asks.part * nominal.misfit, lowest):
        return ()
    enough = max(asks.alike * lowest, lowest + asks.worth * nominal.misfit)
    good = [h for h in known if not smaller(enough, found.get(h.key, np.inf))]
    fewest = min(len(h.effects) for h in good)
    return tuple(in_order((h for h in good if len(h.effects) == fewest), lambda h: found[h.key],
                          Hypothesis.place, band=0.0)[:3])


def _within(fewer: Hypothesis, more: Hypothesis) -> bool:
    """Whether a hypothesis holds all effects of another one, or laws that contain them."""
    return all(e.key in more.key or any(e.key in law.covers for law in more.effects)
               for e in fewer.effects)


def _handicap(h: Hypothesis, asks: VerdictSettings) -> float:
    return asks.decoy_handicap * sum(not e.known for e in h.effects)


def _handicapped(h: Hypothesis, scale: float, asks: VerdictSettings) -> float:
    return h.score(scale) + _handicap(h, asks)


def criterion(h: Hypothesis, predicted: HeldOut | None, scale: float, asks: VerdictSettings
              ) -> float:
    """The criterion over the recording and the held-out one, where there is one."""
    return _handicapped(h, scale, asks) + (0.0 if predicted is None else predicted.deviance / scale)


def _most_probable_first(given: Sequence[Hypothesis], predict: Predict, scale: float,
                         asks: VerdictSettings) -> tuple[Hypothesis, ...]:
    return tuple(in_order(given, lambda h: criterion(h, predict(h), scale, asks), Hypothesis.place))


def _needless(h: Hypothesis, near: Sequence[Hypothesis], given: Sequence[Hypothesis],
              scale: float, asks: VerdictSettings) -> bool:
    """Whether a hypothesis adds effects to a far better one, or laws outside the catalogue to a
    better one.

    One more effect of the catalogue that is nearly worth its penalty may be there: then it is for
    the reader to know.
    """
    if h.symbolic and any(o.symbolic and len(o.minimum.theta) < len(h.minimum.theta)
                          and not below(h.score(scale), o.score(scale)) for o in given):
        return True  # a longer formula for the same
    own = _handicapped(h, scale, asks)
    return any(o.key < h.key and not below(own, _handicapped(o, scale, asks) + (
        0.0 if o in given and not h.known else asks.needless)) for o in near)


def with_formulas(answer: Answer, ranked: Sequence[Hypothesis], scale: float, test: Test,
                  predict: Predict, checked: bool, proves: bool, settings: Settings) -> Answer:
    """The answer where nothing in the catalogue would do, after formulas have been fitted as well.

    A formula is given where it explains about as much as the laws outside the catalogue that kept
    names away, and predicts what is held out; those that do about as well stand beside it.
    """
    if not any(h.symbolic for h in ranked):
        return answer
    asks = settings.verdict
    found = settle(ranked, scale, test, predict, checked, proves, settings)
    totals = {h.key: criterion(h, predict(h), scale, asks) - _handicap(h, asks)
              for h in found.given}
    least = min((totals[h.key] for h in found.given if h.symbolic), default=-np.inf)
    given = tuple(h for h in found.given if h.symbolic
                  or below(asks.same_law, abs(totals[h.key] - least)))
    if not given or any(h.known and not h.symbolic for h in given):
        return answer
    best = next((h for h in given if h.symbolic), given[0]).score(scale)
    reach = best + asks.behind * asks.indistinct
    likely = [h for h in ranked if h.effects and not h.known and h not in given
              and below(h.score(scale), reach)][:settings.budget.predicted]
    apart = [criterion(h, predict(h), scale, asks) - _handicap(h, asks) - least
             for h in likely if predict(h)]
    if any(below(asks.same_law, abs(d)) and below(d, asks.indistinct) for d in apart):
        doubt = "another law outside the catalogue explains it about as well"
        return replace(found, given=given, verdict="unconfirmed", doubt=found.doubt or doubt)
    if len(given) > 1:
        # forms that nobody has tried would do as well
        doubt = "these recordings do not tell which form it has"
        return replace(found, given=given, verdict="unconfirmed", doubt=found.doubt or doubt)
    return replace(found, given=given,
                   verdict="named" if found.verdict == "set" else found.verdict)


def _by_evidence(given: list[Hypothesis], total: Callable[[Hypothesis], float],
                 reasons: dict[frozenset[str], str], asks: VerdictSettings) -> list[Hypothesis]:
    """Without those that predict the held-out recording clearly worse than another does."""
    found = {h.key: total(h) for h in given}
    best = min(found.values())
    # what says how recordings begin costs in the one and in the other
    kept = [h for h in given if below(found[h.key] - _handicap(h, asks) - h.assumed - h.begun,
                                      best + asks.indistinct)]
    for h in given:
        if h not in kept:
            reasons[h.key] = "predicts the held-out recording worse"
    return in_order(kept, lambda h: found[h.key], Hypothesis.place)
