"""Samples that are no part of a motion: gross errors, alone among their neighbours.

What follows a step of an input is alone as well where a rig is as fast as its sampling: what the
inputs' past explains is taken away first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import binom

from pikanid import errors
from pikanid.mismatch.data.left_out import LeftOut
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.stretches import as_one
from pikanid.mismatch.settings.noise import NoiseSettings
from pikanid.mismatch.settings.settings import Settings
from pikanid.noise.level import high_band_sigma
from pikanid.noise.neighbours import LONGEST, are_short, neighbour_weights
from pikanid.problem.held import HeldInput
from pikanid.problem.inputs_past import explained
from pikanid.recording import Recording

MOST, NORMAL = 0.9, 1.645  # definition: a probability, and what normal noise stays below by it
UNEVEN = 0.1  # numerical: share of neighbourhoods whose middle sample does not weigh most
TOUCHING = 5  # numerical: samples, within which a sample makes others look bad
GLITCH = 12  # numerical: samples that a glitch of a few may make look bad
RARE = 0.01  # definition: rate of recordings in which chance makes as many samples alone
NEAR = 15  # numerical: samples, within which errors that happen by chance seldom follow another
LINE = np.array([-2.0, 1.0, 4.0]) / 3.0  # numerical: straight on from three on the left
CUBIC = np.array([-4.0, 9.0, 0.0, 0.0, 0.0, 9.0, -4.0]) / 10.0  # numerical: but for the next ones


def without_outliers(recording: Recording, output: str, settings: Settings,
                     inputs: Sequence[str] = ()) -> tuple[Recording, list[LeftOut]]:
    """The recording without samples that leave the cubic through their neighbours, where they lie
    in time, and which these are.

    The worst goes first: beside a spike its neighbours look bad as well.  None goes where they
    cluster.
    """
    channel, noise = recording[output], settings.noise
    seen = np.flatnonzero(np.isfinite(channel.values))
    y = channel.values[seen].copy()
    if len(y) < noise.least_alone:
        return recording, []
    try:
        sigma, _ = high_band_sigma(channel, settings.rounding)
    except errors.BadRecording:
        return recording, []
    # where σ is known sample by sample, an uncertain one is no outlier
    given = channel.sigma[seen] if isinstance(channel.sigma, np.ndarray) else 0.0
    own = np.maximum(sigma, given) * np.ones(len(y))
    y -= from_inputs(recording, channel.time[seen], y, inputs, settings)
    weights, lengths = neighbour_weights(channel.time[seen])
    weights /= (own[2:-2] * np.sqrt(np.sum(weights**2, axis=1)))[:, None]
    gap = np.sum(weights * np.lib.stride_tricks.sliding_window_view(y, 5), axis=1)
    # where neighbours are farther away a motion does more than noise; across a gap, anything
    far = ~are_short(lengths)
    if far.any():
        weights[far] /= max(1.0, float(np.quantile(np.abs(gap[far]), MOST)) / NORMAL)
        weights[lengths > LONGEST * np.median(lengths)] = 0.0
        gap = np.sum(weights * np.lib.stride_tricks.sliding_window_view(y, 5), axis=1)
    uneven = np.mean(np.abs(weights).max(axis=1) > np.abs(weights[:, 2])) > UNEVEN
    bad: list[int] = []
    while len(bad) <= noise.most_outliers * len(y):
        k = int(np.argmax(np.abs(gap)))
        if abs(gap[k]) < noise.spike:
            break
        j, error = k + 2, gap[k] / weights[k, 2]
        if uneven:
            # of uneven neighbours the one whose error would explain most
            j, error = max((_error_of(j, weights, gap) for j in range(k, k + 5)),
                           key=lambda found: found[2])[:2]
        bad.append(j)
        y[j] -= error
        for near in range(max(j - 4, 0), min(j + 1, len(gap))):
            gap[near] = weights[near] @ y[near:near + 5]
    if not bad or len(bad) > noise.most_outliers * len(y) or _cluster(bad, len(y), noise.clustered):
        return recording, []
    values = channel.values.copy()
    values[seen[bad]] = np.nan
    return recording.with_channels(replace(channel, values=values)), [
        LeftOut(output, recording.name, float(channel.time[k]), float(channel.values[k]))
        for k in seen[sorted(set(bad))]]


def _cluster(bad: Sequence[int] | np.ndarray, count: int, by_chance: float) -> bool:
    """Whether samples, of so many, are closer together than errors that happen by chance would be:
    a motion that is faster than its sampling shows, as it rings after a step, follows none.

    Of a glitch its neighbours look bad as well: those are one event.  One that lasts longer than
    that is a motion, if it is not the only one.
    """
    events = _events(np.sort(bad))
    if sum(e[-1] - e[0] > GLITCH for e in events) > 1:
        return True
    gaps = np.diff([e[0] for e in events])
    near = 1.0 - (1.0 - len(events) / count) ** NEAR
    return bool(len(gaps) and binom.sf(np.sum(gaps <= NEAR) - 1, len(gaps), near) < by_chance)


def _events(at: np.ndarray) -> list[np.ndarray]:
    """Samples (increasing), those together that touch."""
    return np.split(at, np.flatnonzero(np.diff(at) > TOUCHING) + 1) if len(at) else []


def _error_of(j: int, weights: np.ndarray, gap: np.ndarray) -> tuple[int, float, float]:
    """A sample, the error of it that explains the gaps of its neighbourhoods best, and how much of
    their squares that takes away.
    """
    rows = np.arange(max(j - 4, 0), min(j + 1, len(gap)))
    a, b = weights[rows, j - rows], gap[rows]
    square = max(float(a @ a), 1e-300)
    return j, float(a @ b) / square, float(a @ b) ** 2 / square


def from_inputs(recording: Recording, t: np.ndarray, y: np.ndarray, inputs: Sequence[str],
                settings: Settings) -> np.ndarray:
    """The part (N,) of a signal or a residual y (N,) at times t that these inputs' past explains
    beyond chance; an input that is not held is so between its samples.
    """
    channels = [recording[u] for u in inputs if u in recording]
    held = [HeldInput(c.name, c.time, c.values, "zero" if c.hold in (None, "zero") else "first")
            for c in channels]
    return explained(t, y, held, settings.detection.lags, settings.noise.by_chance)


def lone(residual: np.ndarray, noise: NoiseSettings, gaps: float | None = None) -> np.ndarray:
    """Which samples (N,) of a residual are far from what its neighbours say, by so many median
    gaps (`noise.lone`), whichever one asks: those around it, those on one side only, beyond which
    a misfit may bend, or a cubic, which follows one that swings.
    """
    if len(residual) < noise.least_alone:
        return np.zeros(len(residual), bool)
    near = np.lib.stride_tricks.sliding_window_view(
        np.pad(residual, 3, mode="reflect", reflect_type="odd"), 7)
    said = np.stack([np.median(np.delete(near, 3, axis=1), axis=1), near[:, :3] @ LINE,
                     near[:, :3:-1] @ LINE])
    gap, swung = np.min(np.abs(residual - said), axis=0), np.abs(residual - near @ CUBIC)
    far = gap > (gaps or noise.lone) * np.median(gap)
    few = far.sum() <= noise.most_outliers * len(far)
    return far & (swung > noise.off_cubic * np.median(swung)) & few


def not_lone(residual: np.ndarray, noise: NoiseSettings, gaps: float) -> np.ndarray:
    """Which samples (increasing) of a residual (N,) are not alone, by so many median gaps."""
    kept = np.arange(len(residual))
    # two that are neighbours hide each other: the second shows when the first has gone
    while (bad := lone(residual[kept], noise, gaps)).any() and (
            len(kept) > (1 - noise.most_outliers) * len(residual)):
        kept = kept[~bad]
    return kept


def gaps_asked(residuals: Sequence[np.ndarray], noise: NoiseSettings) -> float:
    """Median gaps from which on samples of an output's residuals (N,) are alone: where no more are
    than by chance, in all of them together, only what chance does not make at all is.
    """
    count = sum(len(_events(np.setdiff1d(np.arange(len(r)), not_lone(r, noise, noise.lone))))
                for r in residuals)
    chance = binom.sf(count - 1, sum(map(len, residuals)), noise.lone_rate)
    return noise.lone if chance < RARE else noise.lone_few


def with_humps(residual: np.ndarray, kept: np.ndarray, together: int) -> np.ndarray:
    """Which samples are kept (increasing), with those put back that leave the others together.

    So many neighbours on one side, `together`, are no errors one by one: a sensor may have been at
    its end.

    >>> with_humps(np.array([0.0, 9, 8, 9, 0, 9, 8, 0]), np.array([0, 4, 7]), 3)
    array([0, 1, 2, 3, 4, 7])
    """
    gone = np.setdiff1d(np.arange(len(residual)), kept)
    side = np.sign(residual[gone] - np.interp(gone, kept, residual[kept]))
    runs = np.split(gone, np.flatnonzero((np.diff(gone) > 1) | (np.diff(side) != 0)) + 1)
    return np.union1d(kept, np.concatenate([run for run in runs if len(run) >= together] or [kept]))


def without_lone(records: Records, seen: Iterable[tuple[int, str, np.ndarray, np.ndarray]],
                 inputs: Sequence[str] = ()) -> Records:
    """Records without the samples that are alone in residuals; of a residual where they cluster all
    are kept.

    Args:
        records: Any.
        seen: Number of the recording, output, times (N,) and residual (N,) there.
        inputs: Of the model.
    """
    recordings, noise = list(records.recordings), records.settings.noise
    found = list(records.left_out)
    of = {(r, name): (t, left) for r, name, t, left in seen}
    names = list(dict.fromkeys(name for _, name in of))
    seen_in: dict[str, list[tuple[list[int], np.ndarray, np.ndarray]]] = {n: [] for n in names}
    for own, name in ((own, name) for own in records.stretches for name in names):
        t, left = (np.concatenate([of[r, name][k] for r in own if (r, name) in of] or [np.empty(0)])
                   for k in (0, 1))
        seen_in[name].append((own, t, left - from_inputs(
            as_one([recordings[r] for r in own]), t, left, inputs, records.settings)))
    asked = {n: gaps_asked([r for *_, r in some], noise) for n, some in seen_in.items()}
    for own, name, t, residual in ((own, name, t, r) for name, some in seen_in.items()
                                   for own, t, r in some):
        alone = not_lone(residual, noise, asked[name])
        kept = with_humps(residual, alone, noise.together)
        gone = np.setdiff1d(np.arange(len(t)), kept)
        # where most of what looked alone was not, it is all of one misfit
        most = len(_events(np.setdiff1d(kept, alone))) > len(_events(gone))
        if len(gone) and not most and not _cluster(gone, len(t), noise.clustered):
            for r in own:
                channel = recordings[r][name]
                here = np.isin(channel.time, t[gone]) & np.isfinite(channel.values)
                recordings[r] = recordings[r].with_channels(replace(
                    channel, values=np.where(here, np.nan, channel.values)))
                found += [LeftOut(name, recordings[r].name, float(at), float(was)) for at, was
                          in zip(channel.time[here], channel.values[here], strict=True)]
    return replace(records, recordings=tuple(recordings), left_out=tuple(found))
