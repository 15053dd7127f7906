"""Structures with and without a step, weighed by their evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tanks import coarse

from pikanid.discrepancy import mixture
from pikanid.discrepancy.offers import step_offers


@pytest.mark.parametrize(("gain", "weights"), [
    (-20.0, [1.0]), (0.0, [0.5, 0.5]), (np.log(3.0), [0.25, 0.75]),
    # what was foretold only does not push what was fitted out
    (50.0, [0.02 / 1.02, 1.0 / 1.02])])
def test_structures_count_by_their_evidence(gain: float, weights: list[float],
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    level = coarse()
    (offer,) = step_offers(level, "x")
    monkeypatch.setattr(mixture, "step_offers", lambda *_: [replace(offer, gain=gain)])
    seen = mixture.views(level, "x", True)
    assert [v.weight for v in seen] == pytest.approx(weights)
    assert [v.plans[0].step for v in seen] == [False, True][: len(weights)]
    assert [v.weight for v in mixture.views(level, "x", False)] == [1.0]
