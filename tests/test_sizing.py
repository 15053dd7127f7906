"""An effect at one size: what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.mismatch.design.sizing import _refitted, recorded
from pikanid.mismatch.fitting.hypothesis import fitted
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
