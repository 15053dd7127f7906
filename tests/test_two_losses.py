"""What is enough for the recording that it was fitted to and not for the others is no reason to
stop: a dead zone and a leak together look like one loss that rises near zero.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.steps.confirming import confirmed
from pikanid.mismatch.steps.opening import open_case
from pikanid.mismatch.steps.searching import searched

AREA, OUTLET, DEAD, LEAK = 420.0, 22.0, 1.2, 9e-4  # cm^2, cm^2.5/s, l/min, 1/s
STEP, COUNT = 2.0, 900


def vat() -> pk.Model:
    return pk.Model.from_dict({
        "name": "vat", "states": {"h": {"unit": "cm", "initial": "free"}},
        "inputs": {"q": {"unit": "l/min", "hold": "zero"}},
        "parameters": {"A": {"guess": 300.0, "unit": "cm^2", "bounds": [10.0, 5000.0]},
                       "k": {"guess": 15.0, "unit": "cm^2.5/s", "bounds": [0.0, 200.0]}},
        "equations": {"h": "(q - k*sqrt(h))/A"},
        "outputs": {"h": {"unit": "cm", "expression": "h"}}})


def recorded(seed: int) -> pk.Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(COUNT) * STEP
    q = np.repeat(rng.uniform(2.0, 9.0, COUNT // 45), 45)

    def rate(time: float, h: np.ndarray) -> np.ndarray:
        fed = max(q[min(int(time / STEP + 1e-9), COUNT - 1)] - DEAD, 0.0) * 1000 / 60
        return (fed - OUTLET * np.sqrt(np.maximum(h, 0.0))) / AREA - LEAK * h

    run = solve_ivp(rate, (0.0, t[-1]), [12.0], "Radau", t, rtol=1e-7, atol=1e-8, max_step=STEP)
    h = run.y[0] + 0.05 * rng.standard_normal(COUNT)
    return pk.Recording.from_arrays(t, {"q": q, "h": h}, units={"q": "l/min", "h": "cm"},
                                    hold={"q": "zero"}, name=f"vat {seed}")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 11])
def test_two_effects_are_looked_for_where_one_does_not_hold(seed: int) -> None:
    found = pk.diagnose(vat(), recorded(seed), recorded(seed + 1))
    assert found.verdict in ("unconfirmed", "set")
    constant = {"input_dead_zone", "pump_offset", "static_bias", "coulomb_friction",
                "symbolic:-c_one*(sign(h) + 1)/2"}
    for h in found.hypotheses:
        first, second = sorted((e.ids[0] for e in h.effects), key="seepage".__eq__)
        assert second == "seepage" and first in constant


def test_the_search_goes_on_only_where_what_it_found_does_not_hold(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a leak alone nothing more is asked."""
    monkeypatch.setitem(globals(), "DEAD", 0.0)
    case = open_case(vat(), (recorded(3),), (recorded(4),), None, lambda text: None,
                     pk.Settings())
    ranked = searched(case, lambda text: None)
    grown: list[object] = []
    monkeypatch.setattr(case.search, "grow", lambda adequate: grown.append(adequate))
    assert confirmed(case, ranked).verdict in ("named", "set") and not grown
