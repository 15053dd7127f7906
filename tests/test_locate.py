"""Where a mismatch is, and how small one would show."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.report.locate import locate, smallest
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

SIGMA = 0.002


@pytest.fixture(scope="module")
def nominal() -> tuple[Hypothesis, tuple[Site, ...]]:
    model = pk.systems.sloshing()
    recording = pk.simulate(model, pk.excitation.two_pulse(), sigma=SIGMA, seed=0)
    records = Records((recording,), ({"theta": NoiseModel(SIGMA, 0.0, 0.0, 0.01, "")},), DEFAULTS)
    base = fitted(model, (), records, [{}], 1)
    assert base is not None
    return base, sites(model, (recording,))


def test_the_smallest_offset_is_that_of_a_mean(
        nominal: tuple[Hypothesis, tuple[Site, ...]]) -> None:
    base, where = nominal
    found = smallest(base, tuple(candidates(where)))
    offset = found["sensor_offset"]
    mean = SIGMA / np.sqrt(base.whitened.rows)
    assert offset.value == pytest.approx(DEFAULTS.visible * mean, rel=0.05)
    assert (offset.std, offset.unit) == (0.0, "rad")
    assert found["sensor_gain"].unit == ""


def test_nothing_is_said_of_a_law_where_nothing_is_missing(
        nominal: tuple[Hypothesis, tuple[Site, ...]]) -> None:
    base, (site,) = nominal
    found = locate(base, base, Answer("none", (), ()), site, None, None)
    assert found.static_law is None and found.channel == "undecided"
    assert (found.equation, found.depends_on, found.time) == ("theta_dot", (), ())
