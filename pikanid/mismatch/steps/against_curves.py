"""What is there still once free curves stand for laws that nobody has listed.

A family is not sure where a free curve in its place leaves little more, of a state or an input that
its members do not depend on: a magnet is no friction with a memory, and an amplifier that bends is
no mode.  Where only curves of the deflection do, or only those of inputs, one is there of the
family and a restoring force, or a curve of the input: a scale error is a spring beside the model's
own to the letter.  A constant force is not sure where a curve that is zero at zero leaves as much
without it as beside it: the mean of a curve is no force at rest.  Nor is any family of several
effects sure where one curve of a state leaves no more than all of them do, unless it holds that
family, which does most of it alone: they are facets of one law.

A name is not sure where a free curve beside it, of what it depends on, leaves far less: then its
form is another one; nor where another member of its family does as well once a curve of what
neither depends on stands beside either.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.beyond.free_curve import (
    PIECES,
    input_curve,
    state_curve,
    with_and_instead,
    with_free_curve,
    with_free_input,
    with_free_sensor,
)
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.parallel import side_by_side
from pikanid.mismatch.judge.explanations import Explanations
from pikanid.mismatch.judge.kinds import Kind, kinds_of, members
from pikanid.mismatch.judge.left_over import left_in_train, left_over
from pikanid.mismatch.judge.partial import Doubtful, Instead, Part, Present
from pikanid.mismatch.judge.rivals import rivals
from pikanid.mismatch.settings.verdict import PartSettings
from pikanid.model import Model

RIVALS = 2  # limit: other members of a family that are tried with a curve beside them


def against_curves(case: Case, explained: Explanations, part: Part,
                   noise: Sequence[dict[str, float]]) -> Part:
    """The part without families and names that free curves do as well without.

    Args:
        case: What is diagnosed.
        explained: Explanations, weighed.
        part: What is sure among them.
        noise: σ of each output by name, in the train and in the held-out recordings.
    """
    h, rule = _searched(case, part.hypothesis), case.settings.part
    before = None if h is None else case.predicted(h)
    if h is None or before is None:
        return part
    own_left = max(left_over(h, before, noise), rule.floor)
    present, doubtful = [], list(part.doubtful)
    whole = [*_curves_of_all(case, h, own_left, noise)]
    for p in part.present:
        own = members(p.kind, h, rule.dry)
        if curve := next((c for c in whole if not (_holds(c, p) and _is_most(
                case, h, p, own, own_left, noise))), None):
            doubtful.append(Doubtful(p.kind, p.effect, f"a free curve of {curve[1]} leaves no more "
                                     "by itself than all that was found together"))
            continue
        if own:
            rest = [e for e in h.effects if e not in own]
            found = _against(p, h, rule, _in_its_place(case, h, p, rest, own_left, noise))
            if isinstance(found, Doubtful):
                doubtful.append(found)
                continue
            p = found
            if p.names and not _has_its_form(case, explained, h, p, own_left, noise):
                p = replace(p, names=())
        present.append(p)
    return replace(part, present=tuple(present), doubtful=tuple(doubtful))


def _against(p: Present, h: Hypothesis, rule: PartSettings,
             curves: Sequence[tuple[Kind | None, float]]) -> Present | Doubtful:
    """A family, or that one of it and the family of curves is there, or why neither is sure.

    Args:
        p: The family.
        h: The explanation that holds it.
        rule: What is asked.
        curves: In its place: the family that each is of, if it is of one, and κ.
    """
    asked = max(rule.dominance_of(k.family) for k in p.kinds)
    near = {kind for kind, kappa in curves if smaller(kappa, asked)}
    least = min((kappa for kind, kappa in curves if kind not in near), default=np.inf)
    p = replace(p, dominance=min(p.dominance, least))
    if not near:
        return p
    kind = near.pop()
    held = {k for e in h.effects for k in kinds_of(e, h, rule.dry)}
    if kind is None or near or kind in held or p.instead:
        least = min(kappa for _, kappa in curves)
        return Doubtful(p.kind, p.effect, "a free curve of what it does not depend on leaves " + (
            f"{least:.2g} times as much in its place, sure from {asked:.2g} on" if least >= 1 else
            "less in its place"))
    return replace(p, names=(), instead=Instead(kind, p.effect))


def _curves_of_all(case: Case, h: Hypothesis, own_left: float, noise: Sequence[dict[str, float]]
                   ) -> Iterator[tuple[Site, str]]:
    """Equations and states of which a free curve, which does not hold every effect of an
    explanation of several, leaves no more than it does.
    """
    if len(h.effects) < 2:
        return
    for site in case.sites:
        for s in site.moving:
            if all(e.site.v == site.v and e.channel == "dynamics" and _may_be_of(e, s)
                   for e in h.effects):
                continue
            # of fewer pieces where what the train recordings did not visit cannot be run
            left = (_least(case, [with_free_curve(case.model, h, [], s, site, h.minimum.chi2, [n])],
                           noise, own_left) for n in PIECES)
            if not smaller(own_left, next(filter(np.isfinite, left), np.inf)):
                yield site, s


def _may_be_of(effect: Candidate, s: str) -> bool:
    """Whether a force is a function of a state, or constant."""
    return effect.argument == s or any(
        f == "constant force" or _argument(f, effect) == s for f in effect.families)


def _holds(curve: tuple[Site, str], p: Present) -> bool:
    """Whether a family's members are what a curve may be."""
    site, s = curve
    return p.effect.site.v == site.v and s in _arguments(p)


def _is_most(case: Case, h: Hypothesis, p: Present, own: Sequence[Candidate], own_left: float,
             noise: Sequence[dict[str, float]]) -> bool:
    """Whether a family's members alone leave no more than would be asked of another one."""
    asked = max(case.settings.part.dominance_of(k.family) for k in p.kinds) * own_left
    alone = fitted(case.model, own, h.whitened.records, [h.point], 1, Closest(h.minimum.chi2),
                   h.key)
    return not smaller(asked, _least(case, [alone], noise, asked))


def _searched(case: Case, h: Hypothesis) -> Hypothesis | None:
    """The same on as much of the recordings as can be searched in a minute."""
    short = case.records.beginning(case.settings.budget.rows_searched)
    return h if short is case.records else fitted(
        case.model, h.effects, short, [h.point], 1, Closest(h.minimum.chi2), h.key)


def _has_its_form(case: Case, explained: Explanations, h: Hypothesis, p: Present, own_left: float,
                  noise: Sequence[dict[str, float]]) -> bool:
    """Whether a named effect is what its family's member is, whatever stands beside it."""
    rule = case.settings.part
    if not smaller(rule.floor, own_left):
        return True  # nothing is left that a curve may stand for
    freed = _least(case, _with_its_form_free(case.model, h, p), noise, own_left / rule.form)
    if not smaller(own_left, rule.form * max(freed, rule.floor)):
        return False
    among = rivals(p.kind, p.effect, h, explained.weighed)[:RIVALS]
    others = [o for w in among if (o := _searched(case, w.hypothesis)) is not None]
    if not others:
        return True
    least = max(min(own_left, _least(case, _beside(case.model, h, p), noise, own_left)), rule.floor)
    return not smaller(_least(case, (found for o in others for found in _beside(case.model, o, p)),
                              noise, rule.within * least), rule.within * least)


def _beside(nominal: Model, h: Hypothesis, p: Present) -> Iterator[Hypothesis | None]:
    """An explanation and a free curve of a state; of the one that a family's members depend on it
    would be any of them.
    """
    site = p.effect.site
    return (with_free_curve(nominal, h, h.effects, s, site, h.minimum.chi2)
            for s in site.moving if s not in _arguments(p))


def _in_its_place(case: Case, h: Hypothesis, p: Present, rest: Sequence[Candidate], own_left: float,
                  noise: Sequence[dict[str, float]]) -> list[tuple[Kind | None, float]]:
    """Of free curves beside the `rest` of the effects, of what a family's members do not depend on:
    the family that each is of, of a rate it would be of two, and how many times as much is left.

    Other curves hold a constant force.  One that takes its place is zero where its argument is, and
    is compared with the same beside that force.
    """
    nominal, site, near = case.model, p.effect.site, h.minimum.chi2
    families = {k.family for k in p.kinds}
    states = [s for s in site.moving if s not in _arguments(p)]
    # a curve of a channel has a slope; of an input anywhere it has a mean, as a constant force has
    inputs = () if families & {"gain", "input curve"} else (
        nominal.input_names if "constant force" in families else site.inputs)

    def times_as_much(instead: Hypothesis | None, both: Hypothesis | None = None) -> float:
        left = own_left if both is None else max(
            min(own_left, _least(case, [both], noise, own_left)), case.settings.part.floor)
        return _least(case, [instead], noise, p.dominance * left) / left

    def compared(name: str) -> tuple[Kind | None, float]:
        kind = (Kind("input curve") if name in inputs else
                Kind("restoring force", site.v) if name == site.q else None)
        if "constant force" in families:
            curve = (input_curve(h, name, site, zero_at_zero=True) if name in inputs else
                     state_curve(h, name, site, zero_at_zero=True))
            both, instead = with_and_instead(nominal, h, rest, curve, near)
            return kind, times_as_much(instead, both)
        curve_of = with_free_input if name in inputs else with_free_curve
        return kind, times_as_much(curve_of(nominal, h, rest, name, site, near))

    return side_by_side([*states, *inputs], compared, case.search.workers)


def _with_its_form_free(nominal: Model, h: Hypothesis, p: Present) -> Iterator[Hypothesis | None]:
    """An explanation with a free curve beside a named effect, of what that one's law depends on."""
    site, near = p.effect.site, h.minimum.chi2
    if p.family == "input curve":
        yield from (with_free_input(nominal, h, h.effects, u, site, near) for u in site.inputs)
    elif p.family == "sensor curve":
        yield with_free_sensor(nominal, h, h.effects, site, near)
    else:
        yield from (with_free_curve(nominal, h, h.effects, argument, site, near)
                    for argument in _arguments(p))


def _arguments(p: Present) -> set[str]:
    """The states that the families' members depend on; none where it is none, or several."""
    effects = [p.effect] if p.instead is None else [p.effect, p.instead.effect]
    found = (_argument(k.family, e) for k, e in zip(p.kinds, effects, strict=True))
    return {argument for argument in found if argument}


def _argument(family: str, effect: Candidate) -> str:
    site = effect.site
    states = {"dry friction": site.v, "drag": site.v, "restoring force": site.q}
    return states.get(family, effect.argument)


def _least(case: Case, fits: Iterable[Hypothesis | None], noise: Sequence[dict[str, float]],
           enough: float) -> float:
    """What the best of some fits leaves in all recordings; of those that leave more than `enough`,
    which decides, in the train ones alone that is looked at.
    """
    return min((_left(case, found, noise, enough) for found in fits if found is not None),
               default=np.inf)


def _left(case: Case, found: Hypothesis, noise: Sequence[dict[str, float]], enough: float
          ) -> float:
    seen = left_in_train(found, noise)
    if smaller(enough, seen):
        return seen
    after = case.predicted(found)
    return np.inf if after is None else left_over(found, after, noise)
