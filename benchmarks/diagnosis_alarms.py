"""False alarms: p-values of diagnoses of clean recordings, in white and in coloured noise.

The rig is Eq. (6) at random length and damping, moved at random for 18 s after 2 s of rest; noise
is white, or AR(1) with ρ = 0.5 between neighbouring samples, σ = 0.1°.  Nothing is missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import pikanid as pk
from pikanid.validation.concealed.score import Share

SIGMA = 0.1 * math.pi / 180
CORRELATIONS = {"white": 0.0, "AR(1), ρ = 0.5": 0.5}
LEVELS = (0.01, 0.05, 0.1)
REST, MOVES, DURATION = 2.0, 9, 20.0


def recordings(rho: float, seed: int) -> tuple[pk.Recording, pk.Recording]:
    """Two runs of one rig, without a σ: the diagnosis finds the noise out itself."""
    rng = np.random.default_rng([seed, int(100 * rho)])
    truth = pk.systems.sloshing().with_values(
        l_theta=0.045 * rng.uniform(0.8, 1.25), d_theta=0.15 * rng.uniform(0.7, 1.5))
    return tuple(_run(truth, rho, rng) for _ in range(2))


def _run(truth: pk.Model, rho: float, rng: np.random.Generator) -> pk.Recording:
    moves = pk.excitation.planar_moves(MOVES, DURATION - REST, seed=int(rng.integers(2**31)))
    rest = np.zeros(round(REST / 0.01))
    t = 0.01 * np.arange(len(moves.t) + len(rest))
    drive = pk.Recording.from_arrays(
        t, {"u_x": np.concatenate([rest, moves["u_x"].values])}, {"u_x": "m/s^2"},
        hold={"u_x": "zero"})
    clean = pk.simulate(truth, drive)
    white = rng.standard_normal(len(t))
    noise = white.copy()
    for k in range(1, len(t)):
        noise[k] = rho * noise[k - 1] + math.sqrt(1 - rho**2) * white[k]
    return pk.Recording.from_arrays(
        t, {"u_x": drive["u_x"].values, "theta": clean["theta"].values + SIGMA * noise},
        {"u_x": "m/s^2", "theta": "rad"}, hold={"u_x": "zero"})


def p_value(job: tuple[float, int]) -> float:
    """Of the diagnosis of one clean rig."""
    train, other = recordings(*job)
    return pk.diagnose(pk.systems.sloshing(), train, other, workers=1).p_value


def p_values(rho: float, count: int, store: Path, workers: int) -> Iterator[float]:
    """Of seeds 0, 1, ...; those known from an earlier run are read from the store."""
    store.mkdir(parents=True, exist_ok=True)
    kept = store / f"alarms_{rho:g}.jsonl"
    known = {row[0]: row[1] for row in map(json.loads, kept.read_text().splitlines())} if (
        kept.exists()) else {}
    missing = [seed for seed in range(count) if seed not in known]
    with ProcessPoolExecutor(workers) as pool, kept.open("a") as file:
        for seed, p in zip(missing, pool.map(p_value, [(rho, s) for s in missing]), strict=True):
            known[seed] = p
            file.write(json.dumps([seed, p]) + "\n")
            file.flush()
    yield from (known[seed] for seed in range(count))


def section(count: int, store: Path, workers: int) -> str:
    """The table: alarms at several α, of each kind of noise."""
    lines = [f"\n## False alarms, {count} clean recordings of each kind of noise\n",
             "20 s at 100 Hz, the first 2 s at rest, σ = 0.1° not told to the diagnosis; seeds "
             f"0 to {count - 1}. Shares of p-values below α, with Wilson's 95 % interval.\n",
             "| noise | " + " | ".join(f"α = {a:g}" for a in LEVELS) + " |",
             "| --- |" + " --- |" * len(LEVELS)]
    for name, rho in CORRELATIONS.items():
        p = np.array(list(p_values(rho, count, store, workers)))
        lines.append(f"| {name} | " + " | ".join(
            str(Share(int(np.sum(p < a)), count)) for a in LEVELS) + " |")
    return "\n".join(lines) + "\n"
