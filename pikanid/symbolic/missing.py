"""Reads a discrepancy: the laws that a model lacks, named, and refitted inside the ODE.

An edge is gauge-fixed: whatever the free parameters can do in its place has been taken out of it.
A law is therefore compared with the gauge's own functions as free columns beside it.  Where the
recordings are given, the most probable laws are put into the equation one after the other, all
parameters are estimated again through the simulation, and BIC of the recordings decides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, product

import numpy as np

from pikanid import errors
from pikanid.discrepancy.edge import Edge
from pikanid.discrepancy.result import Discrepancy
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.symbolic.composed import Place
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.laws import Laws, chosen, reading_of_laws, reading_unrefitted, sum_of_laws
from pikanid.symbolic.library import NOTHING, Form
from pikanid.symbolic.named import NamedEdge
from pikanid.symbolic.naming import name_curve, priors
from pikanid.symbolic.reading import Reading, probabilities
from pikanid.symbolic.saved import REST
from pikanid.symbolic.search import shortlist
from pikanid.symbolic.settings import USUAL, SymbolicSettings
from pikanid.symbolic.significance import Contribution

DRAWN = 120  # numerical: points of an edge that are compared
STEEP = 0.4  # limit: least exponent of a law that steps can follow through zero
NEAR = 1e-6  # numerical: of a parameter's range: at its end


def read_discrepancy(found: Discrepancy, library: Sequence[Form],
                     recordings: Recording | Sequence[Recording] | None = None,
                     settings: SymbolicSettings = USUAL) -> Reading:
    """A formula for what is missing; without recordings, by the edges alone."""
    places = {(0, k, 0): edge for k, edge in enumerate(found.edges)}
    named = {place: name_curve(edge_curve(edge, found.estimate.n), library, settings)
             for place, edge in places.items() if edge.significant}
    arguments = [e.argument for e in found.edges]
    ranges = [e.range for e in found.edges]
    weights = [Contribution(0, k, 0, float(np.sqrt(np.mean(e.values**2))),
                            float(np.sqrt(np.mean(e.std**2))), e.p_value)
               for k, e in enumerate(found.edges)]
    if not named or recordings is None:
        laws = sum_of_laws(found.nominal.model, arguments, chosen(named), ranges, found.unit)
        stuck = [found.edges[k].argument for _, k, _ in named
                 if sticks(found.edges[k], settings)]
        return reading_unrefitted(laws, named, arguments, ranges, weights, stuck, settings)
    tried = _tried(found, named, recordings, priors(library, settings), settings)
    share = probabilities([score for score, _, _ in tried])
    _, laws, estimate = tried[0]
    at = [estimate.index(p.name) for p in laws.parameters]
    refitted = replace(laws, parameters=tuple(
        replace(p, value=float(estimate.theta[k]))
        for p, k in zip(laws.parameters, at, strict=True)))
    return reading_of_laws(refitted, named, arguments, ranges, weights, share,
                           [one.label for _, one, _ in tried],
                           estimate.covariance[np.ix_(at, at)], estimate, settings)


def sticks(edge: Edge, settings: SymbolicSettings = USUAL) -> bool:
    """Whether a jump holds its argument at zero for a while.

    How long depends on everything else, by no linear model: what such an edge says of its own law
    is not to be trusted until the law is in the equation.
    """
    reach = max(abs(edge.range[0]), abs(edge.range[1]))
    resting = float(edge.gauge.weights[np.abs(edge.gauge.a) < REST * reach].sum())
    return edge.jump_probability > settings.jumps and resting > settings.resting


def edge_curve(edge: Edge, samples: int) -> Curve:
    """An edge of a discrepancy, ready to be named: at visited arguments, its gauge free."""
    visited = np.sort(edge.gauge.a)
    at = np.unique(visited[np.linspace(0, len(visited) - 1, DRAWN).round().astype(int)])
    return Curve.of_likelihood(
        at, edge.gauge.plan.basis(at), edge.coefficients, edge.covariance, edge.information,
        edge.gain, samples=samples, free=edge.gauge_functions(at), argument=edge.argument,
        unit=edge.unit, x_unit=edge.argument_unit)


def _tried(found: Discrepancy, named: Mapping[Place, NamedEdge],
           recordings: Recording | Sequence[Recording], weights: Mapping[str, float],
           settings: SymbolicSettings = USUAL) -> list[tuple[float, Laws, Estimate]]:
    """Laws inside the ODE, best first: BIC less twice the log of the prior, law, estimate.

    The likely laws of every edge in all combinations, then what is simpler than one of them: where
    a system sticks, the linear model behind an edge misjudges a jump most of all.
    """
    from pikanid.strategies.nls import NLS

    arguments = [e.argument for e in found.edges]
    ranges = [e.range for e in found.edges]
    results: dict[tuple[str, ...], tuple[float, Laws, Estimate] | None] = {}

    def put_in(choice: Mapping[Place, FormFit]) -> None:
        key = tuple(fit.form.name for fit in choice.values())
        if key in results:
            return
        results[key] = None
        law = sum_of_laws(found.nominal.model, arguments, choice, ranges, found.unit)
        try:
            with np.errstate(all="ignore"):  # on its way a law may leave its domain
                estimate = NLS(starts=1).fit(_extended(found, law), recordings)
        except errors.SimulationFailed:
            return
        prior = sum(np.log(weights[fit.form.name]) for fit in choice.values())
        results[key] = (_score(estimate) - 2.0 * float(prior), law, estimate)

    def ranked() -> list[tuple[float, Laws, Estimate]]:
        return sorted((r for r in results.values() if r is not None), key=lambda r: r[0])

    lists = [[(place, fit) for fit in _likely(edge)] for place, edge in named.items()]
    for choice in islice(product(*lists), settings.combinations):
        put_in(dict(choice))
    if not ranked():
        raise errors.SimulationFailed(errors.no_law_simulated())
    for _, law, _ in ranked():
        for place, edge in named.items():
            for fit in _simpler(edge, law.fits[place].form):
                put_in({**law.fits, place: fit})
    return ranked()


def _likely(edge: NamedEdge) -> list[FormFit]:
    """The laws worth a fit inside the ODE, the best of every family; at least the best one."""
    scores = {c.form.name: c.score for c in edge.candidates}
    laws = [f for f in shortlist(edge) if f.form is not NOTHING]
    # near its limit a form is another one's, and may be too steep to simulate
    laws = [f for f in laws if not _at_limit(f, edge)] or laws
    first = min(laws, key=lambda f: scores[f.form.name])
    # an edge knows its law by a linear model: where none fits, that says less than it claims
    freedom = max(edge.curve.rows - first.form.count + 1, 1)
    doubt = max(1.0, first.rss / freedom)
    worst = scores[first.form.name] + doubt * edge.settings.unlikely
    near = [f for f in laws if scores[f.form.name] <= worst]
    return sorted(near, key=lambda f: scores[f.form.name])[:edge.settings.laws]


def _at_limit(fit: FormFit, edge: NamedEdge) -> bool:
    """Whether a parameter inside has gone as far as it may, or a power is all but a jump."""
    curve = edge.curve
    for knob, value in zip(fit.form.knobs, fit.inside, strict=True):
        if knob.kind == "exponent" and value < STEEP:
            return True
        low, high = knob.limits(curve.low, curve.high, len(curve.x))
        if min(value - low, high - value) < NEAR * (high - low):
            return True
    return False


def _simpler(edge: NamedEdge, form: Form) -> list[FormFit]:
    """The best laws that a form contains: relatives with fewer constants, parts of its sum."""
    found = [c for c in edge.candidates
             if c.form is not NOTHING and c.form.count < form.count
             and (c.form.family == form.family or set(c.form.columns) < set(form.columns))]
    return [c.fit for c in sorted(found, key=lambda c: c.score)[:edge.settings.contained]]


def _extended(found: Discrepancy, law: Laws) -> Model:
    return found.nominal.fitted_model.with_term(found.equation, law.expression,
                                                [*law.parameters, *law.fixed])


def _score(estimate: Estimate) -> float:
    """BIC: with χ² where the noise is known."""
    n, a = estimate.n, estimate.adequacy
    penalty = len(estimate.theta) * float(np.log(n))
    if a.source == "given":
        return a.value + penalty
    return n * float(np.log(2.0 * estimate.cost / n + 1e-300)) + penalty
