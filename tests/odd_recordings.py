"""Recordings that nobody should make, and everybody has: made up from a seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import pikanid as pk
from pikanid.recording import Recording

WAYS = ("very short", "output at rest", "output constant", "gaps", "huge units", "small units",
        "huge sigma", "tiny sigma", "output twice", "input constant", "no noise", "quantised",
        "input twice", "spikes", "uneven times", "short gap at the start", "loud")


def odd(seed: int) -> tuple[Recording, Recording | None, tuple[str, ...]]:
    """A recording to explain, one held out (or none) of another rate, and what is odd about them.

    Args:
        seed: Of everything.
    """
    rng = np.random.default_rng(seed)
    truth = pk.systems.sloshing()
    if rng.random() < 0.6:
        truth = truth.with_term("theta_dot", "-k3*theta**3", [pk.Parameter("k3", 200.0)])
    ways = _some(rng, int(rng.integers(1, 4)))
    n, rate = int(rng.integers(60, 240)), float(rng.choice([50.0, 100.0]))
    train = _recorded(truth, n, rate, ways, rng)
    if rng.random() < 0.3:
        return train, None, ways
    other = ways if rng.random() < 0.5 else _some(rng, 1)
    later = _recorded(truth, int(rng.integers(4, 200)), float(rng.choice([20.0, 100.0, 125.0])),
                      other, rng)
    return train, later, (*ways, "held out", *other)


def _some(rng: np.random.Generator, count: int) -> tuple[str, ...]:
    return tuple(sorted({WAYS[k] for k in rng.integers(0, len(WAYS), count)}))


def _recorded(truth: pk.Model, n: int, rate: float, ways: tuple[str, ...],
              rng: np.random.Generator) -> Recording:
    if "very short" in ways:
        n = int(rng.integers(2, 30))
    span = max(n / rate, 3.0)
    moves = pk.excitation.planar_moves(max(int(span / 2), 1), span, dt=1 / rate,
                                       seed=int(rng.integers(1e6)))
    if "input constant" in ways:
        moves = moves.with_channels(*(replace(moves[u], values=np.zeros_like(moves[u].values) + (
            0.3 if "loud" in ways else 0.0)) for u in moves.names))
    sigma = 0.0 if "no noise" in ways else 0.3 if "loud" in ways else 0.002
    found = pk.simulate(truth, moves, sigma=sigma, seed=int(rng.integers(1e6)))
    found = found.window(found.start, found.start + (n - 0.5) / rate)
    c = found["theta"]
    y, t = c.values.copy(), c.time
    if "output at rest" in ways:
        y = 0.002 * rng.standard_normal(len(y))
    if "output constant" in ways:
        y[len(y) // 3:] = y[len(y) // 3]
    if "quantised" in ways:
        y = np.round(y / 0.01) * 0.01
    if "spikes" in ways:
        y[rng.integers(0, len(y), 3)] += 5.0
    if "gaps" in ways:
        y[rng.random(len(y)) < 0.4] = np.nan
    if "short gap at the start" in ways:
        y[:3] = np.nan
    for way, factor in (("huge units", 1e9), ("small units", 1e-12)):
        y = y * factor if way in ways else y
    if "output twice" in ways:
        y = np.repeat(y[::2], 2)[:len(y)]
    level = {"huge sigma": 1e6, "tiny sigma": 1e-12}
    given = next((level[w] for w in ways if w in level), c.sigma)
    changed = [replace(c, values=y, sigma=given)]
    if "input twice" in ways:
        changed.append(replace(found["u_x"], name="u_x_again"))
    found = found.with_channels(*changed)
    if "uneven times" in ways:
        keep = np.sort(rng.choice(len(t), max(len(t) * 2 // 3, 2), replace=False))
        found = found.with_channels(replace(found["theta"], time=t[keep],
                                            values=found["theta"].values[keep]))
    return found
