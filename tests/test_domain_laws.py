"""Laws of the catalogues by domain, in rigs that SciPy simulates, are named as what they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.model import Model

Rates = Callable[[float, np.ndarray, float], list[float]]

FILTER = {
    "name": "filter", "domain": "electrical",
    "states": {"i": {"unit": "A", "initial": 0.0}, "v": {"unit": "V", "initial": 0.0}},
    "inputs": {"u": {"unit": "V", "hold": "zero"}},
    "parameters": {"L": {"unit": "H", "guess": 2e-3, "bounds": [1e-5, 0.1]},
                   "R": {"unit": "ohm", "guess": 1.0, "bounds": [0.01, 100]},
                   "C": {"unit": "F", "guess": 2e-4, "bounds": [1e-6, 0.01]},
                   "G": {"unit": "1/ohm", "guess": 0.05, "bounds": [1e-3, 10]}},
    "equations": {"i": "(u - R*i - v)/L", "v": "(i - G*v)/C"},
    "outputs": {"v": {"unit": "V", "expression": "v"}, "i": {"unit": "A", "expression": "i"}}}

BATCH = {
    "name": "batch", "domain": "kinetics",
    "states": {"X": {"unit": "g/L", "initial": 0.3}, "S": {"unit": "g/L", "initial": "S_0"}},
    "parameters": {"mu": {"unit": "1/h", "guess": 0.5, "bounds": [0.01, 5]},
                   "K": {"unit": "g/L", "guess": 1.0, "bounds": [0.01, 20]},
                   "Y": {"unit": "1", "guess": 0.5, "bounds": [0.05, 1]},
                   "S_0": {"unit": "g/L", "guess": 10.0, "scope": "recording"}},
    "equations": {"X": "mu*S/(K + S)*X", "S": "-mu*S/(K + S)*X/Y"},
    "outputs": {"X": {"unit": "g/L", "expression": "X"}, "S": {"unit": "g/L", "expression": "S"}}}


def recording(rates: Rates, x0: list[float], t: np.ndarray, u: np.ndarray, names: list[str],
              sigma: float, seed: int, units: Mapping[str, str]) -> pk.Recording:
    """Of states (named) of a rig whose input (N,) is held between the samples."""
    x = np.empty((len(t), len(x0)))
    x[0] = x0
    for k in range(len(t) - 1):
        x[k + 1] = solve_ivp(rates, (t[k], t[k + 1]), x[k], "DOP853", args=(u[k],), rtol=1e-9,
                             atol=1e-10).y[:, -1]
    noise = np.random.default_rng(seed).normal(0.0, sigma, x.shape)
    signals = {name: x[:, k] + noise[:, k] for k, name in enumerate(names)}
    driven = {"u": u} if np.any(u) else {}
    return pk.Recording.from_arrays(t, signals | driven, units=units,
                                    hold=dict.fromkeys(driven, "zero"))


def named(model: dict[str, Any], train: pk.Recording, held_out: pk.Recording) -> set[str]:
    """Ids of the effects of the first hypothesis of a diagnosis that is confirmed."""
    found = pk.diagnose(Model.from_dict(model), train, held_out, workers=1)
    assert found.verdict in ("named", "set"), str(found)
    return {name for e in found.hypotheses[0].effects for name in e.ids}


def filtered(lost: Callable[[np.ndarray], tuple[float, float]], seed: int) -> pk.Recording:
    """A filter that loses more voltage across its coil, and more current at its end (i and v)."""
    def rates(_: float, x: np.ndarray, u: float) -> list[float]:
        volts, amperes = lost(x)
        return [(u - 0.7 * x[0] - x[1] - volts) / 1.5e-3, (x[0] - 0.08 * x[1] - amperes) / 2.5e-4]

    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-12, 12, 40), 10)
    return recording(rates, [0.0, 0.0], 2e-4 * np.arange(400), u, ["i", "v"], 0.02, seed,
                     {"u": "V", "v": "V", "i": "A"})


@pytest.mark.parametrize(("lost", "wanted"), [
    (lambda x: (0.0, 8.0 * x[1] / (x[1]**2 + 9.0)), "constant_power"),
    (lambda x: (1.5 * np.tanh(x[0] / 0.3), 0.0), "coulomb_friction"),
    (lambda x: (0.0, 0.5 * np.tanh(x[1] / 0.4)), "coulomb_friction")])
def test_a_load_of_constant_power_is_told_from_a_rounded_dry_one(
        lost: Callable[[np.ndarray], tuple[float, float]], wanted: str) -> None:
    assert named(FILTER, filtered(lost, 1), filtered(lost, 2)) == {wanted}


def test_a_coil_whose_core_saturates() -> None:
    def run(seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-12, 12, 40), 10)
        return recording(lambda _, x, u: [
            (u - 0.7 * x[0] - x[1]) / 1.5e-3 * (1.0 + (x[0] / 5.0) ** 2),
            (x[0] - 0.08 * x[1]) / 2.5e-4], [0.0, 0.0], 2e-4 * np.arange(400), u, ["i", "v"], 0.02,
            seed, {"u": "V", "v": "V", "i": "A"})

    assert named(FILTER, run(1), run(2)) == {"saturation"}


def test_cells_that_grow_after_a_lag() -> None:
    def run(seed: int, s_0: float) -> pk.Recording:
        t = 3600.0 * np.linspace(0.0, 14.0, 60)
        grow = 0.6 / 3600.0
        return recording(lambda t, x, _: (lambda r: [r, -r / 0.45])(
            grow * (1.0 - np.exp(-t / 7000.0)) * max(x[1], 0.0) / (1.2 + max(x[1], 0.0)) * x[0]),
            [0.3, s_0], t, np.zeros_like(t), ["X", "S"], 0.08, seed, {"X": "g/L", "S": "g/L"})

    assert named(BATCH, run(3, 12.0), run(4, 8.0)) == {"lag_phase"}
