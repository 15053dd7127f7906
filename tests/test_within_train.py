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
