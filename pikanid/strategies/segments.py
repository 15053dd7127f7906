"""Plants that are unstable: a recording is followed in segments, each from a start of its own.

Along an unstable motion, as of a ball in a magnetic field that a controller holds there, errors
grow until no simulation from one start follows the recording, however right the parameters are.
Over a short segment they grow a little only (H. G. Bock, Randwertproblemmethoden zur
Parameteridentifizierung, 1987, sec. 3; L. Ljung, System Identification, 1999, sec. 3.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.problem.problem import Experiment, Problem
from pikanid.recording import Channel, Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.nodes import state_near

NODE = "_node"  # definition: ends the name of a state at the beginning of a segment
HOPELESS = 25.0  # limit: logarithm of how much errors grow over what is followed in one go
GROWN = (2.0, 4.0, 8.0)  # numerical: logarithms of how much they do in a segment, one after another
GROSS = 10.0  # limit: times what shorter segments leave, as which longer ones have lost their way
PLACES = 60  # numerical: of a recording at which its rates are looked at first
FINER = 4.0  # numerical: places for each time that errors grow by e
LEAST = 8  # limit: samples of an output in a segment, for each state


def growth(problem: Problem, theta: np.ndarray) -> tuple[float, ...]:
    """Logarithm of how much errors grow along each recording's motion at parameters θ (n_free,):
    of the largest singular value of the product of its transition matrices.

    The motion is read off the samples, so it is known however wrong the parameters are.  Zero where
    it grows by less than e^25, and where outputs do not show all states, or whose rates they are.
    """
    field = VectorField(problem.model)
    return tuple(_growth(field, e, problem.parameters(theta, r))
                 for r, e in enumerate(problem.experiments))


def _growth(field: VectorField, e: Experiment, p: np.ndarray) -> float:
    count = PLACES
    while True:
        t = e.t0 + (e.t1 - e.t0) * (np.arange(count) + 0.5) / count
        nodes = [state_near(field.model, e, at, p) for at in t]
        if not all(told.all() for _, told in nodes):
            return 0.0
        x = np.stack([found for found, _ in nodes])
        with np.errstate(all="ignore"):
            A = field.rhs_jacobians(t, x, e.inputs(t), p)[0]
        A = A[np.all(np.isfinite(A), axis=(1, 2))]
        if not len(A):
            return 0.0
        frozen = float(np.mean(np.maximum(np.linalg.eigvals(A).real.max(axis=1), 0.0)))
        most = frozen * (e.t1 - e.t0)
        if most <= HOPELESS:
            return 0.0
        if count >= FINER * most or count > PLACES:
            break
        count = int(min(np.ceil(FINER * most), max(len(s.t) for s in e.samples)))
    sizes = np.maximum(np.abs(x).max(axis=0), 1e-300)
    total, product = 0.0, np.eye(len(sizes))
    for a in A * sizes[None, None, :] / sizes[None, :, None]:
        product = expm(a * (e.t1 - e.t0) / len(A)) @ product
        size = float(np.linalg.norm(product, 2))
        total, product = total + float(np.log(size)), product / size
    return total if total > HOPELESS else 0.0


def fit_in_segments(problem: Problem, grown: Sequence[float], fit: Callable[[Problem], Estimate]
                    ) -> Estimate:
    """An estimate of shared parameters from segments, first short, then longer ones: these tell
    more, and follow only from a start that is close.

    Args:
        problem: As it was given.
        grown: Logarithm of how much errors grow along each recording.
        fit: Makes an estimate, from a problem's guess on.
    """
    found: Estimate | None = None
    owners: list[int] = []
    for most in GROWN:
        model, motions = free_start(problem.model), None
        if found is not None:
            motions = _of_recordings(found, owners)[1]
            model = model.with_values({f.name: float(v) for f, v in zip(
                found.free, found.theta, strict=True) if f.recording is None})
        pieces, own = in_segments(problem, grown, most, motions)
        longer = fit(Problem(model, pieces))
        if found and not (longer.converged and longer.cost < GROSS**2 * found.cost):
            break
        found, owners = longer, own
        if not found.converged:
            break
    assert found is not None
    return _joined(found, problem, owners, grown)


def in_segments(problem: Problem, grown: Sequence[float], most: float,
                motions: Sequence[Trajectory] | None = None) -> tuple[list[Recording], list[int]]:
    """Recordings cut into segments in which errors grow by e^most, for the model of `free_start`,
    and the recording that each is of.  Their initial states begin as samples tell, or motions.
    """
    pieces: list[Recording] = []
    owners: list[int] = []
    for r, (recording, e, logarithm) in enumerate(zip(
            problem.recordings, problem.experiments, grown, strict=True)):
        states = problem.model.states
        count = max(min(len(s.t) for s in e.samples) // (LEAST * len(states)), 1)
        edges = np.linspace(e.t0, e.t1, min(int(np.ceil(max(logarithm / most, 1))), count) + 1)
        for low, high in pairwise(edges.tolist()):
            x = (state_near(problem.model, e, low)[0] if motions is None else
                 [np.interp(low, motions[r].t, column) for column in motions[r].x.T])
            piece = recording.with_channels(*(
                _cut(c, low, high, high == edges[-1], problem.model) for c in
                recording.channels.values()))
            pieces.append(replace(piece, begins={
                f"{s.name}{NODE}": float(v) for s, v in zip(states, x, strict=True)}))
            owners.append(r)
    return pieces, owners


def _cut(c: Channel, low: float, high: float, last: bool, model: Model) -> Channel:
    """A channel from one instant to another; an input has a value at the first one, and one at the
    second where it runs on to it.
    """
    sigma = None if c.sigma is None or np.ndim(c.sigma) == 0 else np.asarray(c.sigma)
    if c.name not in model.input_names:
        inside = (c.time >= low) & ((c.time < high) | last)
        return replace(c, time=c.time[inside], values=c.values[inside],
                       sigma=c.sigma if sigma is None else sigma[inside])
    k, stop = max(int(np.searchsorted(c.time, low, "right")) - 1, 0), int(
        np.searchsorted(c.time, high, "right"))
    t, values = c.time[k:stop].copy(), c.values[k:stop].copy()
    if t[0] < low:
        if (c.hold or model.input(c.name).hold) != "zero":
            values[0] = np.interp(low, c.time, c.values)
        t[0] = low
    if t[-1] < high and (c.hold or model.input(c.name).hold) != "zero":
        t, values = np.append(t, high), np.append(values, np.interp(high, c.time, c.values))
    return replace(c, time=t, values=values, sigma=None)


def free_start(model: Model) -> Model:
    """With a free initial state; parameters that only the initial state needs are not estimated."""
    needed = {q.name for formulas in (model.equations.values(),
                                      [o.expression for o in model.outputs])
              for f in formulas for q in f.free_symbols}
    nodes = [Parameter(f"{s.name}{NODE}", 0.0, s.unit, free=True, scope="recording")
             for s in model.states]
    fixed = model.replace(parameters=tuple(
        p if p.name in needed else replace(p, free=False) for p in model.parameters))
    return fixed.with_parameters(*nodes).replace(states=tuple(
        replace(s, initial=symbol(f"{s.name}{NODE}")) for s in model.states))


def _joined(found: Estimate, problem: Problem, owners: Sequence[int], grown: Sequence[float]
           ) -> Estimate:
    """What was found in segments as an estimate of the problem as it was given: of its own
    parameters, with one fit and one trajectory for each of its recordings.

    Args:
        found: Of the problem in segments.
        problem: As it was given.
        owners: The recording that each segment is of.
        grown: Logarithm of how much errors grow along each recording.
    """
    starts = {s.initial.name: f"{s.name}{NODE}" for s in problem.model.states
              if s.initial.is_Symbol}
    at = {(f.name, f.recording): k for k, f in enumerate(found.free)}
    free, own = [], []
    for f in problem.free:
        k = at.get((f.name, None), at.get((starts.get(f.name, ""), owners.index(f.recording or 0))))
        if k is not None:
            free.append(f)
            own.append(k)
    said = (f"The plant is unstable: errors grow by e^{max(grown):.0f} along the recording, which "
            f"no simulation from one start follows. It is followed in {len(owners)} segments, each "
            "from a start of its own, and judged there; predict and validate with a horizon.")
    fits, trajectories = _of_recordings(found, owners)
    return replace(
        found, model=problem.model, free=tuple(free), theta=found.theta[own],
        covariance=found.covariance[np.ix_(own, own)], fits=fits, trajectories=trajectories,
        cost=total_cost(fits), settings={**found.settings, "segments": len(owners)},
        warnings=(said, *(w for w in dict.fromkeys(found.warnings) if NODE not in w)))


def _of_recordings(found: Estimate, owners: Sequence[int]
                   ) -> tuple[tuple[Fit, ...], tuple[Trajectory, ...]]:
    outputs = found.model.outputs
    fits, trajectories = [], []
    for owner in dict.fromkeys(owners):
        mine = [k for k, o in enumerate(owners) if o == owner]
        pieces = [found.trajectories[k] for k in mine]
        trajectories.append(Trajectory(np.concatenate([p.t for p in pieces]),
                                       np.concatenate([p.x for p in pieces])))
        for j in range(len(outputs)):
            some = [found.fits[k * len(outputs) + j] for k in mine]
            fits.append(replace(
                some[0], t=np.concatenate([f.t for f in some]),
                measured=np.concatenate([f.measured for f in some]),
                fitted=np.concatenate([f.fitted for f in some]),
                sigma=_together([f.sigma for f in some]),
                spread=_together([f.spread for f in some])))
    return tuple(fits), tuple(trajectories)


def _together(parts: Sequence[np.ndarray | None]) -> np.ndarray | None:
    known = [p for p in parts if p is not None]
    return np.concatenate(known) if len(known) == len(parts) else None
