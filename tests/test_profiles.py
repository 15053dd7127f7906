"""Input profiles: what goes forth comes back, and the seed decides what is random."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pikanid as pk
from pikanid.cli import main
from pikanid.errors import BadSetting
from pikanid.mismatch.design.profiles import Bounds, _pulses, profiles, profiles_for, scaled
from pikanid.model import systems


def test_every_pulse_has_its_counterpart() -> None:
    for seed in range(5):
        u = _pulses(np.random.default_rng(seed), 1800, 2.0, 0.01)
        assert np.abs(u).max() <= 1.0 and np.count_nonzero(u) > 100
        assert abs(u.sum()) < 1e-9
        edges = np.flatnonzero(np.diff(np.concatenate([[0.0], u, [0.0]])))
        assert len(edges) >= 8


def test_profiles_are_as_random_as_their_seed() -> None:
    def values(seed: int) -> list[np.ndarray]:
        made = profiles_for({"one": systems.sloshing()}, None, 10.0, 0.02, seed)
        return [r["u_x"].values for r in made]

    once, again, other = values(1), values(1), values(2)
    assert all(np.isfinite(u).all() and np.ptp(u) > 0.0 for u in once)
    assert all(map(np.array_equal, once, again))
    assert not all(map(np.array_equal, once, other))
    names = [r.name for r in profiles(2.35, duration=10.0, draws=1)]
    assert len(set(names)) == len(names)


EXCHANGER = pk.Model.from_dict({
    "name": "exchanger",
    "states": {"Th": {"unit": "degC", "initial": 40.0}, "Tc": {"unit": "degC", "initial": 20.0}},
    "inputs": {"Fh": {"unit": "kg/s", "hold": "zero"}, "Fc": {"unit": "kg/s", "hold": "zero"}},
    "parameters": {"k": {"unit": "kg/s", "guess": 0.1, "bounds": [0.01, 2.0]}},
    "equations": {"Th": "(Fh*(80 - Th) - k*(Th - Tc))/2", "Tc": "(Fc*(15 - Tc) + k*(Th - Tc))/2"},
    "outputs": {"Th": {"unit": "degC", "expression": "Th"}}})


def flows(low: float = 30.0, high: float = 300.0) -> pk.Recording:
    """Both in g/s, every two seconds, with a temperature."""
    t, rng = 2.0 * np.arange(300), np.random.default_rng(0)
    return pk.Recording.from_arrays(
        t, {"Fh": rng.uniform(low, high, 300), "Fc": rng.uniform(low, high, 300),
            "Th": 40.0 + np.sin(t)}, {"Fh": "g/s", "Fc": "g/s", "Th": "degC"})


def test_an_input_that_is_no_acceleration_keeps_to_its_range() -> None:
    """As recorded, in the model's unit, at the rate of what was recorded; every input moves."""
    offered = profiles_for({"one": EXCHANGER}, None, 400.0, None, 0, {"Fc": (0.1, 0.2)}, [flows()])
    for profile in offered:
        assert np.allclose(np.diff(profile.t), 2.0)
        for name, low, high in (("Fh", 0.03, 0.3), ("Fc", 0.1, 0.2)):
            values = profile[name].values
            assert low <= values.min() < values.max() <= high
            assert values[0] == pytest.approx((low + high) / 2, abs=1e-3)
    whole = [p for p in offered if "full" in p.name]
    assert all(np.ptp(p["Fh"].values) > 0.45 * (0.3 - 0.03) for p in whole)
    # less of it is closer to where it rests
    half = scaled(whole[0], 0.5)["Fh"].values
    assert np.allclose(half - half[0], (whole[0]["Fh"].values - half[0]) / 2, atol=1e-6)


def test_a_range_that_nobody_has_said_is_asked_for() -> None:
    for ranges, recorded, said in (
            (None, [], "input 'Fh' go, in kg/s? Say it (--range Fh=LOW:HIGH"),
            ({"Fh": (0.0, 1.0)}, [], "input 'Fc' go"), (None, [flows(50.0, 50.0)], "input 'Fh' go"),
            ({"Fh": (1.0, 0.0)}, [], "cannot go from 1 to 0"),
            ({"F": (0.0, 1.0)}, [], "'F', which drives nothing (inputs: Fh, Fc)")):
        with pytest.raises(BadSetting, match=re.escape(said)):
            profiles_for({"one": EXCHANGER}, None, 400.0, 1.0, 0, ranges, recorded)
    # the bounds of a drive hold for whatever they are given
    assert profiles_for({"one": EXCHANGER}, Bounds(0.1, np.inf, np.inf), 400.0, 1.0, 0)
    motor = ["design", "dc_motor", "--sigma", "2rad/s", "--out", "next.csv"]
    assert main(motor) == 2 and main([*motor, "--range", "u=6"]) == 2


def test_the_command_takes_a_range_with_a_unit(tmp_path: Path) -> None:
    out = tmp_path / "next.csv"
    assert main(["design", "dc_motor", "--sigma", "2rad/s", "--range", "u=0:6000mV", "--duration",
                 "5", "--rate", "50", "--out", str(out), "--quiet"]) == 0
    u = pk.Recording.read(out)["u"]
    assert 0 <= u.values.min() < u.values.max() <= 6 and u.unit == "V"
    assert np.allclose(np.diff(u.time), 0.02)
