"""Where a mismatch is: channel, equation, states, seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np

from pikanid.mismatch.beyond.force_shape import ForceShape
from pikanid.mismatch.beyond.latent_force import ForceOverTime
from pikanid.mismatch.beyond.local_force import Local
from pikanid.mismatch.beyond.region import Course, course, regions_of_laws
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.residual_tests import unit_columns
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.channels import acts_in
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.own_time import SECOND, told_in
from pikanid.mismatch.report.part import Value, values_of
from pikanid.mismatch.settings.settings import Settings

SURE = ("named", "set", "partial")


def affected(base: Hypothesis, given: Sequence[Hypothesis], sites: Sequence[Site],
             candidates: Sequence[Candidate]) -> Site:
    """The coordinate in which something is missing: that of the effects given or, without any, of
    the entry whose sign takes most of the nominal residual away by itself.
    """
    if given:
        return given[0].effects[0].site
    if len(sites) == 1:
        return sites[0]
    found = directions(base.whitened, base.minimum.theta, candidates)
    units, _ = unit_columns(found.D, base.movable)
    z = -units.T @ base.minimum.r
    size = np.where(found.one_sided, z, np.abs(z))
    return found.candidates[found.owner[int(np.argmax(size))]].site if len(size) else sites[0]


def locate(base: Hypothesis, best: Hypothesis, answer: Answer, site: Site,
           shape: ForceShape | None, force: ForceOverTime | None,
           candidates: Sequence[Candidate] = (), local: Local | None = None) -> Where:
    """The place of a mismatch, as far as the answer and the nominal residual tell.

    Where all laws of a sure answer act in a part of the recording only, that is its place in time.
    Otherwise it is where the force that would explain it is not zero, or, without a force that the
    recording resolves, where the residual is louder than noise.

    Without an answer the shape of the missing force says what it depends on, and whether a static
    law can be all that is missing.  `local` is a force without a name that acts in a region, if
    there is one.
    """
    settings = base.whitened.settings
    # what the new terms are made of
    states = tuple(n for n in site.model.state_names
                   if any(re.search(rf"\b{n}\b", e.expression) for e in best.effects)
                   ) if answer.given else ()
    static: bool | None = None
    if answer.given:
        static = all(e.static for e in best.effects)
    elif shape is not None:
        states, static = shape.depends_on(settings), shape.static_law
    fit = best if answer.part is not None or not answer.given else _simplest(answer)
    courses = [course(fit, base.model, e) for e in _sure(answer)]
    region = local.intervals if local else regions_of_laws(courses, site, settings)
    channels = answer.channels if answer.part is None else ()
    channels = channels or _channels(answer, candidates) or _channel_of_shape(
        answer, site, shape, settings)
    windows = local.course.windows(_period(site)) if local else _seconds(
        base, answer, courses, force)
    values = values_of(base.model.parameters, local.hypothesis.values, local.hypothesis.std,
                       local.overdispersion) if local else {}
    return Where(channels, site.v, states, windows, static, region, values)


def _sure(answer: Answer) -> tuple[Candidate, ...]:
    """Effects whose law is sure: all that are given, or what is there beside a remainder."""
    if answer.part is not None:
        return tuple(p.effect for p in answer.part.present if p.names)
    if answer.verdict not in ("named", "set"):
        return ()
    return _simplest(answer).effects


def _simplest(answer: Answer) -> Hypothesis:
    """Of several that cannot be told apart: what more parameters add is not sure."""
    return min(answer.given, key=lambda h: len(h.minimum.theta))


def _seconds(base: Hypothesis, answer: Answer, courses: Sequence[Course | None],
             force: ForceOverTime | None) -> tuple[tuple[float, float], ...]:
    local = [one for one in courses if one is not None and not one.acts.all() and one.acts.any()]
    if answer.verdict in ("named", "set") and len(local) == len(courses) > 0:
        whole = replace(local[0], acts=np.any([one.acts for one in local], axis=0))
        if whole.acts.mean() <= 1 - base.whitened.settings.beyond.idle:
            return whole.windows(_period(answer.given[0].effects[0].site))
    if force is not None and force.resolved:
        return force.windows
    return loud_windows(base) if answer.verdict != "none" else ()


def _period(site: Site) -> float:
    return 2 * np.pi / site.rate if site.rate else 0.0


def _channels(answer: Answer, candidates: Sequence[Candidate]) -> tuple[Channel, ...]:
    """Channels in which something surely acts, whichever of the explanations holds.

    Of an answer that is not confirmed: the one that all effects of all its hypotheses share.
    """
    def of(e: Candidate, names: Sequence[str]) -> frozenset[Channel]:
        others = {c.channel for c in candidates for i in c.ids if i in names and i not in e.ids}
        return acts_in(e) if e.channel in others else acts_in(e) | others

    def of_families(*families: str) -> frozenset[Channel]:
        return frozenset(c.channel for c in candidates if {*families} & {*c.families})

    found: list[set[Channel]] = []
    if answer.part is not None:
        told = [of(p.effect, p.names) if p.names else of_families(
                    *(k.family for k in p.kinds))
                for p in answer.part.present]
        found = [{*answer.channels, *(next(iter(c)) for c in told if len(c) == 1)}]
    for h in () if answer.part is not None else answer.given:
        table = answer.twins.get(h.key, {})
        told = [of(e, table[e.key].ids if e.key in table else e.names) for e in h.effects]
        sure = answer.verdict in SURE or len(frozenset().union(*told)) == 1
        found.append({next(iter(c)) for c in told if len(c) == 1} if sure else set())
    shared = set.intersection(*found) if found else set()
    if answer.verdict not in SURE and any(own != shared for own in found):
        return ()
    return tuple(c for c in get_args(Channel) if c in shared)


def _channel_of_shape(answer: Answer, site: Site, shape: ForceShape | None, settings: Settings
                      ) -> tuple[Channel, ...]:
    """Of a force without a name that is all that is missing: of inputs alone it is an input's, of
    the rate alone the dynamics'; one of the coordinate can be a sensor's curve as well.
    """
    if answer.given or shape is None or not shape.static_law:
        return ()
    arguments = set(shape.depends_on(settings))
    if arguments and arguments <= set(site.inputs):
        return ("input",)
    return ("dynamics",) if arguments == {site.v} else ()


def smallest(base: Hypothesis, candidates: Sequence[Candidate],
             overdispersion: float = 1.0, time: str = SECOND) -> dict[str, Value]:
    """The size of each effect that would stand out by enough standard errors, by id: of noise and
    of what is left beside it, by which variances are multiplied.  `time` is the unit in place of
    seconds.

    Only of effects that grow from nothing in proportion to one parameter.
    """
    found = directions(base.whitened, base.minimum.theta, [c for c in candidates if c.known])
    _, lengths = unit_columns(found.D, base.movable)
    sizes: dict[str, Value] = {}
    visible = base.whitened.settings.visible * overdispersion**0.5
    for owner, sign, length in zip(found.owner, found.directions, lengths, strict=True):
        candidate = found.candidates[owner]
        if length > 0 and sign.scales and candidate.parameters and sign.start:
            name = next(iter(sign.start))
            times, unit = told_in(
                next(p.unit for p in candidate.parameters if p.name == name), time)
            size = times * visible / float(length) * abs(sign.start[name])
            for key in candidate.ids:
                if key not in sizes or size < sizes[key].value:
                    sizes[key] = Value(size, 0.0, unit)
    return sizes


def loud_windows(base: Hypothesis) -> tuple[tuple[float, float], ...]:
    """Seconds in which the whitened nominal residual of an output of the first recording is louder
    than noise can be.
    """
    outputs, settings = base.whitened.problem.experiments[0].samples, base.whitened.settings
    t = np.concatenate([s.t for s in outputs])
    owner = np.repeat(np.arange(len(outputs)), [len(s.t) for s in outputs])
    r = base.minimum.r[: len(t)]
    edges = np.linspace(t.min(), t.max(), settings.budget.windows + 1)
    loud = []
    for a, b in pairwise(edges):
        inside = (t >= a) & (t < b)
        counts = np.bincount(owner[inside], minlength=len(outputs))
        powers = np.bincount(owner[inside], r[inside] ** 2, len(outputs))
        loudest = counts + settings.beyond.louder * np.sqrt(2 * counts)
        if np.any((counts >= settings.beyond.least_window) & (powers > loudest)):
            loud.append((float(a), float(b)))
    joined: list[tuple[float, float]] = []
    for a, b in loud:
        if joined and abs(joined[-1][1] - a) < 1e-9:
            joined[-1] = (joined[-1][0], b)
        else:
            joined.append((a, b))
    return tuple((round(a, 3), round(b, 3)) for a, b in joined)
