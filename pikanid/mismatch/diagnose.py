"""`diagnose`: detect, locate, name, model and prove what a model leaves out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from pikanid import errors
from pikanid.mismatch.beyond.force_shape import ForceShape, force_shape
from pikanid.mismatch.beyond.patch import patch
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.parallel import blas_on_one_thread, threads
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.locate import affected
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.mismatch.steps.confirming import confirmed, with_laws_outside
from pikanid.mismatch.steps.opening import open_case
from pikanid.mismatch.steps.reporting import reported
from pikanid.mismatch.steps.searching import searched, with_noise_of_the_rest
from pikanid.mismatch.steps.surely import with_sure_part
from pikanid.model import Model
from pikanid.pieces.sentences import p_text
from pikanid.problem.arguments import a_model, several
from pikanid.recording import Recording
from pikanid.settings import of_kind

Recordings = Recording | Sequence[Recording]
SURE = ("none", "named", "set", "partial")  # definition: verdicts that are proved
EXCHANGED = ("Recordings exchanged: the held-out ones are explained, and what was found is proved "
             "on the others, which tell too little of it to be explained themselves.")


def diagnose(model: Model, train: Recordings, held_out: Recordings | None = None, *,
             alpha: float | None = None, settings: Settings = DEFAULTS,
             quiet: tuple[float, float] | None = None,
             tell: Callable[[str], None] = lambda text: None,
             workers: int | None = None) -> Diagnosis:
    """What is missing in a model, according to recordings?

    The model is refitted, its residual whitened by the noise and tested against all that the
    catalogue could have left there; entries, and pairs of them, are added inside the equations and
    refitted; what explains the recording must then predict `held_out`.  That proves an effect only
    if it could have refuted it.  Where nothing is proved so and `held_out` shows more of what
    is missing, that is explained and has to predict `train`: a motion that hardly shows a law tells
    little of its parameters, and can refute them nevertheless.  Of very long recordings the
    beginnings are diagnosed.  Notes say both.

    Args:
        model: Nominal model.  Where a state is the rate of another one, but for a constant factor,
            physics is looked for in the equation of that rate; without any, in those of all states
            that reach an output.
        train: Recording, or several, to explain.
        held_out: Recording, or several, with another excitation, to prove it on.  Without one the
            end of the recording is set aside, and the verdict is at most "unconfirmed".
        alpha: Rate of false alarms, in place of that in `settings`.
        settings: Error rates, thresholds, budgets.
        quiet: Start and stop [s] of a stretch known to show noise only.
        tell: Called with what is being done.
        workers: Threads that fit side by side; by default two where there are as many cores.  The
            diagnosis does not depend on it.

    Returns:
        The diagnosis; `model` is the extended model, `to_dict()` the content of diagnosis.json.

    Raises:
        BadModel: No state reaches an output, or nothing is free.
        BadRecording: A channel is missing or unusable; there are too few samples; train and
            held-out are the same.
        BadSetting: alpha is no probability, settings are none, workers is not positive, or a
            recording ends within the quiet stretch.
        SimulationFailed: The model cannot be simulated, or not as exactly as the noise asks.

    >>> import pikanid as pk
    >>> truth = pk.systems.sloshing().with_term(
    ...     "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 200.0)])
    >>> noisy = lambda seed: pk.simulate(truth, pk.excitation.planar_moves(6, 10.0, seed=seed),
    ...                                  sigma=0.002, seed=seed)
    >>> dx = diagnose(pk.systems.sloshing(), noisy(1), held_out=noisy(2))
    >>> dx.verdict, dx.hypotheses[0].effects[0].ids
    ('named', ('cubic_stiffness',))
    """
    begun = time.perf_counter()
    of_kind(settings, Settings)
    if alpha is not None:
        settings = settings.with_values({"alpha": alpha})
    if workers is not None and workers < 1:
        raise errors.BadSetting(errors.bad_value("workers", workers, "at least 1"))
    if not a_model(model).free_names:
        raise errors.BadModel(errors.nothing_free(model.name))
    recordings = several(train)
    if quiet is not None and (stop := min(r.stop for r in recordings)) <= quiet[1]:
        raise errors.BadSetting(errors.quiet_throughout(quiet[1], stop))
    later = None if held_out is None else several(held_out)
    with blas_on_one_thread():
        opened = partial(open_case, model, tell=tell, settings=settings,
                         workers=threads(workers, settings.budget.threads))
        case = opened(recordings, later, quiet)
        found = _diagnosed(case, quiet, tell)
        if later is not None and case.proves and found.verdict not in SURE:
            tell("recordings exchanged")
            found = _exchanged(case, partial(opened, later, recordings, None), tell) or found
    return replace(found, seconds=time.perf_counter() - begun)


def _exchanged(case: Case, opened: Callable[[], Case], tell: Callable[[str], None]
               ) -> Diagnosis | None:
    """The diagnosis with the held-out recordings explained and the others held out, where those
    show more of what is missing, and it is proved so.
    """
    try:
        other = opened()
        if not smaller(_missed(case.base), _missed(other.base)):
            return None
        found = _diagnosed(other, None, tell)
    except errors.PikanidError:  # good enough to be predicted, not to be explained
        return None
    return None if found.verdict not in SURE or not found.mismatch else replace(
        found, exchanged=True, notes=(EXCHANGED, *found.notes))


def _missed(nominal: Hypothesis) -> float:
    """χ² that the nominal model misses beside noise."""
    return nominal.minimum.chi2 - nominal.whitened.rows


def _diagnosed(case: Case, quiet: tuple[float, float] | None, tell: Callable[[str], None]
               ) -> Diagnosis:
    alpha = case.settings.alpha
    tell("detection")
    detection = case.detected()
    if not smaller(detection.p_value, alpha):
        case.relevelled(case.base, quiet)
        return _nothing_left(case, detection)
    nominal, ranked = case.base, searched(case, tell)
    if case.base is not nominal and not smaller(
            (detection := case.detected()).p_value, alpha):
        return _nothing_left(case, detection)  # the nominal model had been in a wrong minimum
    ranked = with_noise_of_the_rest(case, ranked, quiet, tell)
    tell("confirmation")
    answer, site, shape = _beyond(case, first := confirmed(case, ranked), tell)
    if answer.part is not None and case.adequate(late := answer.part.hypothesis) and all(
            late.fit != h.fit for h in (*ranked, *first.given)):
        # found only now, it explains all: the noise had been read through what it explains
        tell("noise once more")
        ranked = with_noise_of_the_rest(case, case.search.ranked(), quiet, tell)
        answer, site, shape = _beyond(case, confirmed(case, ranked), tell)
    # what explains best has told the noise by now: beside that the nominal model may leave nothing
    if answer.verdict == "unnamed" and not smaller((again := case.detected()).p_value, alpha):
        case.notes.append(errors.louder_than_read(p_text(detection.p_value, 1)))
        return _nothing_left(case, again)
    if answer.verdict == "unnamed" and (noise := case.noise_alone(quiet)) is not None:
        correlations = [level.rho for level in noise.levels[0].values() if level.rho]
        answer = replace(answer, doubt=errors.may_be_noise(correlations))
    mend = None
    if answer.verdict == "unnamed" and case.later is not None:
        mend = patch(case.base, case.model, shape, site, case.records, case.later, case.predicted)
    return replace(reported(case, detection, answer, site, shape), patch=mend)


def _nothing_left(case: Case, detection: Detection) -> Diagnosis:
    """Nothing is missing, unless the held-out recordings say so."""
    case.clear_later(case.base)
    refuted = case.refuted()
    answer = Answer("unnamed" if refuted else "none", (), ())
    return reported(case, refuted or detection, answer, case.sites[0], None)


def _beyond(case: Case, answer: Answer, tell: Callable[[str], None]
            ) -> tuple[Answer, Site, ForceShape]:
    """Where the answer acts, laws of no catalogue, and what is surely there beside a remainder."""
    site = affected(case.base, answer.given, case.sites, case.candidates)
    shape = force_shape(case.base, site, case.candidates)
    if answer.verdict == "unnamed":
        tell("laws outside the catalogue")
        answer = with_laws_outside(case, answer, shape, site)
    return with_sure_part(case, answer, site), site, shape
