"""Plants that are far faster than they are sampled: a motor's current, food used up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import SHARE, TOO_ROUGH, Whitened
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import Model
from pikanid.noise.level import NoiseModel

R, L, K, J, SIGMA = 1.3, 2e-4, 0.06, 3e-4, 0.3
LEVEL = NoiseModel(SIGMA, 0.0, 0.0, 0.05, "given")


def motor() -> Model:
    """Speed measured every 50 ms; the current settles in 0.15 ms."""
    return Model.from_dict({
        "name": "motor", "states": {"i": {"unit": "A"}, "omega": {"unit": "rad/s"}},
        "inputs": {"u": {"unit": "V", "hold": "zero"}},
        "parameters": {"R": {"unit": "ohm", "guess": 1.0, "bounds": [0.1, 10.0]},
                       "L": {"unit": "H", "value": L},
                       "k": {"unit": "V*s/rad", "guess": 0.05, "bounds": [0.001, 1.0]},
                       "J": {"unit": "kg*m^2", "value": J}},
        "equations": {"i": "(u - R*i - k*omega)/L", "omega": "k*i/J"},
        "outputs": {"omega": {"unit": "rad/s", "expression": "omega"}}})


def driven(seed: int, friction: float) -> pk.Recording:
    """By steps of voltage; SciPy's, with a friction that is rounded about rest."""
    rng = np.random.default_rng(seed)
    t = 0.05 * np.arange(400)
    u, x, omega = np.repeat(rng.uniform(-12, 12, 40), 10), np.zeros(2), [0.0]
    for n in range(399):
        def f(_: float, x: np.ndarray, n: int = n) -> list[float]:
            return [(u[n] - R * x[0] - K * x[1]) / L,
                    (K * x[0] - friction * np.tanh(x[1] / 0.05)) / J]
        x = solve_ivp(f, (0, 0.05), x, "Radau", rtol=1e-7, atol=1e-8).y[:, -1]
        omega.append(x[1])
    return pk.Recording.from_arrays(
        t, {"u": u, "omega": np.array(omega) + SIGMA * rng.standard_normal(400)},
        {"u": "V", "omega": "rad/s"}, hold={"u": "zero"})


def still() -> pk.Recording:
    t = 0.05 * np.arange(60)
    u = np.where(t < 1.0, 6.0, -3.0)
    return pk.Recording.from_arrays(t, {"u": u, "omega": t}, {"u": "V", "omega": "rad/s"},
                                    hold={"u": "zero"})


def test_steps_are_implicit_where_explicit_ones_run_away() -> None:
    records = Records((still(),), ({"omega": LEVEL},), DEFAULTS)
    whitened = Whitened(motor(), records)
    theta = np.array([R, K])
    assert whitened.choose_steps(theta)
    assert [s.method for s in whitened.steps] == ["implicit"]
    assert whitened.steps[0].error <= TOO_ROUGH * SHARE
    found = whitened.residual(theta)
    assert found is not None
    y = found[0] * SIGMA + whitened.measured(0)
    rate, end = K * K / (R * J), 6.0 / K  # with L = 0
    wanted = end * (1 - np.exp(-rate * 0.05 * np.arange(20)))
    np.testing.assert_allclose(y[:20], wanted, atol=0.01 * end)


def test_an_implicit_step_counts_as_many_explicit_ones() -> None:
    records = Records((still(),), ({"omega": LEVEL},), DEFAULTS)
    fast, slow = Whitened(motor(), records), Whitened(motor().with_values({"L": 2.0}), records)
    for whitened in (fast, slow):
        assert whitened.choose_steps(np.array([R, K]))
    assert [w.steps[0].method for w in (fast, slow)] == ["implicit", "explicit"]
    each = [w.cost * w.steps[0].longest for w in (fast, slow)]
    assert each[0] == pytest.approx(10 * each[1], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "verdict"), [(0.0, "none"), (0.02, "named")])
def test_a_motor_sampled_slowly_is_diagnosed(friction: float, verdict: str) -> None:
    dx = pk.diagnose(motor(), driven(1, friction), driven(2, friction))
    assert dx.verdict == verdict
    for effect in (e for h in dx.hypotheses[:1] for e in h.effects):
        assert effect.ids == ("coulomb_friction",)
        found = effect.parameters["c_omega"]
        value, error = found.value, found.std
        assert abs(value - friction / J) < 4 * error < 0.2 * value


def used_up(seed: int, S0: float) -> pk.Recording:
    """Growth that stops where food is used up, and is inhibited by much of it; LSODA's."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 60.0, 0.25)
    D, X, S = np.empty_like(t), np.empty_like(t), np.empty_like(t)
    x = np.array([2.0, S0])
    for k in range(0, 240, 16):
        D[k:k + 16] = d = rng.uniform(0.02, 0.42)

        def f(_: float, y: np.ndarray, d: float = d) -> list[float]:
            s = max(y[1], 0.0)
            grown = 0.45 * s / (0.8 + s + s * s / 25) * y[0]
            return [grown - d * y[0], -2 * grown + d * (20 - y[1])]
        run = solve_ivp(f, (0, 4.0), x, "LSODA", 0.25 * np.arange(17), rtol=1e-9, atol=1e-11)
        (X[k:k + 16], S[k:k + 16]), x = run.y[:, :-1], run.y[:, -1]
    noise = 0.05 * rng.standard_normal((2, 240))
    return pk.Recording.from_arrays(3600 * t, {"D": D, "X": X + noise[0], "S": S + noise[1]},
                                    {"D": "1/h", "X": "g/l", "S": "g/l"}, hold={"D": "zero"})


@pytest.mark.slow
def test_a_law_that_drives_the_nominal_model_stiff_is_named() -> None:
    """Without it the half-saturation goes to nothing: growth stops within seconds of food's end."""
    model = Model.from_dict({
        "name": "vessel", "domain": "kinetics",
        "states": {"X": {"unit": "g/l", "initial": "X0"}, "S": {"unit": "g/l", "initial": "S0"}},
        "inputs": {"D": {"unit": "1/h", "hold": "zero"}},
        "parameters": {
            "X0": {"unit": "g/l", "guess": 1.0, "bounds": [0.01, 20.0], "scope": "recording"},
            "S0": {"unit": "g/l", "guess": 5.0, "bounds": [0.0, 50.0], "scope": "recording"},
            "mu": {"unit": "1/h", "guess": 0.4, "bounds": [0.01, 3.0]},
            "K": {"unit": "g/l", "guess": 0.5, "bounds": [0.001, 20.0]},
            "Y": {"unit": "1", "guess": 0.5, "bounds": [0.05, 2.0]},
            "Sin": {"unit": "g/l", "value": 20.0}},
        "equations": {"X": "mu*S/(K + S)*X - D*X", "S": "-mu*S/(K + S)*X/Y + D*(Sin - S)"},
        "outputs": {name: {"unit": "g/l", "expression": name} for name in ("X", "S")}})
    dx = pk.diagnose(model, used_up(1, 4.0), used_up(2, 8.0))
    assert dx.verdict in ("named", "set", "partial")
    assert any("saturating" in e.ids for h in dx.hypotheses for e in h.effects)
