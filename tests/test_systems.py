"""Ready-made models: the physics that they name, and what can be found out about them."""

from __future__ import annotations

import numpy as np
import pytest
from ready_made import EXPERIMENTS, HOUR, double_pendulum_mass

import pikanid as pk
from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Model, Output, systems
from pikanid.simulation import VectorField


def states(model: Model, drive: pk.Recording) -> np.ndarray:
    """The states (N, n) at the times of a drive."""
    seen = model.replace(outputs=tuple(
        Output(f"{s.name}_seen", symbol(s.name), s.unit) for s in model.states))
    made = pk.simulate(seen, drive)
    return np.stack([made[name].values for name in seen.output_names], axis=1)


def test_they_are_listed_once() -> None:
    assert set(systems.__all__) == {"SYSTEMS", "find", *systems.SYSTEMS}
    assert set(EXPERIMENTS) == set(systems.SYSTEMS)
    for name, build in systems.SYSTEMS.items():
        assert systems.find(name) == build() and build().name == name
    with pytest.raises(errors.BadModel, match="cart_pole"):
        systems.find("cartpole")


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_simulation_follows_equations_written_by_hand(name: str) -> None:
    experiment = EXPERIMENTS[name]
    model = experiment.model(name)
    made = pk.simulate(model, experiment.drive(model))
    expected = experiment.reference(model)
    for k, output in enumerate(model.output_names):
        apart = np.abs(made[output].values - expected[:, k])
        assert apart.max() < 1e-6 * np.ptp(expected[:, k]), output


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_parameters_come_back_from_noisy_outputs(name: str) -> None:
    experiment = EXPERIMENTS[name]
    truth = experiment.model(name)
    found = pk.NLS(starts=1).fit(experiment.guess(name), experiment.recording(name, 3))
    assert found.adequacy.verdict == "fits"
    for f in found.free:
        away = abs(found.value(f.name) - truth.values[f.name])
        assert away < 4 * found.std(f.name), f.name
        # an experiment that cannot tell a parameter would pass with anything
        assert found.std(f.name) < 0.5 * abs(truth.values[f.name]), f.name


def test_what_reacts_does_not_vanish() -> None:
    model = EXPERIMENTS["batch_reactor"].model("batch_reactor")
    x = states(model, EXPERIMENTS["batch_reactor"].drive(model))
    np.testing.assert_allclose(x.sum(axis=1), model.values["a0"], rtol=1e-12)
    assert x[-1, 2] > 0.5


def test_nobody_leaves_a_closed_population() -> None:
    model = EXPERIMENTS["sir"].model("sir")
    x = states(model, EXPERIMENTS["sir"].drive(model))
    np.testing.assert_allclose(x.sum(axis=1), 763.0, rtol=1e-12)
    assert x[-1, 0] < 100 < x[:, 1].max()


def test_prey_and_predators_come_round() -> None:
    model = EXPERIMENTS["lotka_volterra"].model("lotka_volterra")
    x, y = states(model, EXPERIMENTS["lotka_volterra"].drive(model)).T
    p = model.values
    kept = p["delta"] * x + p["beta"] * y - p["gamma"] * np.log(x) - p["alpha"] * np.log(y)
    np.testing.assert_allclose(kept, kept[0], atol=1e-8)
    assert np.ptp(x) > 20


def test_a_double_pendulum_without_friction_keeps_its_energy() -> None:
    model = systems.double_pendulum().with_values(
        b1=0.0, b2=0.0, q1_0=1.0, q2_0=0.5, v1_0=0.0, v2_0=1.0)
    drive = pk.Recording.from_arrays(
        np.linspace(0.0, 3.0, 301), {"tau1": np.zeros(301)}, {"tau1": "N*m"})
    q1, q2, v1, v2 = states(model, drive).T
    p = model.values
    kinetic = [0.5 * v @ double_pendulum_mass(q, p) @ v
               for q, v in zip(q2, np.stack([v1, v2], axis=1), strict=True)]
    energy = kinetic - p["g"] * (p["g1"] * np.cos(q1) + p["g2"] * np.cos(q1 + q2))
    np.testing.assert_allclose(energy, energy[0], atol=1e-7)
    assert np.ptp(kinetic) > 0.1


def test_a_cart_pole_swings_as_a_pendulum_where_the_cart_is_heavy() -> None:
    heavy = systems.cart_pole().with_values(m_c=1e5, b=0.0, d=0.0).with_initial(theta=1e-3)
    t = np.linspace(0.0, 2.0, 201)
    drive = pk.Recording.from_arrays(t, {"F": np.zeros(201)}, {"F": "N"})
    theta = pk.simulate(heavy, drive)["theta"].values
    np.testing.assert_allclose(theta, 1e-3 * np.cos(np.sqrt(9.81 / 0.3) * t), atol=1e-7)


def test_slopes_of_levels() -> None:
    """The tanks' root is not analytic, so that complex steps say nothing of its derivatives."""
    model = systems.cascaded_tanks()
    field, p = VectorField(model), np.array(list(model.values.values()))
    x, u, t = np.array([[2.0, 3.0], [0.0, 0.5]]), np.full((2, 1), 2.0), np.zeros(2)
    by_state, by_parameter = field.rhs_jacobians(t, x, u, p)
    k1, k3 = p[:2]
    np.testing.assert_allclose(by_state[0], [
        [-k1 / np.sqrt(8.0), 0.0], [k1 / np.sqrt(8.0), -k3 / np.sqrt(12.0)]], rtol=1e-12)
    np.testing.assert_allclose(by_parameter[0, :, :3], [
        [-np.sqrt(2.0), 0.0, 2.0], [np.sqrt(2.0), -np.sqrt(3.0), 0.0]], rtol=1e-12)
    assert np.all(np.isfinite(by_state)) and np.all(np.isfinite(by_parameter))


def test_tanks_run_dry_and_fill_again() -> None:
    """√x at x = 0: no infinite slope, no level below nothing."""
    model = systems.cascaded_tanks()
    t = np.linspace(0.0, 1600.0, 401)
    drive = pk.Recording.from_arrays(
        t, {"u": np.where(t < 1000, 0.0, 2.0)}, {"u": "V"}, hold={"u": "zero"})
    x = states(model, drive)
    assert x.min() > -1e-5
    assert np.all(np.abs(x[(t > 400) & (t < 1000)]) < 1e-5)
    assert np.all(x[-1] > 1.0)
    recording = pk.simulate(model, drive, sigma=0.02, seed=0)
    found = pk.NLS(starts=1).fit(model.with_values(k1=0.06, k3=0.055), recording)
    for name in ("k1", "k3", "k4"):
        assert abs(found.value(name) - model.values[name]) < 4 * found.std(name)


def test_doses_differ_from_subject_to_subject() -> None:
    model = systems.one_compartment()
    t = np.arange(0, 24) * HOUR
    subjects = [pk.simulate(model, pk.Recording.from_arrays(
        t, {"dose": np.full(24, dose)}, {"dose": "mg/kg"}, hold={"dose": "zero"}),
        sigma=0.05, seed=k) for k, dose in enumerate((3.0, 4.0, 5.0))]
    assert subjects[2]["c"].values.max() > 1.4 * subjects[0]["c"].values.max()
    found = pk.NLS(starts=1).fit(model.with_values(V=0.6), subjects)
    for name in model.free_names:
        assert abs(found.value(name) - model.values[name]) < 4 * found.std(name)
