"""`diagnose`: detect, locate, name, model and prove what a model leaves out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from pikanid import errors
from pikanid.mismatch.beyond.force_shape import ForceShape, force_shape
from pikanid.mismatch.beyond.formulas import symbolic_candidates
from pikanid.mismatch.beyond.latent_force import force_over_time
from pikanid.mismatch.beyond.patch import patch
from pikanid.mismatch.case import SEARCHED, Case, note_outliers
from pikanid.mismatch.catalogue.catalogue import candidates as catalogue_of
from pikanid.mismatch.catalogue.site import Site, sites
from pikanid.mismatch.data.preparation import (
    beginnings,
    check_freedom,
    check_pair,
    freedom,
    held_as_recorded,
    oversampling,
    prepared,
    set_aside,
    with_refined_noise,
    with_sigma,
)
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.as_estimate import as_estimate
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.parallel import blas_on_one_thread, threads
from pikanid.mismatch.fitting.repeats import repeats
from pikanid.mismatch.judge.doubt import least_proof
from pikanid.mismatch.judge.verdict import Answer, settle, with_formulas
from pikanid.mismatch.report.advice import advice
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.explained import explanations
from pikanid.mismatch.report.findings import OutputError, Proof
from pikanid.mismatch.report.locate import affected, locate, smallest
from pikanid.mismatch.search.search import Search
from pikanid.model import Model
from pikanid.problem.arguments import a_model, several
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS

RELEVELLED = 3  # times that the noise is read from what the best explanation leaves, at most
ASKED = 3  # times that rivals of what is given are looked for

Recordings = Recording | Sequence[Recording]


def diagnose(model: Model, train: Recordings, held_out: Recordings | None = None, *,
             alpha: float = 0.01, quiet: tuple[float, float] | None = None,
             tell: Callable[[str], None] = lambda text: None,
             workers: int | None = None) -> Diagnosis:
    """What is missing in a model, according to recordings?

    The model is refitted, its residual whitened by the noise and tested against all that the
    catalogue could have left there; entries, and pairs of them, are added inside the equations and
    refitted; what explains the recording must then predict `held_out`.  That proves an effect only
    if it could have refuted it.  Of very long recordings the beginnings are diagnosed; a note says
    so.

    Args:
        model: Nominal model with a second-order coordinate (a state that is the rate of another).
        train: Recording, or several, to explain.
        held_out: Recording, or several, with another excitation, to prove it on.  Without one the
            end of the recording is set aside, and the verdict is at most "unconfirmed".
        alpha: Rate of false alarms.
        quiet: Start and stop [s] of a stretch known to show noise only.
        tell: Called with what is being done.
        workers: Threads that fit side by side; by default two where there are as many cores.  The
            diagnosis does not depend on it.

    Returns:
        The diagnosis; `model` is the extended model, `to_dict()` the content of diagnosis.json.

    Raises:
        BadModel: No coordinate is found, or nothing is free.
        BadRecording: A channel is missing or unusable; there are too few samples; train and
            held-out are the same.
        BadSetting: alpha is no probability, or workers is not positive.
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
    if not 0 < alpha < 1:
        raise errors.BadSetting(errors.bad_value("alpha", alpha, "between 0 and 1"))
    if workers is not None and workers < 1:
        raise errors.BadSetting(errors.bad_value("workers", workers, "at least 1"))
    if not a_model(model).free_names:
        raise errors.BadModel(errors.nothing_free(model.name))
    later = None if held_out is None else several(held_out)
    with blas_on_one_thread():
        found = _diagnosed(model, several(train), later, alpha, quiet, tell, threads(workers))
    return replace(found, seconds=time.perf_counter() - begun)


def _diagnosed(model: Model, train: tuple[Recording, ...], later: tuple[Recording, ...] | None,
               alpha: float, quiet: tuple[float, float] | None, tell: Callable[[str], None],
               workers: int) -> Diagnosis:
    case = _opened(model, train, later, quiet, tell)
    case.search.workers = workers
    tell("detection")
    detection = case.test(case.base)
    if case.repeats is not None:
        detection = replace(detection, p_value=case.repeats.p_value)
    if not smaller(detection.p_value, alpha):
        answer = Answer("none", (), ())
    else:
        search = case.begin_search()
        ranked = search.run(case.adequate)
        if search.records is not case.records:
            tell("whole recordings")
            explained = not ranked[0].far
            search = case.resumed(search)
            # what nothing explained in part is not explained in whole
            ranked = search.grow(case.adequate) if explained else search.ranked()
        for _ in range(RELEVELLED):
            if not case.relevelled(ranked[0], quiet):
                break
            # the level was read through the mismatch itself: now it is out of the way
            tell("noise again")
            search = case.search
            ranked = search.grow(case.adequate)
        tell("confirmation")
        case.clear_later(ranked[0])
        answer = _settled(case, ranked, alpha)
        for _ in range(ASKED):
            before = {h.fit for h in search.ranked()}
            if not search.closer(answer.given):
                break
            # one that is better has rivals of its own
            known = search.ranked()[0].fit in before
            answer = _settled(case, search.ranked() if known else search.grow(case.adequate), alpha)
    shape, site = None, case.sites[0]
    if answer.verdict != "none":
        site = affected(case.base, answer.given, case.sites, case.candidates)
        shape = force_shape(case.base, site, case.candidates)
    if shape is not None and answer.verdict == "unnamed":
        tell("laws outside the catalogue")
        search = case.search
        search.offer(symbolic_candidates(shape, site))
        answer = with_formulas(answer, search.ranked(), search.scale(), case.test, case.predicted,
                               case.later is not None, case.proves, alpha)
    mend = None
    if shape is not None and answer.verdict == "unnamed" and case.later is not None:
        mend = patch(case.base, case.model, shape, site, case.records, case.later,
                     case.predicted)
    return replace(_diagnosis(case, detection, answer, site, shape, alpha), patch=mend)


def _settled(case: Case, ranked: Sequence[Hypothesis], alpha: float) -> Answer:
    return settle(ranked, case.search.scale(), case.test, case.predicted, case.later is not None,
                  case.proves, case.ahead, alpha)


def _opened(model: Model, train: tuple[Recording, ...], later: tuple[Recording, ...] | None,
            quiet: tuple[float, float] | None, tell: Callable[[str], None]) -> Case:
    notes: list[str] = []
    proves = later is not None
    if later is not None:
        check_pair(train, later)
        later = beginnings(model, later, "the held-out recording", notes)
    train = beginnings(model, train, "the recording", notes)
    if later is None:
        train, later = set_aside(train, model, notes)
    model = held_as_recorded(model, train)
    sites(model, train)  # a model in which nothing can be looked for is refused before any fit
    tell("nominal fit")
    together = oversampling(model, train)
    if together > 1:
        notes.append(f"{together} neighbouring samples of the outputs count as one: nothing in "
                     "them moves fast enough to need more.")
    records = prepared(model, train, quiet, notes, together)
    check_freedom(model, records)
    short = records.beginning(SEARCHED)
    before = NLS().fit(model, with_sigma(short, model))
    if short is not records:
        before = NLS(starts=1).fit(before.fitted_model, with_sigma(records, model))
    nominal = before.fitted_model
    rate = sites(nominal, records.recordings)[0].rate
    records, count = with_refined_noise(records, before, rate, quiet)
    note_outliers(count, "the recording", notes)
    held, excuse = None, ""
    if later is not None:
        held = prepared(model, later, None, notes, together, records.levels[0])
        count, _, needed = freedom(model, held)
        if count < needed:
            held, proves = None, False
            excuse = (f"the held-out recording has {count} usable samples, and at least {needed} "
                      "are needed to confirm anything")
    again = repeats(nominal, records, held if proves else None)
    if again is not None:
        notes += again.notes
        records = records.with_levels(again.levels)
        held = None if held is None else held.with_levels(again.levels)
    found = sites(nominal, records.recordings)
    listed = catalogue_of(found)
    search = Search(nominal, records, listed, tell,
                    guess={n: model.parameter(n).value for n in model.free_names})
    base = search.base()
    alone = tuple(c for c in listed if c.suits())
    case = Case(nominal, records, held, proves, found, alone, search, base, before, notes, {}, {},
                again, excuse)
    search.predicts = case.predicts
    return case


def _diagnosis(case: Case, detection: Detection, answer: Answer, site: Site,
               shape: ForceShape | None, alpha: float) -> Diagnosis:
    if case.excuse:
        case.notes.append(f"{case.excuse[0].upper()}{case.excuse[1:]}: it is left out.")
    best = answer.given[0] if answer.given else case.base
    after = as_estimate(best, case.before) if answer.given else case.before
    given, rejected = explanations(answer, case.search.scale(), case.test, case.predicted)
    proof = _proof(case, answer, best)
    if answer.verdict == "none" and proof is not None and proof.p_value < alpha:
        case.notes.append(
            "Nothing is missing in the recording, but the model does not predict the held-out one "
            f"(p = {proof.p_value:.1g}): diagnose that one, with this one held out.")
    if case.proves and (base := case.predicted(case.base)) and below(
            base.motion, least_proof(alpha)):
        case.notes.append(
            "The held-out recording is at rest, or too short: all that moves in it is worth "
            f"{base.motion:.2g} of chi-squared, and {least_proof(alpha):.0f} are needed to confirm "
            "anything.")
    levels = [level.sentence(o) for o, level in case.records.levels[0].items()]
    force = None if answer.verdict == "none" else force_over_time(case.base, site)
    return Diagnosis(
        answer.verdict, detection.p_value, alpha,
        locate(case.base, best, answer, site, shape, force, alpha),
        given, rejected, case.before, after, proof, tuple(levels),
        tuple(case.notes), smallest(case.base, case.candidates),
        advice(answer.verdict, given, case.records, case.rate, case.proves,
               case.search.workers, bool(answer.doubt)), shape=shape,
        force_over_time=force,
        doubt=answer.doubt or (case.excuse if answer.verdict == "unconfirmed" else ""))


def _proof(case: Case, answer: Answer, best: Hypothesis) -> Proof | None:
    before, after = case.predicted(case.base), case.predicted(best)
    if case.later is None or before is None or after is None:
        return None
    # all that a named model leaves is noise, not its highest frequencies alone
    share = best.noise if answer.verdict in ("named", "set") else 1.0
    outputs = {o.name: OutputError(before.rmse[o.name], after.rmse[o.name],
                                   after.rmse_moved[o.name],
                                   case.later.levels[0][o.name].sigma * share, o.unit)
               for o in case.model.outputs}
    return Proof(outputs, after.detection.p_value, after.t, after.measured, before.predicted,
                 after.predicted, after.moved)
