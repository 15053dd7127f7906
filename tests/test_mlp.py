"""The tanh network as a trajectory: derivatives, Jacobians, the exact start, kinks."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")
mlp = pytest.importorskip("pikanid.approximators.mlp")

pytestmark = pytest.mark.kan

T = np.linspace(0.05, 4.9, 31)


def network(order: int, anchored: bool = False, kinks: tuple[float, ...] = (), **more: object):
    return mlp.MLP(0.0, 5.0, order=order, hidden=(7, 6), offset=0.0 if anchored else 0.3, scale=0.2,
                   rate=9.0, anchored=anchored, kinks=kinks, **more)


def coefficients(net, seed: int = 0) -> np.ndarray:
    return net.initial(seed, spread=5.0) + 0.1 * np.random.default_rng(seed).normal(
        size=net.n_coefficients)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("extras", [{}, {"anchored": True, "kinks": (1.0, 2.52)}],
                         ids=["plain", "anchored"])
def test_derivatives_are_those_of_the_values(order: int, extras: dict) -> None:
    net, h = network(order, **extras), 1e-5
    c = coefficients(net)
    for q in range(order):
        slope = (net.values(T + h, c, q) - net.values(T - h, c, q)) / (2 * h)
        exact = net.values(T, c, q + 1)
        np.testing.assert_allclose(slope, exact, atol=1e-4 * np.abs(exact).max())


@pytest.mark.parametrize("order", [1, 2, 3])
def test_jacobian_is_that_of_the_values(order: int) -> None:
    net = network(order, anchored=True, kinks=(1.0,))
    c = coefficients(net)
    for q in range(order + 1):
        rows = net.jacobian(T, c, q)
        assert rows.shape == (T.size, net.n_coefficients)
        for column in range(net.n_coefficients):
            step = np.zeros(c.size)
            step[column] = 1e-6
            slope = (net.values(T, c + step, q) - net.values(T, c - step, q)) / 2e-6
            np.testing.assert_allclose(rows[:, column], slope, atol=1e-6 * np.abs(rows).max())


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_gradient_is_the_jacobian(order: int) -> None:
    net = network(order, anchored=order % 2 == 0)
    c = torch.tensor(coefficients(net), requires_grad=True)
    weights = np.random.default_rng(3).normal(size=(order + 1, T.size))
    loss = (torch.tensor(weights) * net.at(T).jet(c)).sum()
    (gradient,) = torch.autograd.grad(loss, c)
    wanted = sum(weights[q] @ net.jacobian(T, c.detach().numpy(), q) for q in range(order + 1))
    np.testing.assert_allclose(gradient, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_start_is_exact() -> None:
    net = network(3, anchored=True, kinks=(0.5,))
    c = coefficients(net)
    start = [net.values(np.array([0.0]), c, q)[0] for q in range(3)]
    np.testing.assert_allclose(start, c[:3], rtol=1e-12)


def test_only_the_mth_derivative_jumps_at_a_kink() -> None:
    net, h = network(2, kinks=(2.0,)), 1e-9
    c = coefficients(net)
    sides = [[net.values(np.array([2.0 + s * h]), c, q)[0] for s in (-1, 1)] for q in range(3)]
    jumps = [after - before for before, after in sides]
    assert abs(jumps[0]) < 1e-6 and abs(jumps[1]) < 1e-5
    assert np.isclose(jumps[2], net.scale * net.rate**2 * c[0], rtol=1e-4)


def test_input_is_scaled() -> None:
    """The same network on another time axis is the same function of the scaled time."""
    slow = mlp.MLP(10.0, 110.0, order=1, hidden=(5,))
    fast = mlp.MLP(0.0, 1.0, order=1, hidden=(5,))
    c = slow.initial(0)
    s = np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(slow.values(10.0 + 100.0 * s, c), fast.values(s, c), rtol=1e-12)
    np.testing.assert_allclose(100.0 * slow.values(10.0 + 100.0 * s, c, 1), fast.values(s, c, 1),
                               rtol=1e-12)


def test_same_seed_same_start() -> None:
    net, before = network(2), torch.random.get_rng_state()
    np.testing.assert_array_equal(net.initial(4, 3.0), net.initial(4, 3.0))
    assert np.any(net.initial(4) != net.initial(5))
    assert torch.equal(before, torch.random.get_rng_state())
