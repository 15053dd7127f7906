"""Cases with a remainder: what is dealt, how large it is, and that known sets stay as they were."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import least_squares

from pikanid import errors
from pikanid.cli import main
from pikanid.validation.concealed import case as room
from pikanid.validation.concealed import remainder, seal
from pikanid.validation.concealed.answers import check_case
from pikanid.validation.concealed.candidate import nominal_fit
from pikanid.validation.concealed.case import Case, Order, make
from pikanid.validation.concealed.deck import (
    CLASSES,
    DEFAULT_MIX,
    LAWS,
    STEADY,
    Card,
    apart,
    deal,
    parse_mix,
)
from pikanid.validation.concealed.effect import Effect, Scales
from pikanid.validation.concealed.effects import CATALOGUE, UNFORESEEN, variants
from pikanid.validation.concealed.excitations import two_pulse
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.families import families_of
from pikanid.validation.concealed.generate import orders_of
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.seal import Settings
from pikanid.validation.concealed.simulate import measured
from pikanid.validation.concealed.sizing import STRONG, STRONGEST, strong
from pikanid.validation.concealed.visibility import Visibility, without_each

SIGMA = 0.1 * np.pi / 180
BY_ID = {law.id: law for law in LAWS}
FRICTION, DRIFT = variants("coulomb_friction")[0], variants("sensor_drift")[0]
BIAS = variants("static_bias")[0]
COGGING, TILT = BY_ID["cogging"], BY_ID["platform_tilt"]


# --- what is dealt -----------------------------------------------------------------------------


def test_remainders_stand_apart_from_what_they_are_beside() -> None:
    cards = deal(300, {"remainder": 1.0}, np.random.default_rng(3))
    assert {card.kind for card in cards} == {"remainder"}
    assert Counter(len(card.effects) for card in cards).keys() == {1, 2}
    assert Counter(len(card.remainder) for card in cards).keys() == {1, 2, 3}
    for card in cards:
        assert all(effect.id in STEADY for effect in card.effects)
        assert all(effect.kind != "catalogue" for effect in card.remainder)
        hidden = [families_of(effect.id, effect.variant) for effect in card.effects]
        for k, law in enumerate(card.remainder):
            others = (*card.effects, *card.remainder[:k])
            assert law.near not in {effect.id for effect in card.effects}
            assert not any(families_of(law.id) & of_one for of_one in hidden)
            assert not {f for q in law.quantities for f, _ in q.sets} & {
                f for other in others for q in other.quantities for f, _ in q.sets}


def test_laws_and_effects_of_remainders_come_equally_often() -> None:
    cards = deal(240, {"remainder": 1.0}, np.random.default_rng(0))
    laws = Counter(law.id for card in cards for law in card.remainder)
    assert set(laws) == {law.id for law in LAWS}
    assert max(laws.values()) - min(laws.values()) <= 3
    hidden = Counter(effect.id for card in cards for effect in card.effects)
    assert set(hidden) == set(STEADY)
    assert max(hidden.values()) <= 2.5 * min(hidden.values())


def test_what_cannot_be_confirmed_does_not_hide_beside_a_remainder() -> None:
    left_out = {effect.id for effect in CATALOGUE} - set(STEADY)
    assert left_out == {"boundary_layer", "disturbance", "initial_state", "input_hold"}


@pytest.mark.parametrize(("law", "effect"), [
    ("cable_drag", "wall_impact"), ("smooth_friction", "coulomb_friction"),
    ("power_drag", "coulomb_friction"), ("internal_resonance", "second_mode"),
    ("warming_damping", "parameter_drift"), ("timing_jitter", "sensor_delay"),
    ("one_way_friction", "sensor_offset"), ("rate_limited_input", "input_saturation"),
    ("quadratic_input", "input_dead_zone")])
def test_disguises_are_not_dealt(law: str, effect: str) -> None:
    assert not any(apart(BY_ID[law], variant) for variant in variants(effect))


def test_every_law_that_was_not_foreseen_is_dealt_alone() -> None:
    cards = deal(30, {"unforeseen": 1.0}, np.random.default_rng(0))
    assert Counter(card.effects[0].id for card in cards) == {law.id: 2 for law in UNFORESEEN}
    assert not any(card.remainder for card in cards)


# --- known sets --------------------------------------------------------------------------------


def test_shares_that_are_not_asked_for_are_not_written() -> None:
    """The mix stands in the truth file, whose bytes a known seed has to give again."""
    assert set(DEFAULT_MIX) == {"nothing", "single", "pair", "near", "outside"}
    assert set(parse_mix("single=1")) == set(DEFAULT_MIX)
    assert parse_mix("remainder=1")["remainder"] == 1.0
    assert set(CLASSES) == {*DEFAULT_MIX, "remainder", "unforeseen"}


# Written down before there were other classes: whoever has such a set can make it again.
KNOWN_CARDS = [
    ("ric", "nothing"), ("ric", "near", "hard_stop"), ("ric", "single", "sensor_drift"),
    ("ric", "pair", "quadratic_drag", "cross_axis"),
    ("ric", "pair", "sensor_delay", "wall_impact"), ("two", "single", "input_gain"),
    ("two", "single", "power_drag"), ("two", "single", "coulomb_friction"),
    ("two", "outside", "turbulence"), ("ric", "near", "stribeck_friction"),
    ("two", "outside", "potential_flow"), ("two", "single", "cubic_stiffness")]
# Σ|θ| of what is recorded [rad], training and held out.
KNOWN_SUMS = {
    "stribeck_friction": [17.332758, 22.998492], "coulomb_friction": [10.722735, 9.505269],
    "turbulence": [18.586791, 23.91912]}


def test_known_cards_are_dealt_again() -> None:
    orders = orders_of(Settings(12, "mixed", SIGMA, dict(DEFAULT_MIX)), seal.secret(11))
    found = [(o.excitation[:3], o.card.kind, *(e.id for e in o.card.effects)) for o in orders]
    assert found == KNOWN_CARDS


@pytest.mark.parametrize("card", [
    Card("near", (BY_ID["stribeck_friction"],)), Card("single", (FRICTION,)),
    Card("outside", (BY_ID["turbulence"],))], ids=lambda card: card.kind)
def test_known_recordings_are_made_again(card: Card, monkeypatch: pytest.MonkeyPatch) -> None:
    # How visible an effect is does not enter its recordings: left out, to be quick.
    monkeypatch.setattr(room, "visibility", lambda *a: Visibility(0.0, (), 0.0, (), 0.05, 0.1))
    case = make(Order("001", 11, 4, card, "two_pulse", SIGMA))
    sums = [float(np.nansum(np.abs(theta_of(case, name))))
            for name in ("001_train.csv", "001_held_out.csv")]
    assert sums == pytest.approx(KNOWN_SUMS[card.effects[0].id], abs=1e-5)


# --- what is made ------------------------------------------------------------------------------


def theta_of(case: Case, name: str) -> np.ndarray:
    table = np.genfromtxt(io.BytesIO(case.recordings[name]), delimiter=",", skip_header=1)
    return table[:, 4]


def driven(case: Case, name: str) -> Experiment:
    table = np.genfromtxt(io.BytesIO(case.recordings[name]), delimiter=",", skip_header=1)
    return Experiment("read", *table[:, :4].T, quiet=0.0)


def rig_of(truth: Mapping[str, Any], *keys: str, later: bool = False) -> Rig:
    base = truth["base"]
    rig = Rig(length=base["l_theta"]["value"], damping=base["d_theta"]["value"])
    for entry in (e for key in keys for e in truth[key]):
        known = (entry["id"], entry["variant"], entry["kind"])
        effect = next(e for e in (*CATALOGUE, *LAWS) if (e.id, e.variant, e.kind) == known)
        values = entry["parameters_held_out" if later else "parameters"]
        rig = effect.applied(rig, {name: value["value"] for name, value in values.items()})
    return rig


def apart_from(rig: Rig, truth: np.ndarray, e: Experiment, noise: Noise) -> float:
    """Distance of a truth from a rig with l and d refitted, by SciPy [σ]."""
    def residual(v: np.ndarray) -> np.ndarray:
        moved = rig._replace(length=float(v[0]), damping=float(v[1]))
        return noise.whitened(measured(moved, e) - truth)

    done = least_squares(residual, [rig.length, rig.damping], x_scale=[0.01, 0.1],
                         bounds=([0.01, 0.0], [0.5, 20.0]), xtol=1e-12, ftol=1e-12)
    return float(np.sqrt(2 * done.cost))


@pytest.fixture(scope="module")
def made() -> Case:
    card = Card("remainder", (BIAS, DRIFT), (COGGING, TILT))
    return make(Order("001", 5, 0, card, "two_pulse", SIGMA))


def test_the_truth_says_what_is_left(made: Case) -> None:
    truth = cast(dict[str, Any], made.truth)
    assert (truth["class"], truth["nameable"]) == ("remainder", False)
    assert [e["id"] for e in truth["effects"]] == ["static_bias", "sensor_drift"]
    assert [e["id"] for e in truth["remainder"]] == ["cogging", "platform_tilt"]
    assert all(set(e) == set(truth["effects"][0]) for e in truth["remainder"])
    assert 0.05 <= truth["remainder_share"] <= 0.30
    assert 0 < truth["remainder_share_after_refit"] <= 1.001 * truth["remainder_share"]
    assert truth["visibility"]["best_rival"] == []
    check_case(json.loads(json.dumps(truth)))


def test_the_share_is_that_of_the_hidden_misfit(made: Case) -> None:
    truth = cast(dict[str, Any], made.truth)
    e, noise = driven(made, "001_train.csv"), Noise(**truth["noise"])
    hidden, whole = rig_of(truth, "effects"), rig_of(truth, "effects", "remainder")
    caused = apart_from(rig_of(truth), measured(hidden, e), e, noise)
    left = apart_from(hidden, measured(whole, e), e, noise)
    assert left / caused == pytest.approx(truth["remainder_share"], rel=0.01)
    nominal = apart_from(rig_of(truth), measured(whole, e), e, noise)
    assert nominal == pytest.approx(truth["visibility"]["nominal"], rel=0.01)


def test_both_recordings_hold_the_effects_and_the_remainder(made: Case) -> None:
    truth = cast(dict[str, Any], made.truth)
    noise = Noise(**truth["noise"])
    for name, later in (("001_train.csv", False), ("001_held_out.csv", True)):
        e = driven(made, name)
        seen = theta_of(made, name)
        there = np.isfinite(seen)
        whole = measured(rig_of(truth, "effects", "remainder", later=later), e)
        without = measured(rig_of(truth, "effects", later=later), e)
        error = np.median(np.abs(seen - whole)[there]) / noise.effective_sigma
        assert 0.5 < error < 0.85  # 0.67 of a Gaussian
        assert np.median(np.abs(seen - without)[there]) / noise.effective_sigma > 1.5 * error


def test_a_remainder_does_not_make_an_effect_visible() -> None:
    case = make(Order("001", 5, 1, Card("remainder", (DRIFT,), (COGGING,)), "two_pulse", SIGMA))
    truth = cast(dict[str, Any], case.truth)
    e, noise = driven(case, "001_train.csv"), Noise(**truth["noise"])
    hidden = measured(rig_of(truth, "effects"), e)
    (distance,) = truth["visibility"]["effects"]
    assert distance == pytest.approx(apart_from(rig_of(truth), hidden, e, noise), rel=0.01)
    assert truth["visibility"]["nominal"] != pytest.approx(distance, rel=0.01)


def test_each_of_two_hidden_effects_counts_without_the_other() -> None:
    e, noise, base = two_pulse(), Noise("white", SIGMA), Rig()
    gain = variants("input_gain")[0]
    truth = measured(Rig(input_gain=1.2, sensor_drift=0.01), e)
    found = without_each(truth, e, noise, base, (gain, DRIFT), Scales(0.2, 1.0, 5.0, 14.8),
                         ({"k": 1.2}, {"beta": 0.01}))

    def without_drift(v: np.ndarray) -> np.ndarray:
        return noise.whitened(measured(Rig(length=v[0], damping=v[1], input_gain=v[2]), e) - truth)

    done = least_squares(without_drift, [0.045, 0.15, 1.2], x_scale=[0.01, 0.1, 0.3])
    drifting = apart_from(Rig(sensor_drift=0.01), truth, e, noise)
    assert found[1] == pytest.approx(np.sqrt(2 * done.cost), rel=0.01)
    assert 0.9 * drifting < found[0] <= drifting * 1.001


@pytest.mark.parametrize("effect", [FRICTION, DRIFT, variants("input_gain")[0]],
                         ids=lambda e: e.id)
def test_hidden_effects_are_strong_after_a_refit(effect: Effect) -> None:
    e, noise, base = two_pulse(), Noise("white", 0.05 * np.pi / 180), Rig()
    scales = Scales(0.2, 1.0, 5.0, 14.8)
    distances = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        values = strong(effect.drawn(rng, scales), rng, base, e, noise)
        truth = noise.whitened(measured(effect.applied(base, values), e))
        distances.append(nominal_fit(truth, e, noise, base).distance)
    assert all(0.98 * STRONG < distance < 1.05 * STRONGEST for distance in distances)
    assert max(distances) > 1.2 * min(distances)


def test_an_effect_that_cannot_be_strong_is_refused() -> None:
    e, noise, rng = two_pulse(), Noise("white", SIGMA), np.random.default_rng(0)
    shape = variants("boundary_layer")[0].drawn(rng, Scales(0.2, 1.0, 5.0, 14.8))
    with pytest.raises(errors.SimulationFailed, match="visible"):
        strong(shape, rng, Rig(), e, noise)


def test_effects_that_cannot_be_strong_are_exchanged_beside_the_same_laws() -> None:
    card = Card("remainder", (variants("boundary_layer")[0],), (TILT,))
    truth = cast(dict[str, Any], make(Order("001", 5, 2, card, "two_pulse", SIGMA)).truth)
    assert [e["id"] for e in truth["remainder"]] == ["platform_tilt"]
    assert truth["effects"][0]["id"] in STEADY
    assert min(truth["visibility"]["effects"]) >= STRONG


def test_a_law_that_cannot_leave_enough_is_refused() -> None:
    e, noise, base = two_pulse(), Noise("white", SIGMA), Rig()
    gross = base._replace(sensor_drift=0.2)
    faint = BY_ID["timing_jitter"]
    with pytest.raises(errors.SimulationFailed, match="cannot leave"):
        remainder.drawn([faint], gross, base, [DRIFT], [{"beta": 0.2}], e,
                        Scales(0.2, 1.0, 5.0, 14.8), noise, np.random.default_rng(0))


def test_command_line(tmp_path: Path) -> None:
    for kind in ("remainder", "unforeseen"):
        folder, file = tmp_path / kind, tmp_path / f"{kind}.json"
        words = ["conceal", "--out", str(folder), "--truth", str(file), "--cases", "1", "--mix",
                 f"{kind}=1", "--excitation", "two_pulse", "--seed", "6", "--workers", "1",
                 "--quiet"]
        assert main(words) == 0
        (case,) = json.loads(file.read_text())["cases"]
        assert case["class"] == kind
        assert ("remainder" in case) == (kind == "remainder")
        assert seal.matches(folder, file)
