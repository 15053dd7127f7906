"""An effect at one size: what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.design.sizing import _refitted, recorded, sized
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model import systems
from pikanid.recording import excitation


def test_a_size_is_told_with_its_departure_and_its_distance() -> None:
    model, drive, sigma = systems.sloshing(), excitation.two_pulse(), 0.002
    plain = recorded(model, drive, sigma, DEFAULTS)
    base = fitted(model, (), plain, [{}], 1)
    assert base is not None and base.minimum.chi2 < 1e-6
    # as the nominal model would show it with a damping that is left to its free parameter
    damped = recorded(model.with_values(d_theta=0.2), drive, sigma, DEFAULTS)
    found = _refitted("c", {"c": 0.3, "n": 2.0}, 0.1, True, damped, base)
    assert found is not None and found.records is damped
    assert (found.parameter, found.falling) == ("c", True)
    assert found.values == {"c": 0.3, "n": 2.0}
    assert found.departure == pytest.approx(0.2)
    assert found.nominal.values["d_theta"] == pytest.approx(0.2, rel=1e-3)
    assert found.distance == pytest.approx(np.sqrt(found.nominal.minimum.chi2))
    assert found.distance < 0.1


@pytest.mark.parametrize("refits", [True, False])
def test_an_effect_is_so_strong_as_to_be_as_far_as_wanted(
        refits: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """And has no size where the nominal model cannot be refitted to it."""
    model, drive, sigma = systems.sloshing(), excitation.two_pulse(), 0.002
    plain = recorded(model, drive, sigma, DEFAULTS)
    (offset,) = (c for c in candidates(sites(model, plain.recordings)) if c.key == "sensor_offset")
    base = fitted(model, (), plain, [{}], 1)
    assert base is not None
    screen = Screen(base, [offset])
    if not refits:
        monkeypatch.setattr("pikanid.mismatch.design.sizing.fitted", lambda *_: None)
    own = np.arange(len(screen.found.directions))
    found = sized(offset, screen, own, 10.0, base, drive, sigma)
    assert (found is not None) == refits
    if found is not None:
        assert found.distance == pytest.approx(10.0, rel=0.2)
        # √N b/σ, less the little that length and damping make of it
        assert found.departure == pytest.approx(10.0 * sigma / np.sqrt(501), rel=0.3)
