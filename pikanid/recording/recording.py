"""A recording: named signals over time, immutable, whatever file they came from.

A recording does not know which of its channels are inputs and which are outputs: the model says
so, by name.  Channels may have different time bases, such as a 500 Hz motion and a 60 Hz camera.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Self

from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.recording import channel as channels_of
from pikanid.recording.channel import Array, Channel, Hold
from pikanid.recording.entering import Entering

__all__ = ["Channel", "Hold", "Recording"]


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Entering):
    """Signals measured together.

    Attributes:
        channels: Read-only mapping from name to `Channel`.
        name: How messages and reports call the recording.
        notes: What reading or preparing it left out or changed, one sentence each.
        unreadable: Columns of the file that could not be used, and why; asking for one of them
            raises that sentence.
        began: POSIX time [s] of t = 0, where the file tells it.
        others: What else its file holds, for messages.
        begins: Guesses of parameters that a model estimates for each recording, by name, in the
            model's units: those of an initial state, where the samples tell it.

    >>> rec = Recording.from_arrays([0.0, 0.1, 0.2], {"theta": [0.0, 1.0, 0.5]}, {"theta": "deg"})
    >>> rec["theta"].unit, rec.names, rec.stop
    ('deg', ('theta',), 0.2)
    """

    channels: Mapping[str, Channel]
    name: str = "recording"
    notes: tuple[str, ...] = ()
    unreadable: Mapping[str, str] = field(default_factory=dict)
    began: float | None = None
    others: tuple[str, ...] = ()
    begins: Mapping[str, float] = field(default_factory=dict)

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
        object.__setattr__(self, "begins", MappingProxyType(dict(self.begins)))
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
            hold: Channel name -> ``"zero"``, ``"first"`` or ``"cubic"``.
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
        known = [*self.names, *self.others]
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
        raise errors.BadRecording(errors.missing_channel(self.name, name, known, close))

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
                           self.began, self.others, dict(self.begins))

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
        try:
            return stated.converted(stated.unit if unit is None else unit)
        except errors.BadUnit as bad:
            raise errors.BadUnit(errors.unit_of_recording(self.name, name, str(bad))) from None

    def _with(self, channels: Mapping[str, Channel], *notes: str) -> Self:
        return replace(self, channels=channels, notes=(*self.notes, *notes))
