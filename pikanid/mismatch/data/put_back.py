"""Samples that looked alone among their neighbours, and were motion: a model predicts them.

A contact with a stiff wall lasts a sample or two, and no neighbour of its turning point says where
that is.  Once it is explained, what had been left out for an outlier is data like any other.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from pikanid.mismatch.data.left_out import LeftOut
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.model import Model


def put_back(records: Records, model: Model, theta: np.ndarray) -> Records:
    """The records with those of the samples left out that a model predicts within their noise.

    Args:
        records: Any.
        model: That explains them.
        theta: (n,) its free parameters.
    """
    whole = _with(records, records.left_out)
    whitened = Whitened(model, whole)
    if not records.left_out or not whitened.choose_steps(theta):
        return records
    predicted = set()
    for r, response in enumerate(whitened.responses(theta)):
        near = np.abs(response.y - whitened.measured(r)) < records.settings.noise.spike * (
            whitened.sigma[r])
        samples = whitened.problem.experiments[r].samples
        shown = [(model.outputs[s.output].name, t) for s in samples for t in s.t]
        predicted |= {(output, whole.recordings[r].name, float(t))
                      for (output, t), well in zip(shown, near, strict=True) if well}
    back = {one for one in records.left_out
            if (one.output, one.recording, one.time) in predicted}
    return replace(_with(records, back), left_out=tuple(
        one for one in records.left_out if one not in back))


def _with(records: Records, back: Collection[LeftOut]) -> Records:
    """The records with these samples as they were recorded."""
    recordings = list(records.recordings)
    for one in back:
        for r, recording in enumerate(recordings):
            if recording.name == one.recording:
                channel = recording[one.output]
                gone = (channel.time == one.time) & ~np.isfinite(channel.values)
                recordings[r] = recording.with_channels(replace(
                    channel, values=np.where(gone, one.value, channel.values)))
    return replace(records, recordings=tuple(recordings))
