"""Scoring of places: channels, states, windows and regions whose score is plain, and truths."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from concealing import push

from pikanid import errors
from pikanid.validation.concealed.acting import (
    Truth,
    closed,
    experiment_of,
    natural_period,
    spans,
    truth_of,
)
from pikanid.validation.concealed.effect import Effect
from pikanid.validation.concealed.effects import CATALOGUE, NEAR, OUTSIDE, UNFORESEEN
from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.where import (
    STATES,
    Place,
    channel_outcome,
    f1,
    inside,
    intersection_over_union,
    place,
    read_where,
    states_outcome,
    tally,
)

EVERY = (*CATALOGUE, *NEAR, *OUTSIDE, *UNFORESEEN)


def entry(identifier: str, variant: str = "", **values: float) -> dict[str, Any]:
    e = next(e for e in EVERY if e.id == identifier and e.variant in (variant, ""))
    return {"id": e.id, "variant": e.variant, "channel": e.channel, "twins": list(e.twins),
            "near": e.near, "kind": e.kind,
            "parameters": {n: {"value": v, "unit": ""} for n, v in values.items()}}


def case(*effects: dict[str, Any], laws: tuple[dict[str, Any], ...] = ()) -> dict[str, Any]:
    made: dict[str, Any] = {
        "id": "001", "class": "single", "nameable": True, "effects": list(effects),
        "base": {"l_theta": {"value": 0.045, "unit": "m"}, "d_theta": {"value": 0.15, "unit": ""},
                 "m": {"value": 0.3, "unit": "kg"}, "g": {"value": 9.81, "unit": "m/s^2"}},
        "visibility": {"nominal": 40.0, "effects": [40.0] * len(effects), "best_rival": [],
                       "best_rival_distance": 9.0}}
    return {**made, "remainder": list(laws)} if laws else made


def answer(channel: str = "dynamics", states: tuple[str, ...] = (), time: Any = (), **more: Any
           ) -> dict[str, Any]:
    return {"mismatch": True, "verdict": "named", "where": {
        "channel": channel, "equation": "theta_dot", "depends_on": list(states),
        "time": [list(span) for span in time], "static_law": None, **more}}


WALL, FRICTION = entry("wall_impact", theta_wall=0.1, stiffness=5e3), entry("coulomb_friction")
DELAY, DEAD, DRIFT = entry("input_delay"), entry("input_dead_zone"), entry("sensor_drift")


@pytest.mark.parametrize(("said", "effects", "laws", "outcome"), [
    ({"dynamics"}, [FRICTION], [], "right"),
    ({"input"}, [FRICTION], [], "wrong"),
    ({"dynamics", "input"}, [FRICTION], [], "wrong"),
    (set(), [FRICTION], [], "undecided"),
    (set(), [DELAY], [], "right"),  # its twin is a sensor's delay: nobody can know
    ({"sensor"}, [DELAY], [], "right"),
    ({"dynamics"}, [DELAY], [], "wrong"),
    ({"dynamics"}, [FRICTION, DELAY], [], "right"),
    ({"dynamics"}, [FRICTION, DEAD], [], "part"),
    ({"dynamics", "input"}, [FRICTION, DEAD], [], "right"),
    ({"sensor"}, [FRICTION], [DRIFT], "part"),
    ({"dynamics", "sensor"}, [FRICTION], [DRIFT], "right"),
    ({"dynamics"}, [FRICTION], [DRIFT], "right"),
])
def test_channels(said: set[str], effects: list[dict], laws: list[dict], outcome: str) -> None:
    assert channel_outcome(frozenset(said), effects, laws) == outcome


def test_a_twin_of_two_variants_may_only_be_the_one_in_its_own_channel() -> None:
    bristles = entry("stick_slip_friction")
    assert channel_outcome(frozenset({"input"}), [bristles]) == "wrong"
    assert channel_outcome(frozenset({"dynamics"}), [bristles]) == "right"


@pytest.mark.parametrize(("said", "effects", "laws", "outcome"), [
    ({"theta_dot"}, [FRICTION], [], "right"),
    ({"theta"}, [FRICTION], [], "wrong"),
    ({"theta", "theta_dot"}, [FRICTION], [], "part"),
    ({"theta"}, [FRICTION, WALL], [], "part"),
    ({"theta", "theta_dot"}, [FRICTION, WALL], [], "right"),
    ({"theta", "theta_dot"}, [FRICTION], [WALL], "right"),
    (set(), [FRICTION], [], "unsaid"),
    (set(), [entry("hysteresis", "bouc_wen")], [], "right"),
    (set(), [entry("static_bias")], [], None),  # its twin is a sensor's offset
    (set(), [entry("disturbance")], [], None),
    ({"theta"}, [entry("disturbance")], [], "wrong"),
    ({"theta"}, [FRICTION, DRIFT], [], None),
])
def test_states(said: set[str], effects: list[dict], laws: list[dict], outcome: str | None) -> None:
    assert states_outcome(frozenset(said), effects, laws) == outcome


def test_states_are_known_of_every_law_that_has_some() -> None:
    names = {f"{e.id}:{e.variant}" if e.variant else e.id for e in EVERY}
    assert set(STATES) <= names
    without = {"static_bias", "second_mode", "cross_axis:u_y", "cross_axis:pitch", "disturbance",
               "initial_state", "background_vibration", "turbulence", "platform_tilt"}
    assert {f"{e.id}:{e.variant}" if e.variant else e.id for e in EVERY
            if e.channel == "dynamics"} == {*STATES} | without


@pytest.mark.parametrize(("a", "b", "share"), [
    (((0.0, 1.0),), ((0.0, 1.0),), 1.0),
    (((0.0, 1.0),), ((2.0, 3.0),), 0.0),
    (((0.0, 2.0),), ((1.0, 3.0),), 1 / 3),
    (((0.0, 4.0),), ((0.0, 1.0), (3.0, 4.0)), 0.5),
    ((), ((0.0, 1.0),), 0.0),
    ((), (), 0.0),
])
def test_intersection_over_union(a: Any, b: Any, share: float) -> None:
    assert intersection_over_union(a, b) == pytest.approx(share)
    assert intersection_over_union(b, a) == pytest.approx(share)


def test_f1_is_the_harmonic_mean_of_precision_and_recall() -> None:
    rng = np.random.default_rng(0)
    said, true = rng.random(500) < 0.4, rng.random(500) < 0.3
    both = (said & true).sum()
    precision, recall = both / said.sum(), both / true.sum()
    assert f1(said, true) == pytest.approx(2 / (1 / precision + 1 / recall))
    assert f1(true, true) == 1.0 and f1(~true, true) == 0.0
    nothing = np.zeros(5, bool)
    assert f1(nothing, nothing) == 0.0


def test_random_regions_are_scored_low() -> None:
    """Independent of a truth with a share p of the samples, a region with a share q has an F₁ of
    2pq/(p + q), at most p for q = p: ten of a hundred samples are found with a tenth.
    """
    rng = np.random.default_rng(1)
    true = np.arange(5000) < 500
    scores = [f1(rng.permutation(true), true) for _ in range(200)]
    assert np.mean(scores) == pytest.approx(0.1, abs=4 * np.std(scores) / 200**0.5)
    assert max(scores) < 0.2


def test_windows_that_come_and_go_within_a_period_are_one() -> None:
    rig = case(WALL)
    assert natural_period(rig) == pytest.approx(2 * np.pi * (0.045 / 9.81) ** 0.5)
    assert closed(((2.0, 3.0), (0.0, 1.0), (0.5, 1.9)), 0.2) == ((0.0, 3.0),)
    assert closed((), 1.0) == ()
    assert closed(((0.0, 1.0), (1.5, 2.0)), 0.5) == ((0.0, 1.0), (1.5, 2.0))


def test_spans_hold_every_sample_that_acts() -> None:
    t = np.arange(10) / 10
    mask = np.array([1, 1, 0, 0, 1, 0, 0, 0, 1, 1], bool)
    assert np.allclose(spans(t, mask), [(0.0, 0.15), (0.35, 0.45), (0.75, 0.9)])
    assert spans(t, np.zeros(10, bool)) == ()


def truth(of: dict[str, Any]) -> Truth:
    found = truth_of(of, two_pulse())
    assert found is not None
    return found


def test_a_wall_acts_where_the_true_motion_is_beyond_it() -> None:
    hidden = case(WALL)
    seen = truth(hidden)
    (wall,) = seen.acting
    beyond = seen.motion["theta"] > 0.1
    assert seen.always == () and 0.005 < beyond.mean() < 0.3
    np.testing.assert_array_equal(wall.mask, beyond)
    known = [{"state": "theta", "from": 0.1, "to": 1.0, "unit": "rad"}]
    perfect = place(hidden, answer(states=("theta",), time=seen.windows or (), region=known), seen)
    assert perfect == Place("001", "right", True, "right", pytest.approx(1.0), 1.0, False)
    silent = place(hidden, answer(states=("theta",)), seen)
    assert silent is not None and (silent.overlap, silent.region) == (0.0, 0.0)
    # of all samples, the few that count are not found by saying all of them
    lazy = place(hidden, answer(region=[{"state": "theta", "from": -1.0, "to": 1.0}]), seen)
    p = beyond.mean()
    assert lazy is not None and lazy.region == pytest.approx(2 * p / (1 + p))
    other = place(hidden, answer(region=[{"state": "other", "from": -1.0, "to": 1.0}]), seen)
    assert other is not None and other.region == 0.0


def test_a_disturbance_acts_while_it_lasts() -> None:
    hidden = case(entry("disturbance", peak=3.0, time=2.0, width=0.4))
    seen = truth(hidden)
    found = place(hidden, answer(time=[(1.9, 2.3)]), seen)
    assert found is not None and found.overlap == pytest.approx(0.3 / 0.5, abs=0.05)
    assert found.region is None and not found.invented
    (bump,) = seen.acting
    assert bump.windows == ((1.8, 2.2),) and bump.mask.sum() == pytest.approx(41, abs=1)


def test_laws_that_act_always_have_neither_window_nor_region() -> None:
    both = case(WALL, entry("coulomb_friction", c=0.1))
    seen = truth(both)
    assert seen.windows is None and seen.always == ("coulomb_friction",)
    found = place(both, answer(time=[(0.0, 1.0)]), seen)
    assert found is not None and found.overlap is None and found.region == 0.0
    viscous = case(entry("coulomb_friction", c=0.1))
    said = place(viscous, answer(region=[{"state": "theta", "from": 0.0, "to": 1.0}]),
                 truth(viscous))
    assert said is not None and said.region is None and said.invented


def test_what_is_left_beside_the_effects_need_not_be_placed() -> None:
    left = case(entry("coulomb_friction", c=0.1), laws=(WALL,))
    said = answer(region=[{"state": "theta", "from": 0.1, "to": 1.0}])
    for given in (answer(), said):
        found = place(left, given, truth(left))
        assert found is not None and found.region is None and not found.invented
    both = case(WALL, laws=(entry("one_way_friction", c=0.1),))
    found = place(both, said, truth(both))
    assert found is not None and found.region == 1.0


def test_a_limit_acts_on_either_side() -> None:
    limited = case(entry("input_saturation", limit=0.5))
    seen = truth_of(limited, push(1.0, lambda t: np.linspace(-1.0, 1.0, len(t))))
    assert seen is not None
    np.testing.assert_array_equal(seen.acting[0].mask, np.abs(seen.motion["u_x"]) >= 0.5)


def test_inputs_are_read_as_they_stand_in_the_file() -> None:
    pulse = two_pulse()
    rows = np.column_stack([pulse.t, pulse.u_x, pulse.u_y, pulse.pitch, pulse.t])
    read = experiment_of(rows)
    np.testing.assert_array_equal(read.u_x, pulse.u_x)
    assert read.duration == pulse.duration


def test_liquid_in_a_tank_acts_always() -> None:
    tank = {**entry("coulomb_friction"), "id": "potential_flow", "variant": ""}
    assert truth_of(case(tank), two_pulse()) is None


def test_where_nothing_hides_or_nothing_is_noticed_nothing_is_scored() -> None:
    assert place(case(), answer()) is None
    assert place(case(WALL), {**answer(), "mismatch": False}) is None


@pytest.mark.parametrize("where", [
    None, {}, {"channel": "elsewhere"}, {"time": [[2.0, 1.0]]}, {"time": [[1.0]]},
    {"depends_on": "theta"}, {"channels": ["all"]}, {"region": [{"state": "theta"}]},
    {"region": [{"state": "theta", "from": 1.0, "to": 0.0}]}])
def test_what_is_no_place_is_one_sentence(where: Any) -> None:
    whole = answer()
    broken = {**whole, "where": {**whole["where"], **where} if where else where}
    with pytest.raises(errors.BadSetting, match=r"case '001' cannot be scored.*where"):
        read_where(broken, "001")


def test_tally_counts_what_it_says() -> None:
    places = [Place("1", "right", True, "right", 0.6, 0.9, False),
              Place("2", "wrong", True, "part", 0.4, None, True),
              Place("3", "undecided", False, None, None, 0.2, False),
              Place("4", "part", True, "unsaid", None, None, False)]
    counted = {k: (s.count, s.n) for k, s in tally(places).items()}
    assert counted == {
        "channel_right": (1, 4), "channel_part": (1, 4), "channel_wrong": (1, 4),
        "channel_undecided": (1, 4), "equation_right": (3, 4), "states_right": (1, 3),
        "states_part": (1, 3), "states_wrong": (0, 3), "states_unsaid": (1, 3),
        "time_found": (1, 2), "region_found": (1, 2), "region_invented": (1, 2)}


def test_every_regime_is_one_of_a_known_law_and_its_parameters() -> None:
    from pikanid.validation.concealed.acting import REGIMES

    for identifier, make in REGIMES.items():
        effect: Effect = next(e for e in EVERY if e.id == identifier)
        regime = make({q.name: 0.3 for q in effect.quantities})
        values = np.linspace(-1, 1, 201)
        assert 0 < regime.holds(values).sum() < 201
        assert inside((), {"theta": values}).sum() == 0
