"""When a fit that is refined counts as settled, and how far the refinement goes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from pikanid.settings import Amount, Checked, Count, Factor, Share, changed


@dataclass(frozen=True)
class RelaxationSettings(Checked):
    """What iPDA and PIKAN take as given.

    Attributes:
        settled: [standard errors] that a finer grid or a larger λ may move a parameter by.
        misled: [standard errors] of such a move from which on the coarser grid misled the fit: it
            starts anew on the finer one.
        refinements: Halvings of the grid.
        explained: Times the cost that noise explains up to which no better path is looked for.
        iterations: Of a deep network, at one λ.
        calm: Of these without a move of the parameters, and they have settled: a redundant network
            creeps on long after.
    """

    settled: Amount = 0.05
    misled: Amount = 10.0
    refinements: Count = 6
    explained: Factor = 1.5
    iterations: Count = 30
    calm: Count = 10


@dataclass(frozen=True)
class ClimbSettings(Checked):
    """What a PINN takes as given while λ climbs, and after.

    Attributes:
        settled: [standard errors] that parameters may move by, in the iterations at one λ.
        nearly: The same for a last move that deserves no warning.
        falling: Ratio of standard errors at one λ to those before, below which a larger λ has more
            to tell.
        share: Of what the noise costs, that the physics may cost.
        overfit: Share of the noise's cost below which the curve follows the noise.
        far: [standard errors] by which a simulation may be fitted elsewhere before the curve is
            called misleading; in units of what is left, the same (squared) is what a network may
            leave to a simulation before another start is tried.
        starts: Starting weights tried at most.
    """

    settled: Amount = 0.05
    nearly: Amount = 0.2
    falling: Share = 0.9
    share: Amount = 0.1
    overfit: Share = 0.8
    far: Amount = 5.0
    starts: Count = 4


RELAXATION = RelaxationSettings()
CLIMB = ClimbSettings()


def recorded(strategy: Any) -> dict[str, Any]:
    """The options of a strategy for its result: of its settings those that are not the usual."""
    found = {f.name: getattr(strategy, f.name) for f in fields(strategy)
             if f.name not in ("settings", "progress")}
    own = changed(strategy.settings)
    return found | ({"settings": own} if own else {})
