"""Excitations made of sines: one whose frequency rises, and several at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording.excitation.sampling import grid, inputs
from pikanid.recording.recording import Recording

LOW, HIGH = 0.5, 5.0  # definition: [Hz] unless told: what a hand-sized pendulum follows
LINES = tuple(0.5 * k for k in range(1, 11))  # definition: [Hz] unless told: the same band


def chirp(low: float = LOW, high: float = HIGH, duration: float = 20.0, dt: float = 0.01,
          amplitude: float = 1.0, channel: str = "u_x", unit: str = "m/s^2") -> Recording:
    """A sine whose frequency rises exponentially from `low` to `high` [Hz].

    Each octave gets the same time: phase 2π·low·T/ln(r)·(r^{t/T} - 1) with r = high/low.
    BadSetting is raised unless 0 < low < high < half the sampling rate.

    >>> chirp(0.5, 5.0, duration=2.0).names
    ('u_x',)
    """
    _check_band([low, high], dt)
    if low >= high:
        raise errors.BadSetting(errors.bad_band([low, high], dt))
    t = grid(duration, dt)
    ratio = high / low
    phase = 2 * np.pi * low * duration / np.log(ratio) * (ratio ** (t / duration) - 1)
    return inputs(t, {channel: amplitude * np.sin(phase)}, unit, "chirp")


def multisine(frequencies: ArrayLike = LINES, duration: float = 20.0, dt: float = 0.01,
              amplitude: float = 1.0, seed: int | None = None, channel: str = "u_x",
              unit: str = "m/s^2") -> Recording:
    """A sum of equal sines, scaled to a peak of `amplitude`.

    Args:
        frequencies: (K,) [Hz]; multiples of 1/duration make it periodic.
        duration: [s].
        dt: [s].
        amplitude: Largest absolute value.
        seed: Phases are random for a seed, and Schroeder's φ_k = -π·k(k-1)/K (M. R. Schroeder,
            IEEE Trans. Inf. Theory 16, 1970; a low crest factor) for None.
        channel: Name of the input.
        unit: Of the input.

    Raises:
        BadSetting: Unless all frequencies lie between 0 and half the sampling rate.

    >>> rec = multisine([0.5, 1.0, 1.5], duration=4.0, amplitude=2.0)
    >>> float(abs(rec["u_x"].values).max().round(12))
    2.0
    """
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    _check_band(f.tolist(), dt)
    k = np.arange(1, len(f) + 1)
    phase = (
        -np.pi * k * (k - 1) / len(f)
        if seed is None
        else np.random.default_rng(seed).uniform(0, 2 * np.pi, len(f))
    )
    t = grid(duration, dt)
    u = np.cos(2 * np.pi * np.outer(t, f) + phase).sum(axis=1)
    return inputs(t, {channel: u * (amplitude / np.max(np.abs(u)))}, unit, "multisine")


def _check_band(frequencies: Sequence[float], dt: float) -> None:
    if not frequencies or not all(0 < f < 0.5 / dt for f in frequencies):
        raise errors.BadSetting(errors.bad_band(frequencies, dt))
