"""A fitted formula without the constants that the data do not ask for.

Offsets and shifts go to zero one by one where that lowers BIC.  Then what is left of freedom is
scale: a hidden node may be stretched if the edges that leave it shrink, and factors of a product
may trade a constant.  One constant of each such pair becomes one.
"""

from __future__ import annotations

import numpy as np

from pikanid.symbolic.composed import Composition
from pikanid.symbolic.curve import EXACT
from pikanid.symbolic.library import Form
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.refit import Refit, generic_jacobian, refit
from pikanid.symbolic.settings import USUAL

ROWS = 200  # numerical: that tell which constants trade
SLACK = 1e-2  # numerical: of BIC: a constant that another can replace costs nothing


def tidied(fit: Refit, x: Array, y: Array, exact: float = EXACT,
           evaluations: int = USUAL.evaluations) -> Refit:
    """The same formula with fewer constants, refitted."""
    best, made = fit, fit.composition
    for k in _zeroes(made):
        theta = best.theta.copy()
        theta[k] = 0.0
        best = _tried(best, theta, k, x, y, best.score + SLACK, exact,
                      evaluations)
    for layer in range(len(made.groups)):
        for j, group in enumerate(made.groups[layer]):
            for s in group if len(group) > 1 or layer < len(made.groups) - 1 else ():
                best = _unit_scale(best, layer, j, s, x, y, exact, evaluations)
    return best


def _zeroes(made: Composition) -> list[int]:
    """Constants that may well be zero: offsets of inner layers first, the last offset last."""
    offsets = [first + s for layer, first in enumerate(made.offsets)
               for s in range(made.subnodes(layer))]
    shifts = [at.start + len(form.columns) + k for _, form, at in made.edges
              for k, knob in enumerate(form.knobs) if knob.kind in ("location", "below", "above")]
    return [*offsets[:-1], *shifts, offsets[-1]]


def _tried(best: Refit, theta: Array, k: int, x: Array, y: Array, bar: float,
           exact: float, evaluations: int) -> Refit:
    """With constant k held at θ_k, if the score stays below the bar."""
    if best.held[k]:
        return best
    held = best.held.copy()
    held[k] = True
    generic = generic_jacobian(best.composition, x[:: max(1, len(x) // ROWS)], theta, held)
    other = refit(best.composition, theta, x, y, generic, held, exact,
                  evaluations)
    return other if other is not None and other.score <= bar else best


def _unit_scale(best: Refit, layer: int, j: int, s: int, x: Array, y: Array,
                exact: float, evaluations: int) -> Refit:
    """A subnode scaled such that a rate behind it, or its first amplitude, is one."""
    if best.rank >= int(np.sum(~best.held)):
        return best
    made = best.composition
    into = [(f, at) for (depth, _, target), f, at in made.edges if depth == layer and target == s]
    out = [(p, f, at) for p, f, at in made.edges if p[0] == layer + 1 and p[1] == j]
    if not into:
        return best
    for _, form, at in out:
        for k, knob in enumerate(form.knobs):
            place = at.start + len(form.columns) + k
            if knob.power == -1 and best.theta[place] != 0.0:
                theta = _stretched(best, layer, j, s, float(best.theta[place]))
                theta[place] = 1.0  # not the last digit of a product
                return _tried(best, theta, place, x, y, best.score + SLACK, exact,
                              evaluations)
    place = into[0][1].start
    if best.theta[place] == 0.0:
        return best
    theta = _stretched(best, layer, j, s, 1.0 / float(best.theta[place]))
    theta[place] = 1.0
    return _tried(best, theta, place, x, y, best.score + SLACK, exact,
                  evaluations)


def _stretched(best: Refit, layer: int, j: int, s: int, by: float) -> Array:
    """θ with subnode s multiplied by a number, and what follows it adapted."""
    made, theta = best.composition, best.theta.copy()
    for (depth, _, target), form, at in made.edges:
        if depth == layer and target == s:
            theta[at.start:at.start + len(form.columns)] *= by
    theta[made.offsets[layer] + s] *= by
    for (depth, source, _), form, at in made.edges:
        if depth == layer + 1 and source == j:
            theta[at] = _followed(form, theta[at], by)
    return theta


def _followed(form: Form, own: Array, by: float) -> Array:
    """Parameters of a form that give the same values when its argument is `by` times as large."""
    k = len(form.columns)
    a, p = own[:k].copy(), own[k:].copy()
    exponents = [p[j] for j, knob in enumerate(form.knobs) if knob.kind == "exponent"]
    for j, power in enumerate(form.powers):
        whole = power if power is not None else (exponents[0] if exponents else 0.5)
        a[j] *= float(np.abs(by)) ** -whole * (np.sign(by) if by < 0 and whole % 2 == 1 else 1.0)
    for j, knob in enumerate(form.knobs):
        p[j] *= 1.0 if knob.power is None else by**knob.power
    return np.concatenate([a, p])


