"""What can be done to a recording: each operation returns a new one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import replace
from numbers import Real
from typing import Any, Self

from numpy.typing import ArrayLike

from pikanid import errors
from pikanid.formula import units
from pikanid.recording import resampling
from pikanid.recording.channel import Channel, Hold


class Operations(ABC):
    """The operations of a `Recording`; its data live there."""

    channels: Mapping[str, Channel]
    name: str

    @abstractmethod
    def __getitem__(self, name: str) -> Channel: ...

    @abstractmethod
    def _with(self, channels: Mapping[str, Channel], *notes: str) -> Self: ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels, in order."""
        return tuple(self.channels)

    @property
    def start(self) -> float:
        """First time of any channel [s]."""
        return min((float(ch.time[0]) for ch in self.channels.values() if len(ch)), default=0.0)

    @property
    def stop(self) -> float:
        """Last time of any channel [s]."""
        return max((float(ch.time[-1]) for ch in self.channels.values() if len(ch)), default=0.0)

    def window(self, start: float | None = None, stop: float | None = None) -> Self:
        """The part with start <= t <= stop; times stay as they are.

        Raises:
            BadRecording: If nothing was recorded between them.
            BadSetting: If one of them is no number.

        >>> from pikanid import Recording
        >>> rec = Recording.from_arrays([0, 1, 2, 3], {"y": [0, 1, 2, 3]})
        >>> rec.window(1, 2)["y"].values.tolist()
        [1.0, 2.0]
        """
        a = self.start if start is None else _real(start, "The start of a window")
        b = self.stop if stop is None else _real(stop, "The end of a window")
        cut = {key: resampling.window(ch, a, b) for key, ch in self.channels.items()}
        if not any(map(len, cut.values())):
            raise errors.BadRecording(
                errors.outside_the_record(self.name, a, b, self.start, self.stop))
        return self._with(cut)

    def split(self, at: float) -> tuple[Self, Self]:
        """The part with t < at, and the part with t >= at.

        Raises:
            BadRecording: If one of them would be empty.
            BadSetting: If `at` is no number.

        >>> from pikanid import Recording
        >>> a, b = Recording.from_arrays([0, 1, 2, 3], {"y": [0, 1, 2, 3]}).split(2)
        >>> a.t.tolist(), b.t.tolist()
        ([0.0, 1.0], [2.0, 3.0])
        """
        at = _real(at, "The time of a split")
        if not self.start < at <= self.stop:
            raise errors.BadRecording(errors.split_outside(self.name, at, self.start, self.stop))
        before = {
            key: resampling.window(ch, self.start, at, closed=False)
            for key, ch in self.channels.items()
        }
        return self._with(before), self.window(start=at)

    def decimate(self, n: int, filter: bool = False, channels: Iterable[str] | None = None) -> Self:
        """Every n-th sample of every channel, or of `channels`.

        A channel with a declared hold is an input that is known between its samples: it is
        thinned only where that leaves the held function as it was, and never filtered; otherwise
        it keeps its full rate, and a note says so.

        Args:
            n: Keep samples 0, n, 2n, ...
            filter: Low-pass first (zero phase), so that nothing aliases.
            channels: Names of the channels to thin; all by default.

        Raises:
            BadSetting: If n < 1.
            BadRecording: If a channel is missing, or `filter` meets gaps or uneven times.

        >>> from pikanid import Recording
        >>> rec = Recording.from_arrays([0, 1, 2, 3, 4], {"y": [0, 1, 2, 3, 4]})
        >>> rec.decimate(2)["y"].values.tolist()
        [0.0, 2.0, 4.0]
        """
        count = _real(n, "The stride")
        if not count.is_integer() or count < 1:
            raise errors.BadSetting(errors.bad_stride(n))
        thin, notes = dict(self.channels), []
        for key in self.names if channels is None else channels:
            ch = self[key]
            if ch.hold is not None:
                if resampling.survives_stride(ch, int(n)):
                    thin[key] = resampling.stride(ch, int(n))
                else:
                    notes.append(f"Input '{key}' keeps its full rate: thinning would change it.")
            elif filter:
                thin[key] = resampling.filtered_stride(ch, int(n), self.name)
            else:
                thin[key] = resampling.stride(ch, int(n))
        return self._with(thin, *notes)

    def rename(self, names: Mapping[str, str]) -> Self:
        """Channels under new names: old name -> new name.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [0, 1]}).rename({"y": "theta"}).names
        ('theta',)
        """
        _mapping(names, "What is renamed", "a dictionary: old name -> new name")
        for old in names:
            self[old]
        renamed = [names.get(key, key) for key in self.names]
        for key in renamed:
            if renamed.count(key) > 1:
                raise errors.BadRecording(errors.channel_twice(key, self.name))
        return self._with(dict(zip(renamed, self.channels.values(), strict=True)))

    def with_channels(self, *channels: Channel) -> Self:
        """With channels added, or replaced where the name is the same.

        >>> from pikanid import Recording
        >>> rec = Recording.from_arrays([0, 1], {"y": [0, 1]})
        >>> rec.with_channels(Channel("u", [0, 1], [1, 1])).names
        ('y', 'u')
        """
        for ch in channels:
            if not isinstance(ch, Channel):
                raise errors.BadRecording(
                    errors.not_of_kind("What is added", type(ch).__name__, "a Channel"))
        return self._with({**self.channels, **{ch.name: ch for ch in channels}})

    def without(self, *names: str) -> Self:
        """Without these channels.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [0, 1], "u": [0, 0]}).without("u").names
        ('y',)
        """
        for key in names:
            self[key]
        return self._with({key: ch for key, ch in self.channels.items() if key not in names})

    def with_sigma(self, sigma: Mapping[str, Any] | None = None, /,
                   **more: ArrayLike | None) -> Self:
        """With noise standard deviations; None takes one away.

        Numbers are in the channels' own units, texts may carry one: ``"0.1deg"``.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [0, 1]}).with_sigma(y=0.1)["y"].sigma
        0.1
        """
        if sigma is not None:
            _mapping(sigma, "The noise", "a dictionary: channel -> standard deviation")
        given = {**(sigma or {}), **more}
        return self.with_channels(*(replace(self[k], sigma=s) for k, s in given.items()))

    def with_unit(self, name: str, unit: str) -> Self:
        """With another unit text on a channel whose values are right and whose unit is not.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [0, 1]}).with_unit("y", "mm")["y"].unit
        'mm'
        """
        ch = replace(self[name], unit=unit)  # checks it
        return self.with_channels(replace(ch, unit=units.parse(ch.unit)))

    def with_hold(self, **hold: Hold) -> Self:
        """With the hold of inputs declared.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"u": [0, 1]}).with_hold(u="first")["u"].hold
        'first'
        """
        return self.with_channels(*(replace(self[k], hold=h) for k, h in hold.items()))

    def shift(self, name: str, seconds: float) -> Self:
        """With one channel moved later by `seconds`.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [0, 1]}).shift("y", 0.5)["y"].time.tolist()
        [0.5, 1.5]
        """
        late = _real(seconds, "The shift")
        return self.with_channels(replace(self[name], time=self[name].time + late))


def _real(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        shown = repr(value) if isinstance(value, float) else type(value).__name__
        raise errors.BadSetting(errors.not_of_kind(what, shown, "a finite number"))
    return float(value)


def _mapping(value: object, what: str, wanted: str) -> None:
    if not isinstance(value, Mapping):
        raise errors.BadSetting(errors.not_of_kind(what, type(value).__name__, wanted))
