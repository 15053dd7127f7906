"""A force in the square of a speed, to one side whichever way it moves, is no quadratic drag; a rig
that SciPy simulates.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.catalogue.candidate import Candidate, View
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.model import Model
from pikanid.recording import Recording

TIME = np.linspace(0.0, 12.0, 601)
SPRING, DAMPING, NOISE = 20.0, 0.8, 0.002


def model() -> Model:
    return Model.from_dict({
        "name": "arm on a spring",
        "states": {"q": {"unit": "rad", "initial": 0.0}, "w": {"unit": "rad/s", "initial": 0.0}},
        "parameters": {"k": {"unit": "1/s^2", "guess": 25.0, "bounds": [1.0, 400.0]},
                       "c": {"unit": "1/s", "guess": 1.0, "bounds": [0.0, 20.0]}},
        "inputs": {"u": {"unit": "rad/s^2", "hold": "zero"}},
        "equations": {"q": "w", "w": "u - k*q - c*w"},
        "outputs": {"y": {"unit": "rad", "expression": "q"}}})


def recorded(seed: int, even: float, odd: float = 0.0) -> Recording:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-8.0, 8.0, 25), 25)[:len(TIME)]

    def slope(t: float, s: np.ndarray) -> list[float]:
        held = u[min(int(t / TIME[1] + 1e-9), len(u) - 1)]
        return [s[1], held - SPRING * s[0] - DAMPING * s[1] + even * s[1] ** 2
                - odd * abs(s[1]) * s[1]]

    run = solve_ivp(slope, (0, TIME[-1]), (0.0, 0.0), "DOP853", TIME, rtol=1e-8, atol=1e-10,
                    max_step=TIME[1])
    return Recording.from_arrays(
        TIME, {"u": u, "y": run.y[0] + NOISE * rng.standard_normal(len(TIME))},
        units={"u": "rad/s^2", "y": "rad"}, hold={"u": "zero"})


def the_law() -> Candidate:
    found = candidates(sites(model(), (recorded(1, 0.3),)))
    [law] = [c for c in found if c.ids == ("even_drag",)]
    return law


def test_it_shows_where_the_motion_turns() -> None:
    law = the_law()
    assert not law.known
    v = np.sin(np.linspace(0.0, 9.0, 100))
    [sign] = law.directions(cast(View, SimpleNamespace(x={"w": v})))
    assert sign.force == pytest.approx(-v**2)
    # of a motion one way it is what quadratic drag is
    assert law.directions(cast(View, SimpleNamespace(x={"w": 1.0 + 0.9 * v}))) == []


@pytest.mark.parametrize("even", [0.4, -0.4])
def test_it_is_read_as_a_formula_and_no_entry_explains_it(even: float) -> None:
    answer = diagnose(model(), recorded(2, even), recorded(3, even), workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("symbolic:a_w*w**2",)
    assert effect.parameters["a_w"].value == pytest.approx(even, abs=0.002)


def test_quadratic_drag_is_told_from_it() -> None:
    answer = diagnose(model(), recorded(4, 0.0, 0.4), recorded(5, 0.0, 0.4), workers=1)
    assert answer.verdict == "named"
    assert answer.hypotheses[0].effects[0].ids[0] == "quadratic_drag"
