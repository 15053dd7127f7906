"""How much is computed: rows, fits, iterations, draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pikanid.settings import ASCENDING, Amount, Count, Share


@dataclass(frozen=True)
class Budget:
    """How much a diagnosis may compute.  More finds more, and takes longer.

    Attributes:
        samples: Of all outputs, put together where they may be, that are diagnosed: a minute's.
        put_together: Samples of a recording below which none are put together.
        samples_a_period: That are kept where they are, of the fastest motion.
        fastest: Share of an output's power below the frequency of its fastest motion.
        rows_searched: That a search is made on before its best hypotheses get all.
        rows_tested: Of a residual that is tested as it is.
        modes: Of the residuals of repeats that are told apart.
        draws: Of the distribution of a test.
        singles: Refits of one effect.
        nominal_again: Times that these begin, as long as they lead the nominal model to a lower χ².
        pairs: Refits of two effects at once.
        pairs_weighed: Pairs of signs that are gone through for these.
        names_a_decoy: Effects with a name that are fitted for each one without.
        unpromising: Fits of an effect that promises nothing to first order, from several levels.
        beside_one: Refits of one more effect beside one.
        beside_more: Refits of one more beside two or three.
        leading: Single effects that a second one is added to.
        effects: In a hypothesis.
        carried: Hypotheses refitted to other records.
        carried_far: The same, where none explains the first ones.
        effort: [states times steps] simulated for combinations before nothing new is begun.
        setup: [states times steps] that setting up one fit takes as much time as, measured.
        rivals: Hypotheses about as good as the best that get rivals.
        asked_again: Hypotheses to be given whose neighbours are looked at once more.
        relevelled: Times that the noise is read from what the best explanation leaves.
        rechecked: Times that rivals of what is given are looked for.
        tested: Hypotheses that are tested: no reader wants more.
        predicted: Hypotheses behind these of which is found out what they predict.
        iterations: Of a fit.
        hurried: Of a fit among gross misfits.
        held_out: Of a fit to held-out recordings, by themselves or with all others.
        beginnings: Of what held-out recordings have for themselves alone, which goes first.
        hop_iterations: Of a fit over a hill.
        several_starts: That each of several starts gets before the best one goes on.
        patience: That a fit gets to come near the best one.
        noise_refit: Of a fit where nothing but the noise is another.
        hops: Times that a minimum is left over a hill, if that leads lower.
        finer: Times that a fit goes on with finer steps.
        relinearised: Times that a prior is linearised anew.
        levels: From which fits to all recordings begin, of a law without a first step to it.
        forms: Formulas read of one edge.
        force_passes: The second along the motion that the force of the first one makes.
        force_knots: Fewest and most knot intervals of a force over time.
        slow_knots: Knot intervals where even the most follow no oscillation.
        windows: Of time in which a residual is called loud or not.
        planned_refits: Rivals whose simulations are refitted; the others keep the first order.
        planned_sizes: Simulations of one effect on the way to the wanted visibility.
        smaller: Times that a profile is made smaller until every hypothesis keeps to its limits.
        finalists: Profiles that are judged again after refitting simulations.
        compared: Hypotheses in a set, the most probable, that an experiment is planned for.
        profile: Length of a profile that is proposed [s].
        profile_rate: Natural frequency, at most, that its proposals are made for [Hz].
        threads: That are used where no number is asked for: beyond two, what is begun ahead is too
            often begun in vain.
    """

    samples: Count = 25_000
    put_together: Count = 4000
    samples_a_period: Count = 30
    fastest: Share = 0.999
    rows_searched: Count = 6000
    rows_tested: Count = 6000
    modes: Count = 800
    draws: Count = 4000
    singles: Count = 14
    nominal_again: Count = 3
    pairs: Count = 8
    pairs_weighed: Count = 4000
    names_a_decoy: Count = 3
    unpromising: Count = 3
    beside_one: Count = 8
    beside_more: Count = 4
    leading: Count = 3
    effects: Count = 4
    carried: Count = 12
    carried_far: Count = 4
    effort: Amount = 8e6
    setup: Amount = 6e4
    rivals: Count = 6
    asked_again: Count = 2
    relevelled: Count = 3
    rechecked: Count = 3
    tested: Count = 12
    predicted: Count = 8
    iterations: Count = 30
    hurried: Count = 12
    held_out: Count = 25
    beginnings: Count = 40
    hop_iterations: Count = 10
    several_starts: Count = 5
    patience: Count = 6
    noise_refit: Count = 5
    hops: Count = 4
    finer: Count = 3
    relinearised: Count = 4
    levels: Count = 4
    forms: Count = 3
    force_passes: Count = 2
    force_knots: Annotated[tuple[Count, Count], ASCENDING] = (8, 800)
    slow_knots: Count = 200
    windows: Count = 40
    planned_refits: Count = 4
    planned_sizes: Count = 7
    smaller: Count = 8
    finalists: Count = 5
    compared: Count = 2
    profile: Amount = 20.0
    profile_rate: Amount = 5.0
    threads: Count = 2
