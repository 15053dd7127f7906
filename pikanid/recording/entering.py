"""How a recording comes about: from files, from what other libraries hold, from recordings."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording import merging
from pikanid.recording.channel import Channel
from pikanid.recording.leaving import Leaving

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from pikanid.recording.reading.columns import Result
    from pikanid.recording.reading.table import Table


class Entering(Leaving):
    """What a `Recording` can be made of; its data live there."""

    if TYPE_CHECKING:
        def __init__(self, channels: Mapping[str, Channel], name: str = ...,
                     notes: tuple[str, ...] = ..., unreadable: Mapping[str, str] = ...,
                     began: float | None = ..., others: tuple[str, ...] = ...) -> None: ...

        unreadable: Mapping[str, str]
        began: float | None
        others: tuple[str, ...]

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, columns: Mapping[str, str | int] | None = None,
                   units: Mapping[str, str] | None = None,
                   sigma: Mapping[str, ArrayLike] | None = None,
                   name: str = "recording") -> Self:
        """A recording of a DataFrame; its times are a column or an index called t or time.

        Headers may carry units, as those of a file: ``"theta [deg]"``, ``"t [h]"``.  Dates count
        in seconds from the first one.

        Args:
            frame: The table.
            columns, units, sigma: As in `read`.
            name: Of the recording.

        Raises:
            BadRecording: If there are no times, or a column cannot be used.

        >>> import pandas as pd
        >>> from pikanid import Recording
        >>> frame = pd.DataFrame({"t [min]": [0, 1], "theta [deg]": [1.0, 2.0]})
        >>> Recording.from_frame(frame)
        Recording 'recording': 0 s to 60 s
          theta  [deg]  2 samples, every 60 s  1 to 2
        """
        from pikanid.recording.reading import frame as frames

        if not (hasattr(frame, "columns") and hasattr(frame, "index")):
            raise errors.BadRecording(errors.no_recording(type(frame).__name__))
        return cls._of_table(frames.read(frame, name), columns, units, sigma, name)

    @classmethod
    def from_xarray(cls, data: xr.Dataset | xr.DataArray,
                    columns: Mapping[str, str | int] | None = None,
                    units: Mapping[str, str] | None = None,
                    sigma: Mapping[str, ArrayLike] | None = None,
                    name: str = "recording") -> Self:
        """A recording of a Dataset or DataArray, each variable on the coordinate of its dimension.

        Units, a scalar sigma and the hold are attributes (``units``, ``sigma``, ``hold``), as
        `to_xarray` writes them.  Dates count in seconds from the earliest one.

        Args:
            data: Variables over time; a second dimension makes a signal of each of its labels.
            columns, units, sigma: As in `read`.
            name: Of the recording.

        Raises:
            BadRecording: If no variable has times, or a wanted one cannot be used.

        >>> import pytest; xr = pytest.importorskip("xarray")
        >>> from pikanid import Recording
        >>> y = xr.DataArray([1.0, 2.0], {"time": [0.0, 0.1]}, name="y", attrs={"units": "mm"})
        >>> Recording.from_xarray(y)["y"].unit
        'mm'
        """
        from pikanid.recording.reading import labelled

        if not (hasattr(data, "coords") and hasattr(data, "dims")):
            raise errors.BadRecording(errors.no_recording(type(data).__name__))
        return cls._of_table(labelled.read(data, name), columns, units, sigma, name)

    @classmethod
    def _of_table(cls, table: Table, columns: Mapping[str, str | int] | None,
                  units: Mapping[str, str] | None, sigma: Mapping[str, ArrayLike] | None,
                  name: str) -> Self:
        from pikanid.recording.reading.columns import Request, channels

        rec = cls._of(name, channels(table, Request(columns or {}, None, units or {}), name))
        return rec.with_sigma(sigma) if sigma else rec

    @classmethod
    def _of(cls, name: str, found: Result) -> Self:
        return cls({ch.name: ch for ch in found.channels}, name, found.notes, found.unreadable,
                   found.began, found.others)

    @classmethod
    def from_benchmark(cls, data: Any, inputs: Sequence[str] | None = None,
                       outputs: Sequence[str] | None = None,
                       units: Mapping[str, str] | None = None, rate: float | None = None,
                       name: str | None = None) -> Self:
        """A recording of an object with `u`, `y` and `sampling_time`, as nonlinear_benchmarks has.

        Args:
            data: `u` and `y` are (N,) or (N, channels); `sampling_time` is in seconds; where
                `state_initialization_window_length` is there, a note says so.
            inputs: Names of the inputs; ``u``, or ``u1``, ``u2``, ... by default.
            outputs: Names of the outputs; ``y``, or ``y1``, ``y2``, ... by default.
            units: Channel name -> unit.
            rate: Sampling rate [Hz], where the object has no sampling time.
            name: Of the recording; that of the object by default.

        Raises:
            BadRecording: If it is no such object, or does not say its sampling time.
            BadSetting: If there are more or fewer names than channels.

        >>> from types import SimpleNamespace
        >>> from pikanid import Recording
        >>> data = SimpleNamespace(u=[0.0, 1.0], y=[[0.0, 2.0], [1.0, 3.0]], sampling_time=0.5)
        >>> Recording.from_benchmark(data).names
        ('u', 'y1', 'y2')
        """
        from pikanid.recording import benchmark

        channels, called, notes = benchmark.channels(data, inputs, outputs, units or {}, rate)
        return cls(channels, name or called, notes)

    @classmethod
    def read(cls, path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
             columns: Mapping[str, str | int] | None = None, rate: float | None = None,
             sheet: str | int | None = None,
             units: Mapping[str, str] | None = None, sigma: Mapping[str, ArrayLike] | None = None,
             delimiter: str | None = None, decimal: str | None = None,
             name: str | None = None, also: Iterable[str] = (),
             by_date: bool = True) -> Self:
        """Read a file of a format in `pikanid.recording.formats`: CSV, Excel, Parquet, MDF, ...

        Several files that were recorded together make one recording, in which each channel keeps
        its own times; one that more than one file has is called ``"file/channel"``.

        Args:
            path: The file, or several; its kind is known by its ending, checked against its
                content.
            columns: Channel name -> column in the file; ``"t"`` (or ``"time"``) names the time
                column.  A column may be given by its header with or without unit, by its number
                counted from 1 where the file has no header, by its whole path in a file with
                groups or topics, or by a pattern (``"*/theta"``) that fits one.
            rate: Sampling rate [Hz] of a file without a time column.
            sheet: Excel sheet by name or number counted from 0; the first by default.
            units: Channel name -> unit, in place of what the header says (``"t"`` for time).
            sigma: Channel name -> noise standard deviation in the channel's unit.
            delimiter: Of a CSV; found out by default.
            decimal: Decimal sign of a CSV, ``"."`` or ``","``; found out by default.
            name: Of the recording; the file's stem by default.
            also: Channels that are wanted beside those of `columns` where the file has them, under
                their own names; a table is read as a whole, of other files only what is named.
            by_date: Whether several files are put on one clock as in `merge`.

        Raises:
            BadRecording: With one sentence that says what is wrong, and in which row.

        >>> import pathlib, tempfile
        >>> from pikanid import Recording
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "run.csv"
        ...     _ = path.write_text("t;theta [deg]\\n0,0;1,5\\n0,1;2,5\\n")
        ...     Recording.read(path)["theta"].values.tolist()
        [1.5, 2.5]
        """
        from pikanid.recording import reading
        from pikanid.recording.reading import together
        from pikanid.recording.reading.columns import Request
        from pikanid.recording.reading.table import Options

        asked = Request(columns or {}, rate, units or {}, tuple(also))
        options = Options(sheet, delimiter, decimal, asked.wanted)
        if isinstance(path, str | os.PathLike) or not isinstance(path, Sequence):
            found = [reading.read(path, asked, options)]
        else:
            found = together.read(path, asked, options)
        parts = [cls._of(stem, one) for stem, one in found if one.channels]
        unreadable = {key: why for _, one in found for key, why in one.unreadable.items()}
        others = tuple(other for _, one in found for other in one.others)
        if not parts:
            told = [*unreadable.values(), *(
                errors.missing_channel(together.TOGETHER, text, others) for text in asked.also)]
            raise errors.BadRecording(next(iter(told), errors.no_channels(found[0][0])))
        rec = parts[0] if len(found) == 1 else cls.merge(*parts, by_date=by_date)
        rec = cls(rec.channels, name or "+".join(stem for stem, _ in found), rec.notes, unreadable,
                  rec.began, others)
        return rec.with_sigma(sigma) if sigma else rec

    @classmethod
    def merge(cls, *recordings: Self, name: str | None = None, by_date: bool = True) -> Self:
        """One recording with the channels of several, each with its own time base.

        Where every recording knows when it began (`began`), later ones are moved by so much, and
        t = 0 is the earliest beginning; otherwise, and with ``by_date=False``, times are taken as
        they stand.  Nothing is resampled.

        Args:
            recordings: No two of them with a channel of the same name.
            name: Of the result; that of the first by default.
            by_date: Whether dates count.

        Raises:
            BadRecording: If two of them have a channel of the same name, or they do not overlap by
                their dates.

        >>> from pikanid import Recording
        >>> a = Recording.from_arrays([0, 1], {"u": [0, 1]}, name="motion")
        >>> b = Recording.from_arrays([0.0, 0.5, 1.0], {"y": [0, 1, 2]})
        >>> Recording.merge(a, b).names
        ('u', 'y')
        """
        for rec in recordings:
            if not isinstance(rec, Entering):
                raise errors.BadRecording(errors.no_recording(type(rec).__name__))
        late, began, notes = merging.delays(
            [(r.name, r.start, r.stop, r.began) for r in recordings], by_date)
        together: dict[str, Channel] = {}
        for rec, delay in zip(recordings, late, strict=True):
            for key, ch in rec.channels.items():
                if key in together:
                    raise errors.BadRecording(errors.channel_twice(key, rec.name))
                together[key] = replace(ch, time=ch.time + delay) if delay else ch
        return cls(together, name or (recordings[0].name if recordings else "recording"),
                   tuple(note for rec in recordings for note in rec.notes) + notes,
                   {key: why for rec in recordings for key, why in rec.unreadable.items()}, began,
                   tuple(other for rec in recordings for other in rec.others))
