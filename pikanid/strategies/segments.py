"""Plants that are unstable: a recording is followed in segments, each from a start of its own.

Over a short segment errors grow a little only (H. G. Bock, Randwertproblemmethoden zur
Parameteridentifizierung, 1987, sec. 3; L. Ljung, System Identification, 1999, sec. 3.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import total_cost
from pikanid.pieces.sentences import enumerated
from pikanid.problem.problem import Problem
from pikanid.strategies.cuts import NODE, counts_for, free_start, in_segments
from pikanid.strategies.growth import LONGEST

GROWN = (1.0, 2.0, 4.0, LONGEST)  # numerical: logarithms of how much errors grow in one, in turn
GROSS = 4.0  # limit: times what shorter segments leave, as which longer ones have lost their way


@dataclass(frozen=True, eq=False)
class Followed:
    """Recordings that are followed in segments.

    Attributes:
        estimate: Of the model of `free_start`, from the segments.
        counts: In how many each recording was to be cut.
        owners: The recording that each segment is of.
    """

    estimate: Estimate
    counts: tuple[int, ...]
    owners: tuple[int, ...]

    @property
    def motions(self) -> tuple[Trajectory, ...]:
        """One for each recording; each segment's from its first sample on."""
        found, outputs = self.estimate, len(self.estimate.model.outputs)
        joined = []
        for owner in dict.fromkeys(self.owners):
            parts: list[tuple[np.ndarray, np.ndarray]] = []
            for k in np.flatnonzero(np.array(self.owners) == owner):
                begins = min(f.t[0] for f in found.fits[k * outputs:(k + 1) * outputs])
                t, x = found.trajectories[k].t, found.trajectories[k].x
                first = 0 if not parts else int(np.searchsorted(t, begins))
                parts.append((t[first:], x[first:]))
            joined.append(Trajectory(*(np.concatenate(both) for both in zip(*parts, strict=True))))
        return tuple(joined)

    @property
    def fits(self) -> tuple[Fit, ...]:
        """One for each output of each recording."""
        count = len(self.estimate.model.outputs)
        return tuple(
            Fit.joined([self.estimate.fits[k * count + j] for k, o in enumerate(self.owners)
                        if o == owner])
            for owner in dict.fromkeys(self.owners) for j in range(count))


def followed(problem: Problem, theta: np.ndarray, grown: Sequence[float],
             fit: Callable[[Problem], Estimate], most: float = LONGEST) -> Followed | None:
    """Shared parameters from segments, first short, then longer ones: these tell more, and follow
    only from a start that is close.  None where no segments can be followed.

    Args:
        problem: As it was given.
        theta: (n_free,) where to begin.
        grown: Logarithm of how much errors grow along each recording.
        fit: Makes an estimate, from a problem's guess on.
        most: Logarithm of how much errors grow in a segment, at most.
    """
    found: Followed | None = None
    shared = [f.name for f in problem.free if f.recording is None]
    known = {f.name: float(v) for f, v in zip(problem.free, theta, strict=True)}
    for longest in (g for g in GROWN if g <= most):
        counts = counts_for(problem, grown, longest)
        if found is not None:
            if counts == found.counts:
                continue
            known = dict(zip([f.name for f in found.estimate.free],
                             map(float, found.estimate.theta), strict=True))
        begun = problem.model.with_values({n: known[n] for n in shared if n in known})
        try:
            pieces, owners = in_segments(Problem(begun, problem.recordings), counts, grown,
                                         None if found is None else found.motions)
            longer = fit(Problem(free_start(begun), pieces))
        except (errors.BadRecording, errors.SimulationFailed):
            break
        if found and not (longer.converged and longer.cost < GROSS**2 * found.estimate.cost):
            break
        found = Followed(longer, counts, tuple(owners))
        if not longer.converged:
            break
    return found


def joined(found: Followed, problem: Problem, grown: Sequence[float]) -> Estimate:
    """What was found in segments as an estimate of the problem as it was given: of its own
    parameters, with one fit and one trajectory for each of its recordings.

    Args:
        found: In segments.
        problem: As it was given.
        grown: Logarithm of how much errors grow along each recording.
    """
    inside = found.estimate
    starts = {s.initial.name: f"{s.name}{NODE}" for s in problem.model.states
              if s.initial.is_Symbol}
    at = {(f.name, f.recording): k for k, f in enumerate(inside.free)}
    alone = len(problem.experiments) == 1
    free, own, lost = [], [], []
    for f in problem.free:
        k = at.get((f.name, None))
        if k is None and (f.recording is not None or alone):
            k = at.get((starts.get(f.name, ""), found.owners.index(f.recording or 0)))
        if k is None:
            lost.append(f.label)
        else:
            free.append(f)
            own.append(k)
    said = [f"The plant is unstable: errors grow by e^{max(grown):.0f} along the recording, which "
            f"no simulation from one start follows. It is followed in {len(found.owners)} "
            "segments, each from a start of its own, and judged there; predict and validate with a "
            "horizon."]
    if lost:
        said.append(f"{enumerated(lost)} only set where the recording starts: not estimated.")
    low, high = (np.array([f.bounds[k] for f in free], float) for k in (0, 1))
    return replace(
        inside, model=problem.model, free=tuple(free),
        theta=np.clip(inside.theta[own], low, high), covariance=inside.covariance[np.ix_(own, own)],
        fits=found.fits, trajectories=found.motions, cost=total_cost(found.fits),
        settings={**inside.settings, "pieces": list(found.counts)},
        warnings=(*said, *(w for w in dict.fromkeys(inside.warnings) if NODE not in w)))
