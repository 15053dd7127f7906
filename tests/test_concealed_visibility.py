"""Distances in σ against exact linear algebra and SciPy's least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy.optimize import least_squares

from pikanid.validation.concealed import visibility as room
from pikanid.validation.concealed.candidate import Candidate, nominal_fit, starts
from pikanid.validation.concealed.case import in_tank
from pikanid.validation.concealed.deck import FLOW
from pikanid.validation.concealed.effect import Effect, Scales
from pikanid.validation.concealed.effects import CATALOGUE, variants
from pikanid.validation.concealed.excitations import pair, two_pulse
from pikanid.validation.concealed.fisher import refit, unexplained
from pikanid.validation.concealed.noise import Noise
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import measured
from pikanid.validation.concealed.sizing import sized
from pikanid.validation.concealed.tank import Tank
from pikanid.validation.concealed.visibility import (
    Visibility,
    is_rival,
    visibility,
)

NOISE = Noise("white", 0.1 * np.pi / 180)
SCALES = Scales(float(np.max(measured(Rig(), two_pulse()))), 1.0, 5.0, 14.8)


def effect(identifier: str) -> Effect:
    return variants(identifier)[0]


def seen(rig: Rig, *hidden: str, sizes: Sequence[Mapping[str, float]] = ()) -> Visibility:
    return visibility(measured(rig, two_pulse()), two_pulse(), NOISE, Rig(),
                      [effect(identifier) for identifier in hidden], SCALES, sizes)


def test_distance_of_a_linear_model_is_that_of_its_projection() -> None:
    rng = np.random.default_rng(0)
    basis, target = rng.normal(size=(50, 3)), rng.normal(size=50)
    free = np.full(3, np.inf)
    found = refit(lambda v: basis @ v, target, np.zeros(3), -free, free, np.ones(3))
    wanted = target - basis @ np.linalg.lstsq(basis, target, rcond=None)[0]
    assert found.distance == pytest.approx(np.linalg.norm(wanted), rel=1e-6)
    assert unexplained(basis, target) == pytest.approx(wanted, abs=1e-7)


def test_bounds_hold() -> None:
    line = np.linspace(0, 1, 5)
    found = refit(lambda v: v * line, 2 * line, np.zeros(1), np.zeros(1), np.ones(1), np.ones(1))
    assert found.values == pytest.approx(1.0)


@pytest.mark.parametrize("rig", [Rig(coulomb=0.8), Rig(sensor_gain=1.1), Rig(length=0.03)],
                         ids=["friction", "gain", "length"])
def test_nominal_distance_agrees_with_scipy(rig: Rig) -> None:
    target = NOISE.whitened(measured(rig, two_pulse()))
    ours = nominal_fit(target, two_pulse(), NOISE, Rig(length=rig.length)).distance

    def residual(v: np.ndarray) -> np.ndarray:
        return NOISE.whitened(measured(Rig(length=v[0], damping=v[1]), two_pulse())) - target

    theirs = np.sqrt(2 * least_squares(residual, [rig.length, 0.15], x_scale=[0.01, 0.1],
                                       xtol=1e-12, ftol=1e-12).cost)
    assert ours == pytest.approx(theirs, rel=2e-3, abs=0.02)


def test_refit_finds_a_hidden_effect_again() -> None:
    drag = effect("quadratic_drag")
    truth = NOISE.whitened(measured(Rig(length=0.047, quadratic=1.3), two_pulse()))
    candidate = Candidate((drag,), SCALES, two_pulse(), NOISE, Rig())
    begun = np.r_[0.0465, 0.2, next(starts(drag, SCALES))]
    assert candidate.refitted(truth, begun).values == pytest.approx([0.047, 0.15, 1.3], rel=1e-3)


def test_nothing_is_at_distance_zero() -> None:
    found = seen(Rig())
    assert found.nominal < 0.01
    assert found.rival == ()
    assert found.length == pytest.approx(0.045, rel=1e-5)


def test_equal_pulses_cannot_tell_saturation_from_gain() -> None:
    found = seen(Rig(input_limit=0.8), "input_saturation")
    assert found.nominal > 50
    assert found.distance < 0.5


def test_delay_is_told_from_everything_but_its_twin_and_lags() -> None:
    found = seen(Rig(input_delay=0.02), "input_delay")
    assert set(found.rival) <= {"actuator_lag", "sensor_lag"}
    assert 5 < found.distance < found.nominal
    assert not is_rival(effect("sensor_delay"), effect("input_delay"))
    assert not is_rival(effect("power_drag"), effect("coulomb_friction"))
    assert is_rival(effect("coulomb_friction"), effect("power_drag"))


def test_half_of_a_pair_is_a_rival() -> None:
    faint = seen(Rig(coulomb=2.0, offset=1e-5), "coulomb_friction", "sensor_offset",
                 sizes=[{"c": 2.0}, {"b": 1e-5}])
    assert "coulomb_friction" in faint.rival
    assert faint.distance < 1.0
    friction, offset = faint.effects
    assert offset < 1.0 < 5.0 < friction


def test_a_variant_is_no_half_of_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ways of hysteresis are kept apart: backlash has one quantity, a Bouc-Wen force two."""
    monkeypatch.setattr(room, "CATALOGUE", (*variants("hysteresis"), effect("sensor_drift")))
    bouc_wen, backlash = variants("hysteresis")
    # What the rival backlash explains best is not to be taken for a fit of the Bouc-Wen force.
    truth = measured(Rig(backlash=0.3, memory=0.1, offset=0.01), two_pulse())
    found = visibility(truth, two_pulse(), NOISE, Rig(), [bouc_wen, effect("sensor_offset")],
                       SCALES)
    candidate = Candidate((backlash,), SCALES, two_pulse(), NOISE, Rig())
    half = candidate.refitted(NOISE.whitened(truth), np.array([0.045, 0.15, 0.3]))
    assert found.distance <= 1.01 * half.distance < found.nominal


@pytest.mark.slow
def test_strong_pair_has_no_close_rival() -> None:
    strong = seen(Rig(coulomb=2.0, offset=0.02), "coulomb_friction", "sensor_offset")
    assert strong.distance > 5.0


def test_visibility_grows_with_size_and_falls_with_noise() -> None:
    distances = [seen(Rig(cubic=k3), "cubic_stiffness").nominal for k3 in (50.0, 100.0, 200.0)]
    assert np.all(np.diff(distances) > 0)
    target = measured(Rig(cubic=100.0), two_pulse())
    noisy = Noise("white", 10 * NOISE.sigma)
    found = nominal_fit(noisy.whitened(target), two_pulse(), noisy, Rig()).distance
    assert found == pytest.approx(distances[1] / 10, rel=1e-2)


@pytest.mark.parametrize("wanted", [3.0, 40.0])
@pytest.mark.parametrize("identifier", ["coulomb_friction", "input_delay", "wall_impact"])
def test_size_is_chosen_by_visibility(identifier: str, wanted: float) -> None:
    shape = effect(identifier).drawn(np.random.default_rng(0), SCALES)
    values = sized(shape, wanted, Rig(), two_pulse(), NOISE)
    truth = NOISE.whitened(measured(effect(identifier).applied(Rig(), values), two_pulse()))
    reached = nominal_fit(truth, two_pulse(), NOISE, Rig()).distance
    assert wanted / 2 < reached < 2 * wanted


@pytest.mark.slow
def test_rivals_are_refitted_as_well_as_many_starts_would() -> None:
    """No rival comes closer from any of its starts than the contest found."""
    rng = np.random.default_rng(5)
    train, _ = pair("rich", rng, 2.35, lambda e: measured(Rig(), e), 0.25)
    scales = Scales(0.2, float(np.max(np.abs(train.u_x))), 20.0, 14.8)
    for rig, identifier in ((Rig(coulomb=1.0), "coulomb_friction"),
                            (Rig(sensor_cubic=2.0), "sensor_nonlinearity"),
                            (Rig(mode_gain=10.0, mode_rate=35.0), "second_mode"),
                            (Rig(layer=0.1), "boundary_layer")):
        truth = measured(rig, train)
        target = NOISE.whitened(truth)
        found = visibility(truth, train, NOISE, Rig(), [effect(identifier)], scales)
        best = found.nominal
        for rival in CATALOGUE:
            if not is_rival(rival, effect(identifier)):
                continue
            candidate = Candidate((rival,), scales, train, NOISE, Rig())
            for start in starts(rival, scales):
                for base in ([found.length, found.damping], [0.045, 0.15]):
                    fit = candidate.refitted(target, np.r_[base, start], 25)
                    best = min(best, fit.distance)
        assert found.distance <= 1.1 * best + 0.1, identifier


def test_tank_is_no_pendulum() -> None:
    tank = Tank(0.033, 0.09, contact_line=5e-5)
    base = Rig(length=tank.length, damping=2 * 0.01 * np.sqrt(9.81 / tank.length) * 0.3)
    truth = measured(tank, two_pulse())
    found = visibility(truth, two_pulse(), NOISE, base, [FLOW], Scales(0.2, 1.0, 5.0, 23.4))
    assert found.nominal > 20
    assert found.length == pytest.approx(tank.length, rel=0.05)


def test_tilt_and_contact_line_of_a_tank_are_effects_of_their_own() -> None:
    hidden = in_tank(Tank(0.033, 0.09, contact_line=1e-4, tilt=-0.004))
    assert [entry["id"] for entry in hidden.entries] == [
        "potential_flow", "coulomb_friction", "static_bias"]
    assert [part.kind for part in hidden.parts] == ["outside", "catalogue", "catalogue"]
    assert [entry["id"] for entry in in_tank(Tank(0.033, 0.09)).entries] == ["potential_flow"]


@pytest.mark.slow
def test_what_a_tank_hides_is_seen_part_by_part() -> None:
    tank = Tank(0.033, 0.09, contact_line=2e-4, tilt=0.02)
    base = Rig(length=tank.length, damping=2 * 0.01 * np.sqrt(9.81 / tank.length) * 0.3)
    noise = Noise("white", 0.04)
    found = visibility(measured(tank, two_pulse()), two_pulse(), noise, base,
                       in_tank(tank).parts, Scales(0.2, 1.0, 5.0, 23.4))
    flow, friction, bias = found.effects
    # coarse noise hides that the liquid is no pendulum, not that it is held and tilted
    assert flow < 4 < min(friction, bias) and max(friction, bias) <= found.nominal


def test_friction_in_a_tank_is_fitted_from_several_sizes() -> None:
    """What sticks has many minima, and the first one that is met may be far from the lowest."""
    ratio = 0.01
    tank = Tank(0.033, 0.09, (ratio, 0.0115, 0.0205, 0.0252, 0.0266), 1.5e-4)
    rate = float(np.sqrt(9.81 / tank.length))
    base = Rig(length=tank.length, damping=2 * ratio * rate * Rig().mass)
    noise = Noise("white", np.pi / 180)
    train, _ = pair("rich", np.random.default_rng(1), rate / (2 * np.pi),
                    lambda e: measured(base, e), 0.15)
    scales = Scales(0.15, float(np.max(np.abs(train.u_x))), 20.0, rate)
    truth, parts = measured(tank, train), in_tank(tank).parts
    found = visibility(truth, train, noise, base, parts, scales)
    friction = Candidate((parts[1],), scales, train, noise, Rig())
    best = min(friction.refitted(noise.whitened(truth), np.array([tank.length, d, c]), 25).distance
               for d in (0.1, 0.2, 0.4) for c in (0.3, 1.0, 2.5))
    assert found.effects[0] <= 1.05 * best + 0.05
