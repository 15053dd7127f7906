"""Excitations: the paper's two pulses, and 20 s of rich motion of a planar motor.

Every rich one starts with 2 s at rest, keeps to the motor's bounds of acceleration, velocity and
stroke, returns to rest, and is scaled so that a nominal rig swings to a wanted angle.  Along y and
in pitch the shuttle makes small moves of its own, which the nominal model does not know.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.experiment import RATE, Experiment, grid

QUIET = 2.0  # definition: [s] of rest before a motion
RICH = 20.0  # definition: [s] of a rich motion
DT = 1.0 / RATE  # definition: [s] between samples


@dataclass(frozen=True)
class Bounds:
    """What the planar motor can do."""

    acceleration: float = 4.0  # [m/s²]
    velocity: float = 1.0  # [m/s]
    stroke: float = 0.5  # from end to end [m]

    def share(self, u: Array) -> float:
        """By how much u (N,) may be enlarged before it meets the first bound."""
        velocity = np.cumsum(u) * DT
        position = np.cumsum(velocity) * DT
        return min(self.acceleration / np.max(np.abs(u)),
                   self.velocity / np.max(np.abs(velocity)),
                   self.stroke / np.ptp(position))


def two_pulse(rng: np.random.Generator | None = None) -> Experiment:
    """The paper's profile (Table II), 5 s; with `rng` two other pulses of the same kind.

    >>> u = two_pulse().u_x
    >>> u[[19, 20, 59, 60, 120, 159, 160]].tolist()
    [0.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0]
    """
    t = grid(5.0)
    if rng is None:
        u = _pulse(t, 0.2, 0.4, 1.0) + _pulse(t, 1.2, 0.4, -1.0)
        y = _pulse(t, 0.7, 0.3, 0.8) + _pulse(t, 2.1, 0.3, -0.8)
        pitch = _bump(t, 0.4, 1.5, 0.02) - _bump(t, 2.3, 1.7, 0.02)
    else:
        size, length = float(rng.uniform(0.7, 1.3)), round(float(rng.uniform(0.2, 0.6)), 2)
        first, gap = round(float(rng.uniform(0.3, 0.6)), 2), round(float(rng.uniform(0.8, 1.4)), 2)
        u = _pulse(t, first, length, -size) + _pulse(t, first + gap, length, size)
        late = round(float(rng.uniform(0.5, 1.2)), 2)
        y = _pulse(t, late, 0.25, -0.9) + _pulse(t, late + 1.3, 0.25, 0.9)
        pitch = _bump(t, late, 1.2, -0.02) + _bump(t, late + 1.6, 1.4, 0.02)
    return Experiment("two_pulse", t, u, y, pitch, quiet=0.2)


def moves(rng: np.random.Generator, frequency: float) -> Array:
    """(N,) point-to-point moves with trapezoidal velocity [m/s²]."""
    t = grid(RICH)
    u, start, position = np.zeros(len(t)), QUIET + 0.1, 0.0
    while True:
        target = float(rng.uniform(-0.2, 0.2))
        acceleration = float(rng.uniform(0.6, 2.0))
        steps = max(2, int(np.ceil(np.sqrt(abs(target - position) / acceleration) / DT)))
        cruise = int(rng.integers(0, 20))
        first = round(start / DT)
        if first + 2 * steps + cruise > len(t) - 150:
            return u
        a = (target - position) / (steps * (steps + cruise) * DT**2)
        u[first : first + steps] = a
        u[first + steps + cruise : first + 2 * steps + cruise] = -a
        position = target
        start += (2 * steps + cruise) * DT + float(rng.uniform(0.2, 2.5))


def chirp(rng: np.random.Generator, frequency: float) -> Array:
    """(N,) a sine that sweeps through the natural frequency, up or down."""
    t = grid(RICH)
    s = np.clip((t - QUIET) / (RICH - QUIET - 1.0), 0.0, 1.0)
    low, high = frequency * rng.uniform(0.35, 0.5), frequency * rng.uniform(1.6, 2.2)
    rate = np.log(high / low)
    phase = 2 * np.pi * low * (RICH - QUIET - 1.0) / rate * (np.exp(rate * s) - 1)
    u = np.sin(phase + rng.uniform(0, 2 * np.pi)) * _window(s)
    if rng.random() < 0.5:
        u[t >= QUIET] = u[t >= QUIET][::-1]
    return _at_rest_again(t, u)


def multisine(rng: np.random.Generator, frequency: float) -> Array:
    """(N,) sines around the natural frequency with random phases."""
    t = grid(RICH)
    s = np.clip((t - QUIET) / (RICH - QUIET - 0.5), 0.0, 1.0)
    lines = frequency * np.arange(0.4, 2.4, 0.13)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    sizes = rng.uniform(0.5, 1.0, len(lines))
    u = np.sum(sizes[:, None] * np.cos(2 * np.pi * lines[:, None] * t + phases[:, None]), axis=0)
    return _at_rest_again(t, u * _window(s))


def free_decay(rng: np.random.Generator, frequency: float) -> Array:
    """(N,) kicks, each in time with the swing, then a long free decay."""
    t = grid(RICH)
    period = 1.0 / frequency
    u = np.zeros(len(t))
    for start in (QUIET + rng.uniform(0.05, 0.3), QUIET + rng.uniform(10.0, 12.5)):
        size, half = rng.uniform(0.5, 1.0), round(period / 2, 2)
        # An even number leaves the shuttle at rest, so that nothing disturbs the decay.
        for k in range(int(rng.choice([2, 4]))):
            u += _pulse(t, round(start + k * half, 2), half, size * (-1.0) ** k)
    return u


RICH_KINDS: Mapping[str, Callable[[np.random.Generator, float], Array]] = {
    "moves": moves, "chirp": chirp, "multisine": multisine, "free_decay": free_decay}
# What --excitation may say; "mixed" is a set of which half is two_pulse and half is rich.
CHOICES = ("rich", "two_pulse", "mixed", *RICH_KINDS)


def rich(kind: str, rng: np.random.Generator, frequency: float,
         response: Callable[[Experiment], Array], swing: float) -> Experiment:
    """20 s of one kind, scaled to a wanted swing as far as the motor's bounds allow.

    Args:
        kind: One of RICH_KINDS.
        rng: Source of all that is random.
        frequency: Natural frequency of what is shaken [Hz].
        response: Angle of the nominal rig under an experiment, (N,) [rad].
        swing: Wanted largest angle [rad].
    """
    t = grid(RICH)
    u = RICH_KINDS[kind](rng, frequency)
    bounds = Bounds()
    u *= bounds.share(u) * 0.1
    experiment = Experiment(kind, t, u, _side_moves(rng, t), _slow_pitch(rng, t), QUIET)
    for _ in range(4):
        reached = float(np.max(np.abs(response(experiment))))
        factor = min(swing / reached, bounds.share(experiment.u_x))
        experiment = replace(experiment, u_x=np.round(experiment.u_x * factor, 6))
        if abs(factor - 1) < 0.02:
            break
    return experiment


def pair(choice: str, rng: np.random.Generator, frequency: float,
         response: Callable[[Experiment], Array], swing: float) -> tuple[Experiment, Experiment]:
    """Train and held-out experiment; of a rich pair each is of another kind where possible.

    >>> from pikanid.validation.concealed.rig import Rig
    >>> from pikanid.validation.concealed.simulate import measured
    >>> pair("two_pulse", np.random.default_rng(0), 2.35, lambda e: measured(Rig(), e), 0.2)[0].kind
    'two_pulse'
    """
    if choice == "two_pulse":
        return two_pulse(), two_pulse(rng)
    kinds = list(rng.permutation(sorted(RICH_KINDS)))
    if choice != "rich":
        kinds = [choice, *(kind for kind in kinds if kind != choice)]
    train, held_out = (
        rich(str(kind), rng, frequency, response, swing * factor)
        for kind, factor in zip(kinds[:2], (1.0, float(rng.uniform(0.8, 1.0))), strict=True))
    return train, held_out


def _pulse(t: Array, start: float, length: float, size: float) -> Array:
    k = np.arange(len(t))
    return np.where((k >= round(start * RATE)) & (k < round((start + length) * RATE)), size, 0.0)


def _bump(t: Array, start: float, length: float, size: float) -> Array:
    s = np.clip((t - start) / length, 0.0, 1.0)
    return np.round(size * np.sin(np.pi * s) ** 2, 6)


def _window(s: Array) -> Array:
    """Rises and falls within a tenth of the way."""
    return np.sin(0.5 * np.pi * np.clip(np.minimum(s, 1 - s) / 0.1, 0, 1)) ** 2


def _at_rest_again(t: Array, u: Array) -> Array:
    """u less two slow bows, so that velocity and position are zero at the end."""
    s = np.clip((t - QUIET) / (t[-1] - QUIET), 0.0, 1.0)
    bows = np.stack([np.sin(np.pi * s) ** 2, np.sin(np.pi * s) ** 2 * (s - 0.5)])

    def ends(a: Array) -> Array:
        return np.array([np.sum(a), np.sum(np.cumsum(a)) * DT])

    weights = np.linalg.solve(np.stack([ends(bow) for bow in bows], axis=1), ends(u))
    return u - weights[0] * bows[0] - weights[1] * bows[1]


def _side_moves(rng: np.random.Generator, t: Array) -> Array:
    u = np.zeros(len(t))
    for start in QUIET + 0.3 + np.arange(4) * 4.2 + rng.uniform(0, 2.0, 4):
        size, half = round(float(rng.uniform(0.5, 1.0)), 3), round(float(rng.uniform(0.2, 0.35)), 2)
        sign = float(rng.choice([-1.0, 1.0]))
        u += _pulse(t, start, half, sign * size) - _pulse(t, start + half, half, sign * size)
    return u


def _slow_pitch(rng: np.random.Generator, t: Array) -> Array:
    pitch = np.zeros(len(t))
    for start in QUIET + 0.2 + np.arange(3) * 5.6 + rng.uniform(0, 2.5, 3):
        pitch = pitch + _bump(t, float(start), float(rng.uniform(0.6, 2.5)),
                              float(rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.025)))
    return pitch
