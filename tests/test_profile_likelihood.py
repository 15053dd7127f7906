"""Profile likelihood where it is known: a straight line, whose profiles are parabolas."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import chi2

import pikanid as pk
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.uncertainty.profile_likelihood import profile

T = np.linspace(0.0, 2.0, 9)
SIGMA = 0.1
Y = 2.0 + 0.7 * T + SIGMA * np.random.default_rng(1).normal(size=9)
X = np.column_stack([np.ones(9), T])
BEST = np.linalg.lstsq(X, Y, rcond=None)[0]
RSS = float(np.sum((Y - X @ BEST) ** 2))


@pytest.fixture(autouse=True)
def by_python(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)


def line(decay: bool = False) -> Model:
    """x = a + b·t, or a·exp(-b·t)."""
    return Model.from_dict({
        "states": {"x": {"initial": "a"}}, "parameters": {"a": {"guess": 1.0}, "b": {"guess": 0.5}},
        "equations": {"x": "-b*x" if decay else "b"}, "outputs": {"x": {"expression": "x"}}})


def recorded(y: np.ndarray = Y, stated: bool = True) -> Recording:
    return Recording.from_arrays(T, {"x": y}, sigma={"x": SIGMA} if stated else None)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("level", [0.5, 0.95])
@pytest.mark.parametrize("name", ["a", "b"])
def test_interval_of_a_straight_line_by_hand(name: str, level: float, stated: bool) -> None:
    """x̂ ± √(q·s²·C): with σ unknown s² = RSS/(N - 2), not RSS/N, which were 22 % less."""
    k = ["a", "b"].index(name)
    variance = SIGMA**2 if stated else RSS / 7
    half = np.sqrt(chi2.ppf(level, 1) * variance * np.linalg.inv(X.T @ X)[k, k])
    found = profile(line(), recorded(stated=stated), BEST, name, level)
    assert found.interval == pytest.approx((BEST[k] - half, BEST[k] + half), abs=1e-6 * half)
    assert (found.name, found.level) == (name, level)
    assert np.all(np.diff(found.values) > 0) and BEST[k] in found.values
    at = int(np.searchsorted(found.values, BEST[k]))  # by the same step to either side
    assert found.values[at + 1] - BEST[k] == pytest.approx(BEST[k] - found.values[at - 1])
    parabola = ((found.values - BEST[k]) / half) ** 2 * chi2.ppf(level, 1)
    np.testing.assert_allclose(found.excess, parabola, atol=1e-6)


def test_interval_of_a_curved_model_is_where_the_refitted_cost_says() -> None:
    """a·exp(-b·t) with the best a for every b in closed form: the ends lie unevenly."""
    y = np.exp(-1.5 * T) + SIGMA * np.random.default_rng(2).normal(size=9)

    def cost(b: float) -> float:
        e = np.exp(-b * T)
        return float(np.sum((y - e * (e @ y) / (e @ e)) ** 2)) / SIGMA**2

    found = pk.NLS(starts=1).fit(line(True).with_values(b=1.0), recorded(y))
    best = found.value("b")
    least, quantile = cost(best), float(chi2.ppf(0.95, 1))
    ends = tuple(brentq(lambda b: cost(b) - least - quantile, *sorted((best, far)))
                 for far in (0.05, 20.0))
    along = profile(line(True), recorded(y), found.theta, "b")
    low, high = along.interval
    # crossings are interpolated between values about a quarter of the interval apart
    assert (low, high) == pytest.approx(ends, abs=0.02 * (ends[1] - ends[0]))
    assert high - best > 1.2 * (best - low)
    expected = [cost(value) - least for value in along.values]
    # every sample may be off by 0.01 σ/√N, which moves the sum of squares by 0.02·√χ² at most
    np.testing.assert_allclose(along.excess, expected, atol=0.02 * np.sqrt(least + quantile))


@pytest.mark.parametrize("side", [-1, 1])
def test_a_bound_inside_the_interval_is_its_end(side: int) -> None:
    std = SIGMA * np.sqrt(np.linalg.inv(X.T @ X)[1, 1])
    bound = BEST[1] + side * std
    model = line().with_values(b=BEST[1]).with_bounds(
        b=(bound, 9.0) if side < 0 else (-9.0, bound))
    interval = profile(model, recorded(), BEST, "b").interval
    assert interval[(side + 1) // 2] == bound
    far = BEST[1] - side * np.sqrt(chi2.ppf(0.95, 1)) * std
    assert interval[(1 - side) // 2] == pytest.approx(far, abs=1e-6)


def test_points_and_bounds_of_the_others_are_kept() -> None:
    """With a held at its estimate from both sides, b knows as much as with a given."""
    model = line().with_values(a=BEST[0]).with_bounds(a=(BEST[0] - 1e-9, BEST[0] + 1e-9))
    low, high = profile(model, recorded(), BEST, "b").interval
    half = np.sqrt(chi2.ppf(0.95, 1) / np.sum(T**2)) * SIGMA
    assert (low, high) == pytest.approx((BEST[1] - half, BEST[1] + half), rel=1e-4)
    few = profile(line(), recorded(), BEST, "b", points=1)
    assert len(few.values) == 3 and few.interval == (-np.inf, np.inf)
