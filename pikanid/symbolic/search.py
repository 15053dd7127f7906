"""Which form on which edge: chosen for the whole network, by BIC on its data.

Every edge brings its most probable forms.  Starting from the best of each, one edge at a time tries
its others, all constants refitted, until nothing improves; several starts differ in the outer
edges.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from pikanid.symbolic.composed import Composition, Groups, Place
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit, fit_form
from pikanid.symbolic.library import NOTHING, Form
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.refit import Refit, generic_jacobian, refit
from pikanid.symbolic.settings import USUAL, SymbolicSettings

SIMPLE = ("linear", "quadratic")
FAINT = 1e-2  # numerical: of the loudest: least weight of a value that the output hardly depends on


@dataclass(frozen=True, eq=False)
class Ranked:
    """A refit and its score with the prior of its forms."""

    fit: Refit
    score: float


def shortlist(edge: NamedEdge) -> list[FormFit]:
    """The best form of each of the best families, whatever they leave behind.

    The simplest forms and nothing at all are always among them: where layers or factors have shared
    a law in their own way, an edge alone does not show them.
    """
    best: dict[str, FormFit] = {}
    for c in sorted(edge.candidates, key=lambda c: c.score):
        best.setdefault(c.form.family, c.fit)
    empty = [best.pop(NOTHING.family)] if NOTHING.family in best else []
    simple = [best.pop(name) for name in SIMPLE if name in best]
    ranked = list(best.values())
    first = sorted([*ranked[:1], *simple], key=lambda f: f.rss)
    return [*first, *ranked[1:edge.settings.forms], *empty]


def search(groups: Groups, inputs: tuple[sp.Expr, ...], named: Mapping[Place, NamedEdge],
           offsets: Sequence[Array], x: Array, y: Array, priors: Mapping[str, float],
           exact: float, settings: SymbolicSettings = USUAL) -> list[Ranked]:
    """Compositions that were tried to the end, best first.

    Args:
        named: The edges that are there.
        offsets: Constants of every layer's subnodes beside the edges' own.
        priors: Prior probability of every form, by name.
        exact: Share of the spread of y below which nothing is told apart.
        settings: Budgets.
    """
    lists = {place: shortlist(edge) for place, edge in named.items()}
    step = max(1, len(x) // settings.glance)
    few, target = x[::step], y[::step]
    made: dict[tuple[str, ...], Ranked | None] = {}
    generic: dict[tuple[str, ...], Array] = {}

    def ranked(it: Composition, theta: Array, all_data: bool = False) -> Ranked | None:
        if _key(it) not in generic:
            generic[_key(it)] = generic_jacobian(it, few)
        shape = generic[_key(it)]
        fit = (refit(it, theta, x, y, shape, exact=exact, evaluations=settings.evaluations)
               if all_data else
               refit(it, theta, few, target, shape, exact=exact, evaluations=settings.quick))
        if fit is None or not np.isfinite(fit.score):
            return None
        prior = sum(np.log(priors[form.name]) for _, form, _ in it.edges)
        return Ranked(fit, fit.score - 2.0 * float(prior))

    def changed(best: Ranked | None, other: Composition, place: Place, fit: FormFit
                ) -> Ranked | None:
        """Another form in one place: from the constants of the others as they are, or as named."""
        fits = {p: _of(lists[p], other.forms[p]) for p in lists}
        fresh = ranked(other, _start(other, fits, offsets))
        if best is None or (place[0] < len(groups) - 1 and fresh and fresh.score < best.score):
            return fresh
        if best.fit.composition.forms[place] is NOTHING:
            own = np.concatenate([fit.amplitudes, fit.inside])
            theta = best.fit.composition.carried(best.fit.theta, other, place, own)
            return _best(fresh, ranked(other, theta))
        return _best(fresh, followed(best, other, place))

    def followed(best: Ranked, other: Composition, place: Place) -> Ranked | None:
        """From where the new form follows the old one best."""
        theta = follow(best.fit, other, place, few, settings)
        return None if theta is None else ranked(other, theta)

    for first in _starts(lists, len(groups), settings.outer):
        now = Composition(groups, {p: f.form for p, f in first.items()}, inputs)
        best = made[_key(now)] = made.get(_key(now)) or ranked(now, _start(now, first, offsets))
        improved = True
        while improved:
            improved = False
            for place in sorted(lists, reverse=True):
                for fit in lists[place]:
                    other = now.swapped(place, fit.form)
                    if _key(other) not in made:
                        made[_key(other)] = changed(best, other, place, fit)
                    trial = made[_key(other)]
                    if trial and (best is None or trial.score < best.score - 1e-6):
                        best, now, improved = trial, trial.fit.composition, True
    for best in sorted((r for r in made.values() if r is not None),
                       key=lambda r: r.score)[:settings.polished]:
        simpler: Ranked | None = best
        while simpler is not None:  # forms that have become others' limits give way to them
            best = made[_key(simpler.fit.composition)] = simpler
            simpler = None
            for place in sorted(best.fit.composition.forms, reverse=True):
                own = best.fit.composition.forms[place]
                for fit in lists[place]:
                    if fit.form.count >= own.count:
                        continue
                    other = best.fit.composition.swapped(place, fit.form)
                    simpler = _best(simpler, followed(best, other, place))
            if simpler is not None and simpler.score > best.score - 1e-6:
                simpler = None
    found = sorted((r for r in made.values() if r is not None), key=lambda r: r.score)
    full = [ranked(r.fit.composition, r.fit.theta, True) for r in found[:settings.polished]]
    return sorted((r for r in full if r is not None), key=lambda r: r.score)


def follow(old: Refit, other: Composition, place: Place, x: Array,
           settings: SymbolicSettings = USUAL) -> Array | None:
    """Constants of `other`, which has another form in one place, that keep the old values there.

    The new form follows the old one over the arguments that it gets, weighted by what the output
    makes of it; None where there is nothing to follow, or the form cannot.
    """
    layer, i, s = place
    form = other.forms[place]
    own = next((theta_at for p, _, theta_at in old.composition.edges if p == place), None)
    if own is None:
        return None
    made, theta = old.composition, old.theta
    u = made.stages(theta, x)[layer][0][:, i]
    k = len(made.forms[place].columns)
    values = theta[own][:k] @ np.array(made.forms[place].values(u, *theta[own][k:]))
    heard = np.abs(made.evaluate(theta, x)[1][:, made.offsets[layer] + s])
    heard = np.maximum(heard, FAINT * heard.max())
    if np.ptp(u) == 0.0 or not np.isfinite([u, values, heard]).all() or heard.max() == 0.0:
        return None
    fit = fit_form(form, Curve.of_points(u, values, 1.0 / heard), settings)
    if fit is None:
        return None
    result = made.carried(theta, other, place, np.concatenate([fit.amplitudes, fit.inside]))
    result[other.offsets[layer] + s] += fit.offset
    return result


def _key(made: Composition) -> tuple[str, ...]:
    return tuple(f"{place} {form.name}" for place, form, _ in made.edges)


def _best(*tried: Ranked | None) -> Ranked | None:
    return min((r for r in tried if r is not None), key=lambda r: r.score, default=None)


def _of(fits: list[FormFit], form: Form) -> FormFit:
    return next(f for f in fits if f.form is form)


def _starts(lists: Mapping[Place, list[FormFit]], layers: int, outer: int
            ) -> list[dict[Place, FormFit]]:
    """The best of every edge; where there are layers, with other forms in the last one too."""
    first = {place: fits[0] for place, fits in lists.items()}
    starts = [first]
    if layers > 1:
        for place in lists:
            if place[0] == layers - 1:
                starts += [{**first, place: f} for f in lists[place][1:outer]]
    return starts


def _start(made: Composition, fits: Mapping[Place, FormFit], offsets: Sequence[Array]) -> Array:
    """Constants of every edge as named on its own."""
    theta = np.zeros(made.count)
    for layer, first in enumerate(made.offsets):
        theta[first:first + made.subnodes(layer)] = offsets[layer]
    for (layer, i, s), _, at in made.edges:
        fit = fits[layer, i, s]
        theta[at] = np.concatenate([fit.amplitudes, fit.inside])
        theta[made.offsets[layer] + s] += fit.offset
    return theta
