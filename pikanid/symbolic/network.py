"""Reads a whole KAN: prunes, names every edge, chooses the forms together, refits all constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.approximators.kan.edges import (
    arguments,
    beside,
    edges_of,
    groups_of,
    plain,
    without_edge,
)
from pikanid.approximators.kan.tensors import read
from pikanid.approximators.kan.train import PointFit, fit_points
from pikanid.formula.expressions import symbol
from pikanid.symbolic.composed import Place
from pikanid.symbolic.curve import EXACT, Curve
from pikanid.symbolic.library import LIBRARY, NOTHING, Form
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.naming import name_curve, priors
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.prune import prune
from pikanid.symbolic.reading import Reading, probabilities
from pikanid.symbolic.refit import Refit, covariance
from pikanid.symbolic.search import Ranked, search
from pikanid.symbolic.settings import USUAL, SymbolicSettings
from pikanid.symbolic.significance import Contribution, contributions
from pikanid.symbolic.tidy import tidied

DRAWN = 120  # numerical: points of an edge that are compared


def read_network(kan: Any, x: Array | None = None, y: Array | None = None, *,
                 inputs: Sequence[str] | None = None, library: Sequence[Form] = LIBRARY,
                 alpha: float = 0.01, units: tuple[Sequence[str], str] | None = None,
                 settings: SymbolicSettings = USUAL) -> Reading:
    """A pykan model with one output as a formula; the model stays as it is.

    Args:
        kan: Any pykan model, trained here or elsewhere.
        x, y: The data behind it, (M, n) and (M,); without y the network's own values are read and
            nothing can be tested, without x the inputs that it saw last are taken.
        inputs: Names of the inputs, "x1", "x2", ... unless given; also formulas of a model's names.
        library: The forms that compete.
        alpha: Level at which edges are significant.
        units: Units of the inputs, and of the output.
        settings: Priors, levels of tests, budgets.
    """
    seen = kan.cache_data if x is None else x
    if seen is None:
        raise errors.BadSetting(errors.network_without_inputs())
    x = np.asarray(read(seen) if x is None else x, float)
    x = x.reshape(len(x), -1)
    names = tuple(inputs) if inputs else tuple(f"x{k + 1}" for k in range(x.shape[1]))
    if len(names) != x.shape[1]:
        raise errors.BadSetting(errors.reading_inputs(x.shape[1], names))
    if y is None:
        fit, removed = _alone(plain(kan, x), x, settings.close)
        y_own = arguments(kan, x)[-1][:, 0]
    else:
        pruned = prune(kan, x, np.asarray(y, float), alpha=alpha)
        fit, removed, y_own = pruned.fit, pruned.removed, np.asarray(y, float).ravel()
    named = name_edges(fit, x, y is not None, library, names, settings)
    groups = groups_of(fit.network.plan)
    offsets = [read(b) for b in fit.kan.subnode_bias]
    formulas = tuple(_formula(n) for n in names)
    exact = EXACT if y is not None else settings.believed
    weights = priors(library, settings) | {NOTHING.name: 1.0}
    found = search(groups, formulas, named, offsets, x, y_own, weights, exact, settings)
    if not found:
        raise errors.BadSetting(errors.nothing_read())
    found = _tidied_first(found, x, y_own, exact, settings)
    share = probabilities([r.score for r in found])
    return _reading(found[0].fit, fit, x, y_own, y is not None, names, named,
                    (*contributions(fit, x), *removed), share,
                    [_label(r.fit) for r in found], units, settings)


def _tidied_first(found: Sequence[Ranked], x: Array, y: Array, exact: float,
                  settings: SymbolicSettings) -> list[Ranked]:
    """Those that compete, without the constants that they do not need, ranked again.

    An offset that one form needs and another has at zero would count against both alike.
    """
    reach = found[0].score + 2.0 * float(np.log(len(x)))
    close = [r for r in found[:settings.compete] if r.score <= reach]
    done = [Ranked(fit, r.score + fit.score - r.fit.score)
            for r in close for fit in [tidied(r.fit, x, y, exact, settings.evaluations)]]
    return sorted([*done, *found[len(close):]], key=lambda r: r.score)


def _alone(kan: Any, x: Array, close: float
           ) -> tuple[PointFit, tuple[Contribution, ...]]:
    """A network without data: edges that hardly move its output go."""
    y = arguments(kan, x)[-1][:, 0]
    fit = fit_points(kan, x, y, iterations=0)
    removed: list[Contribution] = []
    while len(edges_of(fit.network)) > 1:
        weakest = min((c for c in contributions(fit, x) if c.target is not None),
                      key=lambda c: c.size)
        if weakest.size > close * float(np.std(y)):
            break
        removed.append(weakest)
        smaller = without_edge(fit.kan, weakest.layer, weakest.source, weakest.target or 0)
        fit = fit_points(smaller, x, y)
    return fit, tuple(removed)


def name_edges(fit: PointFit, x: Array, with_noise: bool, library: Sequence[Form],
               inputs: Sequence[str], settings: SymbolicSettings = USUAL
               ) -> dict[Place, NamedEdge]:
    """Every active edge named on its own, with its own uncertainty where there is one."""
    c = fit.network.coefficients
    entering = arguments(fit.kan, x)
    named = {}
    edges = edges_of(fit.network)
    for edge in edges:
        u = np.sort(entering[edge.layer][:, edge.source])
        at = np.unique(u[np.linspace(0, len(u) - 1, min(DRAWN, len(u))).round().astype(int)])
        basis = edge.basis(at)
        label = inputs[edge.source] if edge.layer == 0 else f"h{edge.layer}_{edge.source + 1}"
        if with_noise:
            V = fit.covariance(edge.at, beside(edges, edge))
            curve = Curve.of_spline(at, basis, c[edge.at], V, samples=len(x), argument=label)
        else:
            curve = Curve.of_points(at, basis @ c[edge.at], argument=label,
                                    exact=settings.believed)
        named[edge.layer, edge.source, edge.target] = name_curve(curve, library, settings)
    return named


def _formula(name: str) -> sp.Expr:
    """An input's name, or the formula that it is."""
    from pikanid.formula.expressions import FUNCTIONS, parse

    if name.isidentifier():
        return symbol(name)
    words = "".join(c if c.isalnum() or c == "_" else " " for c in name).split()
    return parse(name, {w for w in words if w.isidentifier() and w not in FUNCTIONS}, "an input")


def _label(fit: Refit) -> str:
    return "; ".join(f"{form.name} of {fit.composition._node(p[0], p[1])}"
                     for p, form, _ in fit.composition.edges)


def _reading(best: Refit, fit: PointFit, x: Array, y: Array, noisy: bool, names: tuple[str, ...],
             named: Mapping[Place, NamedEdge], weights: Sequence[Any], share: Array,
             labels: Sequence[str], units: tuple[Sequence[str], str] | None,
             settings: SymbolicSettings) -> Reading:
    from scipy.stats import f as fisher

    made, V = best.composition, covariance(best, x, y)
    free = np.flatnonzero(~best.held)
    values: list[sp.Expr] = [
        sp.nsimplify(v) if held else symbol(n)
        for n, v, held in zip(made.names, best.theta, best.held, strict=True)]
    formula = made.expression(values)
    used = {s.name for s in formula.free_symbols}
    free = np.array([k for k in free if made.names[k] in used], int)
    value = made.evaluate(best.theta, x)[0]
    network = y - fit.residual
    p_value = None
    if noisy:
        extra, rest = max(fit.effective - best.rank, 1.0), max(len(y) - fit.effective, 1.0)
        more = max(best.rss - float(fit.residual @ fit.residual), 0.0)
        floor = len(y) * best.floor
        p_value = float(fisher.sf(more / extra / (
            (float(fit.residual @ fit.residual) + floor) / rest), extra, rest))
    return Reading(
        formula, tuple(made.names[k] for k in free), best.theta[free], V[np.ix_(free, free)],
        names, tuple((float(c.min()), float(c.max())) for c in x.T), dict(named), tuple(weights),
        float(share[0]), tuple(zip(labels[1:], map(float, share[1:]), strict=True)),
        float(np.sqrt(np.mean((value - network) ** 2))),
        float(np.sqrt(best.rss / len(y))) if noisy else None, float(np.std(y)), p_value,
        {p: form.name for p, form, _ in made.edges}, kan=fit.kan, composition=made,
        theta=best.theta, settings=settings)
