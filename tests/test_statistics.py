"""Repeated seeds: NLS is efficient, its intervals cover as stated, its verdict rarely errs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import binom, chi2

import pikanid as pk
from pikanid.model import systems
from pikanid.recording import excitation

TRUE = {"l_theta": 0.045, "d_theta": 0.15}
SCENARIOS = [(stride, noise) for stride in (1, 10) for noise in (0.1, 1.0)]
NAMES = [f"{'dense' if stride == 1 else 'sparse'} {noise} deg" for stride, noise in SCENARIOS]


@dataclass(frozen=True)
class Repeated:
    """Errors in units of the bound (seeds, 2), whether the 95 % intervals cover, and verdicts."""

    errors: np.ndarray
    covered: np.ndarray
    blamed: int

    @property
    def ratio(self) -> np.ndarray:
        """Root mean square error over the Cramér-Rao bound, by parameter."""
        return np.sqrt(np.mean(self.errors**2, axis=0))


def repeat(stride: int, noise: float, seeds: range) -> Repeated:
    """Table II's start, one simulation, its noise by seed."""
    model = systems.sloshing()
    sigma = noise * np.pi / 180
    clean = pk.simulate(model, excitation.two_pulse())
    start = model.with_values(l_theta=0.06, d_theta=0.05)
    thin = clean.decimate(stride, channels=["theta"]).with_sigma(theta=sigma)
    bound = pk.uncertainty.cramer_rao(model, thin)
    errors, covered, blamed = [], [], 0
    for seed in seeds:
        full = np.random.default_rng(seed).normal(0.0, sigma, 501)
        noisy = thin.with_channels(type(thin["theta"])(
            "theta", thin["theta"].time, thin["theta"].values + full[::stride], "rad", sigma))
        found = pk.NLS().fit(start, noisy)
        errors.append([(found.value(n) - v) / bound.std(n) for n, v in TRUE.items()])
        inside = [found.interval(n)[0] <= v <= found.interval(n)[1] for n, v in TRUE.items()]
        covered.append(inside)
        blamed += not found.ok
    return Repeated(np.array(errors), np.array(covered), blamed)


def check(found: Repeated, seeds: int, coverage: tuple[float, float]) -> None:
    """Mean squares of `seeds` normal errors follow χ²/seeds; one seed off by 6 σ is a breakdown."""
    low, high = np.sqrt(chi2.ppf([0.0005, 0.9995], seeds) / seeds)
    assert np.all((found.ratio > low) & (found.ratio < high))
    assert np.abs(found.errors).max() < 6
    share = found.covered.mean(axis=0)
    assert np.all((share >= coverage[0]) & (share <= coverage[1]))
    # the verdict blames a right model once in a thousand
    assert found.blamed <= binom.ppf(0.9995, seeds, 1e-3)


@pytest.mark.parametrize(("stride", "noise"), SCENARIOS, ids=NAMES)
def test_few_seeds(stride: int, noise: float) -> None:
    seeds = 20
    low, high = binom.ppf([0.0005, 0.9995], seeds, 0.95) / seeds
    check(repeat(stride, noise, range(seeds)), seeds, (low, high))


@pytest.mark.slow
@pytest.mark.parametrize(("stride", "noise"), SCENARIOS, ids=NAMES)
def test_four_hundred_seeds(stride: int, noise: float,
                            record_property: pytest.Function) -> None:
    found = repeat(stride, noise, range(400))
    record_property("rmse/crb", found.ratio.round(3).tolist())  # type: ignore[operator]
    record_property("coverage", found.covered.mean(axis=0).tolist())  # type: ignore[operator]
    check(found, 400, (0.92, 0.98))
