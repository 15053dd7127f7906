"""Records of an unstable plant, in segments that a simulation can follow."""

from __future__ import annotations

from dataclasses import replace

from pikanid.estimate import Estimate
from pikanid.mismatch.data.preparation import with_sigma
from pikanid.mismatch.data.whitened import Records
from pikanid.model import Model
from pikanid.problem.problem import Problem
from pikanid.strategies.nls import NLS
from pikanid.strategies.segments import free_start, growth, in_segments

MOST = 4.0  # numerical: logarithm of how much errors grow in a segment


def in_pieces(before: Estimate, records: Records, held: Records | None, nls: NLS
              ) -> tuple[Model, Records, Records | None]:
    """The nominal model with a start of its own in each segment, and both records in segments.

    Args:
        before: Of the nominal model, from the records.
        records: To explain.
        held: To prove it on.
        nls: By which the motion in the latter is found.
    """
    model = before.fitted_model
    later = held and _cut(model, held, replace(nls, starts=1).fit(
        model, with_sigma(held, model)))
    return free_start(model), _cut(model, records, before), later


def _cut(model: Model, records: Records, found: Estimate) -> Records:
    problem = Problem(model, records.recordings)
    pieces, owners = in_segments(
        problem, growth(problem, problem.guess), MOST, found.trajectories)
    return replace(records, recordings=tuple(pieces),
                   levels=tuple(records.levels[k] for k in owners), cut_from=tuple(owners))
