"""Effects of sensors and inputs: their parameters, and where fits of them begin."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue import channels
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.cross_axis import cross_axis
from pikanid.mismatch.catalogue.forces import disturbance, wall_impact
from pikanid.mismatch.catalogue.site import Site, sites

T = np.linspace(0.0, 10.0, 1001)


@pytest.fixture(scope="module")
def site() -> Site:
    model = pk.systems.sloshing()
    return sites(model, (pk.simulate(model, pk.excitation.two_pulse(), sigma=0.002),))[0]


def view() -> Any:
    return SimpleNamespace(t=T, y={"theta": 0.2 * np.sin(3 * T)}, u={"u_x": np.cos(2 * T)})


def every(site: Site) -> list[Candidate]:
    return [c for make in (
        channels.sensor_offset, channels.sensor_drift, channels.sensor_gain,
        channels.sensor_nonlinearity, channels.sensor_saturation, channels.delay, channels.lags,
        channels.input_gain, channels.input_limits, channels.input_backlash, channels.input_hold)
        for c in make(site)]


def test_parameters_have_the_names_that_files_hold(site: Site) -> None:
    names = {c.key: [p.name for p in c.parameters] for c in every(site)}
    assert names == {
        "sensor_offset": ["offset"], "sensor_drift": ["beta"], "sensor_gain": ["k_out"],
        "sensor_nonlinearity": ["k_y3"], "sensor_saturation": ["limit"], "input_delay": ["tau"],
        "sensor_lag": ["tau_s"], "actuator_lag": ["tau_a"], "input_gain": ["k_in"],
        "input_saturation": ["u_max"], "input_dead_zone": ["u_dead"],
        "hysteresis[backlash]": ["half_play"], "input_hold": []}


def test_twins_are_what_small_motions_cannot_tell_apart(site: Site) -> None:
    groups: dict[str, set[str]] = {}
    for c in every(site):
        groups.setdefault(c.twin, set()).add(c.key)
    assert groups == {
        "offset": {"sensor_offset"}, "delay": {"input_delay"},
        "gain": {"sensor_gain", "input_gain"}, "lag": {"sensor_lag", "actuator_lag"},
        "": {"sensor_drift", "sensor_nonlinearity", "sensor_saturation", "input_saturation",
             "input_dead_zone", "hysteresis[backlash]", "input_hold"}}


def test_limits_begin_where_the_signal_meets_them(site: Site) -> None:
    for c, name, top in ((channels.sensor_saturation(site)[0], "limit", 0.2),
                         (channels.input_limits(site)[0], "u_max", 1.0)):
        begun = [d.start[name] for d in c.directions(view())]
        assert len(begun) == 6 and max(begun) < top and min(begun) > 0.4 * top
        assert all(np.any(d.seen if d.seen is not None else d.push["u_x"])
                   for d in c.directions(view()))


def test_lags_begin_among_those_that_are_looked_for(site: Site) -> None:
    for c in channels.lags(site):
        (tau,) = c.parameters
        low, high = tau.bounds
        assert low < min(channels.LAGS) <= tau.value <= max(channels.LAGS) < high


@pytest.mark.parametrize("inputs", [("u",), ()])
def test_a_channel_beside_can_act_directly_only_beside_an_input(inputs: tuple[str, ...]) -> None:
    model: Any = SimpleNamespace(input=lambda u: SimpleNamespace(unit="m/s^2"))
    made: Any = SimpleNamespace(inputs=inputs, extra=("w",), v="v", unit="rad", model=model,
                                name=lambda n: n)
    (candidate,) = cross_axis(made)
    assert (candidate.other is not None) == bool(inputs)


def test_play_never_leaves_the_input_further_than_its_half(site: Site) -> None:
    (candidate,) = channels.input_backlash(site)
    u = view().u["u_x"]
    for d in candidate.directions(view()):
        half = d.start["half_play"]
        push = d.push["u_x"]
        assert np.abs(push).max() == pytest.approx(half)
        acts = u + push
        # where the input turns round it moves nothing until the play is used up
        turned = np.abs(np.diff(acts)) < 1e-12
        assert 0 < turned.sum() < len(u)


def test_walls_stand_on_either_side(site: Site) -> None:
    above, below, both = wall_impact(site)
    x = {"theta": np.linspace(-0.2, 0.3, 501)}
    for wall, sign in ((above, 1.0), (below, -1.0)):
        for d in wall.directions(cast(Any, SimpleNamespace(x=x))):
            pushed = d.force != 0.0
            assert np.all(sign * x["theta"][pushed] > d.start["wall"] - 1e-12)
            assert np.all(sign * d.force[pushed] < 0.0)
    assert len({above.key, below.key, both.key}) == 3
    for d in both.directions(cast(Any, SimpleNamespace(x=x))):
        # at the same distance, within what is reached on both sides but for the farthest
        assert np.all(d.force * x["theta"] <= 0.0) and d.start["wall"] <= 1.03 * 0.2
        assert np.any(d.force > 0.0) == (d.start["wall"] < 0.2) and np.any(d.force < 0.0)


def test_soft_springs_have_a_natural_rate_too() -> None:
    model = pk.Model.from_dict({
        "name": "soft", "states": {"x": {"unit": "m"}, "v": {"unit": "m/s", "initial": 1.0}},
        "parameters": {"k": {"guess": 0.25}},
        "equations": {"x": "v", "v": "-k*x"}, "outputs": {"x": {"expression": "x", "unit": "m"}}})
    recording = pk.Recording.from_arrays(T, {"x": np.sin(0.5 * T)}, {"x": "m"})
    assert sites(model, (recording,))[0].rate == pytest.approx(0.5)


def test_a_force_that_acts_once_acts_within_the_record(site: Site) -> None:
    (candidate,) = disturbance(site)
    first, last = site.span
    shown = candidate.directions(cast(Any, SimpleNamespace(t=np.linspace(first, last, 501))))
    begun = np.array([d.start["t_peak"] for d in shown])
    assert begun.min() > first and begun.max() < last
    assert all(np.any(d.force) for d in shown)
