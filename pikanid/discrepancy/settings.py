"""What a search for missing laws takes as given: priors, what counts as evidence, budgets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pikanid.settings import ASCENDING, Amount, Checked, Count, Range, Share, Signed


@dataclass(frozen=True)
class DiscrepancySettings(Checked):
    """What `kan_discrepancy` takes as given, beside the level of its tests.

    Evidence is the marginal likelihood of the linearised problem; its differences are logarithms of
    Bayes factors: from 5 on (odds of 150 to 1) they count as very strong (R. E. Kass and A. E.
    Raftery, J. Am. Stat. Assoc. 90, 1995).

    Attributes:
        strong: [log Bayes factor] that a step or a varying smoothness must gain.
        sure: Standard deviations that a fitted step must differ from zero by, to stay.
        finer: [log Bayes factor] that a finer grid must gain.
        left_out: Share of the weights of all structures below which one is left out of the bands.
        largest: Prior standard deviation of a discrepancy, in units of the equation's size: it is
            small beside the physics that it corrects.
        usual: Prior mean of log λ: where an edge is nearly straight the evidence says nothing.
        spread: Prior standard deviation of log λ.
        step: Prior standard deviation of the steps of log λ from piece to piece: e^±3 is usual.
        pieces: Of log λ along an edge where it varies.
        plausible: Smoothnesses that the bands are averaged over, a power of two.
        freedom: Fewest and most degrees of freedom of the test of an edge.
        draws: Of a simultaneous band.
        followed: Share of a nominal term's mean square that edges must reach for it to be a gauge.
        carried: Share of a gauge direction's size from which on an edge takes part in it.
        louder: Standard deviations of χ², √(2n), beyond its mean from which on σ does not explain
            the residuals, and their own size counts as noise.
        iterations: Of one fit.
        settled: [posterior standard deviations] that the last step of a fit may move by.
        idle: [χ²] by which two steps in a row must lower the cost, or the fit ends.
        turns: Of fit and choice of the smoothness, by relaxation.
        settled_turns: [log λ] that the last of these may change.
    """

    strong: Amount = 5.0
    sure: Amount = 4.0
    finer: Amount = 1.0
    left_out: Share = 0.02
    largest: Annotated[float, Range(1e-6)] = 0.1
    usual: Signed = 5.0
    spread: Annotated[float, Range(1e-6)] = 5.0
    step: Annotated[float, Range(1e-6)] = 3.0
    pieces: Count = 9
    plausible: Count = 32
    freedom: Annotated[tuple[Count, Count], ASCENDING] = (3, 8)
    draws: Count = 2000
    followed: Share = 0.9
    carried: Share = 0.1
    louder: Amount = 5.0
    iterations: Count = 40
    settled: Amount = 0.03
    idle: Amount = 0.05
    turns: Count = 6
    settled_turns: Amount = 0.3


USUAL = DiscrepancySettings()
