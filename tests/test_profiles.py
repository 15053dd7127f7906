"""Input profiles: what goes forth comes back, and the seed decides what is random."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.design.profiles import _pulses, profiles, profiles_for
from pikanid.model import systems


def test_every_pulse_has_its_counterpart() -> None:
    for seed in range(5):
        u = _pulses(np.random.default_rng(seed), 1800, 2.0, 0.01)
        assert np.abs(u).max() <= 1.0 and np.count_nonzero(u) > 100
        assert abs(u.sum()) < 1e-9
        edges = np.flatnonzero(np.diff(np.concatenate([[0.0], u, [0.0]])))
        assert len(edges) >= 8


def test_profiles_are_as_random_as_their_seed() -> None:
    def values(seed: int) -> list[np.ndarray]:
        made = profiles_for({"one": systems.sloshing()}, None, 10.0, 0.02, seed)
        return [r["u_x"].values for r in made]

    once, again, other = values(1), values(1), values(2)
    assert all(np.isfinite(u).all() and np.ptp(u) > 0.0 for u in once)
    assert all(map(np.array_equal, once, again))
    assert not all(map(np.array_equal, once, other))
    names = [r.name for r in profiles(2.35, duration=10.0, draws=1)]
    assert len(set(names)) == len(names)
