"""Piecewise-linear signals against the same operations done in tiny steps."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.validation.concealed import signals
from pikanid.validation.concealed.signals import Signal

T = np.arange(0.0, 3.0, 0.1)
STEP = 2e-4
FINE = np.arange(0.0, 3.2, STEP) + STEP / 3  # never on a knot


@pytest.fixture(params=[signals.zero_order, signals.first_order], ids=["zero", "first"])
def u(request: pytest.FixtureRequest) -> Signal:
    values = np.random.default_rng(3).normal(size=len(T)).cumsum()
    values[0] = 0.0
    return request.param(T, values)


def test_holds() -> None:
    values = np.array([1.0, 1.0, 3.0])
    t = np.array([0.0, 1.0, 2.0])
    assert signals.zero_order(t, values).at(np.array([-1.0, 0.5, 1.999, 2.0, 9.0])).tolist() == [
        1, 1, 1, 3, 3]
    assert signals.first_order(t, values).at(np.array([0.5, 1.5, 2.0, 9.0])).tolist() == [
        1, 2, 3, 3]
    assert len(signals.zero_order(t, values).knots) == 2  # the second sample changes nothing


def test_clipping_and_dead_zone(u: Signal) -> None:
    fine = u.at(FINE)
    assert signals.clipped(u, -0.7, 0.5).at(FINE) == pytest.approx(np.clip(fine, -0.7, 0.5),
                                                                   abs=1e-12)
    dead = np.sign(fine) * np.maximum(np.abs(fine) - 0.6, 0.0)
    assert signals.dead_zone(u, 0.6).at(FINE) == pytest.approx(dead, abs=1e-12)


@pytest.mark.parametrize("rate", [2.0, 9.0, 40.0])
def test_slew_rate(u: Signal, rate: float) -> None:
    fine, y = u.at(FINE), np.empty(len(FINE))
    y[0] = fine[0]
    for k in range(1, len(FINE)):
        y[k] = y[k - 1] + np.clip(fine[k] - y[k - 1], -rate * STEP, rate * STEP)
    assert signals.slewed(u, rate).at(FINE) == pytest.approx(y, abs=2 * rate * STEP)


@pytest.mark.parametrize("half", [0.1, 0.8])
def test_play(u: Signal, half: float) -> None:
    fine, y = u.at(FINE), np.empty(len(FINE))
    y[0] = np.clip(0.0, fine[0] - half, fine[0] + half)
    for k in range(1, len(FINE)):
        y[k] = np.clip(y[k - 1], fine[k] - half, fine[k] + half)
    steepest = float(np.max(np.abs(u.slopes)))
    assert signals.played(u, half).at(FINE) == pytest.approx(y, abs=1e-12 + STEP * steepest)


def test_delay_and_gain(u: Signal) -> None:
    late = u.delayed(0.123).scaled(-2.0)
    past = FINE - 0.123
    assert late.at(FINE) == pytest.approx(np.where(past < 0, 0.0, -2.0 * u.at(past)), abs=1e-9)
    assert u.delayed(0.0) is u
