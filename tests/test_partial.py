"""What is surely there although something is left: the rule, and what is reported of it."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from weighing import COULOMB, DRAG, HYSTERESIS, effect, weighed

import pikanid as pk
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.fitting.as_estimate import widened
from pikanid.mismatch.judge.explanations import Explanations, Weighed
from pikanid.mismatch.judge.kinds import Kind
from pikanid.mismatch.judge.partial import Doubtful, Part, Present, _examined
from pikanid.mismatch.report import part as reported_as
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.findings import Where
from pikanid.mismatch.report.part import Remainder, Value, values_of
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps import surely
from pikanid.mismatch.steps.surely import _without_shares
from pikanid.reporting.diagnosis_page import page


def examined(*found: Weighed, family: Any = "dry friction") -> Present | Doubtful:
    return _examined(Kind(family, "v"), found[0], found, DEFAULTS, 1.0)


def test_a_family_that_dominates_is_there_and_has_a_name() -> None:
    found = examined(weighed((COULOMB,), 1.0, 0.995), weighed((HYSTERESIS,), 1.3, 0.003),
                     weighed((DRAG,), 5.0, 0.002))
    assert isinstance(found, Present) and found.names == ("coulomb_friction",)
    assert found.dominance == pytest.approx(5.0) and found.dominance_within == pytest.approx(1.3)
    assert found.probability_family == pytest.approx(0.998)
    assert list(found.alternatives) == ["hysteresis"]


@pytest.mark.parametrize("rivals, why", [
    ([((DRAG,), 3.9, 0.001)], "3.9 times as much, sure from 4 on"),
    ([((DRAG,), 5.0, 0.02)], "its probability is 0.98")])
def test_what_is_missing_to_a_family_is_said(rivals: list[Any], why: str) -> None:
    found = examined(weighed((COULOMB,), 1.0, 1 - rivals[0][2]),
                     *(weighed(*rival) for rival in rivals))
    assert isinstance(found, Doubtful) and why in found.why


@pytest.mark.parametrize("left, sure", [(12.0, False), (20.0, True)])
def test_a_scale_error_has_to_dominate_far_more(left: float, sure: bool) -> None:
    """Free stiffness and damping take up their share of what is missing, and nothing its gain."""
    gain = effect("sensor_gain", "gain")
    found = _examined(Kind("gain", ""), lead := weighed((gain,), 1.0, 0.999),
                      [lead, weighed((DRAG,), left, 0.001)], DEFAULTS, 1.0)
    assert isinstance(found, Present) is sure
    other = examined(weighed((COULOMB,), 1.0, 0.999), weighed((DRAG,), left, 0.001))
    assert isinstance(other, Present)


@pytest.mark.parametrize("left, names", [(0.6, ("coulomb_friction",)), (0.4, ())])
def test_a_law_that_contains_the_named_one_and_leaves_far_less_is_its_form(
        left: float, names: tuple[str, ...]) -> None:
    wider = effect("stribeck_friction", "dry friction", covers=("coulomb_friction",))
    found = examined(weighed((COULOMB,), 1.0, 0.995), weighed((wider,), left, 0.003),
                     weighed((DRAG,), 9.0, 0.002))
    assert isinstance(found, Present) and found.names == names


@pytest.mark.parametrize("left, sure", [(1.3, True), (3.0, False)])
def test_a_family_needs_an_entry_that_explains_it(left: float, sure: bool) -> None:
    """Of a law that nobody listed the family is a guess."""
    fading = effect("fading_memory", "drag", known=False)
    found = examined(weighed((fading,), 1.0, 0.995), weighed((DRAG,), left, 0.003),
                     weighed((COULOMB,), 8.0, 0.002), family="drag")
    assert isinstance(found, Present) is sure
    if isinstance(found, Doubtful):
        assert "only a law outside the catalogue" in found.why


@pytest.mark.parametrize("without_law, sure", [(5.0, True), (15.0, False)])
def test_what_does_less_than_a_law_of_no_catalogue_is_not_sure(
        without_law: float, sure: bool) -> None:
    """It may be a facet of what that law stands for."""
    law = effect("coupled_state", "coupling", known=False)
    found = examined(weighed((COULOMB, law), 1.0, 0.995), weighed((law,), 8.0, 0.002),
                     weighed((COULOMB,), without_law, 0.002))
    assert isinstance(found, Present) is sure
    if isinstance(found, Doubtful):
        assert "outside the catalogue explains more" in found.why


def test_nothing_is_sure_that_held_out_data_could_not_have_refuted() -> None:
    found = examined(weighed((COULOMB,), 1.0, 0.999, later=1.0),
                     weighed((DRAG,), 9.0, 0.001, later=1.2))
    assert isinstance(found, Doubtful) and "could not have refuted it (it is worth 4 " in found.why


@pytest.mark.parametrize("lead, rival", [
    ((1.0, 0.995, 0.95), (1.1, 0.004)),  # another member leaves hardly more
    ((1.0, 0.7, 0.95), (1.3, 0.295)),  # another member is as probable
    ((1.0, 0.995, 0.85), (1.3, 0.004))])  # too much is unexplained for a name
def test_without_a_name_the_family_is_said(lead: Any, rival: Any) -> None:
    found = examined(weighed((COULOMB,), *lead), weighed((HYSTERESIS,), *rival),
                     weighed((DRAG,), 9.0, 0.001))
    assert isinstance(found, Present) and found.names == ()


def test_a_decoy_gives_no_name() -> None:
    stribeck = effect("stribeck_friction", "dry friction", known=False)
    found = examined(weighed((stribeck,), 1.0, 0.998), weighed((COULOMB,), 1.5, 0.001),
                     weighed((DRAG,), 9.0, 0.001))
    assert isinstance(found, Present) and found.names == ()


def test_nothing_is_sure_of_an_explanation_that_was_not_tried_without_it(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """The last round of comparisons finds a better explanation, of which nothing was left out."""
    first, better, without = (
        SimpleNamespace(effects=e, point={}, key=frozenset(), blurred=frozenset())
        for e in ((COULOMB,), (COULOMB, DRAG), (DRAG,)))
    lead, tried = [first], []

    def compared(search: Any, of: Any) -> bool:
        lead[0] = better
        return True

    def refine(jobs: Any, settled: Any) -> bool:
        effects = [tuple(e.key for e in own) for own, _ in jobs]
        new = [e for e in effects if e not in tried]
        tried.extend(new)
        if ("quadratic_drag",) in effects:
            lead[0] = without  # it does as well
        return bool(new)

    monkeypatch.setattr(surely, "explanations", lambda *_: SimpleNamespace(
        weighed=(), leaders=lambda share: (lead[0],)))
    monkeypatch.setattr(surely, "surely_there", lambda found, *_: Part(
        (), (), *found.leaders(0.8), 1.0, 0.95))
    monkeypatch.setattr(surely, "_compared", compared)
    monkeypatch.setattr(surely, "_one_more", lambda *_: None)
    monkeypatch.setattr(surely, "lasting", lambda _: [first])
    monkeypatch.setattr(surely, "against_curves", lambda case, found, part, noise: part)
    search = SimpleNamespace(refine=refine, ranked=list, scale=lambda: 1.0, settings=DEFAULTS)
    records = SimpleNamespace(levels=[{}])
    case: Any = SimpleNamespace(search=search, settings=DEFAULTS, later=records, records=records,
                                evidence=lambda ranked: SimpleNamespace(scale=1.0))
    _, part = surely._sure(case)
    assert part is not None and part.hypothesis is without
    assert tried == [("coulomb_friction",), ("quadratic_drag",), ()]


def test_what_is_most_probable_is_reduced_though_it_predicts_too_little_to_lead() -> None:
    probable, predicts = (weighed(e, 1.0, w) for e, w in (((COULOMB, DRAG), 0.9), ((DRAG,), 0.1)))
    for shares, wanted in (((0.7, 0.9), [predicts, probable]), ((0.9, 0.9), [probable])):
        found = Explanations(tuple(replace(w, share=s) for w, s in zip(
            (probable, predicts), shares, strict=True)), 1.0)
        assert found.leaders(0.8) == tuple(w.hypothesis for w in wanted)


@pytest.mark.parametrize("wider", [
    effect("stribeck_friction", "dry friction", covers=("coulomb_friction",), known=False),
    effect("one_way_friction", "dry friction", known=False,
           parts=lambda values: [{"coulomb_friction": [0.0], "static_bias": [0.0]}])])
def test_a_law_that_contains_another_does_not_take_its_name(wider: Candidate) -> None:
    """It leaves as little; whether it is worth its parameters, the posterior says."""
    found = examined(weighed((COULOMB,), 1.0, 0.995), weighed((wider,), 1.0, 0.004),
                     weighed((DRAG,), 9.0, 0.001))
    assert isinstance(found, Present) and found.names == ("coulomb_friction",)
    found = examined(weighed((COULOMB,), 1.0, 0.97), weighed((wider,), 1.0, 0.029),
                     weighed((DRAG,), 9.0, 0.001))
    assert isinstance(found, Present) and found.names == ()


@pytest.mark.parametrize(("brief", "shape_of", "names"), [
    (True, ("wall_impact",), ("wall_impact",)), (False, ("wall_impact",), ()), (True, (), ())])
def test_a_brief_contact_has_its_name_whatever_its_shape(
        brief: bool, shape_of: tuple[str, ...], names: tuple[str, ...]) -> None:
    wall = effect("wall_impact", "restoring force", brief=lambda values: brief)
    other = effect("stiffening_wall", "restoring force", known=False, shape_of=shape_of)
    found = examined(weighed((wall,), 1.0, 0.7), weighed((other,), 1.05, 0.299),
                     weighed((DRAG,), 9.0, 0.001), family="restoring force")
    assert isinstance(found, Present) and found.names == names


@pytest.mark.parametrize(("names", "sure"), [((), {"sensor curve"}),
                                             (("sensor_saturation",), {"sensor curve", "gain"})])
def test_a_curve_without_a_name_has_a_slope_of_its_own(names: tuple[str, ...], sure: set[str]
                                                       ) -> None:
    curve, scale = effect("sensor_saturation", "sensor curve"), effect("sensor_gain", "gain")
    present = tuple(Present(Kind(e.families[0]), e, own, {}, 1.0, 1.0, 9.0, 1.0, 0.95)
                    for e, own in ((curve, names), (scale, ("sensor_gain",))))
    h: Any = SimpleNamespace(effects=(curve, scale), blurred=frozenset())
    found = _without_shares(Part(present, (), h, 1.0, 0.95), [])
    assert {p.family for p in found.present} == sure
    assert {d.family for d in found.doubtful} == {"sensor curve", "gain"} - sure


@pytest.mark.parametrize(("share", "within", "names"), [
    (0.85, 5.0, ("coulomb_friction",)), (0.85, 1.5, ()), (0.95, 1.5, ("coulomb_friction",))])
def test_a_name_is_as_sure_as_its_family_where_no_other_member_does_nearly_as_well(
        share: float, within: float, names: tuple[str, ...]) -> None:
    found = examined(weighed((COULOMB,), 1.0, 0.995, share), weighed((HYSTERESIS,), within, 0.003),
                     weighed((DRAG,), 9.0, 0.002))
    assert isinstance(found, Present) and found.names == names


@pytest.mark.parametrize("left, share, names", [
    (1.1, 0.95, ("sensor_lag", "actuator_lag")), (1.3, 0.95, ("sensor_lag",)),
    (1.3, 0.85, ("sensor_lag", "actuator_lag")), (5.0, 0.85, ("sensor_lag",))])
def test_a_name_holds_what_small_motions_cannot_tell_from_it(
        left: float, share: float, names: tuple[str, ...]) -> None:
    lag, other = (effect(name, "timing", twin="lag") for name in ("sensor_lag", "actuator_lag"))
    rounded = effect("sensor_lag", "timing", twin="lag")  # the same one in another shape
    vars(rounded)["key"] = "sensor_lag[rounded]"
    lead = weighed((lag,), 1.0, 0.995, share)
    every = [lead, weighed((other,), left, 0.003), weighed((rounded,), 1.0, 0.001),
             weighed((DRAG,), 9.0, 0.001)]
    found = _examined(Kind("timing", ""), lead, every, DEFAULTS, 1.0)
    assert isinstance(found, Present) and found.names == names
    assert [e.key for e in found.twins] == list(names[1:])


def test_what_noise_hides_is_no_remainder() -> None:
    """Without a floor, explanations that leave nothing would dominate each other at random."""
    found = examined(weighed((COULOMB,), 1e-9, 0.995), weighed((DRAG,), 0.1, 0.005))
    assert isinstance(found, Doubtful) and "2.5 times" in found.why


REMAINDER = Remainder(0.93, 0.95, "theta", 0.02, 0.004, 0.003, 0.0005, "rad", 1e-9, 16.0, 120.0,
                      3.2, ((1.0, 2.5),), (("timing", "its probability is 0.93"),))
FRICTION = reported_as.Present(
    "dry friction", (), "Coulomb friction", "-c*sign(v)",
    {"hysteresis": "hysteresis", "hysteresis[slim]": "hysteresis", "rounded": "Coulomb friction"},
    0.9, 0.999, 12.0, 1.1, 0.93, {"c": Value(0.5, 0.01, "rad/s^2")}, {"c": 0.04})
DELAY = replace(FRICTION, family="timing", ids=("input_delay",), name="a delay", dominance=None)


def diagnosis(p_value: float = 1e-9) -> pk.Diagnosis:
    nothing = cast(pk.Estimate, SimpleNamespace(model=pk.systems.sloshing()))
    return Diagnosis("partial", 1e-12, DEFAULTS, Where(("dynamics",), "v", (), (), None), (), (),
                     nothing, nothing, None, present=(FRICTION, DELAY),
                     remainder=replace(REMAINDER, p_value=p_value))


def test_a_partial_answer_says_what_is_sure_and_what_is_left() -> None:
    said = diagnosis().sentence()
    assert "surely dry friction and a delay, and something else." in said
    assert "93 % of the held-out misfit is explained" in said and "0.004 rad are left" in said
    assert "something else" not in diagnosis(p_value=0.5).sentence()
    two = replace(FRICTION, or_family="gain")
    assert "gain (here as Coulomb friction; which one is not sure, compared with" in two.sentence()
    assert "surely a delay and either dry friction or another gain, and" in replace(
        diagnosis(), present=(two, DELAY)).sentence()
    text = str(diagnosis())
    assert "Surely: dry friction (here as Coulomb friction; its form is not sure, compared with " \
        "hysteresis): without it the best explanation leaves 12 times as much" in text
    assert "Surely: a delay: no explanation does without it" in text
    assert "Left: half of it below 3.2 Hz; louder than noise at 1 to 2.5 s" in text
    assert "Not sure: a delay or a lag: its probability is 0.93" in text


def test_a_partial_answer_as_json() -> None:
    friction, delay = (p.to_dict() for p in (FRICTION, DELAY))
    assert friction["ids"] is None and not friction["exact"] and friction["dominance"] == 12.0
    assert delay["ids"] == ["input_delay"] and delay["exact"] and delay["dominance"] is None
    assert friction["parameters"] == {"c": {
        "value": 0.5, "std": 0.01, "unit": "rad/s^2", "std_with_remainder": 0.04}}
    left = json.loads(json.dumps(REMAINDER.to_dict(), allow_nan=False))
    assert left["time"] == [[1.0, 2.5]] and left["overdispersion"] == 16.0
    assert left["doubtful"] == [{"family": "timing", "why": "its probability is 0.93"}]


def test_variances_are_multiplied_by_the_overdispersion() -> None:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.01, seed=0)
    found = pk.NLS(starts=1).fit(model, recording)
    np.testing.assert_allclose(widened(found, 4.0).covariance, 4 * found.covariance)
    p = pk.Parameter("c", 0.0, "N")
    assert values_of((p,), {"c": 2.0}, {"c": 0.1}, 9.0)["c"] == Value(2.0, pytest.approx(0.3), "N")


@pytest.fixture(scope="module")
def diagnosed() -> pk.Diagnosis:
    """Dry friction beside a force that is periodic in the angle, which no entry is."""
    parts = [pk.Parameter("c", 1.0, "rad/s^2"), pk.Parameter("a", 0.2, "rad/s^2")]
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-c*sign(theta_dot) - a*sin(60*theta + 1)", parts)
    train, other = (pk.simulate(truth, pk.excitation.planar_moves(3, 5.0, seed=seed),
                                sigma=0.0005, seed=seed) for seed in (1, 2))
    return pk.diagnose(pk.systems.sloshing(), train, other)


@pytest.mark.slow
def test_friction_is_sure_beside_a_law_that_nobody_knows(diagnosed: pk.Diagnosis) -> None:
    assert diagnosed.verdict == "partial"
    assert [p.family for p in diagnosed.present] == ["dry friction"]
    left = diagnosed.remainder
    assert left is not None and 0.8 < left.share_explained < 0.999
    assert left.noise < left.rmse < left.rmse_before and left.p_value < 1e-6
    assert 0 < left.frequency < 25


@pytest.mark.slow
def test_standard_errors_count_the_remainder(diagnosed: pk.Diagnosis) -> None:
    found, left = diagnosed.present[0], diagnosed.remainder
    assert left is not None and left.overdispersion > 3
    for name, value in found.parameters.items():
        assert found.std_with_remainder[name] > value.std * np.sqrt(left.overdispersion)
    # those of the explanation as well
    shown = diagnosed.hypotheses[0].effects[0].parameters
    assert all(v.std == found.std_with_remainder[n] for n, v in shown.items()
               if n in found.std_with_remainder)


@pytest.mark.slow
def test_a_partial_answer_is_told_everywhere(diagnosed: pk.Diagnosis) -> None:
    assert "surely" in diagnosed.sentence() and "something else" in diagnosed.sentence()
    content = json.loads(json.dumps(diagnosed.to_dict(), allow_nan=False))
    assert content["verdict"] == "partial" and content["schema_version"] == 2
    entry = content["present"][0]
    assert entry["family"] == "dry friction" and entry["exact"] == (entry["ids"] is not None)
    assert set(entry["parameters"]["c"]) == {"value", "std", "unit", "std_with_remainder"}
    assert content["remainder"]["share_explained"] == diagnosed.remainder.share_explained
    text = page(diagnosed, "run")
    assert "(probability" not in text + str(diagnosed)  # something else is there for sure
    assert "Surely there" in text and "dry friction" in text and "are left" in text
    assert "Surely: " in str(diagnosed)


@pytest.mark.slow
def test_a_motion_that_shows_little_refutes_what_another_one_tells() -> None:
    # a wall that the smaller motion hardly touches: what it tells does not predict the larger one
    parts = [pk.Parameter(name, value) for name, value in (
        ("c", 0.5), ("k_w", 2000.0), ("w", 0.15), ("a", 0.3))]
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-c*tanh(theta_dot/0.02) - k_w*max(theta - w, 0) - a*sin(7*t)", parts)
    small, large = (pk.simulate(truth, pk.excitation.planar_moves(
        count, 6.0, stroke=stroke, seed=k), sigma=0.002, seed=k)
                    for k, count, stroke in ((1, 2, 0.15), (2, 4, 0.4)))
    found = pk.diagnose(pk.systems.sloshing(), small, large)
    assert (found.verdict, found.exchanged) == ("partial", True)
    # the smaller one does not reach the wall: what explains the larger without it misses this one
    assert {p.family for p in found.present} == {"dry friction", "restoring force"}
    assert any("wall_impact" in e.ids for e in found.hypotheses[0].effects)
    assert found.to_dict()["exchanged"] is True and found.held_out is not None
    assert found.held_out.recordings == (small.name,)
    assert "Recordings exchanged" in found.notes[0] and "Recordings exchanged" in page(found, "run")
