"""Plants that are unstable: a recording is followed in segments, each from a start of its own.

Along an unstable motion, as of a ball in a magnetic field that a controller holds there, errors
grow until no simulation from one start follows the recording, however right the parameters are.
Over a short segment they grow a little only (H. G. Bock, Randwertproblemmethoden zur
Parameteridentifizierung, 1987, sec. 3; L. Ljung, System Identification, 1999, sec. 3.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import expm

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.model.parts import Parameter
from pikanid.pieces.sentences import enumerated
from pikanid.problem.problem import Experiment, Problem
from pikanid.recording import Channel, Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.nodes import state_near

NODE = "_node"  # definition: ends the name of a state at the beginning of a segment
HOPELESS = 25.0  # limit: logarithm of how much errors grow over what is followed in one go
GROWN = (1.0, 2.0, 4.0, 8.0)  # numerical: logarithms of how much they do in a segment, in turn
GROSS = 10.0  # limit: times what shorter segments leave, as which longer ones have lost their way
PLACES = 60  # numerical: of a recording at which its rates are looked at first
FINER = 4.0  # numerical: places for each time that errors grow by e
LEAST = 4  # limit: samples of an output in a segment, for each state


def growth(problem: Problem, theta: np.ndarray) -> tuple[float, ...]:
    """Logarithm of how much errors grow along each recording's motion: of the largest singular
    value of the product of its transition matrices, which parameters θ (n_free,) give.

    The motion is read off the samples, so that no simulation need follow it.  Zero where errors
    grow by less than e^25, where outputs show neither a state nor what it is the rate of, and where
    recordings cannot be cut into segments.
    """
    if not _can_be_cut(problem.model):
        return (0.0,) * len(problem.experiments)
    field = VectorField(problem.model)
    return tuple(_growth(field, e, problem.parameters(theta, r))
                 for r, e in enumerate(problem.experiments))


def _can_be_cut(model: Model) -> bool:
    """Whether a segment needs no past of its inputs, and no parameter of a recording's own but an
    initial state: each would be estimated for every segment.
    """
    first = {q.name for s in model.states for q in s.initial.free_symbols} & {*model.free_names}
    own = {p.name for p in model.parameters if p.free and p.scope != "shared"}
    return (not any(i.shaped or i.delay != 0 or i.hold == "cubic" for i in model.inputs)
            and not any(o.delay != 0 for o in model.outputs)
            and not _used(model) & (own | first))


def _used(model: Model) -> set[str]:
    """Names in equations and outputs, not those that only initial states need."""
    formulas = [*model.equations.values(), *(o.expression for o in model.outputs)]
    return {q.name for f in formulas for q in f.free_symbols}


def _growth(field: VectorField, e: Experiment, p: np.ndarray) -> float:
    span, samples = e.t1 - e.t0, max(len(s.t) for s in e.samples)
    x, A = _along(field, e, p, PLACES)
    most = span * _frozen(A)
    if most <= HOPELESS:
        return 0.0
    if (places := int(min(np.ceil(FINER * most), samples))) > PLACES:
        x, A = _along(field, e, p, places)
    sizes = np.maximum(np.abs(x).max(axis=0), 1e-300)
    total, product = 0.0, np.eye(len(sizes))
    with np.errstate(all="ignore"):
        for a in A * sizes[None, None, :] / sizes[None, :, None]:
            product = expm(a * span / len(A)) @ product
            if not np.all(np.isfinite(product)):
                return 0.0  # no segment would be short enough
            size = float(np.linalg.norm(product, 2))
            total, product = total + float(np.log(size)), product / size
    enough = _most_segments(e, len(sizes)) >= total / GROWN[-1]
    return total if total > HOPELESS and enough else 0.0


def _most_segments(e: Experiment, states: int) -> int:
    return max(max(len(s.t) for s in e.samples) // (LEAST * states), 1)


def _along(field: VectorField, e: Experiment, p: np.ndarray, count: int
           ) -> tuple[np.ndarray, np.ndarray]:
    """States (K, n) at so many places, and ∂f/∂x (K, n, n) there; none where some are not known."""
    t = e.t0 + (e.t1 - e.t0) * (np.arange(count) + 0.5) / count
    nodes = [state_near(field.model, e, at, p) for at in t]
    if not all(told.all() for _, told in nodes):
        return np.zeros((0, len(p))), np.zeros((0, 1, 1))
    x = np.stack([found for found, _ in nodes])
    with np.errstate(all="ignore"):
        A = field.rhs_jacobians(t, x, e.inputs(t), p)[0]
    good = np.all(np.isfinite(A), axis=(1, 2))
    return x[good], A[good]


def _frozen(A: np.ndarray) -> float:
    """Mean of the largest rate [1/s] at which errors would grow in systems (K, n, n) that stay."""
    return float(np.mean(np.maximum(np.linalg.eigvals(A).real.max(axis=1), 0.0))) if len(A) else 0.0


def fit_in_segments(problem: Problem, theta: np.ndarray, grown: Sequence[float],
                    fit: Callable[[Problem], Estimate]) -> Estimate | None:
    """An estimate of shared parameters from segments, first short, then longer ones: these tell
    more, and follow only from a start that is close.  None where no segments can be followed.

    Args:
        problem: As it was given.
        theta: (n_free,) where to begin.
        grown: Logarithm of how much errors grow along each recording.
        fit: Makes an estimate, from a problem's guess on.
    """
    found: Estimate | None = None
    owners: list[int] = []
    known = {f.name: float(v) for f, v in zip(problem.free, theta, strict=True)
             if f.recording is None}
    for most in GROWN:
        model, motions = free_start(problem.model), None
        if found is not None:
            motions = _of_recordings(found, owners)[1]
            known = {f.name: float(v) for f, v in zip(found.free, found.theta, strict=True)
                     if f.recording is None}
        try:
            pieces, own = in_segments(problem, grown, most, motions)
            longer = fit(Problem(model.with_values({
                n: v for n, v in known.items() if n in model.free_names}), pieces))
        except (errors.BadRecording, errors.SimulationFailed):
            break
        if found and not (longer.converged and longer.cost < GROSS**2 * found.cost):
            break
        found, owners = longer, own
        if not found.converged:
            break
    return found and _joined(found, problem, owners, grown)


def in_segments(problem: Problem, grown: Sequence[float], most: float,
                motions: Sequence[Trajectory] | None = None) -> tuple[list[Recording], list[int]]:
    """Recordings cut into segments in which errors grow by e^most, for the model of `free_start`,
    and the recording that each is of.  Their initial states begin as samples tell, or motions.
    """
    pieces: list[Recording] = []
    owners: list[int] = []
    for r, (recording, e, logarithm) in enumerate(zip(
            problem.recordings, problem.experiments, grown, strict=True)):
        count = min(int(np.ceil(max(logarithm / most, 1))),
                    _most_segments(e, len(problem.model.states)))
        for low, high, last in _edges(e, count):
            x = (state_near(problem.model, e, low)[0] if motions is None else
                 [np.interp(low, motions[r].t, column) for column in motions[r].x.T])
            piece = recording.with_channels(*(
                _cut(c, low, high, last, problem.model) for c in recording.channels.values()))
            pieces.append(replace(piece, begins={
                f"{s.name}{NODE}": float(v)
                for s, v in zip(problem.model.states, x, strict=True)}))
            owners.append(r)
    return pieces, owners


def _edges(e: Experiment, count: int) -> list[tuple[float, float, bool]]:
    """From when to when segments last, about so many, and whether it is the last one: from sample
    to sample, and as long as it takes for every output to be seen to move.
    """
    t = max((s.t for s in e.samples), key=len)
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


def _cut(c: Channel, low: float, high: float, last: bool, model: Model) -> Channel:
    """A channel from one instant to another; an input has values at both."""
    if c.name not in model.input_names:
        inside = (c.time >= low) & ((c.time < high) | (last & (c.time <= high)))
        sigma = c.sigma
        return replace(c, time=c.time[inside], values=c.values[inside], sigma=np.asarray(
            sigma)[inside] if isinstance(sigma, np.ndarray) and sigma.ndim else sigma)
    inside = (c.time > low) & (c.time < high)
    if (c.hold or model.input(c.name).hold) == "zero":
        k = np.searchsorted(c.time, [low, high], "right") - 1
        ends = c.values[np.maximum(k, 0)]
    else:
        ends = np.interp([low, high], c.time, c.values)
    return replace(c, time=np.concatenate([[low], c.time[inside], [high]]), sigma=None,
                   values=np.concatenate([ends[:1], c.values[inside], ends[1:]]))


def free_start(model: Model) -> Model:
    """With a free initial state; parameters that only the initial state needs are not estimated."""
    needed = _used(model)
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
    alone = len(problem.experiments) == 1
    free, own, lost = [], [], []
    for f in problem.free:
        k = at.get((f.name, None))
        if k is None and (f.recording is not None or alone):
            k = at.get((starts.get(f.name, ""), owners.index(f.recording or 0)))
        if k is None:
            lost.append(f.label)
        else:
            free.append(f)
            own.append(k)
    said = [f"The plant is unstable: errors grow by e^{max(grown):.0f} along the recording, which "
            f"no simulation from one start follows. It is followed in {len(owners)} segments, each "
            "from a start of its own, and judged there; predict and validate with a horizon."]
    if lost:
        said.append(f"{enumerated(lost)} only set where the recording starts: not estimated.")
    fits, trajectories = _of_recordings(found, owners)
    low, high = (np.array([f.bounds[k] for f in free], float) for k in (0, 1))
    return replace(
        found, model=problem.model, free=tuple(free), theta=np.clip(found.theta[own], low, high),
        covariance=found.covariance[np.ix_(own, own)], fits=fits, trajectories=trajectories,
        cost=total_cost(fits), settings={**found.settings, "pieces": len(owners)},
        warnings=(*said, *(w for w in dict.fromkeys(found.warnings) if NODE not in w)))


def _of_recordings(found: Estimate, owners: Sequence[int]
                   ) -> tuple[tuple[Fit, ...], tuple[Trajectory, ...]]:
    """One fit of each output, and one trajectory, for each recording that segments are of."""
    outputs = found.model.outputs
    fits, trajectories = [], []
    for owner in dict.fromkeys(owners):
        mine = [k for k, o in enumerate(owners) if o == owner]
        pieces = [found.trajectories[k] for k in mine]
        trajectories.append(Trajectory(np.concatenate([p.t for p in pieces]),
                                       np.concatenate([p.x for p in pieces])))
        for j in range(len(outputs)):
            fits.append(Fit.joined([found.fits[k * len(outputs) + j] for k in mine]))
    return tuple(fits), tuple(trajectories)
