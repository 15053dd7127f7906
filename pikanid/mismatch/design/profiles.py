"""Input profiles that a rig can run: within acceleration, velocity and stroke of a planar motor, or
the range of any other input.

Every profile rests at first, in the middle of its range, and ends at rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.mismatch.design.ranges import Range, ranges_of, within
from pikanid.mismatch.design.response import decay_rate, natural_frequency
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.recording.channel import Array
from pikanid.recording.excitation.sampling import grid

# Kinds of profile; times in periods of the model, frequencies in its own.
PART = 1.0 / 3.0  # definition: the smaller size: what is not linear shows by the ratio
HAIR = 0.9995  # numerical: below the bounds: rounding adds up along the way
FADE = 0.1  # definition: share of a profile over which it swells, and over which it fades
SIZES = (1.0, 0.5, 0.2)  # definition: of kicks of three sizes
RANGE = (3.0, 6.0)  # definition: of the ratio between the ends of a chirp
LINES = (0.4, 2.6, 0.15)  # definition: first, end and distance of the lines of a multisine
BESIDE = (0.55, 0.75, 1.3, 1.6)  # definition: frequencies beside resonance
LENGTH, GAP, PAUSE = (0.2, 1.0), (0.0, 1.0), (0.3, 4.0)  # definition: of pulses, between, and after
SIZE = (0.3, 1.0)  # definition: of pulses
BIT = 0.2  # definition: shortest time that a binary sequence stays
FINEST = 0.1  # limit: of a period, that the sampling interval may be
RESOLVED = 0.05  # numerical: natural periods a sampling interval, at most, that kicks can follow
REST = (2.0, 0.2)  # limit: [s], and share of a profile, that the drive rests at first
PERIODS = 10.0  # limit: in a profile, of the frequency that is taken where a model has none
LEAST = 3.5  # limit: periods of motion in a profile: kicks of three sizes take one each
FEWEST = 5.0  # limit: periods in a profile as long as a recording
MOST = 10_000  # limit: samples of one: each of several dozen is simulated
LONG = 20.0  # definition: [s] of a profile where nothing was recorded before
EVERY = 0.01  # definition: [s] between samples where nothing was recorded and motion is not faster
ROUNDING = 1e-9  # numerical: of a frequency that was computed from the sampling interval
DIGITS = 6  # numerical: of a profile's values: a file of decimals is run as it was designed


@dataclass(frozen=True)
class Bounds:
    """What a drive that is told its acceleration can do.

    Attributes:
        acceleration: Largest |u|, in the input's unit.
        velocity: Largest |∫u dt|.
        stroke: Range of ∫∫u dt², from end to end.

    Raises:
        BadSetting: If one is not positive.

    >>> Bounds(acceleration=2.0).share(np.array([0.0, 1.0, -1.0, 0.0]), 0.01)
    2.0
    """

    acceleration: float = 1.0
    velocity: float = 0.5
    stroke: float = 0.4

    def __post_init__(self) -> None:
        for name in ("acceleration", "velocity", "stroke"):
            if not getattr(self, name) > 0:
                raise errors.BadSetting(errors.bad_drive_bound(name, getattr(self, name)))

    def share(self, u: Array, dt: float) -> float:
        """By how much u (N,), held over steps of dt [s], may be enlarged."""
        velocity, position = motion(u, dt)
        shares = [bound / reached for bound, reached in (
            (self.acceleration, np.max(np.abs(u))), (self.velocity, np.max(np.abs(velocity))),
            (self.stroke, np.ptp(position))) if reached > 0]
        return float(min(shares, default=np.inf))


def motion(u: Array, dt: float) -> tuple[Array, Array]:
    """Velocity and position (N,) at the sample times under a zero-order hold of u (N,)."""
    velocity = np.concatenate([[0.0], np.cumsum(u[:-1])]) * dt
    position = np.concatenate([[0.0], np.cumsum(velocity[:-1] * dt + 0.5 * u[:-1] * dt**2)])
    return velocity, position


def profiles(frequency: float, bounds: Bounds | None = None, duration: float = 20.0,
             dt: float = 0.01, quiet: float = 2.0, channel: str = "u_x", unit: str = "m/s^2",
             draws: int = 3, seed: int = 0, span: Range | None = None) -> list[Recording]:
    """Candidates for an experiment, each at its largest feasible size and at a third of it.

    Args:
        frequency: Around which the model rings [Hz].
        bounds: Of the drive.
        duration: Of each profile [s].
        dt: Sampling interval [s].
        quiet: Rest at the start, from which the noise can be learnt [s].
        channel: Name of the input.
        unit: Of the input.
        draws: Random versions of each kind.
        seed: Of what is random.
        span: Least and largest value of an input that is no acceleration, in place of bounds.

    Raises:
        BadSetting: If no time is left after the rest, or the sampling is too coarse for
            `frequency`.

    >>> made = profiles(2.35, duration=10.0, draws=1)
    >>> made[0].name, len(made), made[0].names
    ('kicks, full size', 14, ('u_x',))
    """
    bounds = bounds or Bounds()
    t = grid(duration, dt)
    if not (0 < frequency * dt < FINEST and quiet >= 0 and duration - quiet > LEAST / frequency):
        raise errors.BadSetting(errors.no_room_for_profile(duration, quiet, frequency, dt))
    first = int(np.ceil(quiet / dt - 1e-9))
    rng = np.random.default_rng(seed)
    made = []
    for draw in range(draws):
        for name, u in _drawn(rng, t, first, frequency, dt, span is None):
            share = HAIR * (bounds.share(u, dt) if span is None else 1.0 / np.abs(u).max())
            for size, word in ((1.0, "full"), (PART, "a third")):
                shape = u * share * size
                values = _rounded(shape if span is None else within(shape, span))
                title = f"{name}, {word if word == 'a third' else 'full size'}"
                made.append(Recording.from_arrays(
                    t, {channel: values}, {channel: unit}, hold={channel: "zero"},
                    name=title + (f" ({draw + 1})" if draws > 1 else "")))
    return made


def profiles_for(models: Mapping[str, Model], bounds: Bounds | None, duration: float | None,
                 dt: float | None, seed: int, ranges: Mapping[str, Range] | None = None,
                 recorded: Sequence[Recording] = ()) -> list[Recording]:
    """Profiles for the first input, and others at the same time for all further ones; by default as
    long as the longest recording, if that makes 5 periods and 10,000 samples, and sampled as often;
    where nothing was recorded, as the slowest motion or decay of the first model asks for.

    Raises:
        BadSetting: If the models have no input, the range of one is not known, or as for
            `profiles`.
    """
    inputs = {i.name: i for model in models.values() for i in model.inputs if i.default is None}
    if not inputs:
        raise errors.BadSetting(errors.nothing_to_drive(", ".join(models)))
    known = ranges_of(inputs.values(), ranges, recorded, bounds is not None)
    first, *others = inputs.values()
    model = next(iter(models.values()))
    natural, decay = natural_frequency(model), decay_rate(model)
    dt = dt or _interval(inputs, recorded)
    own = natural or (None if recorded else decay)
    if not dt:
        dt = min(max(EVERY, FEWEST / own / MOST), RESOLVED / own) if own else EVERY
        dt = max(dt, (duration or 0.0) / MOST)
    if duration is None:
        longest = min(max((r.stop - r.start for r in recorded), default=LONG), MOST * dt)
        duration = max(longest, FEWEST / min(own or np.inf, RESOLVED / dt))
    frequency = natural or max(decay or 0.0, PERIODS / duration)
    notes: tuple[str, ...] = ()
    if frequency * dt > RESOLVED * (1.0 + ROUNDING):
        notes = (errors.profile_too_slow(frequency, dt, RESOLVED),)
        frequency = RESOLVED / dt
    made = {i.name: profiles(
        frequency, bounds, duration, dt, min(REST[0], REST[1] * duration), i.name, i.unit,
        seed=seed, span=known.get(i.name)) for i in (first, *others)}
    count = len(made[first.name])
    return [replace(profile.with_channels(*(
        made[other.name][(k + 2 * shift) % count][other.name]
        for shift, other in enumerate(others, 1))), notes=notes)
        for k, profile in enumerate(made[first.name])]


def _interval(inputs: Iterable[str], recorded: Sequence[Recording]) -> float:
    """Between the samples of what was recorded beside the inputs [s]; 0 where nothing was."""
    times = [r[n].time for r in recorded for n in r.names if n not in inputs and len(r[n].time) > 1]
    return float(np.median(np.diff(times[0]))) if times else 0.0


def scaled(profile: Recording, factor: float) -> Recording:
    """A profile whose inputs go further from where they rest at first, by a factor."""
    return profile.with_channels(*(
        replace(ch, values=_rounded(ch.values[0] + (ch.values - ch.values[0]) * factor))
        for ch in profile.channels.values()))


def _drawn(rng: np.random.Generator, t: Array, first: int, frequency: float, dt: float,
           shuttle: bool) -> Iterator[tuple[str, Array]]:
    """One profile of every kind, of any size; a shuttle that it accelerates ends at rest."""
    n = len(t) - first
    s = np.linspace(0.0, 1.0, n)
    window = np.sin(0.5 * np.pi * np.clip(np.minimum(s, 1 - s) / FADE, 0, 1)) ** 2
    active = t[first:] - t[first]
    span = active[-1]

    def laid(u: Array) -> Array:
        return np.concatenate([np.zeros(first), u])

    def ended(u: Array) -> Array:
        return _at_rest(u, dt) if shuttle else u

    yield "kicks", laid(_kicks(n, frequency, dt, (1.0,), int(rng.integers(2, 5))))
    yield "kicks of three sizes", laid(_kicks(n, frequency, dt, SIZES,
                                              int(rng.integers(1, 4))))
    yield "pulses", laid(ended(_pulses(rng, n, frequency, dt)))
    yield "binary", laid(ended(_binary(rng, n, frequency, dt)))
    ratio = rng.uniform(*RANGE)
    low = frequency / np.sqrt(ratio)
    phase = 2 * np.pi * low * span / np.log(ratio) * (ratio**s - 1)
    yield "chirp", laid(ended(np.sin(phase + rng.uniform(0, 2 * np.pi)) * window))
    lines = frequency * np.arange(*LINES)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    sines = np.cos(2 * np.pi * np.outer(active, lines) + phases).sum(axis=1)
    yield "multisine", laid(ended(sines * window))
    off = frequency * float(rng.choice(BESIDE))
    swell = np.sin(np.pi * s) ** 2
    yield "drive beside resonance", laid(ended(np.sin(2 * np.pi * off * active) * swell))


def _kicks(n: int, frequency: float, dt: float, sizes: tuple[float, ...], pairs: int) -> Array:
    """Half periods forth and back in time with the swing, then a free decay, for each size."""
    u, half = np.zeros(n), max(1, round(0.5 / frequency / dt))
    slot = n // len(sizes)
    pairs = max(1, min(pairs, slot // (4 * half)))
    for k, size in enumerate(sizes):
        # As long forth as back: the shuttle is at rest afterwards, and nothing disturbs the decay.
        burst = np.repeat(np.tile([1.0, -1.0], pairs), half)
        u[k * slot : k * slot + len(burst)] = size * burst
    return u


def _pulses(rng: np.random.Generator, n: int, frequency: float, dt: float) -> Array:
    """Pulses of random size, length and distance, each with its counterpart."""
    u, at = np.zeros(n), 0
    while True:
        length = max(1, round(rng.uniform(*LENGTH) / frequency / dt))
        gap = round(rng.uniform(*GAP) / frequency / dt)
        if at + 2 * length + gap >= n:
            return u
        size = float(rng.choice([-1.0, 1.0]) * rng.uniform(*SIZE))
        u[at : at + length] += size
        u[at + length + gap : at + 2 * length + gap] -= size
        at += 2 * length + gap + round(rng.uniform(*PAUSE) / frequency / dt)


def _binary(rng: np.random.Generator, n: int, frequency: float, dt: float) -> Array:
    """A random sequence of full acceleration either way."""
    step = max(1, round(BIT / frequency / dt))
    signs = rng.choice([-1.0, 1.0], n // step + 1)
    return np.repeat(signs, step)[:n]


def _at_rest(u: Array, dt: float) -> Array:
    """u (n,) less two slow bows, so that velocity and position are zero at the end."""
    u = np.append(u[:-1], 0.0)
    s = np.linspace(0.0, 1.0, len(u))
    bows = np.stack([np.sin(np.pi * s) ** 2, np.sin(np.pi * s) ** 2 * (s - 0.5)])

    def ends(a: Array) -> Array:
        velocity, position = motion(a, dt)
        return np.array([velocity[-1] + a[-1] * dt, position[-1]])

    weights = np.linalg.solve(np.stack([ends(bow) for bow in bows], axis=1), ends(u))
    return u - weights @ bows


def _rounded(u: Array) -> Array:
    """To decimals that a file holds."""
    return np.round(u, DIGITS)
