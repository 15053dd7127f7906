"""How much is computed: rows, fits, iterations, draws."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Budget:
    """How much a diagnosis may compute.  More finds more, and takes longer.

    Attributes:
        samples: Of all outputs, put together where they may be, that are diagnosed: a minute's.
        put_together: Samples of a recording below which none are put together.
        samples_a_period: That are kept where they are, of the fastest motion.
        rows_searched: That a search is made on before its best hypotheses get all.
        rows_tested: Of a residual that is tested as it is.
        modes: Of the residuals of repeats that are told apart.
        draws: Of the distribution of a test.
        singles: Refits of one effect.
        pairs: Refits of two effects at once.
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
        finalists: Profiles that are judged again after refitting simulations.
        compared: Hypotheses in a set, the most probable, that an experiment is planned for.
        profile: Length of a profile that is proposed [s].
        threads: That are used where no number is asked for: beyond two, what is begun ahead is too
            often begun in vain.
    """

    samples: int = 25_000
    put_together: int = 4000
    samples_a_period: int = 30
    rows_searched: int = 6000
    rows_tested: int = 6000
    modes: int = 800
    draws: int = 4000
    singles: int = 14
    pairs: int = 8
    beside_one: int = 8
    beside_more: int = 4
    leading: int = 3
    effects: int = 4
    carried: int = 12
    carried_far: int = 4
    effort: float = 8e6
    setup: float = 6e4
    rivals: int = 6
    asked_again: int = 2
    relevelled: int = 3
    rechecked: int = 3
    tested: int = 12
    predicted: int = 8
    iterations: int = 30
    hurried: int = 12
    hop_iterations: int = 10
    several_starts: int = 5
    patience: int = 6
    noise_refit: int = 5
    hops: int = 4
    finer: int = 3
    relinearised: int = 4
    levels: int = 4
    forms: int = 3
    force_passes: int = 2
    force_knots: tuple[int, int] = (8, 800)
    slow_knots: int = 200
    windows: int = 40
    planned_refits: int = 4
    planned_sizes: int = 7
    finalists: int = 5
    compared: int = 2
    profile: float = 20.0
    threads: int = 2
