"""Multiple shooting: residuals and Jacobian of data and gaps, and what it finds."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest

from pikanid.model import Model
from pikanid.objective.shooting import Shooting
from pikanid.problem.problem import Problem
from pikanid.recording import Channel, Recording
from pikanid.strategies.multiple_shooting import (
    _cut,
    _open_ended,
    _Residuals,
    multiple_shooting,
)
from pikanid.strategies.nodes import state_near

T = np.linspace(0.0, 4.0, 41)
THETA = np.array([9.0, 0.3, 0.5, 0.8])  # k, d, x0 of each recording


@pytest.fixture(autouse=True)
def by_python(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)


def model() -> Model:
    """x'' = -k x - d x' from x0; only x² is seen, and x itself a little later."""
    return Model.from_dict({
        "states": {"x": {"initial": "x0"}, "v": {}}, "equations": {"x": "v", "v": "-k*x - d*v"},
        "parameters": {"k": {"guess": 9.0}, "d": {"guess": 0.3}, "x0": {"guess": 0.5}},
        "outputs": {"y": {"expression": "x"}, "z": {"expression": "x**2"}}}).per_recording("x0")


def motion(t: np.ndarray, x0: float) -> np.ndarray:
    w = np.sqrt(9.0 - 0.15**2)
    return np.asarray(x0 * np.exp(-0.15 * t) * (np.cos(w * t) + 0.15 / w * np.sin(w * t)))


def rate(t: np.ndarray, x0: float) -> np.ndarray:
    w = np.sqrt(9.0 - 0.15**2)
    return np.asarray(-x0 * np.exp(-0.15 * t) * 9.0 / w * np.sin(w * t))


def problem(noise: float = 0.0) -> Problem:
    rng, own = np.random.default_rng(0), T[1:-1:2] + 0.03
    data = [Recording({
        "y": Channel("y", T, motion(T, x0) + noise * rng.normal(size=41), "",
                     np.linspace(0.01, 0.03, 41)),
        "z": Channel("z", own, motion(own, x0) ** 2 + noise * rng.normal(size=20), "", 0.02)})
        for x0 in THETA[2:]]
    return Problem(model(), data)


def residuals(noise: float, count: int = 3) -> tuple[_Residuals, np.ndarray, Shooting]:
    """With the nodes where the true motion is."""
    shooting = Shooting(problem(noise))
    shooting.choose_steps(THETA, "fine")
    segments, nodes = _cut(shooting.problem, _open_ended(model()), count)
    edges = np.linspace(0.0, 4.0, count + 1)[1:-1]
    nodes = np.concatenate([np.column_stack([motion(edges, x0), rate(edges, x0)])
                            for x0 in THETA[2:]])
    found = _Residuals(shooting, segments, 4, nodes.shape)
    z = np.concatenate([THETA, nodes.ravel()])
    found.choose_steps(z)
    return found, z, shooting


@pytest.mark.parametrize("count", [2, 3])
def test_on_the_motion_gaps_are_closed_and_data_are_those_of_single_shooting(count: int) -> None:
    found, z, shooting = residuals(0.01, count)
    r = found.value(z)
    assert len(r) == shooting.rows + 2 * (count - 1) * 2
    single = shooting.residual(THETA)
    np.testing.assert_allclose(r[:shooting.rows], single, atol=0.05)
    assert np.abs(single).max() > 1
    np.testing.assert_allclose(r[shooting.rows:], 0.0, atol=0.05)
    # every sample belongs to one segment
    rows = np.sort(np.concatenate([g.rows for g in found.segments]))
    np.testing.assert_array_equal(rows, np.arange(shooting.rows))


def test_jacobian_is_that_of_differences() -> None:
    found, z, _ = residuals(0.01)
    z = z * np.random.default_rng(1).uniform(0.9, 1.1, z.size)
    found.choose_steps(z)
    J = found.jacobian(z)
    for k in range(z.size):
        h = 1e-5 * max(abs(z[k]), 0.1) * np.eye(z.size)[k]
        slope = (found.value(z + h) - found.value(z - h)) / (2 * h[k])
        np.testing.assert_allclose(J[:, k], slope, atol=1e-5 * np.abs(slope).max(), err_msg=str(k))


def test_gaps_count_relative_to_the_size_of_a_state_and_to_their_weight() -> None:
    found, z, shooting = residuals(0.0)
    moved = z.copy()
    moved[4:6] += [0.01, 0.01]  # the first node of the first recording
    sizes = np.abs(z[4:].reshape(-1, 2)).max(axis=0)
    found.closing = 1.0
    gap = found.value(moved)[shooting.rows:shooting.rows + 2]
    assert gap == pytest.approx(-0.01 / sizes * found.scale, rel=0.02)
    found.closing, found._kept = 100.0, None
    again = found.value(moved)[shooting.rows:shooting.rows + 2]
    assert again == pytest.approx(100 * gap, rel=0.02)


def test_nodes_start_from_the_data() -> None:
    """A state that is measured from a cubic about the node, its rate from the cubic's slope."""
    given = problem()
    node, told = state_near(model(), given.experiments[1], 1.37)
    assert told.all()
    assert node[0] == pytest.approx(motion(np.array([1.37]), 0.8)[0], abs=0.02)
    assert node[1] == pytest.approx(rate(np.array([1.37]), 0.8)[0], abs=0.15)


def test_a_start_far_off_is_led_to_the_basin() -> None:
    """At half of the rate single shooting ends where the swing is damped away."""
    shooting = Shooting(problem(0.01))
    led = multiple_shooting(shooting, np.array([4.0, 0.1, 0.3, 0.3]), 4)
    assert led is not None
    np.testing.assert_allclose(led, THETA, rtol=0.05)
