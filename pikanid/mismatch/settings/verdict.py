"""What counts as evidence for an explanation, and what as a proof of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class VerdictSettings:
    """When hypotheses are told apart, and when one is confirmed.

    Differences of the criterion are -2 ln of ratios of posterior weights: up to 2 is "not worth
    more than a bare mention", 6 to 10 "strong" (R. E. Kass and A. E. Raftery, J. Am. Stat. Assoc.
    90, 1995).

    Attributes:
        indistinct: [criterion] below which hypotheses are not told apart: weights of 1 to 20.
        behind: Times that, and a hypothesis can still be what predicts best.
        side_by_side: [criterion] below which two explanations are given side by side: a factor of e
            is no evidence.
        same_law: [criterion]: what differs by less may be the same law, written in another way.
        decoy_handicap: [criterion] that each law outside the catalogue is handicapped by: prior
            odds of e² to 1 that a law is one that has a name.
        improvement: Ratio of held-out misfits from which on downwards a prediction is better.
        worth: Share of the nominal held-out misfit that an effect must take away where a part
            remains.
        part: Share of the nominal held-out misfit, a quarter of its square, that a part may leave.
        alike: Ratio of held-out misfits below which two hypotheses predict alike.
        strong: [χ² in all recordings] that one effect must gain, and each of two, of three, of
            four: 4.5 standard deviations in each of two recordings; several together can take up
            most of anything.
        shown: [χ²] that it must gain in the recording it was found in: the other one is the proof.
        needed: [criterion] that each of several effects must gain on held-out recordings.
        worse: Times the nominal held-out RMSE: no proof, whatever errors of parameters forgive.
        linear: Standard deviations that a linearisation holds for: beyond, it is renewed.
        missed: [χ²] that a fit to all recordings may exceed fits to each by, where it is best.
        sharp: Standard error below which an exponent can say that it is a whole number.
        whole: Standard errors from a whole number within which a sharp exponent is that.
        open: Standard errors from a whole number within which an exponent may be that.
        narrow: Share of the half range: a hysteresis loop no wider is dry friction that gives
            before it slips.
        sensitive: Times the held-out RMSE with parameters moved within their errors: more is
            theirs, not a law's.
    """

    indistinct: float = 6.0
    behind: float = 3.0
    side_by_side: float = 2.0
    same_law: float = 1.0
    decoy_handicap: float = 4.0
    improvement: float = 0.9
    worth: float = 0.05
    part: float = 0.5
    alike: float = 1.1
    strong: tuple[float, float, float, float] = (40.0, 45.0, 90.0, 135.0)
    shown: float = 12.0
    needed: float = 4.0
    worse: float = 1.5
    linear: float = 3.0
    missed: float = 15.0
    sharp: float = 0.12
    whole: float = 1.0
    open: float = 3.0
    narrow: float = 0.03
    sensitive: float = 1.2


@dataclass(frozen=True)
class BeyondSettings:
    """What is said of a missing force that has no name.

    Attributes:
        own: Share of what all edges explain that must be an edge's alone to count.
        line: Share of a straight line's sign: with less left the line is the free parameters' own.
        read: Share of what all edges explain that an edge must explain alone to be read.
        read_beside: The same as a share of the best edge's.
        inside: Share of the held-out motion that must lie in the range of a patch.
        knots_a_period: Knots in a natural period: friction's third harmonic still fits between.
        resolved: Knots in a natural period from which on a force that follows the motion shows.
        rows_a_knot: Samples to a knot interval, at least.
        louder: Standard deviations of χ² in a window, √(2n), beyond which it is louder than noise.
        unexplained: [χ² per degree of freedom] from which on no force explains a recording.
    """

    own: float = 0.1
    line: float = 0.05
    read: float = 0.6
    read_beside: float = 0.9
    inside: float = 0.95
    knots_a_period: int = 6
    resolved: int = 4
    rows_a_knot: int = 5
    louder: float = 4.0
    unexplained: float = 1.5
