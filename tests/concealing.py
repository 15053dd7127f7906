"""Helpers of the tests of concealed recordings: experiments without frills, exact periods."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.integrate import quad

from pikanid.validation.concealed.experiment import Experiment, grid
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import motion

TIGHT = 1e-9
COVERED: set[str] = set()  # the effects with an oracle, in the files read so far


def push(duration: float, u_x: Callable[[np.ndarray], np.ndarray] | float = 0.0,
         u_y: float = 0.0, pitch: float = 0.0) -> Experiment:
    """A shuttle whose acceleration is a function of time or constant."""
    t = grid(duration)
    values = u_x(t) if callable(u_x) else np.full(len(t), u_x)
    return Experiment("test", t, values, np.full(len(t), u_y), np.full(len(t), pitch), 0.0)


@cache
def still(duration: float) -> Experiment:
    return push(duration)


def weightless(**settings: float) -> Rig:
    """A rig without gravity and damping: what happens is the effect alone."""
    return Rig(gravity=0.0, damping=0.0, **settings)


def period(potential: Callable[[float], float], low: float, high: float) -> float:
    """Period of θ'' = -V'(θ) between its turning points, exactly: ∮ dθ/θ'."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    energy = potential(high)

    def slowness(phi: float) -> float:
        # θ = middle + half sin φ removes the singularities at the turning points.
        theta = middle + half * np.sin(phi)
        return half * np.cos(phi) / np.sqrt(2 * (energy - potential(theta)))

    edge = 0.5 * np.pi
    return 2 * quad(slowness, -edge + 1e-9, edge - 1e-9, epsabs=1e-11, epsrel=1e-11)[0]


def crossings(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Times at which a dense signal rises through zero."""
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    return t[up] - y[up] * (t[up + 1] - t[up]) / (y[up + 1] - y[up])


def oracle(*ids: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Marks a test as the oracle of effects, so that none is forgotten."""
    COVERED.update(ids)
    return lambda test: test


def dense(rig: Rig, duration: float, points: int = 20001) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, duration, points)
    return t, motion(rig, still(duration), t)
