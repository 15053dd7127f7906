"""`kan_discrepancy`: which law is missing in an equation, as a KAN inside the ODE."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.discrepancy.bands import Posterior, holm, likelihood, wald
from pikanid.discrepancy.edge import Edge
from pikanid.discrepancy.edges import OFFSET, plan_edges
from pikanid.discrepancy.functional import relaxed_level
from pikanid.discrepancy.gauge import Gauge, fix_gauges
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.levels import search
from pikanid.discrepancy.mixture import View, mixed_edge, mixed_plans, views
from pikanid.discrepancy.result import Discrepancy
from pikanid.discrepancy.settings import USUAL, DiscrepancySettings
from pikanid.estimate import Estimate
from pikanid.estimate.estimate import total_cost
from pikanid.model import Input, Model, Parameter, State
from pikanid.objective.adequacy import judge
from pikanid.problem.arguments import a_model
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.settings import changed, of_kind
from pikanid.storage.version import __version__
from pikanid.strategies.finish import bounds_met, evaluate
from pikanid.strategies.nls import NLS

POINTS = 401  # layout: points at which an edge is drawn


def kan_discrepancy(model: Model, recordings: Recording | Sequence[Recording], equation: str,
                    arguments: Sequence[str], *,
                    nominal: Estimate | None = None,
                    method: Literal["shooting", "functional"] = "shooting",
                    grid: Sequence[int] = (10, 20, 40), steps: bool = True, adaptive: bool = True,
                    alpha: float = 0.01,
                    settings: DiscrepancySettings = USUAL) -> Discrepancy:
    """Fit an additive KAN δ(a_1) + δ(a_2) + ... inside one equation, together with the parameters.

    Every edge is a cubic B-spline with a smoothness prior whose weight maximises the evidence
    (marginal likelihood); starting from least squares of the nominal model, all coefficients and
    parameters are fitted by shooting with exact sensitivities.  Edges are reported gauge-fixed: as
    what the free parameters cannot do already.

    Args:
        model: The nominal model.
        recordings: One or several, fitted jointly.
        equation: The state whose equation gets the edges, as "theta_dot".
        arguments: Formulas of states, inputs, parameters and t, one an edge: "theta",
            "theta*theta_dot".
        nominal: The NLS estimate of the nominal model from these recordings, where it is known
            already.
        method: "shooting", or "functional" for the relaxation of Eq. (2) on the coarsest grid,
            without steps.
        grid: Intervals of the edges' grids, refined one after the other until the evidence no
            longer rises.
        steps: Whether an edge may jump where its argument changes sign (dry friction), if the data
            strongly ask for that.
        adaptive: Whether smoothness may vary along an edge, if the data strongly ask for that.
        alpha: Probability that any edge is called significant where none is there.
        settings: Priors, what counts as evidence, budgets.

    Raises:
        BadModel: Unknown equation, or an argument in other than the model's names.
        BadSetting: No argument, one given twice or one that does not move; a bad option.
        BadRecording: A channel is missing or unusable.
        SimulationFailed: The model cannot be simulated.

    >>> import pikanid as pk
    >>> truth = pk.systems.sloshing().with_term(
    ...     "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 100.0, "1/(s^2*rad^2)")])
    >>> moves = pk.excitation.planar_moves(6, 10.0)
    >>> rec = pk.simulate(truth, moves, sigma=0.1*np.pi/180, seed=0)
    >>> found = kan_discrepancy(pk.systems.sloshing(), rec, "theta_dot", ["theta", "theta_dot"],
    ...                         grid=[10])
    >>> [edge.argument for edge in found.significant]
    ['theta']
    """
    begun = time.perf_counter()
    a_model(model).state(equation)
    if not grid or any(not isinstance(g, int | np.integer) or g < 4 for g in grid) or list(
            grid) != sorted(set(grid)):
        raise errors.BadSetting(errors.bad_value("grid", grid, "rising numbers from 4 on"))
    if not 0 < alpha < 1:
        raise errors.BadSetting(errors.bad_value("alpha", alpha, "between 0 and 1"))
    of_kind(settings, DiscrepancySettings)
    if method not in ("shooting", "functional"):
        raise errors.BadSetting(errors.bad_value("method", method, "'shooting' or 'functional'"))
    plans = plan_edges(model, arguments, grid[0])
    nominal = nominal or NLS().fit(model, recordings)
    problem = Problem(nominal.fitted_model, recordings)
    if method == "functional":
        level = relaxed_level(nominal, problem, equation, plans, grid[0], settings)
    else:
        level = search(nominal, problem, equation, plans, grid, steps, adaptive, settings)
    return _result(level, nominal, equation, alpha, steps and method == "shooting", method, begun)


def _result(level: Level, nominal: Estimate, equation: str, alpha: float, steps: bool,
            method: str, begun: float) -> Discrepancy:
    seen = views(level, equation, steps)
    known, settings = seen[0].known, level.fit.smoothness.settings
    gauges = fix_gauges(level.plans, level.visited, settings)
    freedom = [max(float(known.freedom[at].sum()) - g.removed.shape[1], 0.0)
               for g, at in zip(gauges, level.places, strict=True)]
    tests = [wald(level.fit, [k], gauges, freedom) for k in range(len(gauges))]
    verdicts = holm([p for p, _ in tests], alpha)
    shown = fix_gauges(mixed_plans(seen), level.visited, settings)
    edges = tuple(
        _edge(seen, k, gauge, level.problem.model, tests[k], verdicts[k], freedom[k])
        for k, gauge in enumerate(shown))
    estimate = _estimate(level, known.covariance, method, begun)
    together = wald(level.fit, range(len(gauges)), gauges, freedom)[0]
    return Discrepancy(estimate.fitted_model, estimate, nominal, equation, edges,
                       _offset(level, known), together, alpha, level.fit.evidence, settings)


def _edge(seen: Sequence[View], k: int, gauge: Gauge, model: Model, test: tuple[float, int],
          significant: bool, freedom: float) -> Edge:
    plan = gauge.plan
    mean, spread = mixed_edge(seen, k, plan.step)
    c, V = gauge.projection @ mean, gauge.projection @ spread @ gauge.projection.T
    a = np.linspace(gauge.a.min(), gauge.a.max(), POINTS)
    basis = plan.basis(a)
    std = np.sqrt(np.maximum(np.einsum("mi,ij,mj->m", basis, V, basis), 0.0))
    jumps = float(sum(v.weight for v in seen if v.plans[k].step))
    same = max((v for v in seen if v.plans[k].step == plan.step), key=lambda v: v.weight)
    named: list[State | Input | Parameter] = [*model.states, *model.inputs, *model.parameters]
    units = {q.name: q.unit for q in named}
    return Edge(plan.argument, units.get(plan.argument, ""), plan.name,
                model.parameter(OFFSET).unit, a, basis @ c, std, c, V, *test,
                significant, jumps, freedom, gauge, *likelihood(same.fit, k),
                same.fit.smoothness.settings.draws)


def _offset(level: Level, known: Posterior) -> tuple[float, float]:
    """Offset and all edges' means over the data, with the standard deviation of their sum."""
    labels = [f.label for f in level.problem.free]
    row = np.zeros(len(labels))
    row[labels.index(OFFSET)] = 1.0
    for plan, a, at in zip(level.plans, level.visited.arguments.T, level.places, strict=True):
        row[at] = level.visited.weights @ plan.basis(a)
    inside = np.isfinite(np.diag(known.covariance))
    spread = row[inside] @ known.covariance[np.ix_(inside, inside)] @ row[inside]
    return float(row @ level.fit.theta), float(np.sqrt(spread))


def _estimate(level: Level, covariance: np.ndarray, method: str, begun: float) -> Estimate:
    fit, problem, shooting = level.fit, level.problem, level.shooting
    fits, trajectories = evaluate(problem, shooting, fit.theta)
    adequacy = judge([f.residual for f in fits], shooting.known, shooting.data,
                     round(fit.effective), times=[f.t for f in fits])
    notes = []
    if adequacy.verdict == "misfit":
        notes.append(errors.no_static_law([p.argument for p in level.plans]))
    notes += bounds_met(problem.free, fit.theta, ~np.asarray(fit.inside))
    settings = {"method": method, "intervals": level.plans[0].intervals,
                "steps": [p.name for p in level.plans if p.step],
                "log_lambda": [list(map(float, r)) for r in fit.smoothness.split(fit.rho)],
                "effective_parameters": fit.effective, "noise": fit.noise}
    if own := changed(fit.smoothness.settings):
        settings["settings"] = own
    return Estimate(
        model=problem.model, strategy=f"kan_discrepancy ({method})", free=problem.free,
        theta=np.array(fit.theta), covariance=covariance, fits=fits, trajectories=trajectories,
        cost=total_cost(fits), adequacy=adequacy, converged=fit.converged, settings=settings,
        history=fit.history, warnings=tuple(notes), seconds=time.perf_counter() - begun,
        version=__version__)
