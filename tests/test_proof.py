"""What held-out recordings have to show before an effect is sure, on made-up hypotheses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_verdict import BASE, A, B, answered, effect, hypothesis

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.settings.thresholds import least_proof


def test_a_held_out_recording_proves_only_what_it_could_have_refuted() -> None:
    fits = [BASE, hypothesis(1000.0, A)]
    assert answered(fits).verdict == "named"
    given = answered(fits, unseen=("a",))
    assert given.verdict == "unconfirmed" and "could not have refuted a" in given.doubt
    # each of several effects
    both = [*fits, hypothesis(1900.0, B), hypothesis(900.0, A, B)]
    deviance = {"a": 50.0, "b": 50.0}
    assert answered(both, deviance).verdict == "named"
    assert "refuted b" in answered(both, deviance, unseen=("b",)).doubt
    assert "b does not act in any other" in answered(both, deviance, inert=("b",)).doubt


@pytest.mark.parametrize(("a", "inert"), [(replace(effect("a"), absent=True), ()), (A, ("a",))])
def test_what_acts_in_no_other_recording_is_proved_by_a_motion_without_it(
        a: Candidate, inert: tuple[str, ...]) -> None:
    """What happened once, and a limit that is not met there."""
    fits = [BASE, hypothesis(1000.0, a)]
    assert answered(fits, unseen=("a",), inert=inert).verdict == "named"
    still = answered(fits, unseen=("a",), inert=inert, motion=3.0)
    assert still.verdict == "unconfirmed" and "could not have refuted a" in still.doubt
    weak = answered([hypothesis(1090.0), hypothesis(1000.0, a)], inert=inert)
    assert weak.verdict == "unconfirmed" and "a does not act in any other" in weak.doubt
    # another effect, that lasts, would take up most of it, or does not act there, or cannot be run
    rivals = [*fits, hypothesis(1300.0, B)]
    assert "a lasting effect would take up most" in answered(rivals, inert=inert).doubt
    assert not answered(rivals, inert=(*inert, "b")).doubt
    assert not answered(rivals, inert=inert, stiff=("b",)).doubt


def test_what_proves_an_effect_grows_with_the_certainty_that_is_asked() -> None:
    assert least_proof(0.01, DEFAULTS.power) == pytest.approx(13.02, abs=0.01)
    asked = [least_proof(alpha, DEFAULTS.power)
             for alpha in (0.999, 0.5, 0.05, 0.01, 1e-9, 1e-300)]
    assert asked == sorted(asked) and asked[0] == 0.0 and np.isfinite(asked[-1])
    # two predictions that far apart: right at the level α, and wrong in one case of ten
    rng = np.random.default_rng(8)
    apart = np.sqrt(least_proof(0.01, DEFAULTS.power))
    refused = rng.standard_normal(100_000) + apart > 2.3263
    assert np.mean(refused) == pytest.approx(DEFAULTS.power, abs=0.005)
