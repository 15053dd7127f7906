"""From ranked hypotheses to an answer: which are given, and how sure one may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pikanid.mismatch.candidate import Candidate
from pikanid.mismatch.detect import Detection
from pikanid.mismatch.hypothesis import Hypothesis
from pikanid.mismatch.judge import HeldOut
from pikanid.mismatch.result import Verdict
from pikanid.mismatch.screen import EXPONENTS
from pikanid.mismatch.whitened import GROSS

WITHIN = 6.0  # difference of the criterion below which hypotheses are not told apart
BEHIND = 3.0  # times that, and a hypothesis can still be what predicts best
PROVEN = 4.0  # of the criterion: what each of several effects must gain on held-out recordings
GUARD = 4.0  # what a law outside the catalogue is handicapped by: it is the rarer explanation
SHARP = 0.12  # standard error below which an exponent can say that it is a whole number
WHOLE = 1.0  # standard errors from a whole number within which a sharp exponent is that
OPEN = 3.0  # standard errors from a whole number within which an exponent may be that
PART = 0.5  # of the nominal held-out RMSE, a quarter of its square, that a part may leave
NARROW = 0.03  # of the swing: a loop no wider is dry friction that gives a little before it slips
ALIKE = 1.1  # ratio of held-out RMSEs below which two hypotheses predict alike
WORTH = 0.05  # of the nominal held-out RMSE: what an effect must take away where a part remains
BETTER = 1.0  # of the criterion: a smaller gain may be the same law, written in another way
PREDICTED = 8  # hypotheses of which that is found out
# p-value below which a hypothesis leaves something unexplained: asked on both recordings, it
# refuses one right hypothesis in a hundred
ADEQUATE = 0.005
Test = Callable[[Hypothesis], Detection]
Predict = Callable[[Hypothesis], HeldOut | None]


@dataclass(frozen=True)
class Answer:
    """Verdict, hypotheses given (most probable first) and the closest ones not given.

    `twins` lists, for a hypothesis given, the effects that stand for each other in it.
    """

    verdict: Verdict
    given: tuple[Hypothesis, ...]
    others: tuple[Hypothesis, ...]
    twins: dict[frozenset[str], dict[str, tuple[str, ...]]] = field(default_factory=dict)
    reasons: dict[frozenset[str], str] = field(default_factory=dict)


def settle(ranked: Sequence[Hypothesis], scale: float, test: Test, predict: Predict,
           checked: bool, proves: bool,
           ahead: Callable[[Sequence[Hypothesis]], None] = lambda near: None) -> Answer:
    """Choose what is given.

    Args:
        ranked: All hypotheses, best first.
        scale: That divides χ².
        test, predict: Adequacy on the train and on the held-out recordings.
        checked: Whether there is anything held out.
        proves: Whether that is a recording of its own.
        ahead: Told of the hypotheses that will all be tested and predict, before they are.
    """
    reasons: dict[frozenset[str], str] = {}
    tried = [h for h in ranked if h.effects]
    base = next(h for h in ranked if not h.effects)
    if not tried or tried[0].score(scale) >= base.score(scale):
        return Answer("unnamed", (), tuple(tried[:3]))
    lowest = min(_handicapped(h, scale) for h in tried)
    near = [h for h in tried if h.score(scale) < lowest + WITHIN]
    near = _integer_laws(near)
    ahead(near)

    def total(h: Hypothesis) -> float:
        return criterion(h, predict(h), scale) if predict(h) or not checked else np.inf

    def passes(h: Hypothesis) -> bool:
        if test(h).p_value < ADEQUATE:
            reasons[h.key] = "leaves something unexplained in the recording"
        elif checked and ((prediction := predict(h)) is None
                         or prediction.detection.p_value < ADEQUATE):
            reasons[h.key] = "does not predict the held-out recording"
        return h.key not in reasons

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
    proves = proves and any(_proven(h, tried, predict, scale) for h in given)
    outside = [h for h in given if not h.known]
    known = [h for h in given if h.known]
    if not known:
        rest = tuple(h for h in near if h not in given) + tuple(given)
        most = _largest_part(base, tried, scale, predict) if not given else ()
        if most:
            merged, twins = _merged(list(most), tried)
            return Answer("unconfirmed", tuple(merged),
                          tuple(h for h in rest if h not in most)[:5], twins, reasons)
        return Answer("unnamed", (), rest[:5], {}, reasons)
    merged, twins = _merged(known, tried)
    # laws outside the catalogue that would do as well are for the reader to know
    least = min(map(total, known))
    merged += [h for h in outside if total(h) - _handicap(h) < least + WITHIN]
    verdict: Verdict = ("unconfirmed" if not proves else "named" if len(merged) == 1 else "set")
    others = [h for h in tried if h not in merged][:5]
    return Answer(verdict, tuple(merged), tuple(others), twins, reasons)


def _speaks(one: Hypothesis, other: Hypothesis, predict: Predict, least: float = 0.0) -> bool:
    """Whether the held-out recording speaks for one hypothesis rather than another, by `least`."""
    a, b = predict(one), predict(other)
    return a is not None and b is not None and a.evidence < b.evidence - least


def _proven(h: Hypothesis, tried: Sequence[Hypothesis], predict: Predict, scale: float) -> bool:
    """Whether the held-out recording speaks for each of several effects, too.

    One of several is easily found that takes up what the others leave, whatever that is.  Of an
    effect that would hardly show in the held-out recording no proof can be asked.
    """
    rest = {h.key - {e.key} for e in h.effects if not e.absent} if len(h.effects) > 1 else ()
    return all(_speaks(h, o, predict, PROVEN * scale) or _alike(h, o, predict, scale)
               for o in tried if o.key in rest)


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
    names away, and predicts what is held out; one of those that does better stands beside it.
    """
    if not any(h.symbolic for h in ranked):
        return answer
    found = settle(ranked, scale, test, predict, checked, proves)
    totals = {h.key: criterion(h, predict(h), scale) - _handicap(h) for h in found.given}
    least = min((totals[h.key] for h in found.given if h.symbolic), default=-np.inf)
    given = tuple(h for h in found.given if h.symbolic or totals[h.key] < least - BETTER)
    if not given or any(h.known and not h.symbolic for h in given):
        return answer
    return replace(found, given=given, verdict="named" if proves and len(given) == 1
                   else found.verdict)


def _integer_laws(near: list[Hypothesis]) -> list[Hypothesis]:
    """A power law whose exponent is sharply a whole number is left to the law of that name."""
    kept = [h for h in near if not any(
        (gap := _exponent_gap(h, whole)) is not None and gap < WHOLE and _sharp(h)
        for whole in (0, 1, 2))]
    return kept or near


def _exponent(h: Hypothesis) -> str | None:
    """Name of the exponent of a hypothesis' power law, if it has one."""
    return next((e.parameters[1].name for e in h.effects if e.ids[0] == "power_drag"), None)


def _exponent_gap(h: Hypothesis, whole: float) -> float | None:
    """Standard errors between that exponent and a whole number; one at its lower bound is zero."""
    n = _exponent(h)
    if n is None:
        return None
    if whole == 0 and h.values[n] <= h.model.parameter(n).bounds[0]:
        return 0.0
    return abs(h.values[n] - whole) / max(h.std[n], 1e-9)


def _sharp(h: Hypothesis) -> bool:
    n = _exponent(h)
    return n is not None and h.std[n] < SHARP


def _open_exponent(h: Hypothesis, whole: float) -> bool:
    """Whether the exponent of a hypothesis' power law may be `whole`, or something else as well."""
    gap = _exponent_gap(h, whole)
    return gap is not None and gap < OPEN and not (gap < WHOLE and _sharp(h))


def _power_law(h: Hypothesis, effect: Candidate, tried: Sequence[Hypothesis]) -> Hypothesis | None:
    """The hypothesis with a law of free exponent in the place of one of `h`'s effects."""
    rest = h.key - {effect.key}
    return next((o for o in tried for e in o.effects
                 if effect.key in e.covers and e.known and o.key == rest | {e.key}), None)


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


def _merged(known: list[Hypothesis], tried: Sequence[Hypothesis]
            ) -> tuple[list[Hypothesis], dict[frozenset[str], dict[str, tuple[str, ...]]]]:
    """Hypotheses that differ in twins only become one; what stands for what is noted.

    A law of whole exponent has the power law as a twin where the recording leaves the exponent
    open, and hysteresis dry friction where its loop is narrow (P. Dahl, AIAA J. 14, 1976).
    """
    def group(e: Candidate) -> str:
        return e.twin + e.site.suffix if e.twin else e.key

    first: dict[frozenset[str], Hypothesis] = {}
    twins: dict[frozenset[str], dict[str, tuple[str, ...]]] = {}
    absorbed = set()
    for h in known:
        signature = frozenset(group(e) for e in h.effects)
        leader = first.setdefault(signature, h)
        table = twins.setdefault(leader.key, {e.key: e.ids for e in leader.effects})
        for e in leader.effects:
            for o in h.effects:
                if group(o) == group(e):
                    table[e.key] = tuple(dict.fromkeys((*table[e.key], *o.ids)))
        for e in h.effects:
            power = _power_law(h, e, tried) if e.ids[0] in EXPONENTS else None
            if leader is h and power and _open_exponent(power, EXPONENTS[e.ids[0]]):
                table[e.key] += ("power_drag",)
                absorbed.add(power.key)
            if leader is h and e.ids[0] == "hysteresis" and e.channel == "dynamics" and (
                    h.values[e.parameters[1].name] < NARROW * e.site.swing):
                table[e.key] += ("coulomb_friction",)
    return [h for h in first.values() if h.key not in absorbed], twins
