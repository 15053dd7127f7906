"""What is drawn: excitations within bounds, noise of the stated kind, decks without gaps."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from pikanid import errors
from pikanid.validation.concealed import noise as noises
from pikanid.validation.concealed.deck import DEFAULT_MIX, FLOW, deal, parse_mix
from pikanid.validation.concealed.effect import Scales
from pikanid.validation.concealed.effects import CATALOGUE, IDS, NEAR, OUTSIDE
from pikanid.validation.concealed.excitations import RICH_KINDS, Bounds, pair, rich, two_pulse
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured

# As the catalogue of effects names them.
CATALOGUE_IDS = {
    "coulomb_friction", "quadratic_drag", "power_drag", "amplitude_damping", "cubic_stiffness",
    "static_bias", "parameter_drift", "second_mode", "wall_impact", "cross_axis", "disturbance",
    "boundary_layer", "hysteresis", "input_delay", "sensor_delay", "actuator_lag", "sensor_lag",
    "input_gain", "sensor_gain", "input_saturation", "input_dead_zone", "sensor_offset",
    "sensor_drift", "sensor_saturation", "sensor_nonlinearity", "initial_state", "input_hold"}


def test_every_id_of_the_catalogue_is_there() -> None:
    assert set(IDS) == CATALOGUE_IDS
    assert {effect.near for effect in NEAR} <= CATALOGUE_IDS
    assert {effect.id for effect in OUTSIDE}.isdisjoint(CATALOGUE_IDS)


def test_every_effect_is_neutral_at_its_neutral_value() -> None:
    scales = Scales(0.2, 1.0, 5.0, 14.0)
    nominal = measured(Rig(), two_pulse())
    for effect in CATALOGUE:
        if not effect.quantities or not effect.quantities[0].grows:
            continue
        shape = effect.drawn(np.random.default_rng(0), scales)
        values = shape.sized(0.5)
        values[effect.quantities[0].name] = effect.quantities[0].neutral
        values = {**values, "theta_dot_0": 0.0} if effect.id == "initial_state" else values
        changed = measured(effect.applied(Rig(), values), two_pulse())
        assert changed == pytest.approx(nominal, abs=1e-9), effect.id


@pytest.mark.parametrize("kind", sorted(RICH_KINDS))
def test_rich_excitations_keep_to_the_motor(kind: str) -> None:
    bounds = Bounds()
    for seed in range(4):
        rng = np.random.default_rng(seed)
        e = rich(kind, rng, 2.35, lambda e: measured(Rig(), e), 0.25)
        velocity = np.cumsum(e.u_x) / 100
        position = np.cumsum(velocity) / 100
        assert e.duration == 20.0
        assert np.all(e.u_x[e.t < 2.0] == 0)
        assert np.all(e.u_y[e.t < 2.0] == 0)
        assert np.all(e.pitch[e.t < 2.0] == 0)
        assert np.max(np.abs(e.u_x)) <= bounds.acceleration
        assert np.max(np.abs(velocity)) <= bounds.velocity
        assert np.ptp(position) <= bounds.stroke
        assert abs(velocity[-1]) < 1e-3
        assert 0.1 < np.max(np.abs(measured(Rig(), e))) < 0.3


@pytest.mark.parametrize("choice", ["two_pulse", "rich", "chirp"])
def test_held_out_is_another_excitation(choice: str) -> None:
    for seed in range(3):
        train, held_out = pair(choice, np.random.default_rng(seed), 2.35,
                               lambda e: measured(Rig(), e), 0.2)
        assert not np.array_equal(train.u_x, held_out.u_x)
        assert choice == "two_pulse" or train.kind != held_out.kind
        assert choice == "rich" or train.kind == choice


def test_noise_is_whitened_by_its_own_model() -> None:
    rng = np.random.default_rng(0)
    for kind in (Noise("white", 2e-3), Noise("ar", 2e-3, rho=0.6),
                 Noise("quantised", 2e-3, step=4e-3)):
        z = kind.whitened(kind.spoilt(np.linspace(0, 1, 40000), rng) - np.linspace(0, 1, 40000))
        assert np.std(z) == pytest.approx(1.0, abs=0.02)
        assert abs(np.corrcoef(z[1:], z[:-1])[0, 1]) < 0.02


def test_outliers_and_dropouts_come_in_their_share() -> None:
    rng = np.random.default_rng(0)
    y = Noise("outliers", 1e-3, outlier_share=0.02).spoilt(np.zeros(20000), rng)
    assert 0.005 < np.mean(np.abs(y) > 4e-3) < 0.02
    y = Noise("dropouts", 1e-3, dropout_share=0.05).spoilt(np.zeros(20000), rng)
    assert np.mean(np.isnan(y)) == pytest.approx(0.05, abs=0.01)
    assert not np.isnan(y[0])
    z = Noise("dropouts", 1e-3, dropout_share=0.05).whitened(np.full(100, 1e-3))
    assert np.sum(z**2) == pytest.approx(95)


def test_all_classes_of_noise_are_drawn() -> None:
    kinds = {noises.drawn(np.random.default_rng(k), 1e-3).kind for k in range(60)}
    assert kinds == set(noises.CLASSES)


@pytest.mark.parametrize("seed", range(5))
def test_every_id_occurs_five_times_in_two_hundred_cases(seed: int) -> None:
    cards = deal(200, DEFAULT_MIX, np.random.default_rng(seed))
    met = Counter(e.id for card in cards for e in card.effects)
    assert min(met[identifier] for identifier in IDS) >= 5
    kinds = Counter(card.kind for card in cards)
    assert kinds == {"nothing": 20, "single": 90, "pair": 40, "near": 24, "outside": 26}
    assert sum(FLOW in card.effects for card in cards) >= 10
    assert {e.id for card in cards for e in card.effects} >= {e.id for e in (*NEAR, *OUTSIDE)}


def test_pairs_are_two_different_things() -> None:
    cards = deal(400, {"pair": 1.0}, np.random.default_rng(1))
    for card in cards:
        first, second = card.effects
        assert first.id != second.id
        assert second.id not in first.twins


def test_order_does_not_depend_on_the_class() -> None:
    position = np.zeros(len(DEFAULT_MIX))
    for seed in range(100):
        cards = deal(50, DEFAULT_MIX, np.random.default_rng(seed))
        for k, kind in enumerate(DEFAULT_MIX):
            position[k] += np.mean([i for i, card in enumerate(cards) if card.kind == kind])
    assert position / 100 == pytest.approx(24.5, abs=2.5)


@pytest.mark.parametrize("text", ["", "single", "single=-1", "single=0", "double=1", "single=x"])
def test_bad_mix(text: str) -> None:
    with pytest.raises(errors.BadSetting, match="--mix"):
        parse_mix(text)
