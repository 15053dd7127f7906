"""What held-out recordings cannot speak of, in one part of a train recording or the other."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.case import Case
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case
from pikanid.mismatch.steps.within_train import worth_within_train

SIGMA = 0.002
WALL = 0.29  # rad: between the first swing after a kick and the second


def kicked(kicks: tuple[float, ...], size: float) -> pk.Recording:
    """Half a sine as long as half a swing, from each of these times on."""
    t = np.arange(1200) / 100
    u = sum((size * np.sin(14.5 * (t - begin)) * ((t >= begin) & (t < begin + 0.2))
             for begin in kicks), np.zeros_like(t))
    return pk.Recording.from_arrays(t, {"u_x": u}, {"u_x": "m/s^2"})


def case_of(kicks: tuple[float, ...]) -> tuple[Case, Hypothesis, Hypothesis]:
    """A wall that the train recording meets once after each kick and the held-out one never; fits
    with it and without.
    """
    model = pk.systems.sloshing()
    rig = model.with_term("theta_dot", f"-9000*max(theta - {WALL}, 0)")
    train, later = (pk.simulate(rig, kicked(*of), sigma=SIGMA, seed=k)
                    for k, of in enumerate(((kicks, 2.0), ((1.0, 7.0), 1.0))))
    case = open_case(model, (train,), (later,), None, lambda text: None, DEFAULTS)
    wall = next(c for c in case.candidates if c.key == "wall_impact")
    begin = case.base.point | {"wall": 0.28, "k_wall": 5000.0}
    case.search.refine([((wall,), [begin])], frozenset())
    found = case.search.ranked()[0]
    assert found.key == {"wall_impact"} and train["theta"].values.max() > WALL
    return case, found, case.base


@pytest.mark.parametrize(("kicks", "sure"), [((1.0, 7.0), True), ((1.0,), False)])
def test_a_wall_that_is_met_again_could_have_been_refuted(kicks: tuple[float, ...], sure: bool
                                                          ) -> None:
    case, with_wall, without = case_of(kicks)
    wall = with_wall.effects[0]
    seen = case.predicted(with_wall)
    assert seen is not None and {"wall", "k_wall"} <= seen.inert
    found = worth_within_train(case, wall, with_wall, without)
    assert (found > 100 * DEFAULTS.least_proof) if sure else (found == 0.0)


@pytest.mark.parametrize(("high", "verdict"), [((2, 5, 9, 13), "named"), ((9,), "unconfirmed")])
def test_a_limit_that_only_the_train_recording_meets(high: tuple[int, ...], verdict: str) -> None:
    """A speed that is held at each of many levels; its sensor's limit is met at the high ones."""
    model = pk.Model.from_dict({
        "name": "fan", "states": {"w": {"unit": "rad/s", "initial": 0.0}},
        "inputs": {"u": {"unit": "V", "hold": "zero"}},
        "parameters": {"k": {"unit": "rad/(s^2*V)", "guess": 8.0, "bounds": [0.0, 100.0]},
                       "b": {"unit": "1/s", "guess": 1.5, "bounds": [0.0, 50.0]}},
        "equations": {"w": "k*u - b*w"}, "outputs": {"y": {"unit": "rad/s", "expression": "w"}}})

    def run(high: tuple[int, ...], seed: int) -> pk.Recording:
        rng = np.random.default_rng(seed)
        u = np.repeat([5.0 if k in high else rng.uniform(-3.0, 3.0) for k in range(16)], 50)
        w, decay = [0.0], np.exp(-2.0 * 0.02)  # k = 10, b = 2: exact from sample to sample
        for volts in u[:-1]:
            w.append(w[-1] * decay + 5.0 * volts * (1 - decay))
        y = np.minimum(w, 20.0) + 0.05 * rng.standard_normal(len(u))
        return pk.Recording.from_arrays(np.arange(len(u)) * 0.02, {"u": u, "y": y},
                                        {"u": "V", "y": "rad/s"})

    dx = pk.diagnose(model, run(high, 3), run((), 4))
    assert dx.verdict == verdict and dx.hypotheses[0].effects[0].ids == ("sensor_saturation",)
    assert dx.held_out is not None
    assert dx.held_out.not_met == ((name := dx.hypotheses[0].effects[0].name),)
    assert ("confirmed where the recording meets it again: the held-out one does not."
            in dx.sentence()) is (verdict == "named")
    assert dx.to_dict()["held_out"]["not_met"] == [name]
