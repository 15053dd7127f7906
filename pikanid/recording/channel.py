"""One measured signal with its own time base, and the checks before it is used."""

from __future__ import annotations

import functools
from dataclasses import dataclass, fields, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pikanid import errors
from pikanid.formula import quantity as units_quantity
from pikanid.formula import units

Hold = Literal["zero", "first", "cubic"]
Array = NDArray[np.float64]

# Beyond this a square overflows; such values are markers or rubbish, never measurements.
LARGEST = 1e300  # limit: its square still is a number
# Time stamps computed as k*dt differ from their decimal by rounding: compare within this share
# of a sampling interval.
ROUNDING = 1e-6  # numerical: of k*dt against the decimals of a file


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal: times [s], values, unit, standard deviation of its noise, and hold.

    Attributes:
        name: As the model calls it.
        time: (N,) sample times [s].
        values: (N,) samples in `unit`; NaN where a sample is missing.
        unit: Unit text, ``""`` for dimensionless.
        sigma: Standard deviation of the noise in `unit`: scalar, (N,), or None if unknown; on
            making a channel also a text with a unit, such as ``"0.1deg"``.
        hold: How an input runs between samples, ``"zero"``, ``"first"`` or ``"cubic"``; None leaves
            it to the model.

    Arrays are copied and cannot be written to.

    Raises:
        BadRecording: If lengths differ, or times, values or sigma are not numbers.
        BadUnit: If the unit is unknown.
        BadSetting: If there is no such hold.

    >>> Channel("theta", [0.0, 0.1], [1.0, 2.0], "deg").interval
    0.1
    """

    name: str
    time: Array
    values: Array
    unit: str = ""
    sigma: float | Array | None = None
    hold: Hold | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise errors.BadRecording(errors.channel_name(self.name))
        object.__setattr__(self, "time", _frozen(self.time, self.name, "times"))
        object.__setattr__(self, "values", _frozen(self.values, self.name, "values"))
        if not isinstance(self.unit, units.Unread):
            given: object = self.unit
            if not isinstance(given, str | None):
                kind = type(given).__name__
                raise errors.BadUnit(
                    errors.not_of_kind(f"The unit of channel '{self.name}'", kind, "text"))
            object.__setattr__(self, "unit", (self.unit or "").strip())
            units.check(self.unit, f"channel '{self.name}'")
        if len(self.time) != len(self.values):
            raise errors.BadRecording(
                errors.lengths_differ(self.name, len(self.time), len(self.values)))
        if self.hold is not None and self.hold not in get_args(Hold):
            raise errors.BadSetting(errors.unknown_hold(self.name, self.hold))
        if self.sigma is not None:
            object.__setattr__(self, "sigma", self._checked_sigma(self.sigma))

    def _checked_sigma(self, sigma: ArrayLike) -> float | Array:
        if isinstance(sigma, str):
            where = f"sigma of '{self.name}'"
            sigma = units_quantity.quantity(sigma, self.unit, where, difference=True)
        array = _numbers(sigma, self.name, "sigma")
        if array.shape not in ((), self.values.shape):
            raise errors.BadRecording(
                errors.lengths_differ(self.name, len(self.values), array.size, "sigmas"))
        # A sigma may be missing only where its sample is missing.
        used = array if array.ndim == 0 else array[np.isfinite(self.values)]
        if not np.all(np.isfinite(used) & (used > 0)):
            raise errors.BadRecording(errors.bad_sigma(self.name))
        return float(array) if array.ndim == 0 else _frozen(array, self.name, "sigma")

    def __len__(self) -> int:
        return len(self.time)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Channel):
            return NotImplemented
        return all(
            _same(getattr(self, field.name), getattr(other, field.name)) for field in fields(self))

    __hash__ = None  # type: ignore[assignment]  # equal by content, which no hash should walk

    def __reduce__(self) -> tuple[type[Channel], tuple[object, ...]]:
        # Made anew in the other process, so that its arrays are read-only there too.
        return Channel, tuple(getattr(self, field.name) for field in fields(self))

    @property
    def interval(self) -> float:
        """Median sampling interval [s]; NaN with fewer than two samples.

        >>> Channel("u", [0.0, 1.0, 3.0, 4.0], [0, 0, 1, 1]).interval
        1.0
        """
        return float(np.median(np.diff(self.time))) if len(self) > 1 else float("nan")

    @property
    def uniform(self) -> bool:
        """Whether all sampling intervals agree within 0.1 %.

        >>> Channel("u", [0.0, 1.0, 3.0], [0, 0, 1]).uniform
        False
        """
        if len(self) < 3:
            return True
        steps = np.diff(self.time)
        return bool(np.all(np.abs(steps - self.interval) <= 1e-3 * self.interval))

    @functools.cached_property
    def changes_at(self) -> float:
        """Time [s] of the first sample that differs from those before it; infinite if none does.

        >>> Channel("y", [0.0, 1.0, 3.0], [2.0, 2.0, 1.0]).changes_at
        3.0
        """
        seen = np.flatnonzero(np.isfinite(self.values))
        other = seen[self.values[seen] != self.values[seen[:1]]] if seen.size else seen
        return float(self.time[other[0]]) if other.size else float("inf")

    # looked at once, since a channel never changes and every fit asks

    @functools.cached_property
    def _rises(self) -> bool:
        """Whether all times are numbers, each later than the one before."""
        usable = bool(np.all(np.abs(self.time) <= LARGEST))
        return usable and bool(np.all(np.diff(self.time) > 0))

    @functools.cached_property
    def _whole(self) -> bool:
        """Whether every value is a number that can be squared."""
        return bool(np.all(np.abs(self.values) <= LARGEST))

    def converted(self, unit: str) -> Channel:
        """The same signal in another unit; its sigma goes along.

        Raises:
            BadUnit: If a unit is unknown or the two are of different kinds.

        >>> Channel("theta", [0.0], [180.0], "deg").converted("rad").values.round(4)
        array([3.1416])
        """
        where = f"channel '{self.name}'"
        units.check(self.unit, where)
        units.check(unit, where)
        if unit == self.unit:
            return self
        if units.parse(self.unit) == units.parse(unit):
            return replace(self, unit=unit)
        if not units.convertible(self.unit, unit):
            raise errors.BadUnit(errors.units_differ(self.unit, unit, where))
        sigma = None if self.sigma is None else self.sigma * units.factor(self.unit, unit)
        values = units.convert(self.values, self.unit, unit)
        return replace(self, values=values, unit=unit, sigma=sigma)


def check_times(channel: Channel, where: str) -> None:
    """Raise BadRecording unless there are two or more finite, strictly rising times."""
    if len(channel) < 2:
        raise errors.BadRecording(errors.too_short(where, channel.name, len(channel)))
    if channel._rises:
        return
    time = channel.time
    bad = np.flatnonzero(~(np.abs(time) <= LARGEST))
    if bad.size:
        raise errors.BadRecording(errors.bad_time(where, f"sample {bad[0] + 1}", time[bad[0]]))
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        k = int(back[0]) + 1
        raise errors.BadRecording(
            errors.time_not_rising(where, f"sample {k + 1}", time[k], time[k - 1]))


def check_values(channel: Channel, where: str, missing_allowed: bool) -> None:
    """Raise BadRecording on infinite or absurd values and on NaN where none may be."""
    if channel._whole and len(channel) > 1:
        return
    values = channel.values
    with np.errstate(invalid="ignore"):
        wild = np.flatnonzero(np.abs(values) > LARGEST)
    if wild.size:
        place = f"sample {wild[0] + 1} (t = {channel.time[wild[0]]:g} s)"
        raise errors.BadRecording(errors.absurd_value(where, place, channel.name, values[wild[0]]))
    gaps = np.flatnonzero(np.isnan(values))
    if gaps.size and not missing_allowed:
        raise errors.BadRecording(
            errors.missing_input(where, channel.name, gaps[0] + 1, channel.time[gaps[0]]))
    if len(values) - gaps.size < 2:
        raise errors.BadRecording(errors.too_short(where, channel.name, len(values) - gaps.size))


def check_alive(channel: Channel, where: str) -> None:
    """Raise BadRecording if an output never changes: a dead sensor says nothing."""
    if np.isinf(channel.changes_at):
        value = float(channel.values[np.isfinite(channel.values)][0])
        raise errors.BadRecording(errors.constant_output(where, channel.name, value))


def summary(ch: Channel) -> tuple[str, ...]:
    """Name, unit, sampling, range, gaps, hold and noise of a channel in words.

    >>> summary(Channel("y", [0.0, 0.5], [1.0, 2.0], "m"))[:4]
    ('y', '[m]', '2 samples, every 0.5 s', '1 to 2')
    """
    finite = ch.values[np.isfinite(ch.values)]
    span = f"{finite.min():.4g} to {finite.max():.4g}" if finite.size else "no values"
    gaps = len(ch) - finite.size
    rate = f"every {ch.interval:.6g} s" if ch.uniform else "uneven times"
    sigma = "" if ch.sigma is None else f"sigma {np.median(ch.sigma):.3g}"
    return (ch.name, f"[{ch.unit}]" if ch.unit else "", f"{len(ch)} samples, {rate}", span,
            f"{gaps} missing" if gaps else "", f"hold {ch.hold}" if ch.hold else "", sigma)


def _numbers(values: ArrayLike, name: str, what: str) -> Array:
    try:
        array = np.array(values)
    except (ValueError, TypeError):
        raise errors.BadRecording(errors.not_numbers(name, what)) from None
    if array.dtype == object and not any(isinstance(v, str) for v in array.ravel()):
        try:
            array = array.astype(float)
        except (ValueError, TypeError):
            raise errors.BadRecording(errors.not_numbers(name, what)) from None
    if array.dtype.kind not in "fiub":
        raise errors.BadRecording(errors.not_numbers(name, what))
    return array.astype(float)


def _frozen(values: ArrayLike, name: str, what: str) -> Array:
    array = _numbers(values, name, what)
    if array.ndim != 1:
        raise errors.BadRecording(errors.not_one_dimensional(name, what, array.shape))
    array.setflags(write=False)
    return array


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)
    return a == b
