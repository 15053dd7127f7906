"""Whether something is surely missing in the dynamics: free curves of the channels compared."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.beyond.free_channels import _left, sure_channels
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.model import Model, systems

MODEL = systems.sloshing()


def opened(truth: Model, short: bool = False) -> Case:
    seen = [pk.simulate(truth, pk.excitation.two_pulse() if short else
                        pk.excitation.planar_moves(8, 16.0, seed=s), sigma=0.002, seed=s)
            for s in (1, 2)]
    return open_case(MODEL, (seen[0],), (seen[1],), None, lambda text: None, DEFAULTS)


@pytest.mark.parametrize(("truth", "surely"), [
    (MODEL, False),
    (MODEL.with_term("theta_dot", "-sign(theta_dot)"), True),
    (MODEL.with_term("theta_dot", "-0.7*(sin(30*theta + 0.5) - sin(0.5))"), True),
    (MODEL.map_output("theta", function="theta + 0.02*sin(30*theta)"), False),
    (MODEL.map_output("theta", function="theta + 3*theta**3"), False),
    (MODEL.map_input("u_x", function="u_x + 0.4*u_x**2"), False),
    (MODEL.map_input("u_x", [pk.Parameter("tau", 0.02)], lag="tau"), False)])
def test_only_what_no_sensor_and_no_input_can_do_is_surely_a_force(
        truth: Model, surely: bool) -> None:
    case = opened(truth)
    assert (sure_channels(case.base, case.sites[0], case.candidates, ()) == ("dynamics",)) is surely


def test_a_long_delay_is_no_force_once_it_has_been_refitted() -> None:
    """To first order about a fit that makes up for it, only a free force explains what it does."""
    truth = MODEL.with_values({"l_theta": 0.061}).map_output(
        "theta", [pk.Parameter("tau", 0.06)], delay="tau")
    case = opened(truth, short=True)
    base, site = case.base, case.sites[0]
    assert sure_channels(base, site, case.candidates, (base,))
    late = next(c for c in case.candidates if c.key == "input_delay")
    found = fitted(MODEL, (late,), case.records, [{**base.values, "tau": 0.05}], 1)
    assert found is not None
    assert not sure_channels(base, site, case.candidates, (base, found))


def test_what_is_left_of_noise_is_nothing() -> None:
    rng = np.random.default_rng(0)
    noise, columns = rng.normal(size=4000), rng.normal(size=(4000, 50)) / 4000**0.5
    assert abs(_left(columns, noise, 4000)) < 4 * (2 / 4000)**0.5
    target = noise + 300 * columns[:, 3]
    assert _left(columns[:, :0], target, 4000) > 10
    assert abs(_left(columns, target, 4000)) < 4 * (2 / 4000)**0.5
