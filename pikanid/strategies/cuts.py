"""Recordings cut into segments, and the model that begins anew in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pikanid.estimate.data import Trajectory
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.problem.problem import Experiment, Problem
from pikanid.recording import Channel, Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.growth import most_segments, used_after_start
from pikanid.strategies.nodes import state_near

NODE = "_node"  # definition: ends the name of a state at the beginning of a segment
LEAD = 1.0  # numerical: logarithm of how much errors grow before a segment's first sample
STEPS = 12  # numerical: back over that, for a guess


def free_start(model: Model) -> Model:
    """With a free initial state; parameters that only the initial state needs are not estimated."""
    needed = used_after_start(model)
    nodes = [Parameter(f"{s.name}{NODE}", 0.0, s.unit, free=True, scope="recording")
             for s in model.states]
    fixed = model.replace(parameters=tuple(
        p if p.name in needed else replace(p, free=False) for p in model.parameters))
    return fixed.with_parameters(*nodes).replace(states=tuple(
        replace(s, initial=symbol(f"{s.name}{NODE}")) for s in model.states))


def counts_for(problem: Problem, grown: Sequence[float], most: float) -> tuple[int, ...]:
    """In how many segments each recording is cut for errors to grow by about e^most in each."""
    states = len(problem.model.states)
    return tuple(min(int(np.ceil(max(logarithm / most, 1))), most_segments(e, states))
                 for logarithm, e in zip(grown, problem.experiments, strict=True))


def in_segments(problem: Problem, counts: Sequence[int], grown: Sequence[float],
                motions: Sequence[Trajectory] | None = None) -> tuple[list[Recording], list[int]]:
    """Recordings cut into segments, for the model of `free_start`, and of which each segment is.

    Recorded inputs, and with them a simulation, begin before a segment's first sample, as long as
    errors take to grow by e: what delays and lags show there is known.

    Args:
        problem: As it was given.
        counts: In about how many each recording is cut.
        grown: Logarithm of how much errors grow along it.
        motions: By which initial states begin; none: as samples tell.
    """
    pieces: list[Recording] = []
    owners: list[int] = []
    for r, (recording, e, count, logarithm) in enumerate(zip(
            problem.recordings, problem.experiments, counts, grown, strict=True)):
        driven = any(n in recording for n in problem.model.input_names)
        lead = LEAD * (e.t1 - e.t0) / logarithm if driven and logarithm else 0.0
        t = max((recording[e.model.outputs[s.output].name].time for s in e.samples), key=len)
        edges = _edges(t, e, count)
        lows = np.array([low for low, _, _ in edges])
        starts = np.where(lows > e.t0, np.maximum(t[np.searchsorted(t, lows - lead)], e.t0), e.t0)
        x = np.array([state_near(problem.model, e, low)[0] for low in lows]) if motions is None \
            else np.column_stack([np.interp(lows, motions[r].t, c) for c in motions[r].x.T])
        first = _before(problem, r, lows, x, starts)
        for (low, high, last), start, begins in zip(edges, starts.tolist(), first, strict=True):
            piece = recording.with_channels(*(
                _input_cut(c, start, high, problem.model) if c.name in problem.model.input_names
                else _cut(c, low, high, last) for c in recording.channels.values()))
            pieces.append(replace(piece, begins={
                f"{s.name}{NODE}": float(v)
                for s, v in zip(problem.model.states, begins, strict=True)}))
            owners.append(r)
    return pieces, owners


def _before(problem: Problem, r: int, t: np.ndarray, x: np.ndarray, start: np.ndarray
            ) -> np.ndarray:
    """States (M, n) at times `start` (M,) of motions in recording r that are at x (M, n) at times t
    (M,): a first guess, by Runge and Kutta's method.
    """
    field, e = VectorField(problem.model), problem.experiments[r]
    p, h = problem.parameters(problem.guess, r), (start - t)[:, None] / STEPS
    back = x

    def rate(t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return field.rhs(t, x, u, p)

    with np.errstate(all="ignore"):
        for k in range(STEPS):
            now, half, then = (t + (k + share) * h[:, 0] for share in (0.0, 0.5, 1.0))
            u = e.inputs(half)
            k1 = rate(now, back, u)
            k2 = rate(half, back + h / 2 * k1, u)
            k3 = rate(half, back + h / 2 * k2, u)
            back = back + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(then, back + h * k3, u))
    return np.where(np.isfinite(back).all(axis=1)[:, None], back, x)


def _edges(t: np.ndarray, e: Experiment, count: int) -> list[tuple[float, float, bool]]:
    """From when to when segments last, about so many, and whether it is the last one: from sample
    to sample, at times t (N,), and as long as it takes for every output to be seen to move.
    """
    end = max(float(s.t[-1]) for s in e.samples)
    inner = t[np.linspace(0, len(t), count + 1).astype(int)[1:-1]]
    edges = [e.t0, *inner[(inner > e.t0) & (inner < end)].tolist()]
    found, low = [], e.t0
    for high in [*edges[1:], end]:
        seen = [s.y[(s.t >= low) & ((s.t < high) | (high == end))] for s in e.samples]
        if all(len(y) > 1 and np.ptp(y) > 0 for y in seen):
            found.append((low, high, high == end))
            low = high
    if low < end and found:
        found[-1] = (found[-1][0], end, True)
    return found or [(e.t0, end, True)]


def _cut(c: Channel, low: float, high: float, last: bool) -> Channel:
    inside = (c.time >= low) & ((c.time < high) | (last & (c.time <= high)))
    sigma = c.sigma
    return replace(c, time=c.time[inside], values=c.values[inside], sigma=np.asarray(
        sigma)[inside] if isinstance(sigma, np.ndarray) and sigma.ndim else sigma)


def _input_cut(c: Channel, low: float, high: float, model: Model) -> Channel:
    """An input has values at both ends."""
    inside = (c.time > low) & (c.time < high)
    if (c.hold or model.input(c.name).hold) == "zero":
        k = np.searchsorted(c.time, [low, high], "right") - 1
        ends = c.values[np.maximum(k, 0)]
    else:
        ends = np.interp([low, high], c.time, c.values)
    return replace(c, time=np.concatenate([[low], c.time[inside], [high]]), sigma=None,
                   values=np.concatenate([ends[:1], c.values[inside], ends[1:]]))
