"""Small parts of a diagnosis against what they stand for."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.signal import lfilter

from pikanid import Model, Recording, excitation, simulate
from pikanid.mismatch.beyond.local_force import LocalForce
from pikanid.mismatch.beyond.patch import DEGREE, INTERVALS, FreeCurve
from pikanid.mismatch.beyond.penalised import Penalised, _prior
from pikanid.mismatch.catalogue.friction import coulomb_friction
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.preparation import averaged, oversampling
from pikanid.mismatch.design.separation import mean_precision, unexplained
from pikanid.mismatch.design.sizing import _next
from pikanid.mismatch.detect.residual_tests import frequency_bands
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.progressive_horizon import lost
from pikanid.mismatch.fitting.repeats import Spectra, modes_beside
from pikanid.mismatch.judge.kinds import families_of
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import systems
from pikanid.noise.level import NoiseModel
from pikanid.recording.channel import Channel
from pikanid.simulation.vectorfield import VectorField


def test_bands_share_out_the_lines_of_a_record() -> None:
    t = np.linspace(2.0, 12.0, 2001)
    bands = frequency_bands(t, 9.0, DEFAULTS.detection)
    assert len(bands) == 9
    every = np.concatenate(bands, axis=1)
    lines = int(6 * 9.0 * 10.0 / (2 * np.pi))  # up to six natural rates
    assert every.shape == (2001, 2 * lines)
    np.testing.assert_allclose(every.T @ every, np.eye(2 * lines), atol=0.01)
    assert all(a.shape[1] <= b.shape[1] for a, b in pairwise(bands[2:]))


def test_a_fit_is_lost_by_its_chi2_per_row() -> None:
    assert lost(301.0, 100, DEFAULTS) and not lost(299.0, 100, DEFAULTS)
    assert not lost(301.0, 1000, DEFAULTS)


@pytest.mark.parametrize("slope", [1.0, 2.0, -1.5])
def test_the_next_amplitude_follows_the_law_of_distances(slope: float) -> None:
    def distance(a: float) -> float:
        return 5.0 * a**slope

    wanted = distance(1.2)
    assert _next([(1.0, distance(1.0))], wanted, slope) == pytest.approx(1.2)
    both = [(0.8, distance(0.8)), (1.5, distance(1.5))]
    assert _next(both, wanted, slope) == pytest.approx(np.sqrt(0.8 * 1.5))
    far = _next([(100.0, distance(100.0))], wanted, slope)  # never more than twice at a time
    assert far == pytest.approx(100.0 * np.exp(-0.7))


def quick(t: np.ndarray, rate: float) -> Recording:
    return Recording({"u_x": Channel("u_x", t, 0.0 * t, "m/s^2"),
                      "theta": Channel("theta", t, np.sin(2 * np.pi * rate * t), "rad", 0.1)})


def test_samples_are_put_together_only_where_nothing_moves_between() -> None:
    model, t = systems.sloshing(), np.linspace(0.0, 20.0, 40_001)
    count = oversampling(model, (quick(t, 0.5),), DEFAULTS.budget)
    assert isinstance(count, int) and count % 2 == 1 and count > 1
    assert oversampling(model, (quick(t, 30.0),), DEFAULTS.budget) == 1
    uneven = t + 0.0001 * np.sin(np.arange(len(t)))
    assert oversampling(model, (quick(uneven, 0.5),), DEFAULTS.budget) == 1
    assert oversampling(model, (quick(t[::100], 0.5),), DEFAULTS.budget) == 1
    slow = quick(t, 0.5)
    hum = slow.with_channels(replace(
        slow["theta"], values=slow["theta"].values + 0.1 * np.sin(2 * np.pi * 40.0 * t)))
    coarser = DEFAULTS.with_values({"budget.fastest": 0.9}).budget
    assert oversampling(model, (hum,), DEFAULTS.budget) == 1
    assert oversampling(model, (hum,), coarser) == count
    # never so many that a period keeps fewer than thirty
    slow = averaged(slow["theta"], count)
    assert np.diff(slow.time).max() < 2.0 / 25
    np.testing.assert_allclose(slow.values, np.sin(np.pi * slow.time), atol=1e-3)
    rng = np.random.default_rng(0)
    noise = averaged(Channel("y", t, rng.normal(size=t.size), "", 1.0), 9)
    assert np.std(noise.values) == pytest.approx(float(np.mean(noise.sigma)), rel=0.05)
    assert len(noise.values) == len(t) // 9


def test_what_is_unexplained_knows_no_units() -> None:
    rng = np.random.default_rng(1)
    r, jacobian = rng.normal(size=20), rng.normal(size=(20, 3))
    low, high = np.full(3, -0.05), np.full(3, 0.1)
    wanted = unexplained(r, jacobian, low, high)
    for scale in (1e-6, 1e6):
        got = unexplained(r, scale * jacobian, low / scale, high / scale)
        np.testing.assert_allclose(got, wanted, rtol=1e-9)
    assert mean_precision(3.0 * np.eye(4)) == pytest.approx(3.0)
    assert mean_precision(np.ones((5, 2))) == 0.0 and mean_precision(np.ones((1, 2))) == 0.0


def test_a_patch_is_the_same_curve_as_what_was_fitted() -> None:
    model = systems.sloshing()
    (site,) = sites(model, (quick(np.linspace(0.0, 5.0, 101), 0.5),))
    basis = FreeCurve("theta", -0.3, 0.5, model)
    # all cubic splines on these intervals, but for the straight line
    assert len(basis.names) == INTERVALS + DEGREE - 1
    rng = np.random.default_rng(2)
    delta = dict(zip(basis.names, rng.normal(size=len(basis.names)), strict=True))
    found: Any = SimpleNamespace(values=delta)
    patched = basis.extended(model, site, found)
    candidate = basis.candidate(site)
    added = candidate.applied(model).with_values(delta)
    x = np.column_stack([np.linspace(-0.3, 0.5, 41), np.linspace(-1.0, 1.0, 41)])
    t, u = np.zeros(41), np.zeros((41, 2))
    rates = [VectorField(m).rhs(t, x, u, np.array([m.values[n] for n in m.parameter_names]))
             for m in (model, patched, added)]
    curve = basis.matrix(x[:, 0]) @ np.array(list(delta.values()))
    np.testing.assert_allclose(rates[1][:, 1] - rates[0][:, 1], curve, atol=1e-8)
    np.testing.assert_allclose(rates[2][:, 1] - rates[0][:, 1], curve, atol=1e-8)


@pytest.mark.parametrize("make", [
    lambda m, unit, site: FreeCurve("T", 8.0, 22.0, m).candidate(site),
    lambda m, unit, site: FreeCurve("T_a", 5.0, 15.0, m, 3, unit).of_input(site),
    lambda m, unit, site: FreeCurve("T", 8.0, 22.0, m, 3, unit).of_sensor(site),
    lambda m, unit, site: LocalForce("T", 8.0, 22.0, ("below", "above"), m).candidate(site)])
def test_free_curves_of_temperatures_know_no_zero(make: Any) -> None:
    """In degC, where a temperature has no powers, they are what they are in K, or without units."""
    def shown(unit: str) -> np.ndarray:
        model = Model.from_dict({
            "name": "house", "states": {"T": {"unit": unit, "initial": 20.0}},
            "inputs": {"T_a": {"unit": unit}},
            "parameters": {"k": {"unit": "1/s", "guess": 0.01, "bounds": [0.0, 1.0]}},
            "equations": {"T": "-k*(T - T_a)"},
            "outputs": {"T": {"unit": unit, "expression": "T"}}})
        t = np.arange(200) * 5.0
        heard = Recording.from_arrays(t, {"T_a": 10 + 5 * np.sin(t / 100)}, units={"T_a": unit})
        effect = make(model, unit, sites(model, (heard,))[0])
        values = {p.name: 1e-5 * (1 + k) for k, p in enumerate(effect.parameters)}
        return simulate(effect.applied(model).with_values(values), heard)["T"].values

    plain = shown("")
    for unit in ("degC", "K"):
        np.testing.assert_allclose(shown(unit), plain, rtol=1e-12)


def test_penalised_curves_agree_with_the_dense_formulas() -> None:
    rng = np.random.default_rng(3)
    D, J = rng.normal(size=(60, 12)), rng.normal(size=(60, 2))
    force = np.sin(np.linspace(0.0, 3.0, 12))
    target = D @ force + J @ [1.0, -2.0] + 0.1 * rng.normal(size=60)
    found = Penalised(D, J, target, None)
    beside = np.eye(60) - J @ np.linalg.pinv(J)
    penalty = found.weight * _prior(12, found.memory)
    information = D.T @ beside @ D + penalty
    wanted = np.linalg.solve(information, D.T @ beside @ target)
    np.testing.assert_allclose(found.coefficients, wanted, rtol=1e-8)
    np.testing.assert_allclose(found.root @ found.root.T, information, rtol=1e-8, atol=1e-10)
    freedom = np.trace(np.linalg.solve(information, D.T @ beside @ D))
    assert found.freedom == pytest.approx(freedom)
    assert np.linalg.norm(found.coefficients - force) < 0.2 * np.linalg.norm(force)


def test_modes_beside_a_jacobian_in_any_unit() -> None:
    rng = np.random.default_rng(4)
    J = rng.normal(size=(30, 3)) * np.array([1e-6, 1.0, 1e5])
    modes, omega = modes_beside(J)
    assert modes.shape == (30, 27) and np.all(np.diff(omega) >= 0)
    np.testing.assert_allclose(modes.T @ modes, np.eye(27), atol=1e-9)
    np.testing.assert_allclose(modes.T @ (J / np.linalg.norm(J, axis=0)), 0.0, atol=1e-9)


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_noise_of_repeats_has_the_level_that_it_was_drawn_with(rho: float) -> None:
    """That level is not refuted; half of its power is."""
    rng = np.random.default_rng(5)
    white = rng.normal(size=(3, 1200)) * np.sqrt(1 - rho**2)
    residuals = list(lfilter([1.0], [1.0, -rho], white, axis=1)[:, 200:])
    t = np.linspace(0.0, 9.99, 1000)
    spectra = Spectra.of([t] * 3, residuals, [np.ones((1000, 1))] * 3, 0.01, DEFAULTS)
    old = NoiseModel(1.0, rho, 0.05, 0.01, "stated")
    found = spectra.level(old)
    assert found.sigma == pytest.approx(1.0, abs=0.12) and found.rho == pytest.approx(rho, abs=0.1)
    assert spectra.beyond(old) > 0.01
    assert spectra.beyond(NoiseModel(0.7, rho, 0.05, 0.01, "stated")) < 1e-6
    assert rho or spectra.apart == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(("width", "blurred"), [(0.01, False), (0.2, False), (0.45, True),
                                                (5.0, True)])
def test_friction_rounded_over_all_speeds_is_not_dry(width: float, blurred: bool) -> None:
    model = systems.sloshing()
    speed = np.sin(np.linspace(0.0, 60.0, 6000))
    site = sites(model, (simulate(model, excitation.two_pulse()),))[0]
    sharp, rounded = coulomb_friction(site)
    names = [p.name for p in rounded.parameters]
    whitened = SimpleNamespace(
        motion=lambda theta: {site.v: speed},
        problem=SimpleNamespace(free=[SimpleNamespace(name=n) for n in names]))
    minimum: Any = SimpleNamespace(theta=np.array([1.0, width]))
    for effect in (sharp, rounded):
        h = Hypothesis((effect,), model, cast(Any, whitened), minimum, 0.0)
        assert h.blurred == (frozenset({rounded.key}) if blurred and effect is rounded
                             else frozenset())
    assert (families_of(rounded, h, 0.3) == ("drag",)) is blurred
