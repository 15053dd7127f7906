"""A parameter that only an output holds changes with time: a cell's resistance as it heats up."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.output_drift import output_drifts
from pikanid.recording import Recording

STEP, SIGMA = 2.0, 0.001
TRUE = {"Q": 3600.0, "R": 0.04, "R1": 0.02, "tau": 60.0}


def cell() -> pk.Model:
    return pk.Model.from_dict({
        "name": "cell", "inputs": {"i": {"unit": "A"}},
        "states": {"soc": {"initial": 0.9}, "v": {"unit": "V", "initial": 0.0}},
        "parameters": {"Q": {"unit": "A*s", "guess": 3000.0, "bounds": [500.0, 2e4]},
                       "R": {"unit": "V/A", "guess": 0.03, "bounds": [1e-3, 1.0]},
                       "R1": {"unit": "V/A", "guess": 0.03, "bounds": [1e-3, 1.0]},
                       "tau": {"unit": "s", "guess": 40.0, "bounds": [1.0, 1e3]}},
        "equations": {"soc": "-i/Q", "v": "(R1*i - v)/tau"},
        "outputs": {"u": {"unit": "V", "expression": "3.2 + 0.8*soc - v - R*i"}}})


def discharged(seed: int, rise: float) -> Recording:
    """Under currents that are held, where each step has a closed form; R rises by a share."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 2400.0, STEP)
    i = np.repeat(rng.uniform(-0.5, 2.0, len(t) // 25 + 1), 25)[:len(t)]
    soc, v = np.full(len(t), 0.9), np.zeros(len(t))
    keep = np.exp(-STEP / TRUE["tau"])
    for k in range(len(t) - 1):
        soc[k + 1] = soc[k] - i[k] * STEP / TRUE["Q"]
        v[k + 1] = TRUE["R1"] * i[k] + (v[k] - TRUE["R1"] * i[k]) * keep
    R = TRUE["R"] * (1 + rise * t / t[-1])
    u = 3.2 + 0.8 * soc - v - R * i
    return Recording.from_arrays(t, {"i": i, "u": u + SIGMA * rng.standard_normal(len(t))},
                                 {"i": "A", "u": "V"}, hold={"i": "zero"})


def test_a_resistance_that_rises_is_named_and_nothing_else() -> None:
    rise = 0.3
    dx = pk.diagnose(cell(), discharged(1, rise), discharged(2, rise), workers=1)
    assert dx.verdict == "named"
    (effect,) = dx.hypotheses[0].effects
    assert (effect.ids, effect.channel) == (("drift_in_output",), "sensor")
    (rate,) = effect.parameters.values()
    assert abs(rate.value - rise / 2398.0) < 4 * rate.std
    assert pk.diagnose(cell(), discharged(3, 0.0), discharged(4, 0.0), workers=1).verdict == "none"


@pytest.mark.parametrize(("output", "drifting"), [
    ("3.2 + soc - v - R*i", ["R"]),
    ("3.2 + soc - v - R1*i", []),  # R1 stands in an equation: there it is looked for
    ("R + soc", [])])  # adds: that is a drift of the sensor
def test_which_parameters_may_drift_in_an_output(output: str, drifting: list[str]) -> None:
    content = cell().to_dict()
    content["outputs"]["u"]["expression"] = output
    made = output_drifts(pk.Model.from_dict(content), 100.0)
    assert [e.variant for e in made] == drifting
