"""What reading a network as a formula takes as given: priors, levels of tests, budgets."""

from __future__ import annotations

from dataclasses import dataclass

from pikanid.settings import Amount, Checked, Count, Factor, Rate, Share


@dataclass(frozen=True)
class FormulaSettings(Checked):
    """How forms are fitted to a curve, and which of them are worth more.

    Attributes:
        simpler: How much less probable a form is for every further constant, before any data.
        searched: Points of the first search of a form.
        starts: From which a form is fitted.
        iterations: Of one such fit.
        forms: Of an edge, that are tried in a formula.
    """

    simpler: Factor = 4.0
    searched: Count = 400
    starts: Count = 2
    iterations: Count = 60
    forms: Count = 7


@dataclass(frozen=True)
class SymbolicSettings(FormulaSettings):
    """What `extract` and `name_edge` take as given, beside the level of significance of edges.

    Scores are BIC less twice the logarithm of the prior: a difference of d is a ratio of
    probabilities of e^(d/2).

    Attributes:
        nothing: Prior probability that an edge is nothing.
        no_form: Prior probability that an edge which is something has a law that no library holds:
            rare, but there.
        trace: Rate at which a right form is refused for what it leaves in the residual.
        agrees: [squared standard deviations] that two forms which data cannot tell apart may differ
            by: three of one number.
        adequate: Rate at which a right formula is refused for what it leaves of the network.
        close: Share of the spread that a formula may be off where no data can judge.
        believed: Share of its spread by which a network without data is known.
        unlikely: [score] by which a law must be worse than the best one not to be put into the
            equation: odds of three millions to one.
        resting: Share of the samples at which an argument must rest at zero to count as stuck.
        jumps: Probability of a jump from which on an edge counts as one that can be stuck.
        outer: Forms of an edge of the last layer from which a search starts.
        glance: Data that a first choice is made on.
        quick: Evaluations of a first try.
        polished: Compositions that all data then rank.
        evaluations: Of a refit of all constants.
        compete: Readings that are tidied before the best is chosen.
        laws: An edge, that are put into the equation.
        combinations: Of these.
        contained: Laws that one contains, put into the equation beside it.
    """

    nothing: Rate = 0.5
    no_form: Rate = 0.02
    trace: Rate = 1e-3
    agrees: Amount = 9.0
    adequate: Rate = 1e-3
    close: Share = 0.03
    believed: Share = 0.01
    unlikely: Amount = 30.0
    resting: Share = 1e-3
    jumps: Rate = 0.5
    outer: Count = 3
    glance: Count = 400
    quick: Count = 40
    polished: Count = 8
    evaluations: Count = 200
    compete: Count = 3
    laws: Count = 4
    combinations: Count = 16
    contained: Count = 2


USUAL = SymbolicSettings()
