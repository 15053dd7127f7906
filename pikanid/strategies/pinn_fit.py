"""How a PINN is fitted: networks, Eq. (2), one of two optimisers, covariance, complaints.

torch is imported in the functions here, on the first fit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.noise.level import difference_noise
from pikanid.objective.functional import Functional
from pikanid.optimise.gauss_newton import Point
from pikanid.problem.chains import find_chains
from pikanid.problem.problem import Problem
from pikanid.simulation.lowering import lower_model
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.pinn_check import against_simulation
from pikanid.strategies.pinn_settings import PinnSettings, uses_newton
from pikanid.strategies.relaxation import start_is_estimated

if TYPE_CHECKING:
    from pikanid.optimise.gradient_functional import TorchFunctional
    from pikanid.strategies.pinn_networks import Architecture, Networks

# Table II: Adam 5000 with λ 0 → 0.1, L-BFGS 500 at λ = 1, 501 collocation points; λ doubled for
# the sparse scenario, read as fewer than half as many samples as collocation points.  What it does
# not name is chosen here: units, learning rate, and the units of the physics residual.
PAPER_RAMP, PAPER_LAMBDA = 0.1, 1.0  # definition: of Table II
PAPER_STEPS = (5000, 500)  # definition: of Table II
PAPER_COLLOCATION = 501  # definition: of Table II
PAPER_HIDDEN = (64, 16)  # definition: chosen, as Table II names none
PAPER_SPREAD = 1.25  # definition: chosen, as Table II names none

GRADIENT_STEPS = (3000, 3000)  # limit: of Adam and L-BFGS, unless told
GRADIENT_LAMBDA = 100.0  # numerical: of a descent whose λ is not told
NEWTON_STEPS = 400  # limit: of Gauss-Newton, unless told
CLEAN = 1e-5  # numerical: noise of clean data, relative to the signal
LARGEST_STD = 1e3  # numerical: relative: beyond, a standard error says that there is none


@dataclass(frozen=True, eq=False)
class PinnFit:
    """What a PINN found; the parts of the loss are sums over samples and nodes.

    `excess` is that of `pinn_check.Verdict`.
    """

    problem: Problem
    functional: Functional = field(repr=False)
    theta: Array
    covariance: Array
    coefficients: tuple[Array, ...] = field(repr=False)
    converged: bool
    warnings: tuple[str, ...]
    history: tuple[dict[str, float], ...] = field(repr=False)
    settings: Mapping[str, Any]
    excess: float


@dataclass(frozen=True, eq=False)
class _Stop:
    """Where an optimiser stopped."""

    z: Array
    lam: float
    converged: bool
    notes: tuple[str, ...]
    history: tuple[dict[str, float], ...]
    settings: Mapping[str, Any]


def fit_network(problem: Problem, settings: PinnSettings) -> tuple[PinnFit, Any]:
    """A PINN of a model bound to recordings, and its curves.

    Raises:
        BadSetting: See `PINN.fit`.
    """
    _need_torch(settings.device)
    from pikanid.optimise.gradient import one_thread
    from pikanid.optimise.gradient_functional import TorchFunctional
    from pikanid.strategies.pinn_networks import NetworkTrajectories, functional_of, make_networks

    paper = settings.protocol == "paper"
    vector_field, chains = VectorField(problem.model), find_chains(problem.model, settings.form)
    plan = _architecture(problem, settings)
    networks = make_networks(problem, vector_field, chains, plan)
    functional = functional_of(problem, vector_field, chains, networks, plan, weighted=not paper)
    noise = _noise(functional)
    functional = functional.with_scale(_scale(functional, networks, None if paper else noise))
    with one_thread():
        loss = TorchFunctional(functional, settings.device)
        start = loss.pack(Point(networks.start(settings.seed), problem.guess))
        stop = (_newton if uses_newton(settings) else _descend)(loss, start, settings, noise)
        covariance, more = _uncertainty(loss, stop, noise)
    point = loss.unpack(stop.z)
    notes = [*networks.notes, *stop.notes]
    if lower_model(problem.model).switches:
        notes.append(errors.relaxation_smears())
    if not np.all(np.isfinite(np.diag(covariance))):
        notes.append(errors.covariance_unknown())
    residual = np.concatenate([
        (rows.residual / sites.weight).ravel() for r, c in enumerate(point.coefficients)
        for rows, sites in zip(functional.data_rows(r, c, point.theta), functional.parts[r].data,
                               strict=True)])
    verdict = against_simulation(problem, point.theta, float(np.sqrt(np.mean(residual**2))),
                                 settings.settings.far)
    notes += verdict.notes
    coefficients = tuple(
        tuple(c[table.part] for table in part.physics.tops)
        for part, c in zip(functional.parts, point.coefficients, strict=True))
    curves = NetworkTrajectories(problem.model.state_names, chains, networks.nets, coefficients)
    used = {"hidden": list(networks.nets[0][0].hidden), "hard_initial": plan.anchored,
            "kinks": [len(own[0].kinks) for own in networks.nets],
            "nodes": [part.physics.t.size for part in functional.parts],
            "physics_scale": [float(s) for s in functional.scale], "lam": float(stop.lam),
            "seed": settings.seed, **stop.settings, **more}
    return PinnFit(problem, functional, point.theta, covariance, point.coefficients,
                   stop.converged, tuple(notes), stop.history, used, verdict.excess), curves


def _newton(loss: TorchFunctional, start: Array, settings: PinnSettings, noise: float) -> _Stop:
    """λ climbing, damped Gauss-Newton steps on all unknowns."""
    from pikanid.strategies.pinn_newton import climb

    steps = NEWTON_STEPS if settings.steps is None else settings.steps
    assert isinstance(steps, int)
    found = climb(loss, start, noise=noise, known=_known(loss.functional), lam=settings.lam,
                  iterations=steps, progress=settings.progress, settings=settings.settings)
    notes = () if found.converged else (errors.newton_stopped(found.iterations, found.move),)
    return _Stop(found.z, found.lam, found.converged, notes, found.history,
                 {"optimiser": "gauss_newton", "steps": found.iterations})


def _descend(loss: TorchFunctional, start: Array, settings: PinnSettings, noise: float) -> _Stop:
    """Adam with λ rising from 0 or balanced, then L-BFGS at the final λ."""
    from pikanid.optimise.gradient import GradNorm, Ramp, Weight, adam, lbfgs

    paper = settings.protocol == "paper"
    steps = settings.steps or (PAPER_STEPS if paper else GRADIENT_STEPS)
    assert isinstance(steps, tuple)
    final = settings.lam or (PAPER_LAMBDA if paper else GRADIENT_LAMBDA)
    sparse = min(s.t.size for e in loss.functional.problem.experiments for s in e.samples) < (
        PAPER_COLLOCATION / 2)
    if paper and settings.lam is None and sparse:
        final *= 2.0
    top = final * PAPER_RAMP / PAPER_LAMBDA if paper else final
    lower, upper = loss.bounds()
    balanced = settings.balance == "gradnorm"
    weight: Weight = GradNorm() if balanced else Ramp(0.0, top, steps[0])
    first = adam(loss, start, steps=steps[0], weight=weight, goal=None if balanced else top,
                 rate=settings.learning_rate, lower=lower, upper=upper, device=settings.device,
                 progress=settings.progress)
    final = first.lam if balanced else final
    second = lbfgs(loss, first.z, steps=steps[1], lam=final, lower=lower, upper=upper,
                   device=settings.device, progress=settings.progress)
    notes = []
    if first.diverged or second.diverged:
        notes.append(errors.descent_diverged(first.steps if first.diverged else second.steps))
    if not second.finished:
        notes.append(errors.lbfgs_stopped(second.steps, second.gradient))
    z = first.z if second.diverged else second.z
    return _Stop(z, final, second.finished, tuple(notes), (*first.history, *second.history),
                 {"optimiser": "gradient", "steps": [first.steps, second.steps],
                  "gradient_norm": second.gradient, "adam_lam": top})


def _uncertainty(loss: TorchFunctional, stop: _Stop, noise: float) -> tuple[Array, dict[str, Any]]:
    """Sandwich covariance of θ, NaN where it is not known, and the parts of the loss."""
    from pikanid.strategies.pinn_newton import covariance

    functional, problem = loss.functional, loss.functional.problem
    residual, jacobian = loss.linearised(stop.z, stop.lam)
    rows = loss.data_rows()
    data, physics = float(np.sum(residual[rows] ** 2)), float(np.sum(residual[~rows] ** 2))
    count = functional.n_data
    _, effective = covariance(loss, jacobian, rows, np.ones(count))
    left = max(count - effective - problem.guess.size, 0.1 * count)
    spread = np.full(count, 1.0 if _known(functional) else np.sqrt(data / left))
    found, _ = covariance(loss, jacobian, rows, spread)
    theta = loss.unpack(stop.z).theta
    std = np.sqrt(np.abs(np.diag(found)))
    unknown = ~(np.isfinite(std) & (std <= LARGEST_STD * np.maximum(np.abs(theta), 1e-300)))
    found[unknown] = found[:, unknown] = np.nan
    return found, {"data_cost": data, "physics_cost": physics, "effective_parameters": effective,
                   "noise": noise}


def _architecture(problem: Problem, settings: PinnSettings) -> Architecture:
    from pikanid.strategies.pinn_networks import Architecture

    paper = settings.protocol == "paper"
    anchored = not paper if settings.hard_initial is None else settings.hard_initial
    exact = not paper if settings.exact_switches is None else settings.exact_switches
    return Architecture(
        settings.hidden or (PAPER_HIDDEN if paper else None), PAPER_SPREAD if paper else 1.0,
        anchored or start_is_estimated(problem), exact,
        settings.collocation or (PAPER_COLLOCATION if paper else None), settings.device)


def _known(functional: Functional) -> bool:
    """Whether the data rows are in units of a σ that was given."""
    return functional.weighted and all(
        s.sigma is not None for e in functional.problem.experiments for s in e.samples)


def _noise(functional: Functional) -> float:
    """Standard deviation of the data rows: 1 where σ is known, else the visible noise."""
    pairs = [(samples, sites) for e, part in zip(
        functional.problem.experiments, functional.parts, strict=True)
        for samples, sites in zip(e.samples, part.data, strict=True)]
    squares, count = 0.0, 0
    for samples, sites in pairs:
        weight = float(np.sqrt(np.mean(sites.weight**2)))
        if samples.sigma is not None:
            level = weight * float(np.sqrt(np.mean(samples.sigma**2)))
        else:
            level = weight * max(difference_noise(samples.y, samples.t),
                                 CLEAN * float(np.ptp(samples.y)))
        squares, count = squares + samples.t.size * level**2, count + samples.t.size
    return float(np.sqrt(squares / max(count, 1))) or 1.0


def _scale(functional: Functional, networks: Networks, noise: float | None) -> Array:
    """Scale (E,) of the physics residual.

    With the noise: s·√(T/N)/σ, at which λ is dimensionless, s = size·ωᵐ the size of an m-th
    derivative.  Without: ωᵐ, at which the residual has the unit of the state.
    """
    rate = float(np.max(networks.rates))
    orders = np.array(functional.chains.lengths)
    if noise is None:
        return rate**orders
    size = np.max([[net.scale for net in own] for own in networks.nets], axis=0)
    total = sum(float(np.sum(part.physics.weight[:, 0] ** 2)) for part in functional.parts)
    return size * rate**orders * np.sqrt(total / functional.n_data) / noise


def _need_torch(device: str) -> None:
    try:
        import pikanid.optimise.gradient as descent
    except ImportError as missing:
        module = missing.name or "torch"
        raise errors.BadSetting(errors.not_installed("A PINN", module, "kan")) from missing
    if not descent.present(device):
        raise errors.BadSetting(errors.no_such_device(device))
