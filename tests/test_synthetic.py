"""What `simulate` adds to a trajectory: parameters, noise by output, the seed."""

from __future__ import annotations

import interpreted
import numpy as np
import pytest

import pikanid as pk
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.simulation import Simulator, Steps
from pikanid.simulation.simulator import Response
from pikanid.simulation.synthetic import with_outputs

T = np.linspace(0.0, 2.0, 401)


@pytest.fixture(autouse=True)
def by_python(monkeypatch: pytest.MonkeyPatch) -> None:
    interpreted.instead_of_compiled(monkeypatch)


def model() -> Model:
    return Model.from_dict({
        "states": {"x": {"initial": "a"}}, "inputs": {"u": {}}, "equations": {"x": "-b*x + u"},
        "parameters": {"a": {"guess": 1.0}, "b": {"guess": 0.5}},
        "outputs": {"x": {"expression": "x"}, "w": {"expression": "10*x"}}})


def rest() -> Recording:
    return Recording.from_arrays(T, {"u": np.zeros(401)}, hold={"u": "zero"})


def test_parameters_that_differ_and_times_that_are_asked() -> None:
    t = np.array([0.0, 0.3, 1.7])
    found = pk.simulate(model(), rest(), parameters={"b": 2.0}, t=t)
    np.testing.assert_allclose(found["x"].values, np.exp(-2 * t), atol=1e-8)
    np.testing.assert_allclose(found["w"].values, 10 * np.exp(-2 * t), atol=1e-7)
    np.testing.assert_array_equal(found["x"].time, t)
    assert found["x"].sigma is None


def test_noise_has_the_sigma_of_its_output_and_the_seed_decides() -> None:
    clean = pk.simulate(model(), rest())
    found, again, other = (
        pk.simulate(model(), rest(), sigma={"w": 0.3}, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(found["x"].values, clean["x"].values)
    assert (found["x"].sigma, found["w"].sigma) == (None, 0.3)
    noise = found["w"].values - clean["w"].values
    # 401 draws: a standard error of 0.3/√802
    assert np.std(noise) == pytest.approx(0.3, abs=4 * 0.3 / np.sqrt(802))
    np.testing.assert_array_equal(found["w"].values, again["w"].values)
    assert np.all(found["w"].values != other["w"].values)


def test_placeholders_only_where_an_output_is_missing() -> None:
    own = rest().with_channels(pk.Channel("x", T[:5], T[:5] + 1))
    found = with_outputs(model(), own, T[::40])
    np.testing.assert_array_equal(found["x"].values, T[:5] + 1)
    np.testing.assert_array_equal(found["w"].time, T[::40])


def test_kinks_are_not_met_with_ever_shorter_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    kinked = Model.from_dict({
        "states": {"x": {"initial": 1.0}, "v": {}}, "inputs": {"u": {}}, "outputs": {
            "y": {"expression": "x"}}, "equations": {"x": "v", "v": "-30*x - signed_power(v, n)"},
        "parameters": {"n": {"guess": 1.1}}})
    tried: list[float] = []
    run = Simulator.run

    def counted(self: Simulator, p: np.ndarray, active: np.ndarray | None = None,
                steps: Steps | None = None, states: bool = False) -> Response:
        assert steps is not None
        tried.append(steps.longest)
        return run(self, p, active, steps, states)

    monkeypatch.setattr(Simulator, "run", counted)
    few = Recording.from_arrays(T[::20], {"u": np.zeros(21)}, hold={"u": "zero"})
    found = pk.simulate(kinked, few)["y"].values
    shortest = min(tried)
    exact = pk.simulate(kinked, few, tolerance=1e-11, method="explicit")["y"].values
    # 1e-8 of the largest output is promised; 1e-10 had taken far shorter steps
    assert 1e-10 < np.abs(found - exact).max() < 1e-8
    assert min(tried) < 0.2 * shortest
