"""The zero of an input's sensor, on a cell whose motion is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.bound_effects import bound_to
from pikanid.mismatch.catalogue.input_offset import input_offsets
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import systems

Q, R0, R1, T1 = 2000.0, 0.05, 0.08, 30.0
CELL = pk.Model.from_dict({
    "name": "cell", "states": {"soc": {"initial": 0.7}, "v": {"unit": "V"}},
    "inputs": {"I": {"unit": "A", "hold": "zero"}},
    "parameters": {"Q": {"unit": "A*s", "value": Q},
                   "R0": {"unit": "ohm", "guess": 0.04, "bounds": [0.001, 1]},
                   "R1": {"unit": "ohm", "guess": 0.05, "bounds": [0.001, 1]},
                   "T1": {"unit": "s", "guess": 20, "bounds": [2, 200]},
                   "E": {"unit": "V", "guess": 3, "bounds": [2, 4]}},
    "equations": {"soc": "-I/Q", "v": "(R1*I - v)/T1"},
    "outputs": {"V": {"unit": "V", "expression": "E + 0.6*soc - R0*I - v"}}})


def cell(seed: int, offset: float, sigma: float = 0.002) -> pk.Recording:
    """Steps of current; the true one is larger than what is recorded by an offset."""
    rng = np.random.default_rng(seed)
    recorded = np.repeat(rng.uniform(-3.0, 4.0, 30), 20)
    true, soc, v = recorded + offset, 0.7, 0.0
    fade, seen = np.exp(-1.0 / T1), []
    for current in true:
        seen.append(3.1 + 0.6 * soc - R0 * current - v)
        soc, v = soc - current / Q, fade * v + R1 * (1.0 - fade) * current
    noisy = np.array(seen) + sigma * rng.standard_normal(len(seen))
    return pk.Recording.from_arrays(np.arange(len(seen)) * 1.0, {"I": recorded, "V": noisy},
                                    {"I": "A", "V": "V"})


def test_it_acts_everywhere_the_input_does() -> None:
    recording = cell(1, 0.0)
    own = bound_to([], sites(CELL, (recording,)), [recording],
                   lambda: dict.fromkeys(CELL.state_names, np.array([0.0, 1.0])))
    (effect,) = (e for e in own if e.key == "input_offset")
    found = CELL.with_effect(effect)
    shifted = symbol("I") + symbol("I_zero")
    assert effect.size.unit == "A"
    for name, formula in CELL.equations.items():
        assert found.equations[name].equals(formula.subs(symbol("I"), shifted))
    assert found.output("V").expression.equals(
        CELL.output("V").expression.subs(symbol("I"), shifted))


def test_of_one_equation_it_is_a_constant_force() -> None:
    assert [*input_offsets(systems.dc_motor(), {"u": 6.0})] == []
    (effect,) = input_offsets(systems.cart_pole(), {"F": 4.0}, {"F_zero"})
    assert effect.size.name == "F_zero_x"


@pytest.mark.parametrize(("offset", "verdict"), [(0.3, "named"), (0.0, "none")])
def test_it_is_found_where_it_is(offset: float, verdict: str) -> None:
    dx = pk.diagnose(CELL, cell(2, offset), cell(3, offset), workers=1)
    assert dx.verdict == verdict, str(dx)
    if offset:
        (effect,) = dx.hypotheses[0].effects
        assert effect.ids == ("input_offset",)
        size = effect.parameters["I_zero"]
        assert abs(size.value - offset) < 4 * size.std and size.std < 0.05 * offset
