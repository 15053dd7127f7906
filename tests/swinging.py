"""A recording of a swing, as tests of recordings take it, and times of any."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pikanid.recording import Recording

TIMES = hnp.arrays(float, st.integers(2, 30), elements=st.floats(0.01, 1.0)).map(np.cumsum)


def swing(n: int = 101, dt: float = 0.01) -> Recording:
    t = np.arange(n) * dt
    return Recording.from_arrays(
        t,
        {"u_x": np.where(t < 0.5, 1.0, 0.0), "theta": np.sin(5 * t)},
        {"u_x": "m/s^2", "theta": "rad"},
        {"theta": 0.002},
        {"u_x": "zero"},
        "swing",
    )
