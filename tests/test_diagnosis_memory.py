"""What a diagnosis remembers of a hypothesis is that of its best fit, not of an earlier one."""

from __future__ import annotations

from dataclasses import replace

import pikanid as pk
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps.opening import open_case


def test_a_better_fit_of_the_same_effects_is_tested_anew() -> None:
    model = pk.systems.sloshing()
    rec, later = (pk.simulate(model, pk.excitation.two_pulse(), sigma=0.002, seed=seed)
                  for seed in (0, 1))
    case = open_case(model, (rec,), (later,), None, lambda text: None, DEFAULTS)
    h = case.base
    better = replace(h, minimum=replace(h.minimum, r=0.5 * h.minimum.r))
    first, first_prediction = case.test(h), case.predicted(h)
    assert case.test(h) is first
    assert case.test(better).power < 0.3 * first.power
    assert case.predicted(better) is not first_prediction
