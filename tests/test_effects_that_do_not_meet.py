"""Effects of which a model holds either, but not both: what a scale error leaves of a temperature
in degC has no fourth power.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.extended import extended
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


@pytest.fixture(scope="module")
def case() -> Case:
    house = pk.systems.thermal_rc().with_values(R=0.005, C=1e7, T_0=20.0)
    t = np.arange(0.0, 2e5, 600.0)
    drive = pk.Recording.from_arrays(
        t, {"T_a": 5 + 5 * np.sin(t / 2e4), "P": 2000.0 + 2000.0 * np.sign(np.sin(t / 7e3))},
        {"T_a": "degC", "P": "W"}, hold={"T_a": "zero", "P": "zero"})
    run = pk.simulate(house, drive, sigma={"T": 0.02}, seed=1)
    return open_case(house, (run,), None, None, lambda text: None, DEFAULTS)


def test_they_are_fitted_each_by_itself_and_not_together(case: Case) -> None:
    listed = {c.ids[0] + c.variant: c for c in case.candidates}
    gain, radiation = listed["input_gainT_a"], listed["radiation"]
    for alone in (gain, radiation):
        assert fitted(case.model, [alone], case.records, [{}], 30) is not None
    assert fitted(case.model, [radiation, gain], case.records, [{}], 30) is None


def test_what_cannot_be_added_shows_nothing(case: Case) -> None:
    def refused(model: pk.Model) -> pk.Model:
        raise errors.BadUnit("a power of degC")

    listed = {c.ids[0] + c.variant: c for c in case.candidates}
    bad = replace(listed["radiation"], extend=refused)
    found = directions(case.base.whitened, case.base.minimum.theta, [bad, listed["convection"]])
    assert {c.ids[0] for c in found.candidates} == {"convection"} and len(found.owner)


def test_of_two_that_give_an_input_the_same_path_there_is_no_model_of_both(case: Case) -> None:
    def play(name: str) -> Candidate:
        width = pk.Parameter(name, 0.0, "W", (0.0, 1e3))
        return replace(case.candidates[0], ids=(name,), variant="", parameters=(width,),
                       extend=lambda model: model.map_input("P", backlash=name))

    one, other = play("w_gear"), play("w_belt")
    for alone in (one, other):
        assert fitted(case.model, [alone], case.records, [{}], 30) is not None
    assert fitted(case.model, [one, other], case.records, [{}], 30) is None


def test_what_an_input_was_is_one_quantity_of_all_its_delays(case: Case) -> None:
    late = [c for c in case.candidates if c.twin == "delay" and "u_past_T_a" in c.begins]
    assert {c.channel for c in late} == {"input", "sensor"}
    own, shown = (next(c for c in late if c.channel == channel) for channel in ("input", "sensor"))
    for pair in ([own, shown], [shown, own]):
        both = extended(case.model, pair)
        assert both.input("T_a").past == symbol("u_past_T_a")
        assert both.input("T_a").delay == symbol("tau_in") + symbol("tau")


def test_what_can_be_put_together_in_one_order_only_stays_in_that(case: Case) -> None:
    """A temperature that is limited and then scaled: a scale error has no limit in degC."""
    def added(name: str, before: str) -> Candidate:
        size = pk.Parameter(name, 0.0, "")

        def extend(model: pk.Model) -> pk.Model:
            if before in model.parameter_names:
                raise errors.BadUnit("a limit of what is scaled")
            return model.map_input("P", gain=f"1 + {name}")

        return replace(case.candidates[0], ids=(name,), variant="", parameters=(size,),
                       extend=extend, channel="input")

    limit, scale = added("e_limit", "e_scale"), added("e_scale", "")
    found = fitted(case.model, [limit, scale], case.records, [{}], 30)
    assert found is not None and [e.ids[0] for e in found.effects] == ["e_limit", "e_scale"]
