"""Evidence, gauge, bands and tests of edges, in linear problems whose answers are known."""

from __future__ import annotations

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, chi2, multivariate_normal

from pikanid.discrepancy.bands import (
    _smoothest,
    holm,
    likelihood,
    posterior,
    simultaneous_factor,
    wald,
)
from pikanid.discrepancy.edges import EdgePlan
from pikanid.discrepancy.fit import PenalisedFit
from pikanid.discrepancy.gauge import Gauge, Visited, fix_gauges
from pikanid.discrepancy.mixture import View, mixed_edge
from pikanid.discrepancy.smoothness import ROUGHEST, EdgePrior, Smoothness

G = 8
SIGMA = 0.05


def plan(step: bool = False) -> EdgePlan:
    return EdgePlan("delta_a", "a", 0.0, 1.0, G, step)


@functools.cache
def visited() -> Visited:
    """One argument that moves over [-1, 1], and the nominal term p·a."""
    a = np.sin(np.linspace(0.0, 40.0, 400)) * np.linspace(0.3, 1.0, 400)
    return Visited(a[:, None], np.full(400, 1.0 / 400), a[:, None], 1.0)


def design(step: bool = False) -> np.ndarray:
    """Columns of θ = (p, offset, c): the data see the equation itself."""
    a = visited().arguments[:, 0]
    return np.column_stack([a, np.ones(400), plan(step).basis(a)]) / SIGMA


def smoothness(step: bool = False, pieces: int = 1) -> Smoothness:
    prior = EdgePrior(plan(step), 2 + np.arange(plan(step).size), 1.0, pieces)
    return Smoothness((prior,), np.append([1e-6, 1e-2], np.zeros(plan(step).size)))


def linear_fit(y: np.ndarray, step: bool = False, rho: np.ndarray | None = None) -> PenalisedFit:
    """The fit of y [σ] in the linear problem."""
    J, smooth = design(step), smoothness(step)
    A, b = J.T @ J, J.T @ y
    rho = smooth.choose(A, b, smooth.stiff) if rho is None else rho
    theta = np.linalg.solve(A + smooth.precision(rho), b)
    return PenalisedFit(theta, rho, A, b, np.ones(len(b), bool), 1.0, smooth, 0.0, True, ())


@pytest.mark.parametrize(("step", "pieces"), [(False, 1), (True, 1), (False, 5), (True, 5)])
def test_evidence_is_the_marginal_likelihood_of_the_data(step: bool, pieces: int) -> None:
    J, smooth = design(step)[::20], smoothness(step, pieces)
    y = np.random.default_rng(0).normal(size=len(J))

    def dense(rho: np.ndarray) -> float:
        cov = np.eye(len(y)) + J @ np.linalg.inv(smooth.precision(rho)) @ J.T
        steps = np.diff(rho[:pieces]) / 3.0
        off = (rho - 5.0) / 5.0
        prior = -0.5 * float(steps @ steps + off @ off)
        return float(multivariate_normal.logpdf(y, cov=cov)) + prior

    first = smooth.stiff - 3.0
    second = first + np.linspace(-2.0, 1.0, len(first))
    ours = [smooth.cost(J.T @ J, J.T @ y, rho)[0] for rho in (first, second)]
    # the dense covariance has entries of 1e6 beside 1
    assert ours[0] - ours[1] == pytest.approx(dense(second) - dense(first), rel=1e-6, abs=1e-6)


def test_what_all_structures_explain_alike_changes_no_evidence() -> None:
    """A parameter that answers for 1e9 of χ² leaves two smoothnesses compared as they were."""
    # precise data, of which edge and parameter share a part that only the prior divides
    J, smooth = 1e3 * design(), smoothness()
    noise = np.random.default_rng(0).normal(size=len(J))
    large = 3e4 * J[:, 0] / np.linalg.norm(J[:, 0])
    A, rhos = J.T @ J, (np.array([2.0]), np.array([6.0]))
    differences = [smooth.cost(A, J.T @ y, rhos[0])[0] - smooth.cost(A, J.T @ y, rhos[1])[0]
                   for y in (noise, noise + large)]
    assert differences[0] == pytest.approx(differences[1], abs=1e-3)


@pytest.mark.parametrize("y", ["noise", "bent"])
def test_smoothness_is_integrated_out(y: str) -> None:
    """Laplace's approximation against a quadrature over ρ with its prior N(5, 5)."""
    J, smooth = design(), smoothness()
    data = {"noise": np.random.default_rng(1).normal(size=len(J)),
            "bent": np.sin(3 * visited().arguments[:, 0]) / SIGMA}[y]
    A, b = J.T @ J, J.T @ data
    rhos = np.linspace(-20.0, 30.0, 2001)
    costs = np.array([smooth.cost(A, b, np.array([r]))[0] for r in rhos])
    density = np.exp(costs.min() - costs) / (5.0 * np.sqrt(2.0 * np.pi))
    wanted = np.log(np.sum(density) * (rhos[1] - rhos[0])) - costs.min()
    assert smooth.evidence(A, b, smooth.choose(A, b, smooth.stiff)) == pytest.approx(
        wanted, abs=0.5)


def test_gradient_of_the_evidence() -> None:
    J, smooth = design(True), smoothness(True, 5)
    y = np.sin(3 * visited().arguments[:, 0]) / SIGMA
    rho = smooth.stiff + np.arange(6.0)
    cost = functools.partial(smooth.cost, J.T @ J, J.T @ y)
    slopes = [(cost(rho + h)[0] - cost(rho - h)[0]) / 2e-3 for h in 1e-3 * np.eye(6)]
    np.testing.assert_allclose(cost(rho)[1], slopes, rtol=1e-4)


def test_curvature_of_the_evidence() -> None:
    J, smooth = design(True), smoothness(True, 3)
    A, b = J.T @ J, J.T @ np.sin(3 * visited().arguments[:, 0]) / SIGMA
    rho = smooth.choose(A, b, smooth.stiff)
    h = 0.05 * np.eye(len(rho))

    def cost(*moves: np.ndarray) -> float:
        return smooth.cost(A, b, rho + sum(moves))[0]

    wanted = [[(cost(x, y) - cost(x, -y) - cost(-x, y) + cost(-x, -y)) / 0.01 for x in h]
              for y in h]
    found = smooth.curvature(A, b, rho)
    np.testing.assert_allclose(found, wanted, atol=0.03 * np.abs(wanted).max())
    weights = [w for _, w in smooth.plausible(A, b, rho)]
    assert sum(weights) == pytest.approx(1.0, abs=0.01) and min(weights) > 0.0


def test_a_straight_edge_costs_its_size_alone() -> None:
    """A tenth of the equation's size is usual, for all of its coefficients together."""
    prior = EdgePrior(plan(), np.arange(plan().size), 2.0)
    for c in (np.ones(plan().size), np.linspace(-1.0, 1.0, plan().size)):
        cost = c @ prior.precision(np.array([3.0])) @ c
        assert cost == pytest.approx(np.mean(c**2) / 0.2**2, rel=1e-9)
    assert np.linalg.eigvalsh(prior.precision(np.array([-12.0]))).min() > 0.0


def test_what_the_data_alone_say_of_an_edge() -> None:
    """χ² of the edge's coefficients, the parameters at their best: priors of these do not count."""
    y = 0.1 * visited().arguments[:, 0] ** 3 / SIGMA + np.random.default_rng(4).normal(size=400)
    fit = linear_fit(y)
    fit = replace(fit, smoothness=replace(fit.smoothness, weak=1e4 * (fit.smoothness.weak > 0)))
    S, g = likelihood(fit, 0)
    own, edge = design()[:, :2], design()[:, 2:]

    def chi2(c: np.ndarray) -> float:
        left = y - edge @ c
        return float(np.sum((left - own @ np.linalg.lstsq(own, left, rcond=None)[0]) ** 2))

    nothing = np.zeros(plan().size)
    for c in np.random.default_rng(5).normal(size=(3, plan().size)):
        assert c @ S @ c - 2 * g @ c == pytest.approx(chi2(c) - chi2(nothing), rel=1e-6)


def test_the_posterior_does_not_depend_on_where_it_is_expanded() -> None:
    fit = linear_fit(np.random.default_rng(6).normal(size=400))
    away = 0.01 * np.random.default_rng(7).normal(size=len(fit.theta))
    moved = replace(fit, theta=fit.theta + away)
    here, there = posterior(fit), posterior(moved)
    # smoothnesses that hardly count are left out, so that weights add up to one but for 1e-4
    np.testing.assert_allclose(there.mean, here.mean, atol=1e-6)
    np.testing.assert_allclose(there.covariance, here.covariance, atol=1e-8)
    # no wider than the prior, no narrower than at a smoothness that is known
    known = np.linalg.inv(fit.information + fit.smoothness.precision(fit.rho))
    assert np.all(np.diag(here.covariance) > 0.5 * np.diag(known))
    assert np.all((here.freedom >= 0.0) & (here.freedom <= 1.0 + 1e-9))


def test_gauge_is_the_constant_and_the_nominal_term() -> None:
    (gauge,) = fix_gauges((plan(),), visited())
    a, w = visited().arguments[:, 0], visited().weights
    c = np.random.default_rng(0).normal(size=plan().size)
    fixed = plan().basis(a) @ (gauge.projection @ c)
    assert abs(w @ fixed) < 1e-12
    assert abs(w @ (fixed * a)) < 1e-3 * np.sqrt((w @ fixed**2) * (w @ a**2))
    # what the nominal term and the constant do leaves nothing behind
    np.testing.assert_allclose(gauge.fix(lambda z: 2.0 - 3.0 * z, a), 0.0, atol=1e-6)
    np.testing.assert_allclose(gauge.projection @ gauge.projection, gauge.projection, atol=1e-12)


def test_law_and_edge_go_through_the_same_gauge() -> None:
    (gauge,) = fix_gauges((plan(True),), visited())
    a = np.linspace(-0.9, 0.9, 50)
    z = np.linspace(-1.0, 1.0, 500)
    c = np.linalg.lstsq(plan(True).basis(z), z**3 + 0.2 * np.sign(z), rcond=None)[0]
    np.testing.assert_allclose(gauge.fix(lambda q: q**3 + 0.2 * np.sign(q), a),
                               plan(True).basis(a) @ gauge.projection @ c, atol=1e-9)


def covered(by_evidence: bool, draws: int) -> np.ndarray:
    """Share of the range inside the 95 % band, for laws drawn from the prior of smoothness 2."""
    (gauge,) = fix_gauges((plan(),), visited())
    smooth, rng = smoothness(), np.random.default_rng(1)
    root = np.linalg.cholesky(np.linalg.inv(smooth.priors[0].precision(np.array([2.0]))))
    basis = plan().basis(np.linspace(-1.0, 1.0, 101)) @ gauge.projection
    share = []
    for _ in range(draws):
        theta = np.concatenate([rng.normal(size=2), root @ rng.normal(size=plan().size)])
        fit = linear_fit(design() @ theta + rng.normal(size=400),
                         rho=None if by_evidence else np.array([2.0]))
        known = posterior(fit)
        std = np.sqrt(np.einsum("mi,ij,mj->m", basis, known.covariance[2:, 2:], basis))
        share.append(np.mean(np.abs(basis @ (known.mean - theta)[2:]) <= 1.959964 * std))
    return np.array(share)


@pytest.mark.parametrize("by_evidence", [False, True])
@pytest.mark.slow
def test_bands_cover_as_often_as_they_say(by_evidence: bool) -> None:
    share = covered(by_evidence, 100)
    assert 0.95 - 3 * share.std() / 100**0.5 <= share.mean() <= 0.985


def test_false_alarms_of_the_test_are_as_stated() -> None:
    gauges = fix_gauges((plan(),), visited())
    rng, p = np.random.default_rng(2), []
    for _ in range(150):
        fit = linear_fit(design() @ np.append([0.7, -0.2], np.zeros(plan().size))
                         + rng.normal(size=400))
        p.append(wald(fit, [0], gauges, [3.0])[0])
    alarms = int(np.sum(np.array(p) < 0.05))
    assert binom.ppf(0.001, 150, 0.02) <= alarms <= binom.ppf(0.999, 150, 0.05)


def test_a_missing_law_is_found_and_a_nominal_one_is_not() -> None:
    gauges = fix_gauges((plan(),), visited())
    a, noise = visited().arguments[:, 0], np.random.default_rng(3).normal(size=400)
    assert wald(linear_fit(0.1 * a**3 / SIGMA + noise), [0], gauges, [3.0])[0] < 1e-4
    assert wald(linear_fit(10.0 * a / SIGMA + noise), [0], gauges, [3.0])[0] > 0.01


def test_simultaneous_band_of_independent_values() -> None:
    # of n independent normals all lie within q with probability (2Φ(q) - 1)^n
    q = simultaneous_factor(np.eye(20), np.diag(np.linspace(1.0, 3.0, 20)))
    assert q == pytest.approx(3.016, abs=0.08)  # quantile of 2000 draws


def test_mixture_has_the_moments_of_its_parts() -> None:
    a, noise = visited().arguments[:, 0], np.random.default_rng(4).normal(size=400)
    y = 0.02 * np.sign(a) / SIGMA + noise
    fits = [linear_fit(y), linear_fit(y, step=True)]
    seen = [View(w, (plan(s),), f, posterior(f))
            for w, s, f in zip((0.3, 0.7), (False, True), fits, strict=True)]
    mean, spread = mixed_edge(seen, 0, True)
    rng, parts = np.random.default_rng(5), []
    for view in seen:
        c, V = view.known.mean[2:], view.known.covariance[2:, 2:]
        drawn = rng.multivariate_normal(c, V, int(1e5 * view.weight))
        parts.append(np.pad(drawn, ((0, 0), (0, len(mean) - len(c)))))
    draws = np.vstack(parts)
    std = np.sqrt(np.diag(spread))
    np.testing.assert_allclose(draws.mean(axis=0), mean, atol=0.02 * std.max())
    np.testing.assert_allclose(draws.std(axis=0), std, rtol=0.03)


def test_smoothness_is_carried_to_another_structure() -> None:
    old, new = smoothness(), smoothness(True, 5)
    np.testing.assert_allclose(old.carry(np.array([3.0]), new), [3.0] * 5 + [8.0])
    back = new.carry(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 9.0]), smoothness(True))
    np.testing.assert_allclose(back, [3.0, 9.0])


def test_gauge_leaves_a_step_alone() -> None:
    (gauge,) = fix_gauges((plan(True),), visited())
    assert isinstance(gauge, Gauge)
    assert replace(plan(True), step=False).size == plan(True).size - 1
    np.testing.assert_allclose(gauge.removed[-1], 0.0, atol=1e-12)


def test_holm_is_the_closure_of_bonferroni() -> None:
    """A test is significant where no set of tests that holds it passes as a whole at α (R. Marcus,
    E. Peritz and K. R. Gabriel, Biometrika 63, 1976).
    """
    rng, partly = np.random.default_rng(0), 0
    for count in (1, 2, 3, 5):
        for p in rng.uniform(0.0, 0.06, (40, count)):
            sets = [s for size in range(1, count + 1)
                    for s in itertools.combinations(range(count), size)]
            closed = [all(min(p[list(s)]) <= 0.05 / len(s) for s in sets if k in s)
                      for k in range(count)]
            assert holm(p.tolist(), 0.05) == closed
            partly += 0 < sum(closed) < count
    assert partly > 20
    # without correction, or with Bonferroni's, these would be others
    assert holm([0.04, 0.024, 0.015, 0.005], 0.05) == [True] * 4
    assert holm([0.04, 0.03, 0.015, 0.005], 0.05) == [False, False, True, True]


def test_false_alarms_of_several_tests_together_are_as_stated() -> None:
    p = np.random.default_rng(1).uniform(size=(2000, 5))
    alarms = sum(any(holm(row.tolist(), 0.05)) for row in p)
    expected = 1 - 0.99**5
    assert binom.ppf(0.001, 2000, expected) <= alarms <= binom.ppf(0.999, 2000, expected)


@pytest.mark.parametrize(("freedom", "count"), [(0.0, 3), (4.6, 5), (40.0, 8)])
def test_wald_is_the_fall_of_chi_square_beside_what_the_gauge_takes_out(
        freedom: float, count: int) -> None:
    """By two linear regressions: with the tested functions, and without them."""
    gauges = fix_gauges((plan(),), visited())
    noise = np.random.default_rng(7).normal(size=400)
    y = 0.012 * visited().arguments[:, 0] ** 3 / SIGMA + noise
    columns = [design() @ np.vstack([np.zeros((2, part.shape[1])), part])
               for part in (gauges[0].removed, _smoothest(gauges[0], count))]
    alone = np.hstack([design()[:, :2], columns[0]])
    fall = [float(np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2))
            for X in (alone, np.hstack([alone, columns[1]]))]
    p, tested = wald(linear_fit(y), [0], gauges, [freedom])
    assert tested == count
    # priors on offset and coefficients are weak, but there; one degree more or less were 15 %
    assert chi2.isf(p, count) == pytest.approx(fall[0] - fall[1], rel=0.03)
    assert 1e-8 < p < 0.5


def test_likelihood_of_an_edge_leaves_parameters_at_their_best() -> None:
    """χ² of coefficients, parameters refitted by least squares, up to a constant."""
    y = np.random.default_rng(4).normal(size=400) + design()[:, 5]
    J, (S, g) = design(), likelihood(linear_fit(y), 0)

    def left(c: np.ndarray) -> float:
        rest = y - J[:, 2:] @ c
        return float(np.sum((rest - J[:, :2] @ np.linalg.lstsq(J[:, :2], rest, rcond=None)[0])**2))

    first, second = np.random.default_rng(5).normal(size=(2, plan().size))
    wanted = left(first) - left(second)
    assert abs(wanted) > 100.0
    assert first @ S @ first - 2 * g @ first - second @ S @ second + 2 * g @ second == (
        pytest.approx(wanted, rel=1e-8))


def test_a_grid_goes_a_little_beyond_what_was_visited() -> None:
    placed = plan().over(np.array([0.3, -1.0, 0.5]), 12)
    assert placed.intervals == 12
    assert placed.limits == pytest.approx((-1.0 - 0.05 * 1.5, 0.5 + 0.05 * 1.5))


def test_smoothness_stays_within_its_limits() -> None:
    """However large, a curve without any smoothness asks for no more than the roughest."""
    J, smooth = design(), smoothness()
    c = 1e7 * np.random.default_rng(6).normal(size=plan().size)
    rho = smooth.choose(J.T @ J, J.T @ (J[:, 2:] @ c), smooth.stiff)
    assert rho == pytest.approx(ROUGHEST)
