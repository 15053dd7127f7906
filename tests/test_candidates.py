"""Every entry of the catalogue and every guard, in models of one and of two coordinates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import get_args

import numpy as np
import pytest

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.site import sites
from pikanid.model import Model, systems
from pikanid.recording import excitation


def made(model: Model) -> tuple[Candidate, ...]:
    recording = pk.simulate(model, excitation.two_pulse())
    return candidates(sites(model, (recording,)))


@pytest.mark.parametrize("make", [systems.sloshing, systems.sloshing_2d])
def test_candidates_are_well_formed(make: Callable[[], Model]) -> None:
    model = make()
    found = made(model)
    for candidate in found:
        assert candidate.name and candidate.expression and all(candidate.ids), candidate.key
        for p in candidate.parameters:
            low, high = p.bounds
            assert isinstance(p.unit, str), candidate.key
            assert np.isfinite(p.value) and low <= p.value <= high, (candidate.key, p.name)
            assert p.name == symbol(p.name).name and p.name not in model.parameter_names
        if candidate.fits:
            wider = candidate.applied(model)
            added = set(wider.parameter_names) - set(model.parameter_names)
            assert added == {p.name for p in candidate.parameters}, candidate.key
    groups = Counter(c.twin for c in found if c.twin)
    assert groups and min(groups.values()) > 1  # nothing is a twin of nothing
    assert {c.channel for c in found} == set(get_args(Channel))
