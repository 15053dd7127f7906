"""A coordinate that stays on one side of its origin: stops at either end; SciPy simulates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.diagnose import diagnose
from pikanid.model import Model
from pikanid.recording import Recording

STIFF, DAMPED, NOISE, STEP = 400.0, 0.8, 0.002, 0.02


def slide() -> Model:
    return Model.from_dict({
        "name": "slide", "states": {"z": {"unit": "m", "initial": "free"}, "v": {"unit": "m/s"}},
        "parameters": {"g": {"unit": "1/kg", "guess": 0.8, "bounds": [0.01, 10]},
                       "d": {"unit": "1/s", "guess": 0.5, "bounds": [0, 10]}},
        "inputs": {"f": {"unit": "N"}}, "equations": {"z": "v", "v": "g*f - d*v"},
        "outputs": {"z": {"unit": "m", "expression": "z"}}})


def driven(seed: int, buffer: float, side: int) -> Recording:
    """Held near places between 0.3 and 1.2 m, with a spring buffer beyond one."""
    rng = np.random.default_rng(seed)
    x, rows, forces = np.array([0.7, 0.0]), [], []
    wanted = np.repeat(rng.uniform(0.3, 1.2, 15), 100)
    for at in wanted:
        force = float(np.clip(12 * (at - x[0]) - 3 * x[1], -5, 5) + 0.1 * rng.standard_normal())
        rows.append(x[0])
        forces.append(force)
        x = solve_ivp(lambda t, y, by=force: [y[1], by - DAMPED * y[1] - side * STIFF * max(
            side * (y[0] - buffer), 0.0)], (0, STEP), x, rtol=1e-9, atol=1e-11).y[:, -1]
    t = STEP * np.arange(len(rows))
    seen = np.array(rows) + NOISE * rng.standard_normal(len(rows))
    return Recording.from_arrays(t, {"f": np.array(forces), "z": seen},
                                 units={"f": "N", "z": "m"})


@pytest.mark.parametrize(("buffer", "side"), [(0.45, -1), (1.0, 1)])
def test_a_buffer_is_found_at_either_end(buffer: float, side: int) -> None:
    dx = diagnose(slide(), driven(1, buffer, side), driven(2, buffer, side))
    assert dx.verdict in ("named", "set") and len(dx.hypotheses) == 1
    [effect] = dx.hypotheses[0].effects
    assert effect.ids == ("wall_impact",)
    wall = next(p for name, p in effect.parameters.items() if name.startswith("wall"))
    assert abs(side * wall.value - buffer) < 0.01


def test_a_stop_is_one_that_the_motion_leaves() -> None:
    rec = driven(1, 2.0, 1)
    low, high = rec["z"].values.min(), rec["z"].values.max()
    walls = {c.variant: c for c in candidates(sites(slide(), (rec,)))
             if c.ids == ("wall_impact",)}
    assert set(walls) == {"", "negative side"}
    for variant, least in (("", low), ("negative side", -high)):
        at = walls[variant].parameters[0]
        assert least < at.bounds[0] < least + 0.1 * (high - low)
        assert all(at.bounds[0] <= level[at.name] for level in walls[variant].levels)


def test_what_falls_freely_is_at_each_place_once() -> None:
    """Its speed and its place say the same: no stop is looked for where it has not turned."""
    fall = Model.from_dict({
        "name": "fall", "states": {"z": {"unit": "m", "initial": "free"}, "v": {"unit": "m/s"}},
        "parameters": {"g": {"unit": "m/s^2", "guess": 9.0}},
        "equations": {"z": "v", "v": "-g"}, "outputs": {"z": {"unit": "m", "expression": "z"}}})
    t = np.linspace(0.0, 1.0, 100)
    rec = Recording.from_arrays(t, {"z": 10.0 - 4.9 * t**2}, units={"z": "m"})
    found = candidates(sites(fall, (rec,)))
    walls = [c.parameters[0].bounds[0] for c in found if c.ids == ("wall_impact",)]
    assert walls and min(walls) > 0
    assert not {c.ids[0] for c in found} & {"linear_stiffness", "sensor_fading",
                                            "position_coupled_drive"}


def test_the_drive_may_depend_on_the_place() -> None:
    law = next(c for c in candidates(sites(slide(), (driven(1, 2.0, 1),)))
               if c.ids == ("position_coupled_drive",))
    assert not law.known and law.parameters[0].unit == "1/(s^2*N)"
    added = law.applied(slide()).equations["v"] - slide().equations["v"]
    assert {n.name for n in added.free_symbols} == {"f", "z", law.parameters[0].name}
