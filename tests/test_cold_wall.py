"""A room whose wall is colder than it is when the recording begins; SciPy simulates both."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.model.effects_file import read_effects

DAY, STEP, SAMPLES = 86_400.0, 1800.0, 480
RESISTANCE, CAPACITY, TO_ROOM, TO_WALL, NOISE = 0.005, 3e7, 8e-5, 2e-5, 0.03


def recorded(seed: int) -> pk.Recording:
    """Ten days, three after the house was found at 15 degC with walls of 18 degC."""
    rng = np.random.default_rng(seed)
    t = np.arange(-3 * DAY, SAMPLES * STEP, STEP)
    weather, heating = (np.repeat(rng.uniform(0.0, most, -(-len(t) // held)), held)[:len(t)]
                        for most, held in ((8.0, 48), (6000.0, 12)))
    ambient = 4.0 + 5.0 * np.sin(2 * np.pi * (t / 3600 - 9.0) / 24.0) + weather

    def slope(at: float, x: np.ndarray) -> list[float]:
        outside, power = np.interp(at, t, ambient), np.interp(at, t, heating)
        return [(outside - x[0]) / (RESISTANCE * CAPACITY) + power / CAPACITY
                + TO_ROOM * (x[1] - x[0]), TO_WALL * (x[0] - x[1])]

    run = solve_ivp(slope, (t[0], t[-1]), [15.0, 18.0], "DOP853", t, rtol=1e-8, atol=1e-9,
                    max_step=STEP / 2)
    seen = run.y[0] + NOISE * rng.standard_normal(len(t))
    within = t >= 0
    return pk.Recording.from_arrays(
        t[within], {"T_a": ambient[within], "P": heating[within], "T": seen[within]},
        units={"T_a": "degC", "P": "W", "T": "degC"}, hold={"T_a": "first", "P": "first"})


@pytest.mark.parametrize("seed", [1, 3])
def test_a_store_that_is_not_in_balance_at_first_is_named(seed: int) -> None:
    """It had been "surely" there, "and something else": a resistance that settles."""
    room = pk.systems.thermal_rc().with_candidates(*read_effects("thermal"))
    answer = diagnose(room, recorded(seed), recorded(seed + 1), workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("hidden_storage",)
    for name, value in {"k": TO_ROOM * DAY, "r": TO_WALL * DAY}.items():
        found = effect.parameters[name]
        assert found.unit == "1/d"
        assert abs(found.value - value) < 3 * found.std < 0.05 * value
    assert answer.after.value("R") == pytest.approx(RESISTANCE, rel=0.005)


def test_what_a_memory_holds_at_first_is_open_where_the_motion_may_be_under_way() -> None:
    recording, room = recorded(1), pk.systems.thermal_rc()
    open_at_first = {"fading_memory[begun]", "sensor_lag[begun]"}
    free, given = ({c.key: c for c in candidates(sites(m, (recording,)))}
                   for m in (room, room.with_initial(T=19.0)))
    assert open_at_first <= free.keys() and not open_at_first & given.keys()
    for key in open_at_first:
        assert free[key].refines and free[key].begins == (free[key].parameters[-1].name,)
