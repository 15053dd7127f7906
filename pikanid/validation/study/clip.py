"""From simulation to video and back: a rendered clip, tracked, and Eq. (6) identified from it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.recording import Recording, excitation
from pikanid.simulation import simulate
from pikanid.strategies.nls import NLS
from pikanid.tracking.drawing import Still
from pikanid.tracking.edges import Edges
from pikanid.tracking.frames import Frame
from pikanid.tracking.motion import with_motion
from pikanid.tracking.render import Scene, write
from pikanid.tracking.surface import Surface
from pikanid.tracking.tracked import Track
from pikanid.tracking.video import track
from pikanid.validation.study import slosh

SECONDS = 3.0  # definition: of the study's clip
RATE = 100.0  # definition: frames per second, as in Table II
SCENE = Scene(size=(240, 320), tank=(70, 20, 180, 195))  # definition: half the usual picture
SHOWN = (0.44, 1.46)  # definition: seconds of the stills, near both crests
UNUSED = ("level", "shape_2", "shape_3", "shape_4")  # definition: not in Eq. (6)
QUALITY = 95.0  # definition: of Motion JPEG


@dataclass(frozen=True, eq=False)
class Filmed:
    """A clip and what was found in it.

    Attributes:
        truth: The simulated recording, without noise.
        track: What was found in its frames.
        recording: The same with the motion: what is fitted.
        stills: Some of the frames.
        estimate: By NLS, with the standard error of every frame; None where it failed.
        reason: Why it failed.
    """

    truth: Recording
    track: Track
    recording: Recording
    stills: tuple[Still, ...]
    estimate: Estimate | None
    reason: str = ""

    @property
    def rmse(self) -> float:
        """Of the angle [rad]."""
        return float(np.sqrt(np.nanmean((self.track.theta - self.truth["theta"].values) ** 2)))

    @property
    def inside(self) -> float:
        """Share of the frames within their own 95 % band."""
        off = np.abs(self.track.theta - self.truth["theta"].values)
        return float(np.mean(off[np.isfinite(off)] < 1.96 * self.track.sigma[np.isfinite(off), 0]))


def film(seed: int = 0, model: Model | None = None, drive: Recording | None = None,
         scene: Scene = SCENE) -> Filmed:
    """Simulate, render, track and identify.

    Args:
        seed: Of the camera's noise.
        model: Eq. (6) at the study's true values if None.
        drive: Inputs at the camera's times; the paper's two pulses if None.
        scene: What is rendered.

    Raises:
        BadSetting: If OpenCV is not installed.
    """
    drive = excitation.two_pulse(SECONDS, 1 / RATE) if drive is None else drive
    truth = simulate(slosh.model() if model is None else model, drive)
    wanted = [int(np.argmin(np.abs(truth["theta"].time - t))) for t in SHOWN]
    stills: list[Still] = []

    def watch(frame: Frame, found: Edges, surface: Surface) -> None:
        if frame.number in wanted:
            stills.append(Still(frame, found, surface))

    with tempfile.TemporaryDirectory() as folder:
        video = write(Path(folder) / "clip.avi", truth["theta"].values, scene, RATE,
                      quality=QUALITY, seed=seed)
        seen = track(video, watch=watch)
    recording = with_motion(seen.recording().without(*UNUSED), truth.without("theta"))
    try:
        fitted = NLS().fit(slosh.model().with_values(slosh.START), recording)
    except errors.PikanidError as problem:
        return Filmed(truth, seen, recording, tuple(stills), None, str(problem))
    return Filmed(truth, seen, recording, tuple(stills), fitted)
