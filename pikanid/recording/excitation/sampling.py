"""The uniform grid of an excitation, and the recording of what is held between its times."""

from __future__ import annotations

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.recording import Recording


def grid(duration: float, dt: float) -> Array:
    """Times 0, dt, ..., duration [s] as the doubles nearest to their decimals.

    0.01*57 is not 0.57; dividing by a whole rate is correctly rounded, so that a comparison with
    the decimal of a switching time comes out right.

    Raises:
        BadSetting: If `duration` or `dt` is not positive or `dt` exceeds `duration`.

    >>> grid(5.0, 0.01)[57], len(grid(5.0, 0.01))
    (np.float64(0.57), 501)
    """
    if not (np.isfinite(duration) and 0 < dt <= duration):
        raise errors.BadSetting(errors.bad_grid(duration, dt))
    k = np.arange(int(np.floor(duration / dt * (1 + 1e-12) + 1e-9)) + 1)
    rate = round(1 / dt)
    t = k / rate if rate and abs(rate * dt - 1) < 1e-12 else k * dt
    return np.asarray(t, dtype=float)


def inputs(t: Array, values: dict[str, Array], unit: str, name: str) -> Recording:
    """A recording of values (N,) by channel at times t (N,), each held until the next sample."""
    return Recording.from_arrays(t, values, {key: unit for key in values},
                                 hold={key: "zero" for key in values}, name=name)
