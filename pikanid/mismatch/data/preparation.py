"""Recordings made ready to be judged: outliers out, noise levels in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit
from pikanid.mismatch.data.noise_level import first_level, refined
from pikanid.mismatch.data.outliers import from_inputs, without_lone, without_outliers
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.stretches import as_one
from pikanid.mismatch.settings.budget import Budget
from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model
from pikanid.noise.floor import repeated
from pikanid.noise.level import NoiseModel
from pikanid.recording import Recording
from pikanid.recording.channel import Channel

UNEVEN = 0.01  # numerical: of an interval, by which the others may differ
EXACT = 1e-6  # numerical: of an output's half range: no simulation is compared with less noise


def prepared(model: Model, recordings: tuple[Recording, ...], quiet: tuple[float, float] | None,
             notes: list[str], settings: Settings, together: int = 1,
             levels: Mapping[str, NoiseModel] | None = None) -> Records:
    """Recordings in the model's units without outliers, each output with a first noise level, or
    with the one that is known.

    Where `together` is more than one, that many samples of an output become one.
    """
    done, every, left_out = [], [], []
    for recording in recordings:
        found: dict[str, NoiseModel] = {}
        for output in model.outputs:
            channel = recording.as_output(output.name, output.unit or None)
            recording, outliers = without_outliers(
                recording.with_channels(channel), output.name, settings, model.input_names)
            left_out += outliers
            again = repeated(recording[output.name].values, settings.rounding)
            if together > 1:
                recording = recording.with_channels(averaged(recording[output.name], together))
                windows = np.lib.stride_tricks.sliding_window_view(again, together)[::together]
                again = np.asarray(windows.all(axis=1))
            own = recording[output.name]
            if again.any():
                notes.append(errors.rounded_repeats(recording.name, output.name, int(again.sum())))
                recording = recording.with_channels(
                    replace(own, values=np.where(again, np.nan, own.values)))
            if levels is not None:
                found[output.name] = levels[output.name]
                continue
            # of a signal at rest the noise is seen where it still holds all its samples
            whole = recording.with_channels(own)
            level = first_level(whole, output.name, quiet, settings, model.input_names)
            found[output.name] = loud_enough(level, own)
            if found[output.name] is not level:
                notes.append(f"Recording '{recording.name}': noise of '{output.name}' below "
                             f"{EXACT:.0e} of its half range counts as that.")
        done.append(recording)
        every.append(found)
    return Records(tuple(done), tuple(every), settings, left_out=tuple(left_out))


def beginnings(model: Model, recordings: tuple[Recording, ...], what: str, notes: list[str],
               budget: Budget) -> tuple[Recording, ...]:
    """The recordings, or as much of them from their start on as can be diagnosed in a minute.

    Args:
        model: That names the outputs.
        recordings: Each is cut alike.
        what: They are, for a note.
        notes: Get a sentence where something is cut.
        budget: How much can be diagnosed.
    """
    total = sum(len(r[o].time) for r in recordings for o in model.output_names)
    if total <= budget.samples:
        return recordings
    share = budget.samples * oversampling(model, recordings, budget) / total
    if share >= 1:
        return recordings
    notes.append(f"{what[0].upper()}{what[1:]} is long: its first {100 * share:.2g} % are "
                 f"diagnosed, {share * total:.0f} of {total} samples.")
    return tuple(r.window(r.start, r.start + share * (r.stop - r.start)) for r in recordings)


def loud_enough(level: NoiseModel, channel: Channel) -> NoiseModel:
    """The level, or that of the least noise that a simulation can be compared with.

    Recordings without noise, or with a given σ that nothing measured has, would ask for more digits
    than a simulation has.
    """
    seen = channel.values[np.isfinite(channel.values)]
    floor = EXACT * float(np.ptp(seen)) / 2 if len(seen) else 0.0
    return level if level.sigma >= floor else replace(level, sigma=floor)


def check_freedom(model: Model, records: Records) -> None:
    """Refuse recordings that leave too little beside what is estimated.

    Raises:
        BadRecording: With the number of samples that is needed.
    """
    count, free, needed = freedom(model, records)
    if count < needed:
        raise errors.BadRecording(errors.too_few_to_diagnose(count, free, needed))


def freedom(model: Model, records: Records) -> tuple[int, int, int]:
    """Usable samples of the outputs, free parameters, and samples that these ask for."""
    count = sum(int(np.isfinite(r[o].values).sum()) for r in records.recordings
                for o in model.output_names)
    free = sum(1 if p.scope == "shared" else len(records.recordings)
               for p in model.parameters if p.free)
    return count, free, free + records.settings.noise.freedom


def oversampling(model: Model, recordings: tuple[Recording, ...], budget: Budget) -> int:
    """How many samples of the outputs may become one: of records that are long, and recorded far
    faster than anything in them moves.

    Of the frequency that nearly all of an output's changes stay below, the budget's samples a
    period are kept.
    """
    total = sum(len(r[o].time) for r in recordings for o in model.output_names)
    counts = [total // budget.put_together]
    for recording in recordings:
        for name in model.output_names:
            c = recording[name]
            y = c.values[np.isfinite(c.values)]
            steps = np.diff(c.time)
            if len(y) < budget.put_together // 4 or np.ptp(steps) > UNEVEN * np.median(steps):
                return 1
            y = (y - np.linspace(y[0], y[-1], len(y))) * np.hanning(len(y))
            power = np.cumsum(np.abs(np.fft.rfft(y)) ** 2)
            fast = int(np.searchsorted(power, budget.fastest * power[-1])) + 1
            counts.append(int(len(y) / (budget.samples_a_period * fast)))
    odd = max(min(counts), 1)
    return odd - 1 + odd % 2


def averaged(channel: Channel, count: int) -> Channel:
    """A channel in which `count` (odd) neighbouring samples become one.

    Each is the value, in the middle, of the parabola through them (A. Savitzky and M. J. E. Golay,
    Anal. Chem. 36, 1964), which follows a motion to third order.
    """
    half = count // 2
    k = np.arange(-half, half + 1)
    weights = np.linalg.pinv(np.vander(k / max(half, 1), 3))[2]
    middles = np.arange(half, len(channel.time) - half, count)
    values = np.convolve(channel.values, weights[::-1], "valid")[middles - half]
    sigma = channel.sigma
    if sigma is not None:
        sigma = np.broadcast_to(np.asarray(sigma, float), channel.time.shape)[middles] * float(
            np.linalg.norm(weights))
    return replace(channel, time=channel.time[middles], values=values, sigma=sigma)


def with_refined_noise(records: Records, fit: Estimate, rate: float,
                       quiet: tuple[float, float] | None, explained: bool = False
                       ) -> Records:
    """Noise levels again, from what a fit leaves, and without the outliers that it shows."""
    outputs = [(r, name) for r, found in enumerate(records.levels) for name in found]
    fits = dict(zip(outputs, fit.fits, strict=True))
    inputs = fit.fitted_model.input_names
    records = without_lone(records, [(*key, f.t, f.residual) for key, f in fits.items()], inputs)
    samples = sum(len(f.t) for f in fit.fits)
    freedom = max(samples - len(fit.theta), 1) / max(samples, 1)
    levels: list[dict[str, NoiseModel]] = []
    for own in records.stretches:
        recording = as_one([records.recordings[r] for r in own])
        new = {}
        for name, level in records.levels[own[0]].items():
            f = Fit.joined([fits[r, name] for r in own])
            kept = np.isfinite(recording[name].values[np.searchsorted(recording[name].time, f.t)])
            # of samples whose σ differ, what is left is compared as if all had the common one
            left = f.residual * level.sigma / level.spreads(f.sigma, len(f.t))
            # what still follows the inputs is misfit, however fast
            left -= from_inputs(recording, f.t, left, inputs, records.settings)
            again = refined(level, recording[name], f.t[kept], left[kept], rate, quiet,
                            records.settings, explained, freedom)
            new[name] = loud_enough(again, recording[name])
        levels += [new] * len(own)
    return replace(records, levels=tuple(levels))


def set_aside(train: tuple[Recording, ...], model: Model, notes: list[str], noise: NoiseSettings
              ) -> tuple[tuple[Recording, ...], tuple[Recording, ...] | None]:
    """Recordings without their ends, and the same with nothing but their ends to be seen.

    Hypotheses that cannot even predict how the same run goes on are refused; a run driven the same
    way proves no more than that.
    """
    notes.append("There is no held-out recording: whatever is found stays unconfirmed.")
    if min(len(r[o].time) for r in train for o in model.output_names) < noise.least_aside:
        return train, None
    kept, ends = [], []
    for r in train:
        cut = r.start + (1 - noise.aside) * (r.stop - r.start)
        kept.append(r.window(r.start, cut))
        unseen = [replace(r[o], values=np.where(r[o].time < cut, np.nan, r[o].values))
                  for o in model.output_names]
        ends.append(r.with_channels(*unseen))
    if any(np.isinf(r[o].changes_at) for r in (*kept, *ends) for o in model.output_names):
        return train, None  # what does not change proves nothing
    notes.append(f"The last {100 * noise.aside:.0f} % of the recording are set aside: what "
                 "is found has to predict them.")
    return tuple(kept), tuple(ends)


def check_pair(train: tuple[Recording, ...], later: tuple[Recording, ...]) -> None:
    """Refuse held-out recordings that lack a channel of the train ones, or are the same.

    Raises:
        BadRecording: If one does, or is.
    """
    for a in train:
        for b in later:
            missing = [n for n in a.names if n not in b]
            if missing:
                raise errors.BadRecording(errors.held_out_channels(b.name, missing))
            if all(np.array_equal(a[n].values, b[n].values, equal_nan=True) for n in a.names):
                raise errors.BadRecording(errors.held_out_same(a.name, b.name))


def held_as_recorded(model: Model, train: tuple[Recording, ...]) -> Model:
    """A recording that declares how an input is held overrides the model."""
    return model.replace(inputs=tuple(
        replace(i, hold=train[0][i.name].hold or i.hold) if i.name in train[0] else i
        for i in model.inputs))


def with_sigma(records: Records, model: Model) -> list[Recording]:
    """The recordings with the standard deviation of the noise that was found."""
    return [r.with_sigma({o: levels[o].sigma for o in model.output_names})
            for r, levels in zip(records.recordings, records.levels, strict=True)]
