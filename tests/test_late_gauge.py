"""One of several sensors is late, or lags, while the motion is under way; plants that SciPy
simulates.

What a late one shows first was before the recording, which the sensor of a model that begins with
the recording cannot show; one that lags is behind by then.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose

TIME = np.arange(0.0, 900.0, 3.0)
LATE, NOISE = 9.0, 0.005


def model(starts: str = "free") -> pk.Model:
    level = {"unit": "m", "guess": 1.0, "bounds": [0.01, 5.0]}
    rate = {"guess": 0.02, "bounds": [1e-4, 1.0]}
    fixed = {"unit": "m", "initial": 0.8}
    return pk.Model.from_dict({
        "name": "tanks",
        "states": {"a": level | {"initial": "free"},
                   "b": level | {"initial": "free"} if starts == "free" else fixed},
        "parameters": {"k": rate | {"unit": "m^0.5/s"}, "c": rate | {"unit": "m^0.5/s"},
                       "g": rate | {"unit": "1/s"}},
        "inputs": {"u": {"unit": "m", "hold": "zero"}},
        "equations": {"a": "g*u - k*sqrt(a)", "b": "k*sqrt(a) - c*sqrt(b)"},
        "outputs": {"upper": {"unit": "m", "expression": "a"},
                    "lower": {"unit": "m", "expression": "b"}}})


def recorded(seed: int, begun: tuple[float, float], late: float = LATE, lag: float = 0.0
             ) -> pk.Recording:
    """Half a minute after the plant was begun; the lower gauge is late, or lags."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.5, 3.0, 30), 10)

    def slope(t: float, x: np.ndarray) -> list[float]:
        pumped = 0.015 * u[min(max(int(t / 3.0 + 1e-9), 0), len(u) - 1)]
        between, out = 0.02 * np.sqrt(max(x[0], 0.0)), 0.025 * np.sqrt(max(x[1], 0.0))
        return [pumped - between, between - out, (x[1] - x[2]) / (lag or 1.0)]

    run = solve_ivp(slope, (-30.0, TIME[-1]), (*begun, begun[1]), "DOP853", dense_output=True,
                    rtol=1e-8, atol=1e-10, max_step=1.5)
    lower = run.sol(TIME - late)[2 if lag else 1]
    seen = {"upper": run.sol(TIME)[0], "lower": lower}
    noisy = {n: y + NOISE * rng.standard_normal(len(TIME)) for n, y in seen.items()}
    return pk.Recording.from_arrays(TIME, {"u": u, **noisy}, hold={"u": "zero"},
                                    units={"u": "m", "upper": "m", "lower": "m"})


def late_gauge(of: pk.Model) -> Candidate:
    found = candidates(sites(of, (recorded(1, (2.5, 0.6)),)))
    return next(c for c in found if "sensor_delay" in c.ids and c.site.output.name == "lower")


@pytest.mark.parametrize("seed", [1, 3])
def test_a_late_gauge_of_a_running_plant_is_named(seed: int) -> None:
    answer = diagnose(model(), recorded(seed, (2.5, 0.6)), recorded(seed + 1, (1.0, 2.0)),
                      workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("sensor_delay",) and effect.channel == "sensor"
    found = effect.parameters["tau_b"]
    assert abs(found.value - LATE) < 3 * found.std < 1.0
    for name, value in {"k": 0.02, "c": 0.025, "g": 0.015}.items():
        assert answer.after.value(name) == pytest.approx(value, rel=0.005)


@pytest.mark.parametrize("seed", [1, 3])
def test_one_that_lags_is_behind_at_first(seed: int) -> None:
    """It had been "surely" late, with a part of the input in what it shows."""
    one, other = (recorded(s, begun, 0.0, 9.0) for s, begun in (
        (seed, (2.5, 0.6)), (seed + 1, (1.0, 2.0))))
    answer = diagnose(model(), one, other, workers=1)
    assert answer.verdict == "named"
    [effect] = answer.hypotheses[0].effects
    assert effect.ids == ("sensor_lag",)
    lag, behind = (effect.parameters[n] for n in ("tau_s_b", "d_lag_s_b"))
    assert abs(lag.value - 9.0) < 3 * lag.std < 1.0
    assert behind.value < -5 * behind.std


def test_a_punctual_one_is_not_late() -> None:
    answer = diagnose(model(), recorded(5, (2.5, 0.6), 0.0), recorded(6, (1.0, 2.0), 0.0),
                      workers=1)
    assert answer.verdict == "none"


def test_what_begins_somewhere_given_shows_that_until_then() -> None:
    """Of a motion that begins with the recording, nothing was before it."""
    free, fixed = (late_gauge(model(starts)).applied(model(starts)) for starts in ("free", "given"))
    assert [str(o.delay) for o in free.outputs] == ["-tau_b", "0"]
    assert str(free.inputs[0].delay) == "tau_b"
    assert [str(o.delay) for o in fixed.outputs] == ["0", "tau_b"]
    assert str(fixed.inputs[0].delay) == "0"


def hares(t: float, x: np.ndarray) -> list[float]:
    return [x[0] * (1.0 - 0.5 * x[1]), x[1] * (0.3 * x[0] - 0.8)]


def test_without_an_input_it_is_seen_as_it_was() -> None:
    populations = pk.Model.from_dict({
        "name": "populations",
        "states": {n: {"initial": "free", "guess": g, "bounds": [0.0, 50.0]}
                   for n, g in (("h", 2.0), ("l", 1.0))},
        "parameters": {n: {"guess": g, "unit": "1/s"} for n, g in zip(
            "abcd", (1.0, 0.5, 0.3, 0.8), strict=True)},
        "equations": {"h": "h*(a - b*l)", "l": "l*(c*h - d)"},
        "outputs": {"hares": {"expression": "h"}, "lynx": {"expression": "l"}}})
    t = np.linspace(0.0, 20.0, 201)
    run = solve_ivp(hares, (-1.0, 20.0), [2.0, 1.0], "DOP853", dense_output=True, rtol=1e-9,
                    atol=1e-11)
    seen = pk.Recording.from_arrays(t, {"hares": run.sol(t)[0], "lynx": run.sol(t - 0.7)[1]})
    law = next(c for c in candidates(sites(populations, (seen,)))
               if "sensor_delay" in c.ids and c.site.output.name == "lynx")
    late = law.applied(populations).with_values(
        {law.parameters[0].name: 0.7, "h_0": run.sol(-0.7)[0], "l_0": run.sol(-0.7)[1]})
    shown = pk.simulate(late, seen)
    for name in ("hares", "lynx"):
        assert shown[name].values == pytest.approx(seen[name].values, rel=1e-5)
