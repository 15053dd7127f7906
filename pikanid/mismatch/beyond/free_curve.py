"""Free curves of states, inputs, outputs: in place of laws that nobody has listed.

Where a model is far off, no first step leads to the curve.  Then it is read off the motion: the
smoothed output gives the coordinate and its rate, and the curve is what the integral of the
equation lacks, v(t) - v(0) - ∫ a(q, v, u) dt, by least squares together with the free parameters
(J. M. Varah, SIAM J. Sci. Stat. Comput. 3, 1982; integrated, as derivatives of noise are large: I.
Dattner and C. A. J. Klaassen, Electron. J. Stat. 9, 2015).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_smoothing_spline

from pikanid.formula.expressions import symbol
from pikanid.mismatch.beyond.patch import FreeCurve
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.tangent import Tangent
from pikanid.mismatch.fitting.hypothesis import Hypothesis, fitted
from pikanid.model import Model
from pikanid.simulation.vectorfield import VectorField

FINE = 12  # numerical: pieces of a curve, for a law that acts in a tenth of the range
DEPENDENT = 1e-8  # numerical: relative size of singular values that are none
FEWEST = 8  # numerical: samples that a smoothing spline needs


def with_free_curve(nominal: Model, h: Hypothesis, effects: Sequence[Candidate], argument: str,
                    site: Site) -> Hypothesis | None:
    """Effects of a hypothesis and a free curve as a force, refitted from where it stands; None
    where that cannot be run.

    Args:
        nominal: Model without effects.
        h: The hypothesis; its motion is the curve's range.
        effects: Some of its effects.
        argument: State that the curve is a function of.
        site: Coordinate in whose equation it stands.
    """
    visited = h.whitened.motion(h.minimum.theta)[argument]
    curve = FreeCurve(argument, float(visited.min()), float(visited.max()), h.model, FINE)
    return fitted(nominal, [*effects, curve.candidate(site)], h.whitened.records, [h.point], 1,
                  settled=h.key)


def with_free_input(nominal: Model, h: Hypothesis, name: str, site: Site) -> Hypothesis | None:
    """A hypothesis and a free curve of an input in what acts, refitted from where it stands."""
    problem = h.whitened.problem
    at = nominal.input_names.index(name)
    visited = np.concatenate([e.held[at].values for e in problem.experiments])
    return _beside(nominal, h, name, visited, nominal.input(name).unit, FreeCurve.of_input, site)


def with_free_sensor(nominal: Model, h: Hypothesis, site: Site) -> Hypothesis | None:
    """A hypothesis and a free curve of the site's output in what it shows, refitted."""
    problem, output = h.whitened.problem, site.output
    visited = np.concatenate([s.y for e in problem.experiments for s in e.samples
                              if problem.model.outputs[s.output].name == output.name])
    return _beside(nominal, h, output.name, visited, output.unit, FreeCurve.of_sensor, site)


def _beside(nominal: Model, h: Hypothesis, name: str, visited: np.ndarray, unit: str,
            effect: Callable[[FreeCurve, Site], Candidate], site: Site) -> Hypothesis | None:
    low, high = float(visited.min()), float(visited.max())
    if low == high:
        return None
    curve = FreeCurve(name, low, high, h.model, FINE, unit)
    return fitted(nominal, [*h.effects, effect(curve, site)], h.whitened.records, [h.point], 1,
                  settled=h.key)


def share_lacking(base: Hypothesis, argument: str, site: Site) -> float:
    """Share of what the nominal equation lacks that a free curve of a state leaves, both beside the
    free parameters; one where the output is not the coordinate itself, or too short, or where
    forces act through a lever.
    """
    if site.lever or site.output.expression != symbol(site.moving[0]):
        return 1.0
    pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
    theta, problem = base.minimum.theta, base.whitened.problem
    for r, response in enumerate(base.whitened.responses(theta, states=True)):
        samples = next(s for s in problem.experiments[r].samples
                       if problem.model.outputs[s.output].name == site.output.name)
        if len(samples.t) < FEWEST:
            return 1.0
        line = Tangent(base.whitened, theta, r, response.states)
        inside = (line.t >= samples.t[0]) & (line.t <= samples.t[-1])
        t, x, u = line.t[inside], line.x[inside].copy(), line.u[inside]
        q = make_smoothing_spline(samples.t, samples.y)
        at = {n: line.model.state_names.index(n) for n in site.moving}
        for order, name in enumerate(site.moving):
            x[:, at[name]] = q.derivative(order)(t)
        field = VectorField(line.model)
        free = [line.model.parameter_names.index(n) for n in line.model.free_names]
        pieces.append((t, x[:, at[argument]], field.rhs_jacobians(t, x, u, line.p)[1][
            :, at[site.v], free], x[:, at[site.v]] - _integrated(field.rhs(t, x, u, line.p)[
                :, at[site.v]], t)))
    visited = np.concatenate([x for _, x, _, _ in pieces])
    curve = FreeCurve(argument, float(visited.min()), float(visited.max()), base.model, FINE)
    left = [_left([(_integrated(np.column_stack([lever, curve.matrix(x)[:, :n]]), t), lacking)
                   for t, x, lever, lacking in pieces]) for n in (None, 0)]
    return left[0] / max(left[1], 1e-300)


def _integrated(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.asarray(cumulative_trapezoid(values, t, axis=0, initial=0))


def _left(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> float:
    """Power of targets (L,) that columns (L, n) leave, with a constant of its own in each."""
    columns, target = (np.concatenate([part - part.mean(axis=0) for part in parts])
                       for parts in zip(*pieces, strict=True))
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    rest = target - columns @ np.linalg.lstsq(columns, target, DEPENDENT)[0]
    return float(rest @ rest)
