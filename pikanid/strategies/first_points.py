"""Splines through a known trajectory: the model's at its guess, or that of a coarser grid."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.linalg.lapack import dgbsv

from pikanid.approximators import Array
from pikanid.approximators.bspline import BSpline
from pikanid.objective.functional import Functional
from pikanid.optimise.gauss_newton import Point

# Beyond this many intervals a simulation by a general solver takes too long to be worth it.
MOST_INTERVALS = 20_000  # limit: beyond it a general solver takes too long to be worth it


def from_simulation(functional: Functional) -> Point | None:
    """Splines through the trajectory that the model has at its guess; None where it diverges."""
    theta = functional.problem.guess
    coefficients = []
    for r, part in enumerate(functional.parts):
        pieces = []
        for i, spline in enumerate(part.approximators):
            if not isinstance(spline, BSpline) or spline.breakpoints.size > MOST_INTERVALS:
                return None
            state = _first_state(functional, i)
            states = _simulate(functional, r, theta, spline.greville)
            if states is None:
                return None
            fitted = make_interp_spline(spline.greville, states[:, state], spline.degree,
                                        t=spline.knots)
            pieces.append(fitted.c)
        coefficients.append(functional.complete(r, np.concatenate(pieces), theta))
    return Point(tuple(coefficients), theta)


def transfer(old: Functional, new: Functional, point: Point,
             refitted: Callable[[Any, Any, Array], Array]) -> Point:
    """The same trajectories on a finer grid; `refitted` gives the coefficients of a finer curve,
    from the coarser one and its own.
    """
    coefficients = []
    for r, (before, after) in enumerate(zip(old.parts, new.parts, strict=True)):
        pieces = [refitted(fine, coarse, point.coefficients[r][top.part]) for fine, coarse, top in
                  zip(after.approximators, before.approximators, before.physics.tops, strict=True)]
        coefficients.append(new.complete(r, np.concatenate(pieces), point.theta))
    return Point(tuple(coefficients), point.theta)


def through_greville(fine: BSpline, coarse: BSpline, own: Array) -> Array:
    """Interpolation at the Greville points of the finer knots: exact, as the spaces are nested."""
    return _interpolated(fine, fine.greville, coarse.values(fine.greville, own))


def _interpolated(spline: BSpline, t: Array, values: Array) -> Array:
    """Coefficients (n,) of the spline through values (n,) at as many times t, a banded system."""
    first, local = spline.local(t)
    k = spline.degree
    # column after column, as LAPACK works on it in place
    matrix, columns = np.zeros((t.size, 3 * k + 1)).T, first[:, None] + np.arange(k + 1)
    matrix[2 * k + np.arange(t.size)[:, None] - columns, columns] = local
    _, _, coefficients, info = dgbsv(k, k, matrix, values, overwrite_ab=1)
    if info:
        raise np.linalg.LinAlgError("the sites do not determine the spline")
    return coefficients


def _first_state(functional: Functional, chain: int) -> int:
    pairs = zip(functional.chains.root, functional.chains.order, strict=True)
    return list(pairs).index((chain, 0))


def _simulate(functional: Functional, r: int, theta: Array, t: Array) -> Array | None:
    """States (M, n) at increasing times t (M,), the solver restarted at every switch."""
    experiment = functional.problem.experiments[r]
    p, field = functional.problem.parameters(theta, r), functional.vector_field
    edges = np.concatenate([[experiment.t0], experiment.breakpoints(), [experiment.t1]])
    x = experiment.initial(p)
    out = np.empty((t.size, x.size))
    for begin, end in pairwise(edges):

        def rhs(now: float, x: Array, begin: float = begin, end: float = end) -> Array:
            # Kept off the edges, where the input belongs to the neighbour.
            at = np.array([np.clip(now, begin + 1e-9 * (end - begin), end - 1e-9 * (end - begin))])
            return field.rhs(at, x[None], experiment.inputs(at), p)[0]

        inside = (t >= begin) & (t <= end)
        with np.errstate(all="ignore"):
            solved = solve_ivp(rhs, (begin, end), x, method="Radau", rtol=1e-6, atol=1e-9,
                               dense_output=True)
        x = solved.y[:, -1]
        if not solved.success or solved.sol is None or not np.all(np.isfinite(x)):
            return None
        out[inside] = solved.sol(t[inside]).T
    return out
