"""Inputs that move from the beginning: what acted before a recording is not known, and late inputs
show it for a while.
"""

import numpy as np
import pytest
from perturbed import assert_sensitivities

import pikanid as pk
from pikanid import errors
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model.parts import Hold, Parameter
from pikanid.problem.problem import bind
from pikanid.simulation.simulator import Simulator
from pikanid.simulation.translated import Translated

LATE, WAS = 0.043, -1.5
A, B, DELAY, NOISE = 0.04, 0.05, 4.3, 0.01  # of the vessel [1/s, K/J, s, K]


def late(hold: Hold = "zero") -> pk.Model:
    """A tank whose input comes late, after another value."""
    return pk.systems.sloshing().map_input(
        "u_x", [Parameter("tau", LATE, "s", (0.0, 1.0)),
                Parameter("was", WAS, "m/s^2", scope="recording")],
        hold=hold, delay="tau", past="was")


def wandering(hold: Hold = "zero", about: float = 0.0) -> pk.Recording:
    u = about + 0.1 * np.cumsum(np.random.default_rng(0).normal(size=600))
    return pk.Recording.from_arrays(0.01 * np.arange(600), {"u_x": u}, units={"u_x": "m/s^2"},
                                    hold={"u_x": hold})


def vessel(initial: "str | float" = "free") -> pk.Model:
    return pk.Model.from_dict({
        "name": "vessel", "states": {"T": {"unit": "K", "initial": initial}},
        "inputs": {"q": {"unit": "W"}},
        "parameters": {"a": {"unit": "1/s", "guess": 0.03, "bounds": [0.0, 1.0]},
                       "b": {"unit": "K/J", "guess": 0.06, "bounds": [0.0, 5.0]}},
        "equations": {"T": "-a*T + b*q"}, "outputs": {"T": {"unit": "K", "expression": "T"}}})


def run(seed: int, delay: float = DELAY, began: bool = False) -> pk.Recording:
    """600 s of a vessel that is heated in steps, in operation or as heating begins; solved exactly.

    Whether the heater or the thermometer is late makes no difference to it.
    """
    rng = np.random.default_rng(seed)
    before, count, fine = 200, 600, 20
    q = np.repeat(rng.uniform(0.0, 2.0, 40), 20)
    if began:
        q[:before] = 0.0
    steps = np.repeat(q, fine)
    T, left = np.zeros(len(steps) + 1), np.exp(-A / fine)
    for k, heat in enumerate(steps):
        T[k + 1] = T[k] * left + heat * B / A * (1 - left)
    shown = T[(np.arange(before, before + count) * fine - round(delay * fine))]
    return pk.Recording.from_arrays(
        np.arange(count, dtype=float), {"q": q[before:], "T": shown + NOISE * rng.normal(
            size=count)}, units={"q": "W", "T": "K"})


@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("kind", [Simulator, Translated])
def test_sensitivities_are_those_of_differences(kind: type[Simulator], hold: Hold) -> None:
    model = late(hold)
    simulator = kind(model, bind(model, pk.simulate(model, wandering(hold), sigma=0.0)))
    p = np.array([0.045, 0.15, 0.3, 9.81, LATE, WAS])
    assert_sensitivities(simulator, p, np.array([0, 1, 4, 5]))


@pytest.mark.parametrize("hold", ["zero", "first"])
def test_simulated_motion_is_that_of_a_recording_that_begins_before(hold: Hold) -> None:
    rec = wandering(hold)
    # the past, and for a hold of first order the jump that ends it
    t = np.concatenate([[0.0, LATE - 1e-6], LATE + rec["u_x"].time])
    u = np.concatenate([[WAS, WAS], rec["u_x"].values])
    shifted = pk.Recording.from_arrays(t, {"u_x": u}, units={"u_x": "m/s^2"}, hold={"u_x": hold})
    at = rec["u_x"].time
    expected = pk.simulate(pk.systems.sloshing(), shifted, sigma=0.0, t=at)["theta"].values
    found = pk.simulate(late(hold), rec, sigma=0.0)["theta"].values
    assert found == pytest.approx(expected, abs=2e-6)  # the jump takes 1e-6 s there
    held = pk.simulate(late(hold).with_values(was=float(u[2])), rec, sigma=0.0)["theta"].values
    assert np.abs(found - held).max() > 1e-3
    # what methods without a simulation see
    bound = bind(late(hold), pk.simulate(late(hold), rec, sigma=0.0))
    assert bound.inputs(np.array([0.0, LATE / 2, LATE + 1e-6]))[:, 0] == pytest.approx(
        [WAS, WAS, u[2]], abs=1e-3)


def test_fit_finds_what_was_before_each_recording() -> None:
    made = [pk.simulate(late().with_values(was=was), wandering(about=u), sigma=0.0005, seed=seed)
            for seed, (was, u) in enumerate(((2.0, 0.5), (-3.0, -1.0)))]
    est = pk.NLS().fit(late().with_values(tau=0.03, was=0.0), made)
    for name, of, true in (("tau", None, LATE), ("was", 0, 2.0), ("was", 1, -3.0)):
        assert abs(est.value(name, of) - true) < 4 * est.std(name, of) < 0.4


def test_files_and_dicts_keep_it() -> None:
    assert late().to_dict()["inputs"]["u_x"]["past"] == "was"
    assert pk.Model.from_dict(late().to_dict()) == late()
    with pytest.raises(errors.BadModel, match="has a past already"):
        late().map_input("u_x", past=1.0)


def test_the_past_of_what_moves_is_unknown_unless_the_model_begins_in_balance() -> None:
    rec = run(1)
    assert sites(vessel(), (rec,))[0].pasts.keys() == {"q"}
    assert not sites(vessel("b*q/a"), (rec,))[0].pasts
    resting = pk.Recording.from_arrays(rec["q"].time, {"q": rec["q"].values - rec["q"].values[0]},
                                       units={"q": "W"})
    assert not sites(vessel(), (resting,))[0].pasts


@pytest.mark.parametrize(("initial", "began"), [("free", False), ("free", True), (0.0, True)])
def test_in_operation_a_late_input_is_the_same_as_a_late_output(
        initial: "str | float", began: bool) -> None:
    """The first seconds, under what was before, would tell them apart and are the past's own."""
    given = pk.diagnose(vessel(initial), run(3, began=began), run(4, began=began))
    assert given.verdict in ("named", "set")
    assert any([{*e.ids} for e in h.effects] == [{"input_delay", "sensor_delay"}]
               and abs(h.effects[0].parameters["tau"].value - DELAY) < 0.1
               for h in given.hypotheses)


def test_it_is_also_where_the_rig_was_not_where_the_model_begins() -> None:
    given = pk.diagnose(vessel(0.0), run(10), run(11))
    assert given.verdict in ("named", "set")
    assert any(sorted(map(sorted, (e.ids for e in h.effects))) == [
        ["initial_state"], ["input_delay", "sensor_delay"]] for h in given.hypotheses)


def test_where_nothing_is_late_nothing_is_missing() -> None:
    assert pk.diagnose(vessel(), run(5, delay=0.0), run(6, delay=0.0)).verdict == "none"
