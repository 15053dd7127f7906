"""The potential-flow truth against linear theory, conservation of energy and geometry."""

from __future__ import annotations

import numpy as np
import pytest
from concealing import push, still
from scipy.integrate import solve_ivp
from scipy.special import jv

from pikanid.validation.concealed import tank_equations
from pikanid.validation.concealed.camera import silhouette, surface_angle
from pikanid.validation.concealed.case import PAPER_DEPTH, PAPER_LENGTH, PAPER_RADIUS
from pikanid.validation.concealed.simulate import measured, motion
from pikanid.validation.concealed.tank import MODES, Tank, radius_for, shape, zero

PAPER = Tank(PAPER_RADIUS, PAPER_DEPTH)
WIDE = Tank(radius_for(PAPER_LENGTH, PAPER_DEPTH), PAPER_DEPTH)
UNDAMPED = Tank(PAPER_RADIUS, PAPER_DEPTH, ratios=(0.0,) * 5)


def test_frequencies_of_the_paper_s_rig() -> None:
    xi = np.array([1.841184, 5.331443, 8.536316])
    k = xi / 0.033
    assert [zero(1, n) for n in (1, 2, 3)] == pytest.approx(xi, abs=1e-6)
    linear = np.sqrt(9.81 * k * np.tanh(k * 0.09)) / 2 / np.pi
    assert PAPER.frequencies[:3] == pytest.approx(linear, rel=1e-6)
    assert PAPER.frequencies[0] == pytest.approx(3.72, abs=0.005)
    assert PAPER.length == pytest.approx(0.0179, abs=5e-5)


def test_wide_vessel_swings_like_the_paper_s_pendulum() -> None:
    assert WIDE.length == pytest.approx(0.045, abs=1e-12)
    assert WIDE.radius == pytest.approx(0.080, abs=1e-3)


def test_modes_are_orthonormal_and_expand_the_tilted_plane() -> None:
    r, w = np.polynomial.legendre.leggauss(80)
    r, w = 0.5 * (r + 1), 0.5 * w
    planar = np.array([[shape(*mode, x) for x in r] for mode in MODES[:3]])
    assert (planar * r * w) @ planar.T == pytest.approx(np.eye(3), abs=1e-10)
    # <x ψ_n> by quadrature.
    assert PAPER.offsets == pytest.approx(0.033 * (planar * r * w) @ r, abs=1e-12)


def test_linear_response_to_a_step() -> None:
    u = 1e-6
    states = motion(PAPER, push(3.0, u), still(3.0).t)
    t = still(3.0).t
    for n in range(3):
        omega, zeta = 2 * np.pi * PAPER.frequencies[n], PAPER.ratios[n]
        wd = omega * np.sqrt(1 - zeta**2)
        rising = 1 - np.exp(-zeta * omega * t) * (np.cos(wd * t) + zeta * omega / wd
                                                  * np.sin(wd * t))
        wanted = -u * PAPER.offsets[n] / 9.81 * rising
        assert states[:, 2 * n] == pytest.approx(wanted, abs=1e-5 * np.max(np.abs(wanted)))


def energy(tank: Tank, x: np.ndarray) -> np.ndarray:
    a, (coupling0, coupling2) = tank.inertias, tank.couplings
    eta, rate = x[:, 0::2], x[:, 1::2]
    total = 0.5 * np.sum(a * rate**2, axis=1) + 0.5 * 9.81 * np.sum(eta**2, axis=1)
    for s, (p, q) in ((3, coupling0), (4, coupling2)):
        total += 0.5 * p * eta[:, s] * rate[:, 0] ** 2 + q * eta[:, 0] * rate[:, 0] * rate[:, s]
    return total


def test_energy_is_conserved_without_damping() -> None:
    p, x0 = UNDAMPED.settings(), np.zeros(10)
    x0[0], x0[2] = 0.004, 0.001

    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        dx = np.empty(10)
        tank_equations.rhs(x, np.zeros(4), p, 1, False, dx)
        return dx

    x = solve_ivp(rhs, (0, 5), x0, method="DOP853", rtol=1e-11, atol=1e-14).y.T
    assert energy(UNDAMPED, x) == pytest.approx(energy(UNDAMPED, x[:1])[0], rel=1e-7)
    assert np.max(np.abs(x[:, 6])) > 1e-5  # the driven modes take part


def test_nonlinearity_grows_with_the_square_of_the_amplitude() -> None:
    small, large = (
        measured(UNDAMPED, push(2.0, u)) / u for u in (0.05, 0.1))
    tiny = measured(UNDAMPED, push(2.0, 1e-4)) / 1e-4
    # Over a few swings the phase error is proportional to the amplitude squared.
    ratio = np.linalg.norm(large - tiny) / np.linalg.norm(small - tiny)
    assert 1.8 < ratio < 4.5


def test_tilted_tank_rests_level_and_shows_its_tilt() -> None:
    tank = Tank(PAPER_RADIUS, PAPER_DEPTH, tilt=0.02)
    theta = measured(tank, still(2.0))
    assert np.ptp(theta) < 1e-12
    # Three of infinitely many modes carry the plane, all of them would give the tilt itself.
    assert theta[0] == pytest.approx(0.02, rel=0.05)


def test_contact_line_holds_and_then_damps_dry() -> None:
    held = Tank(PAPER_RADIUS, PAPER_DEPTH, contact_line=5e-4)
    weak = 9.81 * 4e-4 / shape(1, 1, 1.0) / held.offsets[0]
    assert np.all(motion(held, push(1.0, weak), still(1.0).t)[:, 0] == 0.0)
    assert np.any(motion(held, push(1.0, 1.5 * weak), still(1.0).t)[:, 0] != 0.0)
    kicked = motion(held, push(8.0, lambda t: np.where(t < 0.13, 0.6, 0.0)), still(8.0).t)
    assert kicked[-1, 1] == 0.0  # at rest in finite time


def test_silhouette_is_the_highest_point_of_each_line_of_sight() -> None:
    states = np.zeros((2, 10))
    states[0, 0], states[1, 0] = 0.003, -0.003
    x, seen = silhouette(PAPER, states)
    rising = x > 0
    middle = [shape(1, 1, place / PAPER.radius) * 0.003 for place in x[rising]]
    assert seen[0, rising] == pytest.approx(middle, abs=1e-15)  # a crest is seen in the middle
    at_wall = 0.003 * shape(1, 1, 1.0) * x[~rising] / PAPER.radius
    assert seen[0, ~rising] == pytest.approx(at_wall, abs=1e-15)  # a trough at the near wall
    assert seen[0] == pytest.approx(seen[1][::-1], abs=1e-15)
    angles = surface_angle(PAPER, states)
    assert angles[0] == -angles[1] < 0


def test_angle_has_the_sign_of_the_pendulum_s() -> None:
    assert measured(PAPER, push(0.1, 0.5))[-1] > 0


def test_shape_is_a_mode_of_the_bessel_function() -> None:
    assert shape(1, 1, 0.5) / shape(1, 1, 1.0) == pytest.approx(
        jv(1, 0.5 * zero(1, 1)) / jv(1, zero(1, 1)))
