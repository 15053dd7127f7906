"""From simulation to video and back: do standard errors hold, is hidden physics named?"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import pikanid as pk
from pikanid.model import Parameter
from pikanid.tracking.render import Scene
from pikanid.validation.study import clip, slosh

CLIPS = 20
DYES = ((40.0, 80.0, 175.0), (180.0, 50.0, 45.0), (60.0, 140.0, 70.0))
RATE = 100.0
SECONDS = 8.0
# id in the catalogue -> the truth that hides it
HIDDEN = {
    "quadratic_drag": lambda m: m.with_term("theta_dot", "-c*abs(theta_dot)*theta_dot",
                                            [Parameter("c", 0.6, "", (0.0, 10.0))]),
    "coulomb_friction": lambda m: m.with_term("theta_dot", "-f*tanh(theta_dot/0.01)",
                                          [Parameter("f", 0.5, "rad/s^2", (0.0, 10.0))]),
}


@dataclass(frozen=True)
class Errors:
    """(estimate - truth) / standard error of l and d, how well frames were tracked, the verdict."""

    seed: int
    z: tuple[float, float]
    rmse: float
    inside: float
    explained: bool


def scene(seed: int) -> Scene:
    """A rig that was set up anew: place and level, light, dye, focus, noise of a fast camera."""
    rng = np.random.default_rng(seed)
    left, top, width, height = clip.SCENE.tank
    right, down = rng.uniform(-0.2, 0.2, 2)
    return replace(
        clip.SCENE, noise=8.0, blur=float(rng.uniform(0.6, 1.2)), light=(float(right), float(down)),
        tank=(left + int(rng.integers(-9, 10)), top, width + int(rng.integers(-9, 10)), height),
        level=float(rng.uniform(0.45, 0.55)), dye=DYES[seed % len(DYES)])


def chained_clip(seed: int) -> Errors:
    """The clip of one rig, tracked and fitted."""
    found = clip.film(seed, scene=scene(seed))
    assert found.estimate is not None, found.reason
    e = found.estimate
    z = [(e.value(n) - true) / e.std(n) for n, true in slosh.TRUE.items()]
    return Errors(seed, (z[0], z[1]), found.rmse, found.inside, e.adequacy.verdict == "fits")


def diagnosed(effect: str) -> str:
    """A video of physics that Eq. (6) lacks, and another one to prove it on: what a diagnosis says.
    """
    truth = HIDDEN[effect](slosh.model())
    runs = []
    for seed in (1, 2):
        drive = pk.excitation.planar_moves(3, SECONDS, 1 / RATE, seed=seed)
        runs.append(clip.film(seed, truth, drive.without(
            *(n for n in drive.names if n != "u_x")), scene(seed)).recording)
    return str(pk.diagnose(pk.systems.sloshing(), runs[0], runs[1]))
