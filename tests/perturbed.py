"""Sensitivities of a simulation beside differences of simulations."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.simulation.simulator import Simulator
from pikanid.simulation.translated import Translated


def assert_sensitivities(simulator: Simulator | Translated, p: np.ndarray, active: np.ndarray
                         ) -> None:
    """Those by the active parameters are what small steps of them do, and none is nothing."""
    steps = simulator.choose_steps(p, 1e-10)
    found = simulator.run(p, active, steps)
    for column, k in enumerate(active):
        aside = np.zeros(len(p))
        aside[k] = 1e-6
        up, down = (simulator.run(p + s * aside, active, steps).y for s in (1, -1))
        expected = (up - down) / 2e-6
        scale = np.abs(expected).max()
        assert scale > 0
        assert found.sensitivity[:, column] == pytest.approx(expected, abs=1e-6 * scale)
