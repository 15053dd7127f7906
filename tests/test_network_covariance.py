"""Sandwich and naive covariance of a network's fit, from what its elimination leaves of θ."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
covariance = pytest.importorskip("pikanid.optimise.network_covariance")

pytestmark = pytest.mark.kan


def test_noise_of_one_size_scales_both(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two families of 7 and 5 samples; sandwich = bread RᵀRσ² bread, naive = bread σ²."""
    rng, sigma = np.random.default_rng(0), 0.3
    families = [SimpleNamespace(residual=rng.normal(size=n), answer=rng.normal(size=(n, 2)))
                for n in (7, 5)]
    schur = np.array([[4.0, 1.0], [1.0, 3.0]])
    system: Any = SimpleNamespace(
        functional=SimpleNamespace(problem=SimpleNamespace(
            lower=np.full(2, -9.0), upper=np.full(2, 9.0))),
        normal=lambda at: [SimpleNamespace(layout=None)], columns=[np.arange(2)],
        jacobian=lambda r, at: families)
    at: Any = SimpleNamespace(point=SimpleNamespace(theta=np.array([1.0, 2.0])),
                              data_costs=[(0.0, 0.0)])
    monkeypatch.setattr(covariance, "_solved", lambda n: (SimpleNamespace(schur=schur), 0.0))
    monkeypatch.setattr(covariance, "_trace", lambda *_: 1.5)
    monkeypatch.setattr(covariance, "_response", lambda layout, family, solved: family.answer)
    sandwich, naive, effective = covariance.network_covariance(
        system, at, lambda effective: [sigma, np.full(5, sigma)])
    bread, R = np.linalg.inv(schur), np.vstack([f.answer for f in families])
    np.testing.assert_allclose(naive, sigma**2 * bread)
    np.testing.assert_allclose(sandwich, sigma**2 * bread @ R.T @ R @ bread)
    assert effective == pytest.approx(1.5 + np.trace(R @ bread @ R.T))
