"""What a fit decides by the closest one before it, and whether another one would change that."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.data.whitened import Records, Whitened, allowance
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.002


@pytest.fixture(scope="module")
def records() -> Records:
    recording = pk.simulate(
        pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=1)
    return Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "given")},), DEFAULTS)


def test_only_a_closer_fit_that_changes_nothing_lets_a_decision_stand() -> None:
    closest = Closest(100.0)
    assert closest.ask(lambda chi2: chi2 > 60.0)
    assert closest.stands(100.0)
    assert closest.stands(61.0)
    assert not closest.stands(60.0)
    assert not closest.stands(101.0)
    assert not Closest().stands(1.0)  # nothing to be close to is another matter


@pytest.mark.compiled
def test_steps_stand_exactly_as_long_as_they_would_be_chosen_again(records: Records) -> None:
    model = pk.systems.sloshing()
    theta = Whitened(model, records).problem.guess
    rows = Whitened(model, records).rows

    def chosen(misfit: float) -> float:
        whitened = Whitened(model, records)
        assert whitened.choose_steps(theta, share=0.05, misfit=misfit)
        return whitened.steps[0].longest

    seen = set()
    for misfit in np.geomspace(DEFAULTS.fits.gross, 1e9, 5):
        whitened = Whitened(model, records)
        closest = Closest(misfit * rows)
        assert closest.choose_steps(whitened, theta, lambda chi2: chi2 / rows)
        for less in np.geomspace(1.0, misfit, 8)[:-1]:
            stands = closest.stands(less * rows)
            same = chosen(less) == whitened.steps[0].longest and less >= DEFAULTS.fits.gross
            assert stands == same
            seen.add(stands)
    assert seen == {True, False}


def test_more_is_allowed_where_much_is_left() -> None:
    assert allowance(1.0) == allowance(DEFAULTS.fits.gross) == 1.0
    assert allowance(100 * DEFAULTS.fits.gross) == pytest.approx(10.0)
