"""NLS: joint fits, scopes, bounds, starts, multiple shooting, determinism."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.strategies.nls import NLS

SIGMA = math.radians(0.1)


def slosh(seed: int = 0, **parameters: float) -> pk.Recording:
    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=seed,
                       parameters=parameters)


def started() -> pk.Model:
    return pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)


def test_two_recordings_are_fitted_jointly() -> None:
    both = NLS().fit(started(), [slosh(0), slosh(1)])
    alone = [NLS().fit(started(), slosh(k)) for k in (0, 1)]
    weights = [1 / a.std("l_theta") ** 2 for a in alone]
    mean = np.average([a.value("l_theta") for a in alone], weights=weights)
    assert both.value("l_theta") == pytest.approx(mean, abs=0.05 * both.std("l_theta"))
    assert both.std("l_theta") == pytest.approx(sum(weights) ** -0.5, rel=0.02)
    assert both.n == 1002


def test_a_parameter_of_its_own_for_every_recording() -> None:
    model = started().per_recording("d_theta")
    found = NLS().fit(model, [slosh(0, d_theta=0.1), slosh(1, d_theta=0.3)])
    assert [f.label for f in found.free] == ["l_theta", "d_theta[0]", "d_theta[1]"]
    assert found.value("d_theta", 0) == pytest.approx(0.1, abs=5 * found.std("d_theta", 0))
    assert found.value("d_theta", 1) == pytest.approx(0.3, abs=5 * found.std("d_theta", 1))


def test_an_optimum_at_a_bound_is_found_and_said() -> None:
    model = started().with_values(d_theta=0.5).with_bounds(d_theta=(0.2, 1.0))
    found = NLS(starts=1).fit(model, slosh())
    assert found.value("d_theta") == pytest.approx(0.2, abs=1e-6)
    assert any("bound" in w for w in found.warnings)
    assert np.isnan(found.std("d_theta"))


def test_same_seed_same_numbers() -> None:
    far = pk.systems.sloshing().with_values(l_theta=0.007, d_theta=0.05)
    sparse = slosh().decimate(10, channels=["theta"])
    one, two = (NLS(seed=3).fit(far, sparse) for _ in range(2))
    np.testing.assert_array_equal(one.theta, two.theta)
    assert one.history == two.history


def test_the_papers_protocol_tries_five_starts() -> None:
    found = NLS(protocol="paper").fit(started(), slosh())
    assert len(found.history) == 5
    assert found.ok


def test_multiple_shooting_fits_a_chaotic_recording_where_single_shooting_cannot() -> None:
    lorenz = pk.Model.from_dict({
        "name": "lorenz",
        "states": {"x": {"initial": 1.0}, "y": {"initial": 1.0}, "z": {"initial": 20.0}},
        "parameters": {"s": {"guess": 10.0, "bounds": [1, 50]},
                       "r": {"guess": 28.0, "bounds": [1, 100]},
                       "b": {"guess": 2.6667, "bounds": [0.1, 10]}},
        "equations": {"x": "s*(y-x)", "y": "x*(r-z)-y", "z": "x*y-b*z"},
        "outputs": {"x": {"expression": "x"}, "z": {"expression": "z"}}})
    clock = pk.Recording.from_arrays(np.arange(0, 6, 0.02), {"tick": np.arange(300.0)})
    recording = pk.simulate(lorenz, clock, sigma=0.2, seed=1)
    start = lorenz.with_values(s=7.0, r=35.0, b=1.5)
    assert not NLS(starts=1, method="explicit").fit(start, recording).ok
    led = NLS(starts=1, segments=20, method="explicit").fit(start, recording)
    assert led.ok
    assert led.theta == pytest.approx([10.0, 28.0, 2.6667], rel=0.01)


def test_a_model_that_explodes_is_one_sentence() -> None:
    model = pk.Model.from_dict({
        "name": "bang", "states": {"x": {"initial": 1.0}},
        "parameters": {"k": {"guess": 5.0, "bounds": [4.0, 6.0]}},
        "equations": {"x": "k*x**2"}, "outputs": {"x": {"expression": "x"}}})
    t = np.linspace(0, 2, 40)
    with pytest.raises(errors.SimulationFailed):
        NLS(method="explicit").fit(model, pk.Recording.from_arrays(t, {"x": np.sin(t)}))


def test_fewer_samples_than_parameters() -> None:
    few = pk.Recording.from_arrays([0.0, 1.0], {"u_x": [0.0, 1.0], "theta": [0.0, 0.1]})
    three = pk.systems.sloshing().free("m")
    with pytest.raises(errors.BadRecording, match="2 usable samples for 3"):
        NLS().fit(three, few)


def test_an_input_that_lacks_is_an_error_unless_it_has_a_default() -> None:
    recording = slosh()
    with pytest.raises(errors.BadRecording, match="u_x"):
        NLS().fit(started(), recording.without("u_x"))
    renamed = recording.rename({"u_x": "ux"})
    with pytest.raises(errors.BadRecording, match="u_x"):
        NLS().fit(started(), renamed)
    found = NLS().fit(started(), recording.with_channels(
        pk.Channel("temperature", recording.t, recording.t, "s")))
    assert any("temperature" in w for w in found.warnings)
