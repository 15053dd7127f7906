"""PIKAN with a deep network: Levenberg-Marquardt from the lifted shallow fit.

The start is the shallow PIKAN's curve, which every deeper network contains: it becomes the first
node's hidden edge, scaled into the middle of the next grid, and the edges that follow it are the
identity.  All other nodes begin as slow waves of time, and the last layer takes nothing from them
yet.  From there on all edges, kinks and parameters move together, while λ rises tenfold from the
shallow fit's until no parameter moves by more than 0.05 of its standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN, build_kan
from pikanid.approximators.kan.curve import HIGHEST, KanCurve
from pikanid.approximators.kan.plan import Base, KanPlan
from pikanid.approximators.kan.tensors import read, write
from pikanid.approximators.tables import gauss_nodes
from pikanid.objective.functional import Functional, Part, bind
from pikanid.objective.rows import AnyApproximator
from pikanid.optimise.bordered import BorderedSystem
from pikanid.optimise.damped import Stop, levenberg_marquardt
from pikanid.optimise.gauss_newton import Point
from pikanid.optimise.network_covariance import network_covariance
from pikanid.optimise.schedules import Continuation, Stage, moved
from pikanid.problem.problem import Problem
from pikanid.strategies.data_noise import row_noise
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.relaxation import RELATIVE, RelaxedFit, Setup

NEAR_END = 0.9  # numerical: of a hidden grid's half width
ROOM = 1.6  # numerical: of a hidden grid's half width to the start's amplitude in it
LARGEST_LAMBDA = 1e9  # limit: beyond it rounding has the physics' digits
MOST_KINKS = 500  # limit: a border of the normal equations, dense


@dataclass(frozen=True)
class Shape:
    """A network beyond its first grid.

    Attributes:
        width: Nodes of every layer, [sums, products] where nodes multiply.
        hidden_grid: Cells of the grids of hidden values.
        base: "zero" (w_b = 0) or "silu".
        seed: Of the waves that the other nodes begin with.
    """

    width: tuple[int | Sequence[int], ...]
    hidden_grid: int = 6
    base: Base = "zero"
    seed: int = 0


def deep_fit(setup: Setup, start: RelaxedFit, shape: Shape, lam: float | None,
             tell: Callable[[int, Sequence[Stage]], None]) -> RelaxedFit:
    """Train networks of a shape from a shallow fit, at λ or from the shallow fit's λ upwards.

    Raises:
        BadSetting: If the shape cannot be a curve over time or its derivatives are not carried.
    """
    chains, grid = setup.chains, start.grid
    assert isinstance(grid, KanGrid)
    if max(chains.lengths) > HIGHEST:
        raise errors.BadSetting(errors.kan_order(max(chains.lengths), HIGHEST))
    kinks = sum(len(network.kink_columns) for part in start.functional.parts
                for network in part.approximators if isinstance(network, ShallowKAN))
    if kinks > MOST_KINKS:
        raise errors.BadSetting(errors.kan_kinks(kinks, MOST_KINKS))
    curves = []
    for part, c in zip(start.functional.parts, start.coefficients, strict=True):
        curves.append(tuple(
            _lifted(network, c[table.part], shape) for network, table
            in zip(part.approximators, part.physics.tops, strict=True)))
    theta, damping, weight = start.theta, 1.0, start.lam if lam is None else lam
    plan = Continuation(float(start.functional.n_data), lockable=True, factor=10.0)
    stages: list[Stage] = []
    fits: list[RelaxedFit] = []
    notes: list[str] = []
    while True:
        functional = bind(setup.problem, setup.field, chains, curves,
                          _nodes(setup.problem, grid, curves[0]), given_start=setup.given_start,
                          weighted=setup.weighted).with_scale(start.functional.scale)
        system = BorderedSystem(functional, tuple(
            np.concatenate([_units(curve) for curve in own]) for own in curves))
        point = Point(tuple(np.concatenate([curve.coefficients for curve in own])
                            for own in curves), theta)
        try:
            stop = levenberg_marquardt(
                system, point, weight, setup.problem.lower, setup.problem.upper, damping=damping,
                iterations=setup.settings.iterations, admitted=partial(_inside, functional))
            fit = _concluded(setup, system, stop, grid, weight)
        except LinAlgError:
            best = fits[-1] if fits else start
            notes.append(errors.fit_diverged(f"at λ = {weight:g}"))
            return replace(best, stages=(*start.stages, *stages), converged=False,
                           warnings=(*start.warnings, *notes))
        tell(grid.intervals, fit.stages)
        fits.append(fit)
        stages += fit.stages
        settled = len(stages) > 1 and moved(
            stages[-2].theta, fit.theta, stages[-2].std, RELATIVE) <= setup.settings.settled
        # A physics cost below one datum's share cannot have locked anything.
        quiet = fit.converged and fit.physics_cost <= fit.data_cost / plan.noise_cost
        kept = len(stages) - 1 if settled or quiet else plan.keep(stages)
        if lam is not None or settled or kept < len(stages) - 1 or weight >= LARGEST_LAMBDA:
            break
        theta, damping, weight = fit.theta, stop.damping, 10.0 * weight
        curves = _kept(functional, stop.at.point)
    best = fits[kept]
    if kept < len(stages) - 1:
        said = errors.relaxation_locked if fit.converged else errors.relaxation_stuck
        notes.append(said(weight, stages[kept].lam))
    if not best.converged:
        notes.append(errors.not_converged(best.lam))
    return replace(best, stages=(*start.stages, *stages[:kept + 1]),
                   warnings=(*start.warnings, *notes))


def _concluded(setup: Setup, system: BorderedSystem, stop: Stop, grid: KanGrid,
               lam: float) -> RelaxedFit:
    at = stop.at
    sandwich, naive, effective = network_covariance(
        system, at,
        lambda count: row_noise(system.functional, at, count))  # type: ignore[arg-type]  # data's rows are alike
    std = np.sqrt(np.diag(sandwich))
    # A redundant network creeps on long after θ has come to rest.
    last = setup.settings.calm
    calm = stop.converged or (len(stop.path) > last and moved(
        stop.path[-1 - last], at.point.theta, std, RELATIVE) <= setup.settings.settled)
    stage = Stage(lam, at.point.theta, std, at.data_cost, at.physics_cost,
                  len(stop.path) - 1, calm)
    return RelaxedFit(setup.problem, at.point.theta, sandwich, naive, at.point.coefficients,
                      system.functional, grid, lam, (stage,), at.data_cost, at.physics_cost,
                      effective, calm)


def _lifted(network: AnyApproximator, coefficients: Array, shape: Shape) -> KanCurve:
    """A deep curve that equals a shallow one with these coefficients."""
    assert isinstance(network, ShallowKAN)
    bumps = list(network.kink_columns)
    splines = np.delete(coefficients, bumps)[:network.n_splines]
    low, high = float(splines.min()), float(splines.max())
    half = 0.5 * ROOM * ((high - low) or 1.0)
    hidden = len(shape.width) - 2
    kan = build_kan(
        [entry if isinstance(entry, int) else list(entry) for entry in shape.width],
        grid=[network.n_splines - network.degree] + [shape.hidden_grid] * hidden,
        k=network.degree, grid_range=[(network.start, network.stop)] + [(-1.0, 1.0)] * hidden,
        base=shape.base, seed=shape.seed, noise=0.0, start="waves")
    curve = KanCurve(kan, network.kinks)
    _carry(kan, curve.network.plan, splines, 0.5 * (low + high), half)
    curve.heights = coefficients[bumps]
    return curve


def _units(curve: KanCurve) -> Array:
    """Moves of a curve's coefficients that count as one.

    That is a hidden value's way across half its grid, or as much of the curve's own size.
    """
    last = curve.kan.act_fun[-1]
    outer = read(last.coef).size
    if curve.network.plan.base == "silu":
        outer += read(last.scale_base).size
    units = np.ones(curve.n_coefficients)
    size = float(np.ptp(read(last.coef)[0, 0])) * float(read(last.scale_sp)[0, 0])
    units[curve.network.n_coefficients - outer:] = 0.5 * (size or 1.0)
    return units


def _carry(kan: Any, plan: KanPlan, splines: Array, middle: float, half: float) -> None:
    """Let the first node of every layer carry the curve; the output takes nothing else."""
    for layer in range(plan.depth):
        edges = kan.act_fun[layer]
        coef, scale = read(edges.coef), read(edges.scale_sp)
        last = layer == plan.depth - 1
        sums = plan.width[layer + 1][0]
        # A product node carries the curve in its first factor; the others are one.
        ones = [] if sums else list(range(1, plan.factors(layer + 1)[0]))
        for subnode in range(coef.shape[1]) if last else [0, *ones]:
            coef[:, subnode] = 0.0
        knots = plan.knots[layer][0]
        values = (splines - middle) / half
        if layer:
            # knot averages: the spline that is its own argument
            values = np.array([knots[i + 1:i + plan.k + 1].mean() for i in range(coef.shape[2])])
        if last:
            values = middle + half * values
        coef[0, 0] = values / scale[0, 0]
        for subnode in ones:
            coef[0, subnode] = 1.0 / scale[0, subnode]
        write(edges.coef, coef)
        if plan.base == "silu":
            write(edges.scale_base, np.zeros(scale.shape))


def _nodes(problem: Problem, grid: KanGrid, curves: Sequence[KanCurve]
           ) -> list[tuple[Array, Array]]:
    """Gauss nodes: in every cell one more than the first layer has coefficients there."""
    count = max(curve.width for curve in curves) + 1
    return [gauss_nodes(grid.panels(e), count) for e in problem.experiments]


def _inside(functional: Functional, point: Point) -> bool:
    """Whether all hidden values stay on their grids: beyond, edges fade."""
    return all(curve.coverage(part.physics.t, c[table.part]) <= 1.0
               for part, c in zip(functional.parts, point.coefficients, strict=True)
               for curve, table in zip(_curves(part), part.physics.tops, strict=True))


def _kept(functional: Functional, point: Point) -> list[tuple[KanCurve, ...]]:
    """The curves with their coefficients, on wider hidden grids where values come near an end."""
    found = []
    for part, c in zip(functional.parts, point.coefficients, strict=True):
        own = []
        for curve, table in zip(_curves(part), part.physics.tops, strict=True):
            curve.set_coefficients(c[table.part])
            near = curve.coverage(part.physics.t, c[table.part]) > NEAR_END
            own.append(curve.widened() if near else curve)
        found.append(tuple(own))
    return found


def _curves(part: Part) -> list[KanCurve]:
    return [curve for curve in part.approximators if isinstance(curve, KanCurve)]
