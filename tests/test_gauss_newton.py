"""Banded-plus-border algebra against dense least squares."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from relaxing import TRUTH, collocated, guessed, random_point, slosh
from scipy.optimize import lsq_linear

import pikanid as pk
from pikanid.objective.functional import Functional
from pikanid.optimise.box import box_minimum
from pikanid.optimise.covariance import (
    _trace_of_quotient,
    effective_parameters,
    error_bound,
    invert,
    respond,
    theta_covariance,
)
from pikanid.optimise.gauss_newton import BandedSystem, Point, gauss_newton
from pikanid.optimise.schedules import Continuation, Fixed, Stage
from pikanid.optimise.small_matrices import inverse_diagonal
from pikanid.optimise.smoothing import multiply, smooth

LAM = 1.7
WIDE = np.full(9, 1e9)


def dense(functional: Functional, point: Point, lam: float = LAM
          ) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian by [free coefficients, θ], held ones eliminated, and the residual."""
    jacobian = functional.jacobian(point.coefficients, point.theta, lam).toarray()
    count = sum(c.size for c in point.coefficients)
    theta, kept, first = jacobian[:, count:].copy(), [], 0
    for r, part in enumerate(functional.parts):
        held = first + part.held
        slopes = functional.hold_jacobian(r, point.theta)
        if slopes is not None:
            theta[:, functional.problem.columns(r)[1]] += jacobian[:, held] @ slopes
        inside = np.arange(first, first + part.n_coefficients)
        kept.append(np.setdiff1d(inside, held))
        first += part.n_coefficients
    return (np.column_stack([jacobian[:, np.concatenate(kept)], theta]),
            functional.residual(point.coefficients, point.theta, lam))


MODELS = {
    "plain": guessed(),
    "free start": guessed().with_initial(theta="free", theta_dot="free"),
    "per recording": guessed().per_recording("d_theta").with_initial(theta="free"),
    "gain": guessed().map_output("theta", parameters=[pk.Parameter("gain", 1.1)], gain="gain"),
}


@pytest.mark.parametrize("form", ["second_order", "state"])
@pytest.mark.parametrize("name", MODELS)
def test_step_is_the_dense_least_squares_step(name: str, form: str) -> None:
    functional = collocated(MODELS[name], [slosh(0.1, s, stride=4) for s in range(2)], form, 10)
    point = random_point(functional)
    system = BandedSystem(functional)
    at = system.linearise(point, LAM)
    size = point.theta.size
    step = system.step(at, -WIDE[:size], WIDE[:size])
    jacobian, residual = dense(functional, point)
    wanted = np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
    got = np.concatenate([
        *(np.delete(c, part.held) for c, part in zip(
            step.coefficients, functional.parts, strict=True)), step.theta])
    assert np.abs(got - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert at.cost == pytest.approx(residual @ residual)
    after = residual + jacobian @ wanted
    assert step.promised == pytest.approx(residual @ residual - after @ after)
    # θ block of (JᵀJ)⁻¹
    inverse = np.linalg.inv(jacobian.T @ jacobian)[-size:, -size:]
    assert np.allclose(np.linalg.inv(step.schur), inverse, rtol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_sandwich_and_effective_parameters(name: str) -> None:
    functional = collocated(MODELS[name], slosh(0.1, stride=4), intervals=10)
    point = random_point(functional)
    system = BandedSystem(functional)
    at = system.linearise(point, LAM)
    size = point.theta.size
    step = system.step(at, -WIDE[:size], WIDE[:size])
    jacobian, _ = dense(functional, point)
    data = jacobian[:functional.n_data]
    bread = np.linalg.inv(jacobian.T @ jacobian)
    noise = 0.5 + np.arange(functional.n_data) / functional.n_data
    wanted = (bread @ (data.T * noise**2) @ data @ bread)[-size:, -size:]
    response = respond(system, at, step)
    sandwich, naive = theta_covariance(system, at, step, [noise])
    for again, once in zip(theta_covariance(system, at, step, [noise], response),
                           (sandwich, naive), strict=True):
        assert np.array_equal(again, once)
    assert np.allclose(sandwich, wanted, rtol=1e-5, atol=1e-9 * np.abs(wanted).max())
    assert np.allclose(naive, bread[-size:, -size:] * np.mean(noise**2), rtol=1e-5)
    bound = error_bound(system, at, step, [noise])
    assert np.all(bound >= np.sqrt(np.diag(sandwich))) and np.all(np.isfinite(bound))
    used = effective_parameters(system, at, step, respond(system, at, step).data)
    assert used == pytest.approx(np.trace(data @ bread @ data.T), rel=1e-6)


def test_covariance_grows_as_the_variance_of_the_noise() -> None:
    """A hundred million times the variance and as much less physics: the same point, less sure."""
    sharp = slosh(0.1, stride=4)
    blunt = sharp.with_sigma(theta=1e4 * float(sharp["theta"].sigma))
    found = []
    for recording, lam in ((sharp, LAM), (blunt, 1e-8 * LAM)):
        functional = collocated(guessed(), recording, intervals=10)
        system = BandedSystem(functional)
        at = system.linearise(random_point(functional), lam)
        step = system.step(at, -WIDE[:2], WIDE[:2])
        found.append(theta_covariance(system, at, step, [1.0]))
    assert np.diag(step.schur).min() < 1.0  # little is known, yet something
    for less, more in zip(*found, strict=True):
        assert np.allclose(more, 1e8 * less, rtol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_reduced_matrix_at_a_large_lambda(name: str) -> None:
    """What the normal equations leave of it has lost its digits; an orthogonal reduction keeps."""
    lam = 1e12
    functional = collocated(MODELS[name], slosh(0.1, stride=4), intervals=40)
    system = BandedSystem(functional)
    point = Point((functional.resting(0, functional.problem.guess),), functional.problem.guess)
    size = point.theta.size
    found = gauss_newton(system, point, lam, -WIDE[:size], WIDE[:size])
    jacobian, _ = dense(functional, found.at.point, lam)
    triangle = np.linalg.qr(jacobian / np.linalg.norm(jacobian, axis=0), mode="r")
    corner = triangle[-size:, -size:] * np.linalg.norm(jacobian[:, -size:], axis=0)
    wanted = np.sqrt(np.diag(np.linalg.inv(corner.T @ corner)))
    reduced = respond(system, found.at, found.step).reduced
    got, naive = (np.sqrt(np.diag(np.linalg.inv(m))) for m in (reduced, found.step.schur))
    assert np.abs(got / wanted - 1).max() < 1e-7
    assert np.abs(naive / wanted - 1).max() > 1e-7


def test_minimum_and_bounds() -> None:
    functional = collocated(guessed(), slosh(0.1, stride=4), intervals=40)
    system = BandedSystem(functional)
    start = Point((functional.resting(0, functional.problem.guess),), functional.problem.guess)
    lower, upper = functional.problem.lower, functional.problem.upper
    free = gauss_newton(system, start, LAM, lower, upper)
    assert free.converged
    jacobian, residual = dense(functional, free.at.point)
    gradient = jacobian.T @ residual / np.linalg.norm(jacobian, axis=0)
    assert np.abs(gradient).max() < 1e-3 * np.linalg.norm(residual)
    held = gauss_newton(system, start, LAM, np.array([0.05, 0.0]), upper)
    assert held.at.point.theta[0] == pytest.approx(0.05) and held.converged
    assert held.at.cost > free.at.cost
    fixed = gauss_newton(system, start, LAM, start.theta, start.theta)
    assert np.array_equal(fixed.at.point.theta, start.theta)


@given(size=st.integers(1, 6), seed=st.integers(0, 200))
def test_box_minimum_agrees_with_scipy(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(size + 3, size))
    target = rng.normal(size=size + 3)
    lower, upper = -rng.uniform(0.0, 0.5, size), rng.uniform(0.01, 0.5, size)
    wanted = lsq_linear(root, target, (lower, upper), method="bvls", tol=1e-14).x
    found = box_minimum(root.T @ root, -root.T @ target, lower, upper)
    assert np.allclose(found, wanted, atol=1e-8)


def test_box_minimum_refuses_a_saddle() -> None:
    """What bounds hold does not count, what becomes free does."""
    saddle = np.array([[1.0, 2.0], [2.0, 1.0]])
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        box_minimum(saddle, np.array([-1.0, -1.0]), -np.ones(2), np.ones(2))
    held = box_minimum(saddle, np.array([-1.0, 0.0]), np.array([-2.0, 0.5]), np.array([2.0, 0.5]))
    np.testing.assert_allclose(held, [0.0, 0.5], atol=1e-15)


def test_band_is_as_narrow_as_the_splines() -> None:
    for intervals in (20, 200):
        rec = pk.simulate(pk.systems.sloshing_2d(), pk.excitation.two_pulse(), sigma=1e-3, seed=0)
        functional = collocated(pk.systems.sloshing_2d(), rec, intervals=intervals)
        assert BandedSystem(functional).assemblers[0].bandwidth <= 2 * 6


def test_smoothing_removes_noise() -> None:
    functional = collocated(guessed(), slosh(1.0), intervals=80)
    system = BandedSystem(functional.smoothing())
    flat = Point((functional.resting(0, functional.problem.guess),), functional.problem.guess)
    found = smooth(system, flat)
    assert found is not None
    assert found.sigma == pytest.approx(1.0, abs=0.15)
    curve = functional.parts[0].data[0].states[0].values(found.point.coefficients[0])
    error = curve - slosh()["theta"].values
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.pi / 180


def test_parameter_without_influence_stays() -> None:
    matrix = np.array([[2.0, 0.0], [0.0, 0.0]])
    found = box_minimum(matrix, np.array([-1.0, 0.0]), -np.ones(2), np.ones(2))
    assert np.allclose(found, [0.5, 0.0])
    # nor do all of them move, where none has any
    found = box_minimum(0.0 * matrix, np.zeros(2), -np.ones(2), np.ones(2))
    np.testing.assert_array_equal(found, [0.0, 0.0])


def test_multiply_and_invert() -> None:
    rng = np.random.default_rng(0)
    full = np.diag(rng.normal(size=8)) + np.diag(rng.normal(size=7), -1)
    full = full + full.T
    band = np.array([np.diag(full), np.append(np.diag(full, -1), 0.0)])
    x = rng.normal(size=(8, 3))
    assert np.allclose(multiply(band, x), full @ x)
    out = invert(np.diag([2.0, 4.0, 0.0]), np.array([True, False, True]))
    assert np.allclose(out, np.diag([0.5, 0.0, 0.0]))
    root, diagonal = rng.normal(size=(4, 4)), np.empty(4)
    square = root.T @ root
    inverse_diagonal(square, np.array([True, True, False, True]), diagonal)
    kept = np.ix_([0, 1, 3], [0, 1, 3])
    assert np.allclose(diagonal[[0, 1, 3]], np.diag(np.linalg.inv(square[kept])))
    assert diagonal[2] == 0.0
    inverse_diagonal(-square, np.array([True, True, False, True]), diagonal)
    assert np.array_equal(diagonal, [np.inf, np.inf, 0.0, np.inf])


def stage(lam: float, value: float, data: float, physics: float, converged: bool = True) -> Stage:
    return Stage(lam, np.array([value]), np.array([0.1]), data, physics, 1, converged)


def test_continuation_settles() -> None:
    plan = Continuation(100.0)
    past = [stage(1.0, 1.0, 80, 1), stage(1e4, 1.3, 90, 2)]
    assert plan.next([]) == 1.0
    assert plan.next(past) == pytest.approx(1e8)
    assert plan.next([past[0], replace(past[1], iterations=30)]) == pytest.approx(1e6)
    past.append(stage(1e8, 1.301, 95, 0.1))  # a twentieth of the bias: a 19th of 0.01 is left
    assert plan.next(past) is None and plan.keep(past) == 2
    past[-1] = stage(1e8, 1.304, 95, 0.1)
    assert plan.next(past) == pytest.approx(1e10)
    past[-1] = stage(1e8, 1.304, 95, 0.02)
    assert plan.next(past) is None
    past[-1] = stage(1e8, 1.3, 95, 2.1)
    assert plan.next(past) == pytest.approx(1e10)
    past[-1] = stage(1e8, 1.4, 95, 0.1, converged=False)
    assert plan.next(past) is None and plan.keep(past) == 1


def test_continuation_steps_back_from_a_lock() -> None:
    plan = Continuation(100.0, lockable=True, factor=10.0)
    past = [stage(1.0, 1.0, 80, 1), stage(10.0, 1.3, 90, 9.9)]
    assert plan.next(past) is None and plan.keep(past) == 0
    following_noise = [stage(1.0, 1.0, 1, 1), stage(10.0, 1.3, 10, 9.9)]
    assert plan.next(following_noise) == pytest.approx(100.0)
    broken = [stage(1.0, 1.0, 90, 5), stage(10.0, 9.0, 400, 4)]
    assert plan.next(broken) is None and plan.keep(broken) == 0
    assert Continuation(100.0).next(broken) == pytest.approx(1e5)
    assert Fixed(1e-4).next(past) is None and Fixed(1e-4).keep(past[:1]) == 0


def test_hard_limit_is_least_squares_on_the_model() -> None:
    functional = collocated(guessed(*TRUTH), slosh(0.1), intervals=60)
    system = BandedSystem(functional)
    start = Point((functional.resting(0, TRUTH),), TRUTH)
    problem = functional.problem
    found = gauss_newton(system, start, 1e8, problem.lower, problem.upper)
    nls = pk.NLS().fit(guessed(), slosh(0.1))
    std = np.sqrt(np.diag(nls.covariance))
    assert np.all(np.abs(found.at.point.theta - nls.theta) < 0.05 * std)


def test_iterations_that_run_out_are_no_convergence() -> None:
    system = BandedSystem(collocated(guessed(), slosh(0.1)))
    start, bounds = random_point(system.functional), (system.lower, system.upper)
    for count in (1, 2):
        found = gauss_newton(system, start, 1.0, *bounds, iterations=count)
        assert (found.iterations, found.converged) == (count, False)
    assert gauss_newton(system, start, 1.0, *bounds).converged


def test_trace_of_a_quotient_of_bands_that_are_hardly_definite() -> None:
    """Closed forms; a pivot that is zero is lifted by rounding, a negative one is refused."""
    share = np.array([[1.0, 3.0, 0.0], [0.0, 0.0, 0.0]])
    band = np.array([[2.0, 4.0, 5.0], [0.0, 0.0, 0.0]])
    assert _trace_of_quotient(share, band) == pytest.approx(1 / 2 + 3 / 4)
    ones = np.array([[1.0, 1.0], [1.0, 0.0]])
    assert _trace_of_quotient(ones, ones) == pytest.approx(1.0, abs=0.01)
    band[0, 2] = -1.0
    with pytest.raises(np.linalg.LinAlgError):
        _trace_of_quotient(share, band)


@pytest.mark.parametrize(("promised", "converged"), [(0.005, True), (0.02, False)])
def test_a_stop_without_decrease_counts_where_little_is_promised(promised: float, converged: bool
                                                                 ) -> None:
    """Of a hundredth of one datum's share of the cost, here 100/100."""
    def linearise(at: object, lam: float) -> object:
        return SimpleNamespace(cost=100.0, point=None, lam=lam)

    stuck = SimpleNamespace(
        functional=SimpleNamespace(n_data=100, data_square=0.0), linearise=linearise,
        moved=lambda point, step: point, step=lambda *_: SimpleNamespace(promised=promised))
    free = np.full(2, np.inf)
    found = gauss_newton(cast(BandedSystem, stuck), cast(Point, None), 1.0, -free, free)
    assert (found.iterations, found.converged) == (0, converged)
