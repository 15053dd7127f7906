"""The scoring rule, on answers whose score is plain, and its statistics against SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from pikanid import errors
from pikanid.validation.concealed.outcome import read
from pikanid.validation.concealed.score import Share, judge, reliability, tally, wilson

PUMPED = "symbolic:l_theta -> l_theta*(1 + a*sin(rate*t) + b*cos(rate*t))"
SWINGING = "symbolic:swing_a*sin(swing_rate*t) + swing_b*cos(swing_rate*t)"
TWINS = {"input_delay": ["sensor_delay"], "sensor_delay": ["input_delay"]}


def case(*ids: str, kind: str = "single", nameable: bool = True, near: str = "",
         rival: tuple[str, ...] = (), distance: float = 9.0, nominal: float = 40.0,
         seen: tuple[float, ...] = ()) -> dict:
    effects = [{"id": i, "twins": TWINS.get(i, []), "near": near,
                "kind": kind if kind in ("near", "outside") else "catalogue"} for i in ids]
    return {"id": "001", "class": kind if ids else "nothing", "nameable": nameable and bool(ids),
            "effects": effects, "base": {"l_theta": {"value": 0.045}, "d_theta": {"value": 0.15}},
            "visibility": {"nominal": nominal, "best_rival": list(rival),
                           "effects": list(seen or [nominal] * len(ids)),
                           "best_rival_distance": distance}}


def answer(*hypotheses: list[str], verdict: str = "", mismatch: bool | None = None,
           **more: Any) -> dict:
    """Each hypothesis is a list of effects, twins joined with a slash; the first most probable."""
    verdict = verdict or ("none" if not hypotheses else "named" if len(hypotheses) == 1 else "set")
    return {"verdict": verdict, "mismatch": verdict != "none" if mismatch is None else mismatch,
            "hypotheses": [{"effects": [{"ids": e.split("/")} for e in h],
                            "probability": 0.9 / 2**k}
                           for k, h in enumerate(hypotheses)], **more}


FRICTION, PAIR = case("coulomb_friction"), case("coulomb_friction", "input_delay", kind="pair")


@pytest.mark.parametrize(("truth", "given", "outcome", "reason"), [
    (FRICTION, answer(["coulomb_friction"]), "right", ""),
    (FRICTION, answer(["quadratic_drag"], ["coulomb_friction"]), "right", ""),
    (FRICTION, answer(["quadratic_drag"], ["power_drag"], ["coulomb_friction"]), "long", ""),
    (FRICTION, answer(["quadratic_drag"]), "wrong", "other"),
    (FRICTION, answer(["quadratic_drag"], ["power_drag"]), "wrong", "other"),
    (FRICTION, answer(["coulomb_friction", "sensor_offset"]), "wrong", "extra"),
    (FRICTION, answer(["symbolic:theta**3"]), "wrong", "other"),
    (FRICTION, answer(["coulomb_friction"], verdict="unconfirmed"), "silent", ""),
    (FRICTION, answer(verdict="unnamed"), "silent", ""),
    (FRICTION, answer(), "silent", ""),
    (case("input_delay"), answer(["sensor_delay"]), "right", ""),
    (case("input_delay"), answer(["input_delay/sensor_delay"]), "right", ""),
    (PAIR, answer(["sensor_delay", "coulomb_friction"]), "right", ""),
    (PAIR, answer(["coulomb_friction", "input_gain"]), "wrong", "other"),
    (PAIR, answer(["coulomb_friction"]), "wrong", "part"),
    (case("coulomb_friction", "input_delay", kind="pair",
          rival=("coulomb_friction",), distance=1.0),
     answer(["coulomb_friction"]), "wrong", "indistinguishable"),
    (case("coulomb_friction", "input_delay", kind="pair", seen=(30.0, 1.0)),
     answer(["coulomb_friction"]), "visible", ""),
    (case("coulomb_friction", "input_delay", kind="pair", seen=(30.0, 1.0)),
     answer(["quadratic_drag"], ["power_drag"], ["coulomb_friction"]), "long", "visible"),
    (case("coulomb_friction", "input_delay", kind="pair", seen=(30.0, 1.0)),
     answer(["input_delay"]), "wrong", "part"),
    (case("coulomb_friction", "input_delay", kind="pair", seen=(1.0, 1.0)),
     answer(["coulomb_friction"]), "wrong", "part"),
    (case("coulomb_friction", rival=("quadratic_drag",), distance=4.1),
     answer(["quadratic_drag"]), "wrong", "other"),
    (case("hard_stop", kind="near", near="wall_impact"), answer(["wall_impact"]), "wrong", "near"),
    (case("hard_stop", kind="near", near="wall_impact"),
     answer(["symbolic:(-k_wall*max(theta - wall, 0))*(1 + a_wall*theta_dot)"]), "formula", ""),
    (case("stribeck_friction", kind="near", near="coulomb_friction"),
     answer(["coulomb_friction"]), "right", ""),
    (case("even_stiffness", kind="outside"), answer(["symbolic:theta**2"]), "formula", ""),
    (case("even_stiffness", kind="outside"), answer(["symbolic:theta**4"]), "wrong", "other"),
    (case("even_stiffness", kind="outside"), answer(["symbolic:theta**2", "input_gain"]),
     "wrong", "extra"),
    (case("even_stiffness", kind="outside"), answer(["cubic_stiffness"], ["symbolic:theta**2"]),
     "formula", ""),
    (case("wobbling_length", kind="outside"), answer(["symbolic:theta**2"]), "wrong", "other"),
    (case("wobbling_length", kind="outside"), answer([PUMPED]), "formula", ""),
    (case("parametric_excitation", kind="outside"), answer([PUMPED]), "formula", ""),
    (case("warming_damping", kind="outside"), answer([PUMPED]), "wrong", "other"),
    (case("background_vibration", kind="outside"), answer([PUMPED]), "wrong", "other"),
    (case("background_vibration", kind="outside"), answer([SWINGING]), "formula", ""),
    (case("wobbling_length", kind="outside"), answer([SWINGING]), "wrong", "other"),
    (case("even_stiffness", kind="outside"), answer(verdict="unnamed"), "silent", ""),
    (case(), answer(), "right", ""),
    (case(), answer(["coulomb_friction"]), "wrong", "nothing"),
    (case(), answer(verdict="unnamed"), "alarm", "")])
def test_outcome(truth: dict, given: dict, outcome: str, reason: str) -> None:
    found = judge(truth, given)
    assert (found.outcome, found.reason) == (outcome, reason)


def test_one_name_does_not_explain_two_effects() -> None:
    """Twice the same effect is no pair: each hidden effect needs a partner of its own."""
    twice = answer(["input_delay/sensor_delay", "sensor_delay"])
    assert judge(PAIR, twice).outcome == "wrong"
    assert judge(case("input_delay"), twice).reason == "extra"


def test_parameters_and_held_out_error() -> None:
    after = {"l_theta": {"value": 0.0452, "std": 1e-4}, "d_theta": {"value": 0.1, "std": 0.02}}
    held = {"rmse_after": 0.0021, "noise": 0.002}
    good = judge(FRICTION, answer(["coulomb_friction"], parameters={"after": after}, held_out=held))
    assert good.within
    assert good.held_out == pytest.approx(1.05)
    after["l_theta"]["value"] = 0.0454
    bad = judge(FRICTION, answer(["coulomb_friction"], parameters={"after": after}, held_out=None))
    assert bad.within is False
    assert bad.held_out is None
    assert judge(FRICTION, answer(["coulomb_friction"])).within is None


def test_tally_counts_what_it_says() -> None:
    faint = case("coulomb_friction", nameable=False, nominal=2.0)
    scores = [
        judge(FRICTION, answer(["coulomb_friction"], held_out={"rmse_after": 2.0, "noise": 1.0})),
        judge(FRICTION, answer(["quadratic_drag"])),
        judge(FRICTION, answer()),
        judge(faint, answer()),
        judge(case("coulomb_friction", nameable=False, rival=("quadratic_drag",), distance=1.0),
              answer(["quadratic_drag"])),
        judge(case("coulomb_friction", "input_delay", kind="pair", nameable=False,
                   seen=(30.0, 1.0)), answer(["coulomb_friction"])),
        judge(case(), answer(verdict="unnamed")),
        judge(case(), answer())]
    counts = {name: (share.count, share.n) for name, share in tally(scores).items()}
    assert counts == {
        "right": (1, 3), "wrong": (2, 8), "wrong_strictly": (3, 8), "wrong_of_answers": (2, 4),
        "wrong_but_knowable": (1, 8), "surely_in_part": (0, 8), "found": (0, 0),
        "found_by_name": (0, 0), "found_of_two": (0, 0), "formula": (0, 8),
        "false_alarm": (1, 2), "missed": (1, 5), "parameters_within_3_std": (0, 0),
        "held_out_within_1.1_noise": (0, 1)}


@pytest.mark.parametrize(("count", "n"), [(0, 240), (1, 240), (57, 60), (5, 5), (9, 400)])
def test_wilson_agrees_with_scipy(count: int, n: int) -> None:
    wanted = binomtest(count, n).proportion_ci(method="wilson")
    assert wilson(count, n) == pytest.approx((wanted.low, wanted.high), abs=1e-12)
    assert str(count) in str(Share(count, n))


def test_reliability_of_calibrated_answers() -> None:
    rng = np.random.default_rng(0)
    scores = []
    for p in rng.uniform(0.5, 1.0, 4000):
        given = answer(["coulomb_friction" if rng.random() < p else "quadratic_drag"])
        given["hypotheses"][0]["probability"] = float(p)
        scores.append(judge(FRICTION, given))
    scores += [judge(FRICTION, answer())]
    rows = reliability(scores)
    assert sum(share.n for _, share in rows) == 4000
    for mean, share in rows:
        low, high = wilson(share.count, share.n, 3.5)
        assert low < mean < high


@pytest.mark.parametrize("broken", [
    {}, {"verdict": "named", "mismatch": True, "hypotheses": [{"effects": [{}]}]},
    {"verdict": "perhaps", "mismatch": True, "hypotheses": []}])
def test_what_is_no_diagnosis(broken: dict) -> None:
    with pytest.raises(errors.BadSetting, match="case '001'"):
        judge(FRICTION, broken)


# --- beside a remainder ------------------------------------------------------------------------


def entry(identifier: str, near: str = "", **more: Any) -> dict:
    return {"id": identifier, "twins": TWINS.get(identifier, []), "near": near, **more}


def beside(*ids: str, laws: tuple[str, ...] = ("cogging", "turbulence"),
           seen: tuple[float, ...] = ()) -> dict:
    return {**case(*ids, kind="remainder", nameable=False, nominal=300.0, seen=seen),
            "remainder": [entry(law) for law in laws], "remainder_share": 0.2}


def surely(*present: tuple[str, str], **more: Any) -> dict:
    """Families, or two of which one is there, and, where the name is sure, ids."""
    return answer(["quadratic_drag"], verdict="partial", present=[
        {"family": family.split(" or ")[0], "or_family": ([*family.split(" or "), None])[1],
         "ids": ids.split("/") if ids else None} for family, ids in present], **more)


ONE, TWO = beside("coulomb_friction"), beside("coulomb_friction", "input_delay")
DRY, LATE = ("dry friction", ""), ("timing", "")
NAMED = ("dry friction", "coulomb_friction")


@pytest.mark.parametrize(("truth", "given", "outcome", "reason", "found"), [
    (ONE, answer(["coulomb_friction"]), "right", "", (1, 1)),
    (ONE, answer(["coulomb_friction", "symbolic:-a*sin(m*theta + p)"]), "right", "", (1, 1)),
    (ONE, answer(["quadratic_drag"], ["coulomb_friction"]), "right", "", (1, 1)),
    (ONE, answer(["quadratic_drag"], ["power_drag"], ["coulomb_friction"]), "long", "", (0, 0)),
    (ONE, answer(["coulomb_friction", "sensor_offset"]), "wrong", "extra", (0, 0)),
    (ONE, answer(["quadratic_drag"]), "wrong", "other", (0, 0)),
    (ONE, answer(["turbulence"]), "part", "", (0, 0)),
    (ONE, answer(["coulomb_friction"], verdict="unconfirmed"), "silent", "", (0, 0)),
    (ONE, answer(), "silent", "", (0, 0)),
    (ONE, surely(DRY), "part", "", (1, 0)),
    (ONE, surely(NAMED), "part", "", (1, 1)),
    (ONE, surely(NAMED, ("restoring force", "")), "part", "", (1, 1)),  # of the cogging
    (ONE, surely(("restoring force", "")), "part", "", (0, 0)),
    (ONE, surely(("restoring force", "cubic_stiffness")), "wrong", "other", (0, 0)),
    (ONE, surely(NAMED, ("drag", "")), "wrong", "family", (0, 0)),
    (ONE, surely(("dry friction", "hysteresis")), "wrong", "other", (0, 0)),
    (ONE, surely(), "silent", "", (0, 0)),
    (TWO, answer(["coulomb_friction", "sensor_delay"]), "right", "", (2, 2)),
    (TWO, answer(["coulomb_friction"]), "part", "", (1, 1)),
    (TWO, surely(NAMED, LATE), "part", "", (2, 1)),
    (TWO, surely(LATE), "part", "", (1, 0)),
    (beside("coulomb_friction", "input_delay", seen=(200.0, 79.0)), surely(LATE), "part", "",
     (0, 0)),
    (beside("hysteresis"), surely(DRY), "part", "", (1, 0)),
    (case("coulomb_friction"), surely(DRY), "part", "", (0, 0)),
    (case(), surely(DRY), "wrong", "nothing", (0, 0)),
    # liquid in a tank has a second planar mode, but no stiffness of its own kind
    (case("potential_flow"), surely(("mode", "second_mode")), "part", "", (0, 0)),
    (case("potential_flow"), surely(("mode", "")), "part", "", (0, 0)),
    (case("potential_flow"), surely(("restoring force", "")), "wrong", "family", (0, 0)),
    (case("potential_flow"), answer(["second_mode"]), "wrong", "other", (0, 0))])
def test_what_is_said_beside_a_remainder_has_to_be_there(
        truth: dict, given: dict, outcome: str, reason: str, found: tuple[int, int]) -> None:
    score = judge(truth, given)
    assert (score.outcome, score.reason) == (outcome, reason)
    assert (score.found, score.found_by_name) == found


@pytest.mark.parametrize(("hypotheses", "true"), [
    ([["coulomb_friction"]], True), ([["coulomb_friction", "turbulence"]], True),
    ([["coulomb_friction", "symbolic:-a*sin(m*theta + p)", "turbulence"]], True),
    ([["turbulence"]], False), ([["coulomb_friction", "sensor_offset"]], False),
    ([["quadratic_drag"], ["coulomb_friction"]], False)], ids=str)
def test_beside_a_remainder_the_first_hypothesis_is_true_if_all_of_it_is_there(
        hypotheses: list[list[str]], true: bool) -> None:
    assert judge(ONE, answer(*hypotheses)).first_is_truth is true


@pytest.mark.parametrize(("said", "outcome", "counts"), [
    (["dry friction or gain"], "part", (1, 0, 1)), (["gain or dry friction"], "part", (1, 0, 1)),
    (["gain or drag"], "wrong", (0, 0, 0)), (["timing", "gain or dry friction"], "part", (2, 0, 1)),
    (["timing or gain", "timing"], "part", (1, 0, 0))])
def test_one_of_two_families_has_to_be_there(said: list[str], outcome: str,
                                             counts: tuple[int, int, int]) -> None:
    score = judge(TWO, surely(*((families, "") for families in said)))
    assert score.outcome == outcome
    assert (score.found, score.found_by_name, score.found_of_two) == counts


def test_families_of_what_hides_are_those_of_its_variant_and_exponent() -> None:
    def outcome(family: str, **effect: Any) -> str:
        truth = {**ONE, "effects": [entry(**effect)]}
        return judge(truth, surely((family, ""))).outcome

    play = {"identifier": "hysteresis", "variant": "backlash"}
    assert outcome("input curve", **play) == "part"
    assert outcome("dry friction", **play) == "wrong"
    power = {"identifier": "power_drag", "parameters": {"n": {"value": 0.2}}}
    assert outcome("dry friction", **power) == outcome("drag", **power) == "part"
    power["parameters"] = {"n": {"value": 1.5}}
    assert outcome("dry friction", **power) == "wrong"


def test_rounded_coulomb_friction_is_coulomb_friction() -> None:
    smooth = case("smooth_friction", kind="near", near="coulomb_friction")
    assert judge(smooth, answer(["coulomb_friction"])).outcome == "right"
    assert judge(smooth, answer(["symbolic:-c*tanh(theta_dot/w)"])).outcome == "formula"
    memory = case("stick_slip_friction", kind="near", near="coulomb_friction")
    assert judge(memory, answer(["coulomb_friction"])).reason == "near"


def test_tally_counts_strong_effects_beside_a_remainder_only() -> None:
    weak = beside("coulomb_friction", "input_delay", seen=(200.0, 79.0))
    scores = [judge(TWO, surely(NAMED, LATE)), judge(weak, surely(NAMED)), judge(ONE, answer()),
              judge(case("coulomb_friction", nominal=300.0), answer(["coulomb_friction"])),
              judge(ONE, surely(DRY, ("drag", "")))]
    counts = {name: (share.count, share.n) for name, share in tally(scores).items()}
    assert counts["found"] == (3, 5)
    assert counts["found_by_name"] == (2, 5)
    assert counts["surely_in_part"] == (2, 5)
    assert counts["wrong"] == (1, 5)


@pytest.mark.parametrize("changed", [
    {"remainder": "cogging"}, {"remainder": [{"id": "cogging"}]}, {"remainder_share": "much"},
    {"remainder_share": -0.1}, {"remainder": [entry("cogging", parameters=[1])]},
    {"remainder": [entry("cogging", variant=3)]},
    {"remainder": [entry("power_drag", parameters={"n": {"value": "big"}})]}], ids=str)
def test_a_remainder_that_is_none_is_one_sentence(changed: dict) -> None:
    with pytest.raises(errors.BadSetting, match="truth file"):
        judge({**ONE, **changed}, answer())


@pytest.mark.parametrize(("formula", "law"), [
    ("swing_a*sin(swing_rate*t) + swing_b*cos(swing_rate*t)", "periodic_force"),
    ("k3 -> k3*(1 + k3_swing_a*sin(k3_swing_rate*t) + k3_swing_b*cos(k3_swing_rate*t))",
     "pumped_parameter")])
def test_a_force_that_swings_is_no_parameter_that_does(formula: str, law: str) -> None:
    assert {"periodic_force", "pumped_parameter"} & read({f"symbolic:{formula}"}) == {law}
