"""From ranked hypotheses to an answer: which are given, and how sure one may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pikanid.mismatch.detect import Detection
from pikanid.mismatch.hypothesis import Hypothesis
from pikanid.mismatch.judge import HeldOut
from pikanid.mismatch.noise_level import UNKNOWN
from pikanid.mismatch.result import Verdict
from pikanid.mismatch.same_law import integer_laws, merged_twins
from pikanid.mismatch.whitened import GROSS

WITHIN = 6.0  # difference of the criterion below which hypotheses are not told apart
MANY = 12  # of them that are tested: no reader wants more
BEHIND = 3.0  # times that, and a hypothesis can still be what predicts best
PROVEN = 4.0  # of the criterion: what each of several effects must gain on held-out recordings
# of χ² in all recordings, that one effect must gain, and each of two, of three, of four: 4.5
# standard deviations in each of two recordings; several together can take up most of anything
STRONG = (40.0, 45.0, 90.0, 135.0)
AT_MOST = 1.64  # standard errors by which the noise may be larger than it seems
FOUND = 12.0  # of χ² that it must gain in the recording it was found in: the other one is the proof
GUARD = 4.0  # what a law outside the catalogue is handicapped by: it is the rarer explanation
PART = 0.5  # of the nominal held-out RMSE, a quarter of its square, that a part may leave
ALIKE = 1.1  # ratio of held-out RMSEs below which two hypotheses predict alike
WORTH = 0.05  # of the nominal held-out RMSE: what an effect must take away where a part remains
WORSE = 1.5  # times the nominal held-out RMSE: no proof, whatever errors of parameters forgive
OPEN = 2.0  # of the criterion: two explanations that differ by less are given side by side
SAME = 1.0  # of the criterion: what differs by less may be the same law, written in another way
PREDICTED = 8  # hypotheses of which that is found out
# p-values below which a hypothesis leaves something unexplained, in the recordings it was fitted to
# or in held-out ones, and in all together: one right hypothesis in a hundred is refused
ADEQUATE, TOGETHER = 0.005, 0.001
Test = Callable[[Hypothesis], Detection]
Predict = Callable[[Hypothesis], HeldOut | None]


@dataclass(frozen=True)
class Answer:
    """Verdict, hypotheses given (most probable first) and the closest ones not given.

    `twins` lists, for a hypothesis given, the effects that stand for each other in it; `reasons`
    why others are not given, and `doubt` what keeps the first one from being confirmed.
    """

    verdict: Verdict
    given: tuple[Hypothesis, ...]
    others: tuple[Hypothesis, ...]
    twins: dict[frozenset[str], dict[str, tuple[str, ...]]] = field(default_factory=dict)
    reasons: dict[frozenset[str], str] = field(default_factory=dict)
    doubt: str = ""


def settle(ranked: Sequence[Hypothesis], scale: float, test: Test, predict: Predict,
           checked: bool, proves: bool,
           ahead: Callable[[Sequence[Callable[[], object]]], None] = lambda jobs: None) -> Answer:
    """Choose what is given.

    Args:
        ranked: All hypotheses, best first.
        scale: That divides χ².
        test, predict: Adequacy on the train and on the held-out recordings.
        checked: Whether there is anything held out.
        proves: Whether that is a recording of its own.
        ahead: Given work that is all needed, before it is: to do it side by side.
    """
    reasons: dict[frozenset[str], str] = {}
    tried = [h for h in ranked if h.effects]
    base = next(h for h in ranked if not h.effects)
    if not tried or tried[0].score(scale) >= base.score(scale):
        return Answer("unnamed", (), tuple(tried[:3]))
    lowest = min(_handicapped(h, scale) for h in tried)
    near = [h for h in tried if h.score(scale) < lowest + WITHIN][:MANY]
    near = integer_laws(near)
    ahead([partial(ask, h) for h in near for ask in (predict, test)])

    def total(h: Hypothesis) -> float:
        return criterion(h, predict(h), scale) if predict(h) or not checked else np.inf

    def passes(h: Hypothesis) -> bool:
        if test(h).p_value < ADEQUATE:
            reasons[h.key] = "leaves something unexplained in the recording"
        elif checked and ((seen := predict(h)) is None or seen.detection.p_value < ADEQUATE):
            reasons[h.key] = "does not predict the held-out recording"
        return h.key not in reasons

    def explains_all(h: Hypothesis) -> bool:
        seen = predict(h)
        if checked and seen and (both := seen.together) and both.p_value < TOGETHER:
            reasons[h.key] = "leaves something unexplained in all recordings together"
        return h.key not in reasons

    if checked:
        ahead([partial(getattr, seen, "detection") for h in near
               if test(h).p_value >= ADEQUATE and (seen := predict(h))])
    given = [h for h in near if passes(h)]
    given = [h for h in given if not _needless(h, near, given, scale)]
    if checked:
        # what the recording speaks against a little may predict better
        best = min(map(total, near))
        behind = [h for h in tried if h not in near
                  and _handicapped(h, scale) < lowest + BEHIND * WITHIN][:PREDICTED]
        given += [h for h in behind if total(h) < best and passes(h)]
        for h in [h for h in given if any(
                o.key < h.key and total(o) < total(h) and _speaks(o, h, predict) for o in given)]:
            reasons[h.key] = "the held-out recording speaks against one of its effects"
            given.remove(h)
    if checked and len(given) > 1:
        given = _by_evidence(given, total, reasons)
    if checked:
        ahead([partial(getattr, seen, "together") for h in given if (seen := predict(h))])
    given = [h for h in given if explains_all(h)]
    outside = [h for h in given if not h.known]
    known = [h for h in given if h.known]
    if not known:
        rest = tuple(h for h in near if h not in given) + tuple(given)
        most = _largest_part(base, tried, scale, predict) if not given else ()
        if most:
            merged, twins = merged_twins(list(most), tried)
            return Answer("unconfirmed", tuple(merged),
                          tuple(h for h in rest if h not in most)[:5], twins, reasons)
        return Answer("unnamed", (), rest[:5], {}, reasons)
    merged, twins = merged_twins(known, tried)
    # laws outside the catalogue that would do as well are for the reader to know
    least = min(map(total, known))
    open_to, more = merged_twins(
        [h for h in outside if total(h) - _handicap(h) < least + WITHIN], tried)
    merged, twins = merged + open_to, {**twins, **more}
    doubt = _doubt(known[0], ranked, predict, scale) if proves else ""
    if doubt and not outside:
        # what it holds may be sure by itself, whatever may be there besides
        simplest = min((h for h in known if h.key <= known[0].key), key=lambda h: len(h.effects))
        doubt = _doubt(simplest, ranked, predict, scale) and doubt
    # beside one name, such a law may explain it by a factor e better: that is no evidence
    margin = OPEN if len(merged) == 2 else 0.0
    if proves and not known[0].symbolic and any(
            total(h) - _handicap(h) < least - margin for h in outside):
        doubt = "a law outside the catalogue explains it better"
    if proves and any(total(h) < least - WITHIN for h in near if h.key in reasons):
        doubt = doubt or "what explains it far better leaves something unexplained"
    verdict: Verdict = ("unconfirmed" if doubt or not proves
                        else "named" if len(merged) == 1 else "set")
    others = [h for h in tried if h not in merged][:5]
    return Answer(verdict, tuple(merged), tuple(others), twins, reasons, doubt)


def _speaks(one: Hypothesis, other: Hypothesis, predict: Predict, least: float = 0.0) -> bool:
    """Whether the held-out recording speaks for one hypothesis rather than another, by `least`."""
    a, b = predict(one), predict(other)
    return a is not None and b is not None and a.evidence < b.evidence - least


def _doubt(h: Hypothesis, ranked: Sequence[Hypothesis], predict: Predict, scale: float) -> str:
    """Why a hypothesis is not proved on other data; empty where it is.

    Each effect has to be strong.  What is weak can be a facet of anything: laws that no catalogue
    holds leave nothing beside it that a test would find.  And the held-out recording has to speak
    for each of several: one is easily found that takes up what the others leave, whatever that is.
    Of an effect that would hardly show in the held-out recording no proof can be asked.
    """
    fits = {o.key: o for o in ranked}
    nominal = predict(fits[frozenset()])
    proof = predict(h)
    if nominal and proof and proof.rmse > WORSE * nominal.rmse:
        return "as it stands it predicts the held-out recording far worse than the nominal model"
    louder = float(np.exp(AT_MOST * min(h.whitened.records.spread, UNKNOWN)))
    for e in h.effects:
        rest = h.key - {e.key}
        count = max(len(h.effects), len(e.covers) if h.symbolic else 1)
        asked = STRONG[count - 1] * louder
        # a formula that is the sum of two entries must need both
        for fewer in (rest, *(rest | {part} for part in e.covers if h.symbolic)):
            o = fits.get(fewer)
            if o is None:
                continue
            a, b = predict(h), predict(o)
            later = 0.0 if a is None or b is None else max(b.evidence - a.evidence, 0.0)
            first = (o.minimum.chi2 - h.minimum.chi2) / scale
            if first < FOUND:
                return f"the recording itself hardly shows {e.name}"
            gain = first + later / scale
            if gain < asked:
                return (f"{e.name} is too weak to be sure of (it lowers chi-squared by {gain:.0f}, "
                        f"{asked:.0f} are asked)")
            needed = _speaks(h, o, predict, PROVEN * scale) or _alike(h, o, predict, scale) or (
                a is not None and {p.name for p in e.parameters} <= a.inert)
            if len(h.effects) > 1 and not e.absent and not needed:
                return f"the held-out recording does not need {e.name}"
    return ""


def _alike(one: Hypothesis, other: Hypothesis, predict: Predict, scale: float) -> bool:
    """Whether what two hypotheses predict differs by less than a standard deviation in all."""
    a, b = predict(one), predict(other)
    return a is not None and b is not None and float(np.sum((a.rest - b.rest) ** 2)) < scale


def _largest_part(base: Hypothesis, tried: Sequence[Hypothesis], scale: float,
                  predict: Predict) -> tuple[Hypothesis, ...]:
    """The smallest known hypotheses that predict held-out data as well as any, and far better than
    nothing does, though not down to the noise: part of what is missing, given as unconfirmed.
    """
    # what happens once takes up much of any misfit, and no other recording can confirm it
    lasting = [h for h in tried if h.known and not any(e.absent for e in h.effects)]
    known = sorted(lasting, key=lambda h: h.score(scale))[:PREDICTED]
    closest = min(tried, key=lambda h: _handicapped(h, scale))
    nominal = predict(base)
    if not known or nominal is None or (
            not closest.known and scale < GROSS
            and known[0].score(scale) > _handicapped(closest, scale)):
        return ()
    found = {h.key: p.rmse for h in known if (p := predict(h)) is not None}
    lowest = min(found.values(), default=np.inf)
    if lowest > PART * nominal.rmse:
        return ()
    enough = max(ALIKE * lowest, lowest + WORTH * nominal.rmse)
    good = [h for h in known if found.get(h.key, np.inf) <= enough]
    fewest = min(len(h.effects) for h in good)
    return tuple(sorted((h for h in good if len(h.effects) == fewest),
                        key=lambda h: found[h.key])[:3])


def _handicap(h: Hypothesis) -> float:
    return GUARD * sum(not e.known for e in h.effects)


def _handicapped(h: Hypothesis, scale: float) -> float:
    return h.score(scale) + _handicap(h)


def criterion(h: Hypothesis, predicted: HeldOut | None, scale: float) -> float:
    """The criterion over the recording and the held-out one, where there is one."""
    return _handicapped(h, scale) + (0.0 if predicted is None else predicted.evidence / scale)


def _needless(h: Hypothesis, near: Sequence[Hypothesis], given: Sequence[Hypothesis],
              scale: float) -> bool:
    """Whether a hypothesis adds effects to a far better one, or laws outside the catalogue to a
    better one.

    One more effect of the catalogue that is nearly worth its penalty may be there: then it is for
    the reader to know.
    """
    if h.symbolic and any(o.symbolic and len(o.minimum.theta) < len(h.minimum.theta)
                          and o.score(scale) <= h.score(scale) for o in given):
        return True  # a longer formula for the same
    return any(o.key < h.key and _handicapped(o, scale) + (
        0.0 if o in given and not h.known else WITHIN) <= _handicapped(h, scale) for o in near)


def with_formulas(answer: Answer, ranked: Sequence[Hypothesis], scale: float, test: Test,
                  predict: Predict, checked: bool, proves: bool) -> Answer:
    """The answer where nothing in the catalogue would do, after formulas have been fitted as well.

    A formula is given where it explains about as much as the laws outside the catalogue that kept
    names away, and predicts what is held out; those that do about as well stand beside it.
    """
    if not any(h.symbolic for h in ranked):
        return answer
    found = settle(ranked, scale, test, predict, checked, proves)
    totals = {h.key: criterion(h, predict(h), scale) - _handicap(h) for h in found.given}
    least = min((totals[h.key] for h in found.given if h.symbolic), default=-np.inf)
    given = tuple(h for h in found.given if h.symbolic or abs(totals[h.key] - least) > SAME)
    if not given or any(h.known and not h.symbolic for h in given):
        return answer
    likely = [h for h in ranked if h.effects and not h.known and h not in given
              and h.score(scale) < given[0].score(scale) + BEHIND * WITHIN][:PREDICTED]
    apart = [criterion(h, predict(h), scale) - _handicap(h) - least for h in likely if predict(h)]
    if any(abs(d) > SAME and d < WITHIN for d in apart):
        doubt = "another law outside the catalogue explains it about as well"
        return replace(found, given=given, verdict="unconfirmed", doubt=found.doubt or doubt)
    return replace(found, given=given, verdict="named" if found.verdict == "set" and len(given) == 1
                   else found.verdict)


def _by_evidence(given: list[Hypothesis], total: Callable[[Hypothesis], float],
                 reasons: dict[frozenset[str], str]) -> list[Hypothesis]:
    """Without those that predict the held-out recording clearly worse than another does."""
    found = {h.key: total(h) for h in given}
    best = min(found.values())
    kept = [h for h in given if found[h.key] - _handicap(h) < best + WITHIN]
    for h in given:
        if h not in kept:
            reasons[h.key] = "predicts the held-out recording worse"
    return sorted(kept, key=lambda h: found[h.key])
