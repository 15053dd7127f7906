"""Whether splines can follow the physics: when the question is given up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pikanid.strategies import locks

SAMPLES = 100


def state(lam: float, data: float, physics: float) -> Any:
    return SimpleNamespace(lam=lam, data_cost=data, physics_cost=physics, cost=data + physics,
                           point=SimpleNamespace(theta=np.zeros(2)))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The λ that were iterated at; every ten iterations leave `shrinks` of the physics' cost."""
    found: list[float] = []

    def gauss_newton(system: Any, at: Any, lam: float, *_: Any, **options: Any) -> Any:
        assert options["iterations"] == locks.ITERATIONS
        found.append(lam)
        physics = at.physics_cost * lam / at.lam
        return SimpleNamespace(at=state(lam, at.data_cost, physics * system.shrinks),
                               converged=False)

    monkeypatch.setattr(locks, "gauss_newton", gauss_newton)
    return found


def system(shrinks: float) -> Any:
    return SimpleNamespace(shrinks=shrinks, functional=SimpleNamespace(n_data=SAMPLES))


def test_iterations_go_on_while_they_lead_somewhere(asked: list[float]) -> None:
    """What is left of the physics halves each time, and in the end it is less than a datum's."""
    assert locks.follows_physics(system(0.5), state(1e5, 100.0, 100.0), 1e5)
    assert asked == [1e10] * 5 + [1e12] * 5


def test_iterations_end_where_they_gain_next_to_nothing(asked: list[float]) -> None:
    assert not locks.follows_physics(system(0.995), state(1e5, 100.0, 100.0), 1e5)
    assert asked == [1e10]


def test_splines_that_yield_a_little_are_asked_again(asked: list[float]) -> None:
    assert not locks.follows_physics(system(0.97), state(1e5, 100.0, 100.0), 1e5)
    assert asked == [1e10] * 5 + [1e12] * 5 + [1e14] * 5 + [1e16] * 5
