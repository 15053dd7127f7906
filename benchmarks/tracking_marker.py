"""From simulation to a video of a moving tank and back: the motion is known by a marker alone."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import pikanid as pk
from pikanid.recording import Recording
from pikanid.tracking.region import Region
from pikanid.tracking.render import Pattern, Scene, write
from pikanid.tracking.video import track
from pikanid.validation.study import slosh

RATE, SECONDS = 100.0, 3.0
PIXEL = 66e-3 / 180  # [m]
STEEPEST = np.radians(12)  # of the surface
TANK = Scene(size=(200, 380), tank=(150, 20, 180, 165), noise=8.0)
# what the marker is on -> the scene, and where the marker is followed
SIDES = {
    "tank": (replace(TANK, pattern=Pattern(210, 25, 40, 24)), Region(211, 26, 38, 22)),
    "background": (replace(TANK, pattern=Pattern(50, 60, 40, 40), glued=False, riding=True),
                   Region(51, 61, 38, 38)),
}


@dataclass(frozen=True)
class Followed:
    """What a marker told.

    Attributes:
        rmse: Of the position [px].
        inside: Share of positions within 1.96 of their standard errors.
        acceleration: RMSE of u_x, over its root mean square.
        plain: (estimate - truth) / standard error of l and d, errors of the motion left out.
        z: The same, counted.
        share: Standard errors of l and d, counted, over their values.
        speed: Frames per second of CPU time.
    """

    rmse: float
    inside: float
    acceleration: float
    plain: tuple[float, ...]
    z: tuple[float, ...]
    share: tuple[float, ...]
    speed: float


def moved(seed: int) -> tuple[Recording, Recording]:
    """A smooth motion of a tank, and what the liquid in it does: ``x``, ``u_x``; ``theta``."""
    step = 1e-3
    t = np.arange(-1, round(SECONDS / step) + 2) * step
    w = np.random.default_rng(seed).uniform(8, 16, 2)
    x = np.sin(np.pi * t / SECONDS) ** 3 * (8e-3 * np.sin(w[0] * t) + 3e-3 * np.sin(w[1] * t + 1))
    size = 1.0
    for _ in range(5):
        u = size * np.diff(x, 2) / step**2
        drive = Recording.from_arrays(t[1:-1], {"x": size * x[1:-1], "u_x": u},
                                      {"x": "m", "u_x": "m/s^2"})
        drive = drive.with_channels(replace(drive["u_x"], hold="cubic"))
        truth = pk.simulate(slosh.model(), drive.without("x"))
        size *= STEEPEST / np.max(np.abs(truth["theta"].values))
    return drive, truth


def followed(seed: int, side: str, resamples: int = 40) -> Followed:
    """Simulate, render, track with a marker alone, and identify."""
    import time

    drive, truth = moved(seed)
    t = np.arange(round(SECONDS * RATE) + 1) / RATE
    x, theta, u = (np.interp(t, source[name].time, source[name].values) for source, name in (
        (drive, "x"), (truth, "theta"), (drive, "u_x")))
    scene, area = SIDES[side]
    assert scene.pattern is not None
    scene = replace(scene, pattern=replace(scene.pattern, seed=seed))
    with tempfile.TemporaryDirectory() as folder:
        video = write(Path(folder) / "clip.avi", theta, scene, RATE, seed=seed,
                      motion=[(a / PIXEL, 0.0) for a in x])
        begun = time.process_time()
        seen = track(video, follow=(area, side), pixel=PIXEL)
        speed = len(t) / (time.process_time() - begun)
    where, sigma = seen.motion
    off = where[:, 0] - x - np.nanmean(where[:, 0] - x)
    recording = seen.recording().without("level", "shape_2", "shape_3", "shape_4", "y")
    found = recording["u_x"]
    wrong = found.values - np.interp(found.time, t, u)
    fit = pk.NLS().fit(slosh.model().with_values(slosh.START), recording)
    counted = pk.bootstrap(fit, recording, resamples, positions={"u_x": "x"})
    errors = {p: fit.value(p) - true for p, true in slosh.TRUE.items()}
    return Followed(
        float(np.sqrt(np.nanmean(off**2))) / PIXEL,
        float(np.nanmean(np.abs(off) < 1.96 * sigma[:, 0])),
        float(np.sqrt(np.mean(wrong**2) / np.mean(u**2))),
        tuple(e / fit.std(p) for p, e in errors.items()),
        tuple(e / counted.std(p) for p, e in errors.items()),
        tuple(counted.std(p) / fit.value(p) for p in errors), speed)
