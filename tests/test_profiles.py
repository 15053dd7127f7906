"""Profiles keep to the bounds of a drive, and are as fast and long as a model asks for."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid import errors
from pikanid.mismatch.design.profiles import Bounds, motion, profiles, profiles_for, scaled
from pikanid.mismatch.design.response import decay_rate, natural_frequency
from pikanid.model import Model, systems


def test_motion_is_that_of_piecewise_constant_acceleration() -> None:
    u, dt = np.array([2.0, 2.0, -1.0, 0.0, 0.0]), 0.5
    velocity, position = motion(u, dt)
    assert velocity == pytest.approx([0.0, 1.0, 2.0, 1.5, 1.5])
    # x = v t + a t²/2 over each step
    assert position == pytest.approx([0.0, 0.25, 1.0, 1.875, 2.625])


@pytest.mark.parametrize("bounds", [Bounds(), Bounds(4.0, 1.0, 0.5), Bounds(0.3, np.inf, np.inf)])
def test_profiles_keep_to_the_drive_s_bounds(bounds: Bounds) -> None:
    kinds = set()
    for profile in profiles(2.35, bounds, seed=1):
        u, t = profile["u_x"].values, profile.t
        velocity, position = motion(u, 0.01)
        assert np.all(u[t < 2.0] == 0)
        assert np.max(np.abs(u)) <= bounds.acceleration
        assert np.max(np.abs(velocity)) <= bounds.velocity
        assert np.ptp(position) <= bounds.stroke
        assert abs(velocity[-1]) < 2e-3
        kinds.add(profile.name.split(",")[0])
        if "full" in profile.name:  # nothing is given away
            shares = [np.max(np.abs(u)) / bounds.acceleration,
                      np.max(np.abs(velocity)) / bounds.velocity, np.ptp(position) / bounds.stroke]
            assert max(shares) == pytest.approx(1.0, abs=1e-3)
    assert len(kinds) == 7


def test_profiles_are_the_same_for_a_seed_and_differ_between_draws() -> None:
    first, again, other = (profiles(2.35, seed=s, draws=2) for s in (0, 0, 1))
    assert all(np.array_equal(a["u_x"].values, b["u_x"].values)
               for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[4]["u_x"].values, other[4]["u_x"].values)
    assert len({p.name for p in first}) == len(first)


@pytest.mark.parametrize("wrong", [
    {"duration": 2.5}, {"duration": 3.4}, {"frequency": 12.0}, {"frequency": 0.0}, {"quiet": 19.9}])
def test_profiles_that_cannot_be(wrong: dict[str, float]) -> None:
    with pytest.raises(errors.BadSetting, match="profile"):
        profiles(**{"frequency": 2.35, **wrong})  # type: ignore[arg-type]
    with pytest.raises(errors.BadSetting, match="velocity"):
        Bounds(velocity=0.0)


def test_the_shortest_profiles_hold_all_kicks() -> None:
    for duration in np.arange(3.0, 5.0, 0.05):
        try:
            made = profiles(2.35, duration=duration, draws=1)
        except errors.BadSetting:
            assert duration < 3.55
        else:
            kicks = next(p for p in made if "kicks of three sizes" in p.name)["u_x"].values
            assert len({round(abs(u), 9) for u in kicks} - {0.0}) == 3


def test_scaled_profile_is_smaller() -> None:
    profile = profiles(2.35, seed=3)[6]
    smaller = scaled(profile, 1 / 3)
    assert np.all(np.abs(smaller["u_x"].values) <= np.abs(profile["u_x"].values) / 3 + 1e-6)


@pytest.mark.parametrize("equations", [
    {"x": "-20*x + b*u"}, {"x": "-1e-5*x + b*u"},  # time constants of 50 ms and of a day
    {"x": "v", "v": "-9e4*x - 30*v + b*u"},  # rings at 48 Hz
    {"x": "v", "v": "-9e-6*x - 1e-4*v + b*u"}])  # and every 35 min
def test_profiles_are_as_fast_and_as_long_as_the_model_asks_for(equations: dict[str, str]) -> None:
    model = Model.from_dict({
        "name": "rig", "states": {name: {"initial": 0.0} for name in equations},
        "inputs": {"u": {}}, "parameters": {"b": {"guess": 1.0}}, "equations": equations,
        "outputs": {"x": {"expression": "x"}}})
    slowest = natural_frequency(model) or decay_rate(model)
    assert slowest is not None
    for profile in profiles_for({"rig": model}, None, None, None, 0, {"u": (-1.0, 1.0)}):
        t = profile["u"].time
        assert len(t) <= 10_001 and not profile.notes
        assert t[1] - t[0] <= 0.051 / slowest and t[-1] >= 4.9 / slowest


def test_a_rate_that_cannot_follow_the_model_is_told() -> None:
    model = systems.sloshing()
    coarse = profiles_for({"rig": model}, None, 60.0, 0.05, 0)
    assert all("at 47" in p.notes[0] and "--rate" in p.notes[0] for p in coarse)
