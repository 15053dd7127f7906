"""From the columns of a file to channels: which are wanted, and on which time base each one is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid import errors
from pikanid.formula import units
from pikanid.recording.channel import LARGEST, Array, Channel
from pikanid.recording.reading.gaps import note_gaps
from pikanid.recording.reading.headers import (
    TIME_NAMES,
    Named,
    are_times,
    find,
    missing,
    named,
)
from pikanid.recording.reading.sentinels import without_sentinels
from pikanid.recording.reading.table import Table

OWN_TIME = "t:"  # "t:theta" holds the times of theta alone
OWN_SIGMA = "sigma:"  # "sigma:theta" holds its noise sample by sample


@dataclass(frozen=True)
class Request:
    """What the caller says about the columns: mapping, sampling rate [Hz], units, and signals that
    are wanted under their own names where the file has them.
    """

    columns: Mapping[str, str | int]
    rate: float | None
    units: Mapping[str, str]
    also: tuple[str, ...] = ()

    @property
    def wanted(self) -> tuple[str, ...]:
        """Names and patterns of all that is asked for; empty if that is everything."""
        return (*map(str, self.columns.values()), *self.also,
                *(f"{mark}{name}" for mark in (OWN_TIME, OWN_SIGMA) for name in self.also))


@dataclass(frozen=True)
class Result:
    """Channels, notes on the file, why some of its columns are unusable, when t = 0 was, and what
    columns else the file has, which nobody asked for.
    """

    channels: tuple[Channel, ...]
    notes: tuple[str, ...]
    unreadable: Mapping[str, str]
    began: float | None
    others: tuple[str, ...]


def channels(table: Table, request: Request, where: str, partly: bool = False) -> Result:
    """The channels of a table.

    Without a mapping every column is meant, and a wrong cell in one of them is an error (columns
    of words are left out).  With a mapping only the mapped columns are checked so strictly, and in
    a file whose channels have paths none: it holds what nobody asked for.

    Args:
        table: The columns of a file.
        request: Which of them are wanted.
        where: Name of the file, for messages.
        partly: Whether it may hold nothing of all that.

    Raises:
        BadRecording: If a column, a time, or a cell of a wanted column is wrong.
        BadUnit: If a unit is unknown or the time's unit is not one of time.
    """
    if request.rate is not None and not 0 < request.rate < LARGEST:
        raise errors.BadSetting(errors.bad_rate(request.rate))
    available = named(table.columns, where)
    mapped = {key: find(str(header), available, where) for key, header in request.columns.items()}
    clock = mapped.pop("t", None) or mapped.pop("time", None)
    bases = TimeBases(table, request, where, available, clock)
    signals = [(key, found, True) for key, found in mapped.items()]
    # Variables of a workspace are unrelated: a mapping then names all that are wanted.
    every = table.shared_time or not request.wanted
    if every or request.also:
        taken, named_clocks = [*mapped.values(), *bases.clocks()], clocks_by_name(available)
        signals += [
            (found.name, found, False)
            for found in available
            if found not in taken
            and (every or found.name in request.also)
            and found.name not in mapped
            and found not in named_clocks
            and not found.name.startswith((OWN_TIME, OWN_SIGMA))
        ]
    made: list[Channel] = []
    sentinels: list[str] = []
    unreadable: dict[str, str] = {}
    for key, found, is_mapped in signals:
        defect, strict = _defect(table, where, found), not request.columns
        time = None
        if not defect:
            time, defect, is_gap = bases.times(found)
            strict = strict and not is_gap
        if time is not None:
            channel, note = without_sentinels(_channel(key, found, time, request, available))
            made.append(channel)
            sentinels += [note] if note else []
        elif is_mapped or (strict and not found.column.text and not found.column.path):
            raise errors.BadRecording(defect)
        else:
            unreadable[key] = defect
    notes = tuple(f"Column '{key}' is left out: {why}" for key, why in unreadable.items())
    notes += tuple(f"Times of '{found.name}' are read as {found.unit} since 1970."
                   for found in bases.clocks() if found.counted)
    notes += tuple(errors.counted_as_seconds(found.name) for found in bases.clocks()
                   if "t" not in request.units and _counts(found))
    if not made and not partly:
        soft = [unreadable[k] for k, found, _ in signals if not found.column.text]
        soft += [missing(name, available, where) for name in request.also if not every]
        raise errors.BadRecording(soft[0] if soft else errors.no_channels(where))
    for key in set(request.units) - {"t", "time"} - {ch.name for ch in made}:
        if partly:
            continue
        raise errors.BadRecording(
            errors.missing_channel(where, key, [channel.name for channel in made]))
    used = [found for _, found, _ in signals] + bases.clocks()
    others = tuple(found.column.path or found.name for found in available if found not in used)
    notes += (*sentinels, *note_gaps(made))
    return Result(tuple(made), (*table.notes, *notes), unreadable, bases.began(), others)


def _counts(clock: Named) -> bool:
    """Whether times without a unit are whole numbers: milliseconds, hours or samples perhaps."""
    values = clock.column.values
    return not (clock.unit or clock.column.is_clock) and len(values) > 2 and bool(
        np.all(values == np.round(values)))


def _defect(table: Table, where: str, found: Named) -> str:
    values = found.column.values
    if found.column.defect:
        return found.column.defect
    with np.errstate(invalid="ignore"):
        wild = np.flatnonzero(np.abs(values) > LARGEST)
    if wild.size:
        k = int(wild[0])
        return errors.absurd_value(where, table.place(k), found.name, float(values[k]))
    return ""


def _channel(key: str, found: Named, time: Array, request: Request,
             available: list[Named]) -> Channel:
    column, n = found.column, len(time)
    own = [other for other in available if other.name == OWN_SIGMA + found.name]
    unit = request.units.get(key)
    return Channel(
        key,
        time,
        column.values[:n],
        found.unit if unit is None else units.parse(unit),
        own[0].column.values[:n] if own else column.sigma,
        column.hold,  # type: ignore[arg-type]  # checked by Channel
    )


def clocks_by_name(available: Sequence[Named]) -> list[Named]:
    """The columns whose names say that they are times."""
    told = are_times([(c.name, c.unit) for c in available])
    return [c for c, is_time in zip(available, told, strict=True) if is_time]


@dataclass(frozen=True)
class TimeBases:
    """Finds and checks the times of each column."""

    table: Table
    request: Request
    where: str
    available: list[Named]
    mapped: Named | None

    def clocks(self) -> list[Named]:
        """Every column that holds times."""
        sources = [self._source(found) for found in self.available]
        return [source for source in sources if source is not None] + (
            [self.mapped] if self.mapped else []
        )

    def began(self) -> float | None:
        """POSIX time of t = 0: of the file, or of the dates that all of its clocks are."""
        starts = {clock.column.began for clock in self.clocks()}
        return starts.pop() if self.table.began is None and len(starts) == 1 else self.table.began

    def times(self, found: Named) -> tuple[Array | None, str, bool]:
        """(times [s], "", False), or None, what is wrong, and whether there simply are none."""
        source = self._source(found)
        n = len(found.column.values)
        if source is None:
            if self.request.rate is not None:
                return np.arange(n) / self.request.rate, "", False
            headers = [other.column.header or other.name for other in self.available
                       if not (other.column.is_clock and other.column.path)]
            return None, errors.no_time(self.where, headers), True
        if len(source.column.values) != n:
            wanted = len(source.column.values)
            return None, errors.time_length(self.where, found.name, n, wanted), True
        if source.column.defect:
            return None, source.column.defect, False
        return self._checked(source, found)

    def _source(self, found: Named) -> Named | None:
        n = len(found.column.values)
        for other in self.available:
            if other.name == OWN_TIME + found.name:
                return other
        if self.mapped is not None and (found.column.time is None or self._fits(self.mapped, n)):
            return self.mapped
        for other in self.available:
            if found.column.time is not None and other.column.header == found.column.time:
                return other
        for name in TIME_NAMES:
            for other in clocks_by_name(self.available):
                if other.name.casefold() == name and other is not found and self._fits(other, n):
                    return other
        return None

    def _fits(self, clock: Named, n: int) -> bool:
        return len(clock.column.values) == n

    def _checked(self, source: Named, found: Named) -> tuple[Array | None, str, bool]:
        time = self._seconds(source)
        finite = np.flatnonzero(np.isfinite(time))
        n = int(finite[-1]) + 1 if finite.size else 0
        # A shorter time base may share the file: its last rows are empty in time and signal.
        if not np.isnan(found.column.values[n:]).all():
            n = len(time)
        bad = np.flatnonzero(~(np.abs(time[:n]) <= LARGEST))
        if bad.size:
            k = int(bad[0])
            return None, errors.bad_time(self.where, self.table.place(k), float(time[k])), False
        back = np.flatnonzero(np.diff(time[:n]) <= 0)
        if back.size:
            k = int(back[0]) + 1
            place = self.table.place(k)
            return None, errors.time_not_rising(self.where, place, time[k], time[k - 1]), False
        rate = self.request.rate
        if rate is not None and n > 1 and abs(np.median(np.diff(time[:n])) * rate - 1) > 0.01:
            actual = 1 / float(np.median(np.diff(time[:n])))
            return None, errors.rate_disagrees(self.where, rate, source.name, actual), False
        return time[:n], "", False

    def _seconds(self, source: Named) -> Array:
        unit = self.request.units.get("t", self.request.units.get("time", source.unit)) or "s"
        where = f"the time column '{source.name}'"
        units.check(unit, where)
        if source.column.is_clock or units.parse(unit) == "s":
            return source.column.values
        if not units.convertible(unit, "s"):
            raise errors.BadUnit(errors.units_differ(unit, "s", where))
        return units.convert(source.column.values, unit, "s")
