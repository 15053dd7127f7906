"""A recording: named signals over time, immutable, whatever file they came from.

A recording does not know which of its channels are inputs and which are outputs: the model says
so, by name.  Channels may have different time bases, such as a 500 Hz motion and a 60 Hz camera.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording import channel as channels_of
from pikanid.recording.channel import Array, Channel, Hold
from pikanid.recording.leaving import Leaving

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Channel", "Hold", "Recording"]


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Leaving):
    """Signals measured together.

    Attributes:
        channels: Read-only mapping from name to `Channel`.
        name: How messages and reports call the recording.
        notes: What reading or preparing it left out or changed, one sentence each.
        unreadable: Columns of the file that could not be used, and why; asking for one of them
            raises that sentence.
        began: POSIX time [s] of t = 0, where the file tells it.

    >>> rec = Recording.from_arrays([0.0, 0.1, 0.2], {"theta": [0.0, 1.0, 0.5]}, {"theta": "deg"})
    >>> rec["theta"].unit, rec.names, rec.stop
    ('deg', ('theta',), 0.2)
    """

    channels: Mapping[str, Channel]
    name: str = "recording"
    notes: tuple[str, ...] = ()
    unreadable: Mapping[str, str] = field(default_factory=dict)
    began: float | None = None

    def __post_init__(self) -> None:
        given: object = self.channels
        for made in [given, *(given.values() if isinstance(given, Mapping) else ())]:
            if not isinstance(made, Mapping if made is given else Channel):
                raise errors.BadRecording(errors.no_channel_table(type(made).__name__))
        channels = {name: replace(ch, name=name) for name, ch in self.channels.items()}
        if not channels:
            raise errors.BadRecording(errors.no_channels(self.name))
        object.__setattr__(self, "channels", MappingProxyType(channels))
        object.__setattr__(self, "unreadable", MappingProxyType(dict(self.unreadable)))
        object.__setattr__(self, "notes", tuple(self.notes))

    @classmethod
    def from_arrays(cls, t: ArrayLike, values: Mapping[str, ArrayLike],
                    units: Mapping[str, str] | None = None,
                    sigma: Mapping[str, ArrayLike] | None = None,
                    hold: Mapping[str, Hold] | None = None, name: str = "recording") -> Recording:
        """A recording of arrays that share one time base.

        Args:
            t: (N,) times [s].
            values: Channel name -> (N,) samples.
            units: Channel name -> unit text.
            sigma: Channel name -> noise standard deviation, scalar or (N,).
            hold: Channel name -> ``"zero"`` or ``"first"``.
            name: Of the recording.

        Raises:
            BadRecording: If lengths differ or values are not numbers.
            BadSetting: If `units`, `sigma` or `hold` names a channel that is not there.

        >>> Recording.from_arrays([0, 1], {"u": [0, 1]}, hold={"u": "zero"})["u"].hold
        'zero'
        """
        found: object = values
        if not isinstance(found, Mapping):
            kind, wanted = type(found).__name__, "a dictionary: channel -> samples"
            raise errors.BadRecording(errors.not_of_kind("'values'", kind, wanted))
        for what, given in (("units", units), ("sigma", sigma), ("hold", hold)):
            for unknown in set(given or ()) - set(values):
                raise errors.BadSetting(errors.unknown_channel_setting(what, unknown, [*values]))
        made = {
            key: Channel(
                key,
                t,  # type: ignore[arg-type]  # made an array by Channel
                y,  # type: ignore[arg-type]  # likewise
                (units or {}).get(key, ""),
                (sigma or {}).get(key),  # type: ignore[arg-type]  # checked by Channel
                (hold or {}).get(key),
            )
            for key, y in values.items()
        }
        return cls(made, name)

    @classmethod
    def from_frame(cls, frame: pd.DataFrame, columns: Mapping[str, str | int] | None = None,
                   units: Mapping[str, str] | None = None,
                   sigma: Mapping[str, ArrayLike] | None = None,
                   name: str = "recording") -> Recording:
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
        >>> frame = pd.DataFrame({"t [min]": [0, 1], "theta [deg]": [1.0, 2.0]})
        >>> Recording.from_frame(frame)
        Recording 'recording': 0 s to 60 s
          theta  [deg]  2 samples, every 60 s  1 to 2
        """
        from pikanid.recording.reading import columns as made_of
        from pikanid.recording.reading import frame as frames

        if not (hasattr(frame, "columns") and hasattr(frame, "index")):
            raise errors.BadRecording(errors.no_recording(type(frame).__name__))
        request = made_of.Request(columns or {}, None, units or {})
        found = made_of.channels(frames.read(frame, name), request, name)
        rec = cls({ch.name: ch for ch in found.channels}, name, found.notes, found.unreadable,
                  found.began)
        return rec.with_sigma(sigma) if sigma else rec

    @classmethod
    def read(cls, path: str | os.PathLike[str], columns: Mapping[str, str | int] | None = None,
             rate: float | None = None, sheet: str | int | None = None,
             units: Mapping[str, str] | None = None, sigma: Mapping[str, ArrayLike] | None = None,
             delimiter: str | None = None, decimal: str | None = None,
             name: str | None = None, also: Iterable[str] = ()) -> Recording:
        """Read a file of a format in `pikanid.recording.formats`: CSV, Excel, Parquet, ...

        Args:
            path: The file; its kind is known by its ending, checked against its content.
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

        Raises:
            BadRecording: With one sentence that says what is wrong, and in which row.

        >>> import pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "run.csv"
        ...     _ = path.write_text("t;theta [deg]\\n0,0;1,5\\n0,1;2,5\\n")
        ...     Recording.read(path)["theta"].values.tolist()
        [1.5, 2.5]
        """
        from pikanid.recording import reading

        found = reading.read(path, columns, rate, sheet, units, delimiter, decimal, also)
        rec = cls({ch.name: ch for ch in found.channels}, name or found.stem, found.notes,
                  found.unreadable, found.began)
        return rec.with_sigma(sigma) if sigma else rec

    @classmethod
    def merge(cls, *recordings: Recording, name: str | None = None) -> Recording:
        """One recording with the channels of several, each with its own time base.

        Raises:
            BadRecording: If two of them have a channel of the same name.

        >>> a = Recording.from_arrays([0, 1], {"u": [0, 1]}, name="motion")
        >>> b = Recording.from_arrays([0.0, 0.5, 1.0], {"y": [0, 1, 2]})
        >>> Recording.merge(a, b).names
        ('u', 'y')
        """
        together: dict[str, Channel] = {}
        for rec in recordings:
            if not isinstance(rec, Recording):
                raise errors.BadRecording(errors.no_recording(type(rec).__name__))
            for key, ch in rec.channels.items():
                if key in together:
                    raise errors.BadRecording(errors.channel_twice(key, rec.name))
                together[key] = ch
        return cls(together, name or (recordings[0].name if recordings else "recording"),
                   tuple(note for rec in recordings for note in rec.notes),
                   {key: why for rec in recordings for key, why in rec.unreadable.items()})

    # --- looking ---------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Channel:
        asked: object = name
        if not isinstance(asked, str):
            kind = type(asked).__name__
            raise errors.BadRecording(errors.not_of_kind("The name of a channel", kind, "text"))
        if name in self.channels:
            return self.channels[name]
        if name in self.unreadable:
            raise errors.BadRecording(self.unreadable[name])
        close = difflib.get_close_matches(name, self.names, n=1, cutoff=0.5)
        raise errors.BadRecording(errors.missing_channel(self.name, name, self.names, close))

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return self.name == other.name and dict(self.channels) == dict(other.channels)

    __hash__ = None  # type: ignore[assignment]  # equal by content, which no hash should walk

    def __reduce__(self) -> tuple[type[Recording], tuple[object, ...]]:
        # A read-only mapping cannot be sent to another process; what it shows can.
        return Recording, (dict(self.channels), self.name, self.notes, dict(self.unreadable),
                           self.began)

    @property
    def t(self) -> Array:
        """(N,) times [s] of the first channel."""
        return next(iter(self.channels.values())).time

    def as_input(self, name: str, unit: str | None = None) -> Channel:
        """The channel `name`, fit to drive a model: rising times, nothing missing.

        Args:
            name: Of the channel.
            unit: Unit to convert to; as recorded if None.  A channel without one is taken to be
                in it already.

        Raises:
            BadRecording: If it is absent or unusable; BadUnit if its unit does not fit.

        >>> Recording.from_arrays([0, 1], {"u": [0, 1]}, {"u": "mV"}).as_input("u", "V").values[1]
        np.float64(0.001)
        """
        return self._checked(name, unit, missing_allowed=False)

    def as_output(self, name: str, unit: str | None = None) -> Channel:
        """The channel `name`, fit to be compared with a model: missing samples (NaN) may be.

        Args:
            name: Of the channel.
            unit: Unit to convert to; as recorded if None.  A channel without one is taken to be
                in it already.

        Raises:
            BadRecording: If it is absent, unusable or never changes; BadUnit if its unit does not
                fit.

        >>> Recording.from_arrays([0, 1], {"y": [0, 1]}).as_output("y").values[1]
        np.float64(1.0)
        """
        checked = self._checked(name, unit, missing_allowed=True)
        channels_of.check_alive(checked, self.name)
        return checked

    def _checked(self, name: str, unit: str | None, missing_allowed: bool) -> Channel:
        found = self[name]
        channels_of.check_times(found, self.name)
        channels_of.check_values(found, self.name, missing_allowed)
        # Where a file states no unit, the model's is meant.
        stated = found if found.unit or not unit else replace(found, unit=unit)
        return stated.converted(stated.unit if unit is None else unit)

    def _with(self, channels: Mapping[str, Channel], *notes: str) -> Self:
        return replace(self, channels=channels, notes=(*self.notes, *notes))
