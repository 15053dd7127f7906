"""Rendered clips whose truth is known, tracked under good and bad conditions."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pikanid.tracking import from_corners, track
from pikanid.tracking.render import Cover, Glare, Scene, Splash, write
from pikanid.tracking.tracked import Track

FRAMES = 300  # of each clip
WIDTH = 0.066  # [m] of the tank, as in the paper
NORMAL, BAD = 0.1, 0.3  # degrees of RMSE that may be


@dataclass(frozen=True)
class Condition:
    """What is unlike a plain clip, how it is compressed, and whether it counts as bad."""

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    codec: str = "mjpg"
    quality: float = 95.0
    bad: bool = False
    straightened: bool = False


GLARE = (Glare(300, 240),)
CABLE = (Cover((250, 0), (330, 480), 5.0, 60, 240),)
HAND = (Cover((40, 200), (-80, 420), 45.0, 80, 200, (3.0, 0.0)),)  # goes by from left to right
SPLASHES = (Splash(300, 260, 70, 120), Splash(390, 250, 180, 230, drops=60, radius=12.0, seed=1))
CONDITIONS = (
    Condition("plain"),
    Condition("lossless", codec="ffv1"),
    Condition("no noise but rounding", {"noise": 0.5}),
    Condition("noise 8", {"noise": 8.0}),
    Condition("noise 20", {"noise": 20.0}, bad=True),
    Condition("blur 2 px", {"blur": 2.0}),
    Condition("blur 4 px", {"blur": 4.0}, bad=True),
    Condition("light falls by half to one side", {"light": (0.33, 0.0)}),
    Condition("light falls by half downwards", {"light": (0.0, -0.33)}),
    Condition("red dye", {"dye": (190.0, 50.0, 45.0)}),
    Condition("green dye", {"dye": (70.0, 150.0, 60.0)}),
    Condition("pale red dye", {"dye": (215.0, 150.0, 145.0)}, bad=True),
    Condition("black dye, region given", {"dye": (45.0, 45.0, 48.0)}),
    Condition("glare on the surface", {"glare": GLARE}, bad=True),
    Condition("meniscus", {"meniscus": (5.0, 7.0)}),
    Condition("camera turned by 9° and 6°", {"yaw": 0.15, "pitch": 0.1}, straightened=True),
    Condition("small: 160 px of tank", {"size": (240, 320), "tank": (80, 20, 160, 195)}),
    Condition("quality 60", quality=60.0),
    Condition("quality 25", quality=25.0, bad=True),
    Condition("MPEG-4, few bits", codec="mp4v", bad=True),
    Condition("a cable before the tank", {"covers": CABLE}, bad=True),
    Condition("a hand passes", {"covers": HAND}, bad=True),
    Condition("a hand as pale as the air", {"covers": (replace(HAND[0], colour=Scene().air),)},
              bad=True),
    Condition("a hand in a glove of the dye's colour", {
        "covers": (replace(HAND[0], colour=Scene().dye),)}, bad=True),
    Condition("splashes", {"splashes": SPLASHES}, bad=True),
    Condition("all at once", {"noise": 10.0, "blur": 2.0, "light": (0.25, 0.2), "glare": GLARE,
                              "meniscus": (4.0, 7.0)}, quality=60.0, bad=True))


@dataclass(frozen=True)
class Score:
    """How well one clip was tracked, in degrees; shares are of all its frames, `blind`
    of those alone that nothing covers or splashes."""

    condition: Condition
    rmse: float
    worst: float
    inside: float
    half_width: float
    failed: float
    wrong: float
    alike: float
    speed: float
    blind: float


def swing(frames: int = FRAMES, rate: float = 100.0) -> np.ndarray:
    """Angles [rad] that go through all from -25° to 25° and come to rest."""
    t = np.arange(frames) / rate
    return np.radians(25) * np.sin(2 * np.pi * 2.35 * t) * np.interp(
        t, [0, t[-1] / 2, t[-1]], [1, 1, 0.02])


def tracked(condition: Condition, seed: int = 0) -> tuple[np.ndarray, Track, float]:
    """Truth, what was found, and frames per second of CPU time."""
    scene = replace(Scene(), **condition.changes)
    truth = swing()
    ending = {"mjpg": "avi", "ffv1": "avi", "mp4v": "mp4"}[condition.codec]
    geometry = region = None
    if condition.straightened:
        height = WIDTH * scene.tank[3] / scene.tank[2]
        geometry = from_corners(scene.corners, WIDTH, height, scene.size)
    if "region given" in condition.name:
        from pikanid.tracking import Region

        left, top, width, height = scene.tank
        region = Region(left + 5, top + 5, width - 10, height - 10)
    with tempfile.TemporaryDirectory() as folder:
        clip = write(Path(folder) / f"clip.{ending}", truth, scene, codec=condition.codec,
                     quality=condition.quality, seed=seed)
        begun = time.process_time()
        found = track(clip, geometry=geometry, region=region)
        spent = time.process_time() - begun
    return truth, found, len(truth) / spent


def score(condition: Condition, seed: int = 0) -> Score:
    """One clip, rendered and tracked."""
    truth, found, speed = tracked(condition, seed)
    off = np.degrees(found.theta - truth)
    sigma = np.degrees(found.sigma[:, 0])
    there = np.isfinite(off)
    left = off[there]
    alone = np.ones(len(truth), bool)
    for thing in (*condition.changes.get("covers", ()), *condition.changes.get("splashes", ())):
        alone[thing.first:thing.last + 1] = False
    return Score(
        condition, float(np.sqrt(np.mean(left**2))), float(np.max(np.abs(left))),
        float(np.mean(np.abs(left) < 1.96 * sigma[there])), 1.96 * float(np.median(sigma[there])),
        float(np.mean(~there)), float(np.mean(np.abs(left) > 1)),
        float(np.corrcoef(left[1:], left[:-1])[0, 1]), speed, float(np.mean(~there[alone])))
