"""Where a mismatch is: channel, equation, states, seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import numpy as np

from pikanid.mismatch.beyond.force_shape import ForceShape
from pikanid.mismatch.beyond.latent_force import ForceOverTime
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.residual_tests import unit_columns
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.verdict import Answer
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.part import Value


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
    units, _ = unit_columns(found.D, base.minimum.J)
    z = -units.T @ base.minimum.r
    size = np.where(found.one_sided, z, np.abs(z))
    return found.candidates[found.owner[int(np.argmax(size))]].site if len(size) else sites[0]


def locate(base: Hypothesis, best: Hypothesis, answer: Answer, site: Site,
           shape: ForceShape | None, force: ForceOverTime | None) -> Where:
    """The place of a mismatch, as far as the answer and the nominal residual tell.

    In time it is where the force that would explain it is not zero, or, without a force that the
    recording resolves, where the residual is louder than noise.

    Without an answer the shape of the missing force says what it depends on, and whether a static
    law can be all that is missing.
    """
    channels: set[Channel] = {e.channel for h in answer.given for e in h.effects}
    ambiguous = any(len(ids) > 1 for table in answer.twins.values() for ids in table.values())
    channel: Channel | Literal["undecided"] = "undecided"
    if len(channels) == 1 and not ambiguous:
        channel = next(iter(channels))
    # what the new terms are made of
    states = tuple(n for n in site.model.state_names
                   if any(re.search(rf"\b{n}\b", e.expression) for e in best.effects)
                   ) if answer.given else ()
    static: bool | None = None
    if answer.given:
        static = all(e.static for e in best.effects)
    elif shape is not None:
        states, static = shape.depends_on(base.whitened.settings), shape.static_law
    spans: tuple[tuple[float, float], ...] = ()
    if force is not None and force.resolved:
        spans = force.windows
    elif answer.verdict != "none":
        spans = loud_windows(base)
    return Where(channel, site.v, states, spans, static)


def smallest(base: Hypothesis, candidates: Sequence[Candidate],
             overdispersion: float = 1.0) -> dict[str, Value]:
    """The size of each effect that would stand out by enough standard errors, by id: of noise and
    of what is left beside it, by which variances are multiplied.

    Only of effects that grow from nothing in proportion to one parameter.
    """
    found = directions(base.whitened, base.minimum.theta, [c for c in candidates if c.known])
    _, lengths = unit_columns(found.D, base.minimum.J)
    sizes: dict[str, Value] = {}
    visible = base.whitened.settings.visible * overdispersion**0.5
    for owner, sign, length in zip(found.owner, found.directions, lengths, strict=True):
        candidate = found.candidates[owner]
        if length > 0 and sign.scales and candidate.parameters and sign.start:
            name = next(iter(sign.start))
            unit = next(p.unit for p in candidate.parameters if p.name == name)
            size = visible / float(length) * abs(sign.start[name])
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
