"""Which samples show a time at which the inputs had been recorded.

A sensor whose clock loses shows, in the end, what came after the recording of the inputs; so it is
where an input was recorded late.  What acted then nobody knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pikanid.mismatch.data.records import Records
from pikanid.model import Model
from pikanid.problem.evaluated import delays
from pikanid.problem.late import sample_delays
from pikanid.problem.problem import Samples
from pikanid.recording import Channel, Recording

ROUNDED = 1e-6  # numerical: of an interval: two times are the same


def covered(records: Records, model: Model, values: Mapping[str, float]) -> Records:
    """The records without samples that, by the delays of a model at these values of its parameters,
    show what came after the inputs were recorded; the same records where there are none.
    """
    p = np.array([values.get(name, value) for name, value in model.values.items()])
    found = tuple(_covered(r, model, p) for r in records.recordings)
    same = all(new is old for new, old in zip(found, records.recordings, strict=True))
    return records if same else replace(records, recordings=found)


def _covered(recording: Recording, model: Model, p: np.ndarray) -> Recording:
    given = [(recording[i.name], float(late)) for i, late in zip(
        model.inputs, delays(model.inputs, model, p), strict=True)
        if i.name in recording and np.ptp(recording[i.name].values) > 0]
    if not given:
        return recording
    end = min(_end(u) for u, _ in given)
    known = min(_end(u) + late for u, late in given)
    channels = [recording[o.name] for o in model.outputs]
    samples = [Samples(k, c.time, c.values, None) for k, c in enumerate(channels)]
    changed = []
    for c, late in zip(channels, sample_delays(model, samples, p), strict=True):
        slack = ROUNDED * float(np.median(np.diff(c.time)))
        # what was recorded longer than the inputs were is so without a delay as well
        gone = (c.time <= end + slack) & (c.time - late > known + slack) & np.isfinite(c.values)
        if gone.any():
            changed.append(replace(c, values=np.where(gone, np.nan, c.values)))
    return recording.with_channels(*changed) if changed else recording


def _end(u: Channel) -> float:
    """Until when an input is known: its last sample is held for an interval."""
    return float(u.time[-1] + np.median(np.diff(u.time)))
