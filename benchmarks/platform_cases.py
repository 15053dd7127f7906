"""The recordings of `platforms`, and their diagnoses under whatever this process was started with.

    python benchmarks/platform_cases.py FOLDER ANSWERS.json THREADS CASE ...
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import pikanid as pk
from pikanid.recording import datasets

SIGMA = 0.1 * math.pi / 180
DURATION, DT, REST = 12.0, 0.01, 2.0
# Laws that sloshing leaves out, with a size at which each is plain to see.
LAWS = {
    "dry": ("-dry*sign(theta_dot)", 0.6), "drag": ("-drag*abs(theta_dot)*theta_dot", 0.6),
    "cubic": ("-cubic*theta**3", 150.0), "wet": ("-wet*theta**2*theta_dot", 20.0),
    "tilt": ("tilt", 0.5), "square": ("-square*theta**2", 20.0),
}
MIXES: tuple[tuple[str, ...], ...] = (
    (), ("dry",), ("drag",), ("cubic",), ("wet",), ("tilt",), ("square",), ("dry", "cubic"),
    (), ("drag", "tilt"), ("cubic", "wet"), ("dry",), ("drag",), ("cubic",), ("dry", "drag"), ())
SIMULATED = {f"{seed:02d} {' + '.join(mix) or 'nothing'}": (seed, mix)
             for seed, mix in enumerate(MIXES)}
BALLS = ("Baseball", "Golf Ball", "Orange Whiffle Ball")
REAL = ("single pendulum", *BALLS)
CASES = (*SIMULATED, *REAL)
SHORT = (CASES[1], CASES[8], CASES[9], "Golf Ball")

FALL = {
    "name": "free fall",
    "states": {"h": {"unit": "m", "initial": "free"}, "v": {"unit": "m/s", "initial": "free"}},
    "parameters": {"g": {"unit": "m/s^2", "value": 9.81}},
    "equations": {"h": "v", "v": "-g"},
    "outputs": {"h": {"unit": "m", "expression": "h"}}}


def make(folder: Path, cases: Sequence[str]) -> None:
    """Write the simulated recordings, for all settings to read the same numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    for case in cases:
        if case in SIMULATED:
            for recording, path in zip(simulated(*SIMULATED[case]), _files(folder, case),
                                       strict=True):
                recording.write(path)


def simulated(seed: int, mix: Sequence[str]) -> tuple[pk.Recording, pk.Recording]:
    """Two runs of one rig at random length and damping: hidden laws between hardly seen and plain.
    """
    rng = np.random.default_rng(seed)
    model = pk.systems.sloshing().with_values(
        l_theta=0.045 * rng.uniform(0.8, 1.25), d_theta=0.15 * rng.uniform(0.7, 1.5))
    for name in mix:
        text, plain = LAWS[name]
        size = plain * 10 ** rng.uniform(-1.0, 0.0)
        model = model.with_term("theta_dot", text, [pk.Parameter(name, size)])
    return tuple(_moved(model, rng) for _ in range(2))  # type: ignore[return-value]  # two


def _moved(model: pk.Model, rng: np.random.Generator) -> pk.Recording:
    moves = pk.excitation.planar_moves(6, DURATION - REST, seed=int(rng.integers(2**31)))
    still = np.zeros(round(REST / DT))
    u = np.concatenate([still, moves["u_x"].values])
    drive = pk.Recording.from_arrays(DT * np.arange(len(u)), {"u_x": u}, {"u_x": "m/s^2"},
                                     hold={"u_x": "zero"})
    return pk.simulate(model, drive, sigma=SIGMA, seed=int(rng.integers(2**31)))


def answered(folder: Path, case: str, threads: int) -> dict[str, object]:
    """The diagnosis of one case, as in diagnosis.json."""
    if case in SIMULATED:
        model, runs = pk.systems.sloshing(), tuple(map(pk.Recording.read, _files(folder, case)))
    elif case in BALLS:
        model = pk.Model.from_dict(FALL)
        runs = tuple(datasets.falling_balls_excerpt(case, drop) for drop in (1, 2))
    else:
        model = pk.systems.pendulum()
        runs = tuple(datasets.single_pendulum_excerpt(part) for part in ("train", "held_out"))
    return pk.diagnose(model, runs[0], runs[1], workers=threads).to_dict()


def _files(folder: Path, case: str) -> tuple[Path, Path]:
    stem = case.replace(" ", "_")
    return folder / f"{stem}_train.csv", folder / f"{stem}_held_out.csv"


if __name__ == "__main__":
    place, target, count = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    target.write_text(json.dumps({case: answered(place, case, count) for case in sys.argv[4:]}))
