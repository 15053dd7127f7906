"""Forms of effects, bound to a model in every way that its states, inputs and recordings allow."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.between import Motion, effects_between
from pikanid.mismatch.catalogue.feedthrough import feedthroughs
from pikanid.mismatch.catalogue.input_offset import input_offsets
from pikanid.mismatch.catalogue.output_curve import output_curves
from pikanid.mismatch.catalogue.output_drift import output_drifts
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import coordinates, span_of
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.model import Effect, EffectForm, Model
from pikanid.model.binding import Surroundings, bound
from pikanid.recording import Recording


def bound_to(effects: Iterable[Effect | EffectForm], sites: Sequence[Site],
             recordings: Sequence[Recording], motion: Callable[[], Motion]) -> list[Effect]:
    """The effects, with every form bound in each way in which that can be done and units fit.

    Args:
        effects: In the names of the sites' model, and forms for any model.
        sites: Of the model.
        recordings: With the model's inputs.
        motion: Of every state; asked where there are forms or pairs of coordinates.

    Raises:
        BadModel: A form that says something that no effect can.
    """
    effects = list(effects)
    forms = [e for e in effects if isinstance(e, EffectForm)]
    own = [e for e in effects if isinstance(e, Effect)]
    site, first = sites[0], recordings[0]
    motion = functools.cache(motion)
    names = {n for e in own for n in e.names}
    recorded = [*(i for i in site.model.input_names if i in first), *site.extra]
    sizes = {n: float(np.abs(first[n].values).max(initial=0.0)) for n in recorded}

    def ranges() -> dict[str, tuple[float, float]]:
        return {n: (float(x.min()), float(x.max())) for n, x in motion().items()} | {
            n: span_of(n, (first,)) for n in recorded}

    seen = {n: span_of(n, (first,)) for n in site.model.output_names if n in first}
    spans = {n: high - low for n, (low, high) in seen.items()}
    moving = {n: size for n, size in sizes.items() if np.ptp(first[n].values) > 0}
    derived = [e for e in (*effects_between(site.model, coordinates(site.model), motion, names),
                           *input_offsets(site.model, sizes, names, ranges),
                           *output_curves(site.model, motion, spans, names),
                           *feedthroughs(site.model, moving, spans, names),
                           *output_drifts(site.model, first.stop - first.start, names))
               if all(e.key != one.key for one in own)]
    if not forms and not derived:
        return own
    around = Surroundings(
        site.model, tuple(dict.fromkeys(s.v for s in sites)),
        {n: r for n, r in ranges().items() if n in site.model.state_names},
        seen, sizes, {n: first[n].unit for n in site.extra},
        sum(r.stop - r.start for r in recordings), site.interval,
        unseen=frozenset(site.model.state_names) - {
            o.expression.name for o in site.model.outputs if o.expression.is_Symbol})
    extended = {_extended(site.model, e) for e in own}
    for effect in derived:
        made = _extended(site.model, effect)
        if made is not None and made not in extended:
            own.append(effect)
            extended.add(made)
    for form in forms:
        around = replace(around, taken=frozenset(n for e in own for n in e.names))
        for effect in bound(form, around):
            made = _extended(site.model, effect)
            # of a parameter in two equations, the same may be said of each
            if made is not None and made not in extended:
                own.append(effect)
                extended.add(made)
    return own


def _extended(model: Model, effect: Effect) -> tuple[sp.Expr, ...] | None:
    """The formulas of a model with an effect, whatever that one's names; None where its units are
    not those of the model.
    """
    try:
        found = model.with_effect(effect)
    except errors.BadUnit:
        return None
    plain = {symbol(n): symbol(f"own_{k}") for k, n in enumerate(effect.names)}
    delays = (d for i in found.inputs for d in i.formulas.values())
    return tuple(sp.S(e).xreplace(plain) for e in (
        *found.equations.values(), *(s.initial for s in found.states), *delays,
        *(formula for o in found.outputs for formula in (o.expression, o.delay))))


def reserved(sites: Iterable[Site], effects: Iterable[Effect]) -> tuple[Site, ...]:
    """The sites, whose own candidates then keep off the names of these effects' parameters."""
    taken = frozenset(n for e in effects for n in e.names)
    return tuple(replace(site, taken=taken) for site in sites)


def with_unseen_speeds(sites: Iterable[Site], motion: Callable[[], Motion]) -> tuple[Site, ...]:
    """The sites, which know how large the states become that no output shows."""
    return tuple(site if site.shown else _unseen(site, motion()) for site in sites)


def _unseen(site: Site, motion: Motion) -> Site:
    there = replace(site, unseen_speed=float(np.abs(motion[site.v]).max(initial=0.0)))
    return replace(there, half_range=float(np.ptp(motion[site.q])) / 2) if site.q else there


def motion_along(model: Model, records: Records) -> Motion:
    """Along the recordings, at the model's guesses.

    Raises:
        SimulationFailed: The model cannot be simulated there.
    """
    whitened = Whitened(model, records)
    if not whitened.choose_steps(whitened.problem.guess):
        raise errors.SimulationFailed(errors.too_rough_to_diagnose(model.name))
    return whitened.motion(whitened.problem.guess)
