"""The scoring rule, on answers whose score is plain, and its statistics against SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from pikanid import errors
from pikanid.validation.concealed.score import Share, judge, reliability, tally, wilson

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
        "wrong_but_knowable": (1, 8), "formula": (0, 8), "false_alarm": (1, 2), "missed": (1, 5),
        "parameters_within_3_std": (0, 0), "held_out_within_1.1_noise": (0, 1)}


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
