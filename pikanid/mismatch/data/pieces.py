"""Records of an unstable plant, in segments that a simulation can follow."""

from __future__ import annotations

from dataclasses import replace

from pikanid.mismatch.data.preparation import with_sigma
from pikanid.mismatch.data.records import Records
from pikanid.model import Model
from pikanid.problem.problem import Problem
from pikanid.strategies.cuts import NODE, free_start, in_segments
from pikanid.strategies.growth import growth
from pikanid.strategies.nls import NLS

MOST = 4.0  # numerical: logarithm of how much errors grow in a segment, at most


def in_pieces(model: Model, records: Records, held: Records | None, nls: NLS
              ) -> tuple[Model, Records, Records | None]:
    """The nominal model with a start of its own in each segment, and both records in segments.

    Args:
        model: The nominal one, fitted to the records.
        records: To explain.
        held: To prove it on.
        nls: By which they are followed.
    """
    return free_start(model), _cut(model, records, nls), held and _cut(model, held, nls)


def _cut(model: Model, records: Records, nls: NLS) -> Records:
    known = Problem(model, with_sigma(records, model))
    grown = growth(known, known.guess)
    found = nls.followed(known, known.guess, grown, MOST)
    if found is None:
        return records
    pieces, owners = in_segments(Problem(model, records.recordings), found.counts, grown)
    begun = [replace(piece, begins={f"{n}{NODE}": float(v) for n, v in zip(
        model.state_names, motion.x[0], strict=True)})
        for piece, motion in zip(pieces, found.estimate.trajectories, strict=True)]
    return replace(records, recordings=tuple(begun),
                   levels=tuple(records.levels[k] for k in owners), cut_from=tuple(owners))
