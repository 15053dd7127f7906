"""A cell whose voltage follows its charge in a curve, and one with a further pair of R and C."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import pikanid as pk
from pikanid.mismatch.catalogue.bound_effects import bound_to
from pikanid.mismatch.catalogue.output_curve import output_curves
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import systems
from pikanid.model.domains import candidates_of

CELL = pk.Model.from_dict({
    "name": "cell", "domain": "electrical",
    "states": {"soc": {"unit": "1", "initial": 0.9}, "v": {"unit": "V"}},
    "inputs": {"i": {"unit": "A", "hold": "zero"}},
    "parameters": {"Q": {"unit": "A*h", "value": 2.0},
                   "R0": {"unit": "ohm", "guess": 0.04, "bounds": [1e-3, 1.0]},
                   "R1": {"unit": "ohm", "guess": 0.01, "bounds": [1e-3, 1.0]},
                   "C1": {"unit": "F", "guess": 1500.0, "bounds": [10.0, 1e6]},
                   "E": {"unit": "V", "guess": 3.2, "bounds": [1.0, 5.0]},
                   "k": {"unit": "V", "guess": 0.5, "bounds": [0.0, 5.0]}},
    "equations": {"soc": "-i/Q", "v": "i/C1 - v/(R1*C1)"},
    "outputs": {"U": {"unit": "V", "expression": "E + k*soc - R0*i - v"}}})
SIGMA, STEP = 0.001, 1.0


def recorded(seed: int, bend: float = 0.0, further: float = 0.0) -> pk.Recording:
    """Exact, as the current is held: sums and decays from sample to sample."""
    rng = np.random.default_rng(seed)
    i = np.repeat(rng.uniform(-1.5, 4.0, 60), rng.integers(15, 30, 60))[:1200]
    t = STEP * np.arange(len(i))
    soc = 0.9 - np.concatenate([[0.0], np.cumsum(i)[:-1]]) * STEP / 7200.0

    def pair(R: float, tau: float) -> np.ndarray:
        keep = np.exp(-STEP / tau)
        return lfilter([0.0, R * (1 - keep)], [1.0, -keep], i)

    U = 3.1 + 0.7 * soc + bend * (soc - 0.7) ** 2 - 0.03 * i - pair(0.02, 20.0) - pair(
        further, 150.0) + SIGMA * rng.normal(size=len(i))
    return pk.Recording.from_arrays(t, {"i": i, "U": U}, {"i": "A", "U": "V"}, hold={"i": "zero"})


def bound(model: pk.Model, recording: pk.Recording) -> set[tuple[str, str]]:
    seen = {n: np.linspace(0.5, 0.9) for n in model.state_names}
    made = bound_to(candidates_of(model), sites(model, [recording]), [recording], lambda: seen)
    return {(e.key, e.variant) for e in made}


def test_only_a_state_with_a_free_slope_has_a_curve() -> None:
    found = bound(CELL, recorded(1))
    assert ("output_curve", "soc,U") in found and ("output_curve", "v,U") not in found
    assert any(key == "further_pair" for key, _ in found)
    # neither an output of one term, nor one whose slope is known
    fixed = CELL.fix(k=0.7)
    for model in (systems.thermal_rc(), systems.sloshing(), fixed):
        motion = {n: np.linspace(0.0, 1.0) for n in model.state_names}
        assert [*output_curves(model, lambda m=motion: m,  # type: ignore[misc]  # a default
                               dict.fromkeys(model.output_names, 1.0))] == []


def test_a_further_pair_is_of_a_voltage_and_a_current() -> None:
    motor = systems.dc_motor()
    recording = pk.simulate(motor, pk.Recording.from_arrays(
        0.01 * np.arange(100), {"u": np.ones(100)}, {"u": "V"}))
    assert not any(key == "further_pair" for key, _ in bound(motor, recording))


def test_a_state_that_stays_has_no_curve() -> None:
    motion = {n: np.full(5, 0.9) for n in CELL.state_names}
    assert [*output_curves(CELL, lambda: motion, {"U": 1.0})] == []


@pytest.mark.slow
@pytest.mark.parametrize(("hidden", "wanted"), [
    ({"bend": 0.8}, {"output_curve"}), ({"further": 0.012}, {"further_pair"}),
    ({"bend": 0.8, "further": 0.012}, {"output_curve", "further_pair"})])
def test_they_are_found(hidden: dict[str, float], wanted: set[str]) -> None:
    found = pk.diagnose(CELL, recorded(1, **hidden), recorded(2, **hidden))
    # a memory of the other pair's voltage does nearly the same
    assert found.verdict in ("named", "set", "partial"), str(found)
    first = found.hypotheses[0]
    assert {i for e in first.effects for i in e.ids} == wanted
    for effect in first.effects:
        if effect.ids == ("further_pair",):
            R, r = effect.parameters["R"], effect.parameters["r"]
            assert R.value == pytest.approx(-0.012, abs=4 * R.std)
            assert r.value == pytest.approx(1 / 150.0, abs=4 * r.std)


@pytest.mark.slow
def test_a_cell_without_either_is_explained() -> None:
    assert pk.diagnose(CELL, recorded(3), recorded(4)).verdict == "none"
