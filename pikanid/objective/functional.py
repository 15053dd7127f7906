"""Eq. (2): the stacked residual [data; √λ·physics] of an approximator and a model.

PDA, iPDA, PINN and PIKAN minimise ½‖r(α, θ)‖² of this one functional; they differ in the
approximator, in how λ moves and in the optimiser (Table I).  With σ known the data rows are
divided by it.  Initial values are part of the model: a clamped spline is held at them exactly, by
elimination of its leading coefficients; any other approximator is tied to them by heavy rows.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from typing import Literal

import numpy as np
from scipy import sparse

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.tables import Shown, anchor, side_by_side
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.noise.level import difference_noise
from pikanid.objective.rows import ONE, AnyApproximator, Part, Rows, Sites, by_coefficients
from pikanid.problem.chains import Chains
from pikanid.problem.late import shown_within
from pikanid.problem.problem import Problem, Samples
from pikanid.simulation.vectorfield import VectorField

__all__ = ["Functional", "Part", "Penalty", "Rows", "Sites", "bind"]

Penalty = Literal["physics", "roughness"]

# Rows for an initial state that cannot be eliminated weigh as much as data of this 1/σ.
START_WEIGHT = 1e6  # numerical: holds them to 1e-6 of the states' units


@dataclass(frozen=True, eq=False)
class Functional:
    """Eq. (2) for a model bound to recordings.

    α is a list of coefficient vectors, one a recording; θ is the vector of `problem.free`.
    `scale` (E,) divides the physics residual of each chain; Eq. (2) itself has scale 1.
    """

    problem: Problem
    vector_field: VectorField = field(repr=False)
    chains: Chains
    parts: tuple[Part, ...] = field(repr=False)
    scale: Array
    weighted: bool = True  # data rows are divided by σ where it is known
    penalty: Penalty = "physics"

    def with_scale(self, scale: Array) -> Functional:
        """The same functional with other scales of the physics residual."""
        return replace(self, scale=np.asarray(scale, dtype=float))

    def smoothing(self, extra: int = 0) -> Functional:
        """The functional of PDA's first step: λ weighs derivatives, not the physics.

        They are those of the model's order, or `extra` orders higher.
        """
        parts = self.parts
        if extra:
            parts = tuple(replace(part, physics=part.physics.differentiated(extra))
                          for part in self.parts)
        return replace(self, penalty="roughness", parts=parts)

    @functools.cached_property
    def n_data(self) -> int:
        """Number of samples that take part."""
        return sum(sites.t.size for part in self.parts for sites in part.data)

    @functools.cached_property
    def data_square(self) -> float:
        """Weighted sum of squares of the samples themselves."""
        return sum(float(np.sum((sites.weight.T * sites.target) ** 2))
                   for part in self.parts for sites in part.data if sites.target is not None)

    def complete(self, r: int, coefficients: Array, theta: Array) -> Array:
        """The coefficients with the held ones set from the initial state x0(p)."""
        part = self.parts[r]
        if part.held.size == 0:
            return coefficients
        full = coefficients.copy()
        x0 = self.problem.experiments[r].initial(self.problem.parameters(theta, r))
        full[part.held] = part.hold @ x0
        return full

    def resting(self, r: int, theta: Array) -> Array:
        """Coefficients (n,) of recording r with every spline constant at its initial value."""
        part = self.parts[r]
        x0 = self.problem.experiments[r].initial(self.problem.parameters(theta, r))
        coefficients = np.zeros(part.n_coefficients)
        for state, (i, q) in enumerate(zip(self.chains.root, self.chains.order, strict=True)):
            if q == 0:  # B-splines sum to one
                coefficients[part.physics.tops[i].part] = x0[state]
        return self.complete(r, coefficients, theta)

    def hold_jacobian(self, r: int, theta: Array) -> Array | None:
        """d c[held] / d θ (k, b) in the columns of `problem.columns(r)`; None where constant."""
        part = self.parts[r]
        if part.held.size == 0:
            return None
        positions, _ = self.problem.columns(r)
        jacobian = self.problem.experiments[r].initial_jacobian(self.problem.parameters(theta, r))
        return part.hold @ jacobian[:, positions] if jacobian[:, positions].any() else None

    @functools.cached_property
    def start_moves(self) -> bool:
        """Whether an initial state is a formula of parameters or inputs."""
        return any(state.initial.free_symbols for state in self.problem.model.states)

    def states(self, sites: Sites, coefficients: Array) -> Array:
        """Approximated states (M, n) at the sites."""
        return side_by_side(sites.states, coefficients)

    def rows(self, r: int, coefficients: Array, theta: Array, lam: float) -> list[Rows]:
        """All residual families of recording r with derivatives: data, physics, start."""
        p = self.problem.parameters(theta, r)
        with np.errstate(all="ignore"):  # a wild iterate is told from its cost
            return [self.family(r, k, coefficients, p, lam)
                    for k, _ in enumerate(self.families(r))]

    def family(self, r: int, k: int, c: Array, p: Array, lam: float) -> Rows:
        """The k-th of them, at all parameters p (P,)."""
        part = self.parts[r]
        if k < len(part.data):
            return _data(part.data[k], c, p)
        if part.start is None or k == len(part.data):
            return self._physics(part.physics, c, p, lam)
        return self._start(part.start, r, c, p)

    def data_rows(self, r: int, coefficients: Array, theta: Array) -> list[Rows]:
        """The data families of recording r alone."""
        p = self.problem.parameters(theta, r)
        with np.errstate(all="ignore"):
            return [_data(sites, coefficients, p) for sites in self.parts[r].data]

    def physics_rows(self, r: int, coefficients: Array, theta: Array, lam: float) -> Rows:
        """The physics family of recording r alone."""
        p = self.problem.parameters(theta, r)
        with np.errstate(all="ignore"):
            return self._physics(self.parts[r].physics, coefficients, p, lam)

    def rows_of(self, r: int, values: Sequence[Array], theta: Array, lam: float) -> list[Rows]:
        """Data and physics families of recording r from the states, and then tops, (n + E, M) that
        are given for each of them.
        """
        part, p, (*seen, physics) = self.parts[r], self.problem.parameters(theta, r), values
        with np.errstate(all="ignore"):
            families = [_data_at(s, v, p) for s, v in zip(part.data, seen, strict=True)]
            return [*families, self._physics_at(part.physics, physics, p, lam)]

    def _physics(self, sites: Sites, c: Array, p: Array, lam: float) -> Rows:
        return self._physics_at(sites, sites.values(c), p, lam)

    def _physics_at(self, sites: Sites, values: Array, p: Array, lam: float) -> Rows:
        n = len(self.chains.root)
        factor, tops = self.physics_factor(lam), values[n:]
        if self.penalty == "roughness":
            return Rows(sites.weight, factor, np.zeros(tops.T.shape), tops, None, None, True)
        assert sites.lines is not None
        f, fx, fp = sites.lines(sites.t, values[:n].T, sites.u, p)
        return Rows(sites.weight, factor, f, tops, fx, fp, True)

    def physics_factor(self, lam: float) -> Array:
        """What multiplies the physics residual (E,) besides the weights of the sites."""
        return -math.sqrt(lam) / self.scale

    def _start(self, sites: Sites, r: int, c: Array, p: Array) -> Rows:
        experiment = self.problem.experiments[r]
        jacobian = experiment.initial_jacobian(p)[:, self.problem.columns(r)[0]]
        n = len(jacobian)
        return Rows(sites.weight, np.ones(n), self.states(sites, c), experiment.initial(p)[:, None],
                    np.eye(n)[None], -jacobian[None])

    def families(self, r: int) -> list[Sites]:
        """The sites of `rows`, in the same order."""
        part = self.parts[r]
        return [*part.data, part.physics, *([] if part.start is None else [part.start])]

    def residual(self, coefficients: Sequence[Array], theta: Array, lam: float) -> Array:
        """Stacked residual, recording after recording, family after family, time by time."""
        return np.concatenate([
            rows.residual.ravel() for r, c in enumerate(coefficients)
            for rows in self.rows(r, c, theta, lam)])

    def jacobian(self, coefficients: Sequence[Array], theta: Array,
                 lam: float) -> sparse.csr_array:
        """Derivative of `residual` by [α_1, α_2, ..., θ], for any approximator."""
        blocks, borders = [], []
        for r, c in enumerate(coefficients):
            _, columns = self.problem.columns(r)
            own, border = [], []
            for sites, rows in zip(self.families(r), self.rows(r, c, theta, lam), strict=True):
                own.append(by_coefficients(sites, rows, c))
                dense = np.zeros((rows.residual.size, theta.size))
                if rows.by_theta is not None:
                    dense[:, columns] = rows.by_theta.reshape(rows.residual.size, -1)
                border.append(dense)
            blocks.append(sparse.vstack(own))
            borders.append(np.vstack(border))
        return sparse.csr_array(sparse.hstack(
            [sparse.block_diag(blocks), sparse.csr_array(np.vstack(borders))]))


def bind(problem: Problem, vector_field: VectorField, chains: Chains,
         approximators: Sequence[tuple[AnyApproximator, ...]],
         nodes: Sequence[tuple[Array, Array]], *, given_start: bool = True,
         weighted: bool = True, like: Functional | None = None) -> Functional:
    """Eq. (2) for approximators (one tuple a recording, one entry a chain) and physics nodes.

    `nodes` are (times (M,), weights (M,)) a recording: Gauss points with their weights for the
    integral, the samples with weight 1 for the sum of Eq. (5).  With `given_start` the initial
    state of the model is kept, exactly where the approximators are clamped.  `weighted` divides
    data by their σ (where it is unknown, by the visible noise if there are several outputs).
    `like` is one bound to the same problem: its data are taken over.

    Raises:
        BadSetting: If a delay, a backlash or a rate limit is to be estimated: no functional over
            fixed sites can see them.
    """
    _check_seen(problem.model)
    parts = []
    for r, (experiment, own, (times, weights)) in enumerate(zip(
            problem.experiments, approximators, nodes, strict=True)):
        free = problem.columns(r)[0].tolist()
        sizes = [a.n_coefficients for a in own]
        pieces = [slice(*ends) for ends in pairwise(accumulate(sizes, initial=0))]
        states = [Shown(own[i], q, pieces[i])
                  for i, q in zip(chains.root, chains.order, strict=True)]
        tops = [Shown(own[i], m, pieces[i]) for i, m in enumerate(chains.lengths)]
        data = [] if like is None else [
            sites.with_states(states) for sites in like.parts[r].data]
        for seen, samples in shown_within(experiment) if like is None else ():
            sigma = _spread(samples, len(problem.model.outputs) > 1) if weighted else 1.0
            weight = np.empty((seen.size, 1))
            weight[:, 0] = 1.0 / sigma
            data.append(Sites.of(seen, experiment.inputs(seen), weight, states, (),
                                 np.ascontiguousarray(samples.y)[None], samples.output,
                                 None if samples.sigma is None else weight[:, 0] * samples.sigma,
                                 vector_field.linearised_outputs([samples.output], free)))
        weight = np.sqrt(weights)[:, None] * np.ones(len(own))
        physics = Sites.of(times, experiment.inputs(times), weight, states, tops,
                           lines=vector_field.linearised_rhs(chains.top, free))
        held, hold, start = np.zeros(0, np.int64), np.zeros((0, len(chains.root))), None
        if given_start:
            grip = anchor(own, chains.lengths, experiment.t0)
            if grip is None:
                at = np.array([experiment.t0])
                heavy = np.full((1, len(chains.root)), START_WEIGHT)
                start = Sites.of(at, experiment.inputs(at), heavy, states)
            else:
                held, hold = grip[0], np.empty_like(grip[1])
                hold[:, np.lexsort((chains.order, chains.root))] = grip[1]
        parts.append(Part(own, tuple(data), physics, start, held, hold))
    return Functional(problem, vector_field, chains, tuple(parts), np.ones(len(chains.top)),
                      weighted)


def _data(sites: Sites, c: Array, p: Array) -> Rows:
    return sites.measured_at(c) or _data_at(sites, sites.values(c), p)


def _data_at(sites: Sites, values: Array, p: Array) -> Rows:
    if (plain := sites.measured(values)) is not None:
        return plain
    assert sites.lines is not None and sites.target is not None
    y, hx, hp = sites.lines(sites.t, values.T, sites.u, p)
    return Rows(sites.weight, ONE, y, sites.target, hx, hp)


def _spread(samples: Samples, several: bool) -> Array | float:
    """σ; where unknown, 1 for a single output and the visible noise of each of several."""
    if samples.sigma is not None or not several:
        return 1.0 if samples.sigma is None else samples.sigma
    return max(difference_noise(samples.y, samples.t), 1e-6 * float(np.ptp(samples.y)), 1e-300)


def _check_seen(model: Model) -> None:
    free = {symbol(name) for name in model.free_names}
    for what, items in (("input", model.inputs), ("output", model.outputs)):
        for item in items:
            names = sorted(s.name for s in item.delay.free_symbols & free)
            if names:
                raise errors.BadSetting(errors.relaxation_cannot_see(
                    names, f"the delay of {what} '{item.name}'"))
    for item in model.inputs:
        for what, formula in item.formulas.items():
            names = sorted(s.name for s in formula.free_symbols & free)
            if names:
                raise errors.BadSetting(errors.relaxation_cannot_see(
                    names, f"the {what.replace('_', ' ')} of input '{item.name}'"))
