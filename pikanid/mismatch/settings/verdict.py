"""What counts as evidence for an explanation, and what as a proof of it."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.mismatch.settings.thresholds import dominance, odds_against
from pikanid.settings import Amount, Count, Factor, Rate, Share


@dataclass(frozen=True)
class VerdictSettings:
    """When hypotheses are told apart, and when one is confirmed.

    Differences of the criterion are -2 ln of ratios of posterior weights: up to 2 is "not worth
    more than a bare mention", 6 to 10 "strong" (R. E. Kass and A. E. Raftery, J. Am. Stat. Assoc.
    90, 1995).

    Attributes:
        unlikely: Posterior weight, as a share of the best one's, below which a hypothesis is told
            apart from it.
        besides: The same of an explanation that holds one more effect than another: that there is
            more needs some evidence, that it may be something else needs none.
        behind: Times `indistinct`, and a hypothesis can still be what predicts best.
        same: [χ²] in the train and in the held-out recordings: where both differ by less, two
            hypotheses are one motion, and count as one law.
        same_law: [criterion]: what differs by less may be the same law, written in another way.
        decoy_handicap: [criterion] that each law outside the catalogue is handicapped by: prior
            odds of e² to 1 that a law is one that has a name.
        unforeseen: Prior probability that what explains everything is a law that neither the
            catalogue nor what keeps its names away holds.
        crowd: Explanations, none of which holds another one, beyond which they are many.  The more
            of a catalogue recordings leave, the more they would leave of laws that are in none: of
            a set, two things must not be true that it holds many, that it holds a law outside the
            catalogue, and that it explains less than `minor_strong`.
        improvement: Ratio of held-out misfits from which on downwards a prediction is better.
        worth: Share of the nominal held-out misfit that an effect must take away where a part
            remains.
        part: Share of the nominal held-out misfit, a quarter of its square, that a part may leave.
        alike: Ratio of held-out misfits below which two hypotheses predict alike.
        strong: [χ² in all recordings] that one effect must gain, and each of two, of three, of
            four: 6.7 standard deviations in each of two recordings.  A law that is in no catalogue
            lies at some angle to the next one that is, and what is weaker shows no such angle but
            a wide one; several together can take up most of anything.
        minor: Share of what an explanation gains below which an effect of it is minor: a tenth
            of the misfit's size, as what nobody has modelled often is.
        minor_strong: [χ² in all recordings] that a minor effect must gain, and one that happens
            once, of which no other recording speaks: 10 standard deviations in each of two
            recordings tell it from most laws of that size, of which that needs one if it is all.
        shown: [χ²] that it must gain in the recording it was found in: the other one is the proof.
        needed: [criterion] that each of several effects must gain on held-out recordings.
        once: Share of what an effect that happens once takes away beside others that one that lasts
            may take away in its place.
        sized: Standard errors from nothing that the size of an effect of one parameter must be
            where something is left: what gains much and still may be nothing stands for a part of
            that.  And, as a root of χ², how much more it must explain than a parameter would that a
            bound holds without it.
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
        guessed: Probability from which on what is not confirmed is said to be perhaps so.
    """

    unlikely: Rate = 0.01
    besides: Rate = 0.05
    behind: Factor = 2.0
    same: Amount = 0.1
    same_law: Amount = 1.0
    decoy_handicap: Amount = 4.0
    unforeseen: Rate = 0.005
    crowd: Count = 2
    improvement: Share = 0.9
    worth: Share = 0.05
    part: Share = 0.5
    alike: Factor = 1.1
    strong: tuple[Amount, Amount, Amount, Amount] = (90.0, 95.0, 95.0, 135.0)
    minor: Share = 0.01
    minor_strong: Amount = 200.0
    shown: Amount = 12.0
    needed: Amount = 4.0
    once: Share = 0.5
    sized: Amount = 3.0
    worse: Factor = 1.1
    linear: Amount = 3.0
    missed: Amount = 15.0
    sharp: Amount = 0.12
    whole: Amount = 1.0
    open: Amount = 3.0
    narrow: Share = 0.03
    sensitive: Factor = 1.2
    guessed: Rate = 0.05

    @property
    def indistinct(self) -> float:
        """[criterion] below which hypotheses are not told apart."""
        return odds_against(self.unlikely)

    @property
    def needless(self) -> float:
        """[criterion] from which on one more effect is not told."""
        return odds_against(self.besides)


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
        least_window: Samples of a window that can say whether it is louder than noise.
        louder: Standard deviations of χ² in a window, √(2n), beyond which it is louder than noise.
        unexplained: [χ² per degree of freedom] from which on no force explains a recording.
        idle: Share of what was visited in which a law must be zero to act in a region.
        clean: The same of a force that has no name.
    """

    own: Share = 0.1
    line: Share = 0.05
    read: Share = 0.6
    read_beside: Share = 0.9
    inside: Share = 0.95
    knots_a_period: Count = 6
    resolved: Count = 4
    rows_a_knot: Count = 5
    least_window: Count = 4
    louder: Amount = 4.0
    unexplained: Amount = 1.5
    idle: Share = 0.05
    clean: Share = 0.25


@dataclass(frozen=True)
class PartSettings:
    """When physics is surely there although something is left.

    Attributes:
        rate: Posterior probability that may be missing to one.
        chance: Rate at which a family that is not there may dominate.
        spread: Of ln κ of families that are not there, which is about half-normal.
        gain_spread: The same of a scale error: the free parameters of a model take up the stiffness
            and the damping of what is missing, and nothing its gain.
        share: Of the held-out misfit's square that must be explained.
        within: κ of an effect among explanations that hold the same family; of a law with a free
            exponent `dominance` is asked.
        exact: Share of the held-out misfit's square that a name must explain, unless it dominates
            among members of its family as the family does.
        form: κ of a free curve of the same state beside a named effect, or of a law that contains
            it: from there on the form is another one, and only the family is sure.
        floor: Of σ²: less than that is not told from nothing.
        rivals: Explanations without a family that are compared with the best one with it.
        pool: Explanations that are looked at, the best first.
        dry: Exponent of the speed at or below which a force is dry friction.
        all_of: Effects that may be said to be all that is missing without each being sure whatever
            is left.
    """

    rate: Rate = 0.01
    chance: Rate = 0.002
    spread: Amount = 0.45
    gain_spread: Amount = 0.9
    share: Share = 0.8
    within: Factor = 1.2
    exact: Share = 0.9
    form: Factor = 2.0
    floor: Amount = 0.04
    rivals: Count = 6
    pool: Count = 10
    dry: Amount = 0.3
    all_of: Count = 2

    @property
    def dominance(self) -> float:
        """κ that is asked of a family: how many times more is left without it."""
        return dominance(self.chance, self.spread)

    def dominance_of(self, family: str) -> float:
        """The same of one family."""
        return dominance(self.chance, self.gain_spread) if family == "gain" else self.dominance
