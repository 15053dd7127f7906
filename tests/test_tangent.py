"""Signs of effects over several recordings."""

from __future__ import annotations

import numpy as np

import pikanid as pk
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.tangent import Directions, directions
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.level import NoiseModel

MODEL = pk.systems.sloshing()
THETA = np.array([0.045, 0.15])
MOVED = pk.simulate(MODEL, pk.excitation.two_pulse())
LISTED = [c for c in candidates(sites(MODEL, (MOVED,))) if not c.per_recording]
LEVEL = {"theta": NoiseModel(0.002, 0.0, 0.0, 0.01, "")}


def found(*recordings: pk.Recording) -> Directions:
    whitened = Whitened(MODEL, Records(recordings, tuple(LEVEL for _ in recordings), DEFAULTS))
    assert whitened.choose_steps(THETA)
    return directions(whitened, THETA, LISTED)


def test_every_column_means_the_same_in_all_recordings() -> None:
    time = MOVED["theta"].time
    # where nothing moves an effect that takes its levels from the motion has no sign
    noise = 0.002 * np.random.default_rng(0).standard_normal(len(time))
    still = pk.Recording.from_arrays(time, {"u_x": 0 * time, "theta": noise},
                                     {"u_x": "m/s^2", "theta": "rad"})
    alone, few, both = found(MOVED), found(still), found(still, MOVED)
    assert len(few.directions) < len(alone.directions) == len(both.directions)
    np.testing.assert_array_equal(both.owner, alone.owner)
    np.testing.assert_allclose(both.D[len(time):], alone.D, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.count_nonzero(both.D[:len(time)].any(axis=0)),
                               np.count_nonzero(few.D.any(axis=0)))
