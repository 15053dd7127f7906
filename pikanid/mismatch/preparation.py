"""Recordings made ready to be judged: outliers out, noise levels in."""

from __future__ import annotations

from pikanid.estimate import Estimate
from pikanid.mismatch.noise_level import Level, first_level, refined, without_outliers
from pikanid.mismatch.whitened import Records
from pikanid.model import Model
from pikanid.recording import Recording


def prepared(model: Model, recordings: tuple[Recording, ...], quiet: tuple[float, float] | None,
             notes: list[str]) -> Records:
    """Recordings in the model's units without outliers, each output with a first noise level."""
    done, levels = [], []
    for recording in recordings:
        found: dict[str, Level] = {}
        for output in model.outputs:
            channel = recording.as_output(output.name, output.unit or None)
            recording, count = without_outliers(recording.with_channels(channel), output.name)
            if count:
                notes.append(f"Recording '{recording.name}': {count} outliers of "
                             f"'{output.name}' are left out.")
            found[output.name] = first_level(recording, output.name, quiet)
        done.append(recording)
        levels.append(found)
    return Records(tuple(done), tuple(levels))


def with_refined_noise(records: Records, fit: Estimate, rate: float,
                       quiet: tuple[float, float] | None) -> Records:
    """Noise levels again, from what a fit leaves."""
    levels = []
    fits = iter(fit.fits)
    for recording, found in zip(records.recordings, records.levels, strict=True):
        new = {}
        for name, level in found.items():
            f = next(fits)
            new[name] = refined(level, recording[name], f.t, f.residual, rate, quiet)
        levels.append(new)
    return Records(records.recordings, tuple(levels))
