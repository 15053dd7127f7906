"""How a recording leaves: as a table of pandas, as a Dataset of xarray, as a file, as text."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from pikanid import errors
from pikanid.recording import channel as channels_of
from pikanid.recording.operations import Operations

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Leaving(Operations):
    """What a `Recording` can be turned into; its data live there."""

    notes: tuple[str, ...]

    def to_frame(self) -> pd.DataFrame:
        """A DataFrame indexed by time; with several time bases, their union and NaN between.

        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [5, 6]}).to_frame()["y"].tolist()
        [5.0, 6.0]
        """
        import pandas as pd

        every = np.unique(np.concatenate([ch.time for ch in self.channels.values()]))
        series = {key: pd.Series(ch.values, ch.time) for key, ch in self.channels.items()}
        return pd.DataFrame(series, index=pd.Index(every, name="t"))

    def to_xarray(self) -> xr.Dataset:
        """A Dataset: a variable for each channel, a dimension for each time base.

        The first channel's times are the coordinate ``t`` [s]; a channel on other times brings its
        own, ``t:name``.  Units, a scalar sigma and the hold are attributes; a sigma of each sample
        is the variable ``sigma:name``.  `Recording.from_xarray` gives the channels back.

        Raises:
            BadSetting: If xarray is not installed.

        >>> import pytest; xr = pytest.importorskip("xarray")
        >>> from pikanid import Recording
        >>> Recording.from_arrays([0, 1], {"y": [5, 6]}, {"y": "mm"}).to_xarray()["y"].attrs
        {'units': 'mm'}
        """
        try:
            import xarray as xr
        except ImportError:
            raise errors.BadSetting(
                errors.not_installed("to_xarray", "xarray", "xarray")) from None
        shared = next(iter(self.channels.values())).time
        made = xr.Dataset(attrs={"name": self.name})
        for key, ch in self.channels.items():
            axis = "t" if np.array_equal(ch.time, shared) else f"t:{key}"
            about = {"units": ch.unit, "hold": ch.hold,
                     "sigma": ch.sigma if isinstance(ch.sigma, float) else None}
            told = {k: v for k, v in about.items() if v is not None}
            at = {axis: (axis, ch.time, {"units": "s"})}
            made[key] = xr.DataArray(ch.values, at, [axis], attrs=told)
            if isinstance(ch.sigma, np.ndarray):
                made[f"sigma:{key}"] = xr.DataArray(ch.sigma, at, [axis])
        return made

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write a file, as ``.csv`` or ``.parquet``; see `pikanid.recording.writing`."""
        from pikanid.recording import writing

        if not isinstance(path, str | os.PathLike):
            raise errors.BadRecording(errors.no_path(type(path).__name__))
        writing.write(self.channels, path)

    def __repr__(self) -> str:
        rows = [channels_of.summary(ch) for ch in self.channels.values()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [f"Recording '{self.name}': {self.start:g} s to {self.stop:g} s"]
        for row in rows:
            cells = (part.ljust(width) for part, width in zip(row, widths, strict=True))
            lines.append("  " + "  ".join(cells).rstrip())
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            "<tr>"
            + "".join(f"<td>{escape(part)}</td>" for part in channels_of.summary(ch))
            + "</tr>"
            for ch in self.channels.values()
        )
        return f"<table><caption>{escape(self.name)}</caption>{rows}</table>"
