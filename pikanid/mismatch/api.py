"""`diagnose`: detect, locate, name, model and prove what a model leaves out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.mismatch.advice import advice
from pikanid.mismatch.candidate import Candidate
from pikanid.mismatch.catalogue import candidates as catalogue_of
from pikanid.mismatch.detect import Detection
from pikanid.mismatch.estimating import as_estimate
from pikanid.mismatch.force_shape import ForceShape, force_shape
from pikanid.mismatch.hypothesis import Hypothesis
from pikanid.mismatch.judge import HeldOut, held_out, residual_tests
from pikanid.mismatch.latent_force import force_over_time
from pikanid.mismatch.locate import locate, smallest
from pikanid.mismatch.outliers import without_lone
from pikanid.mismatch.patch import patch
from pikanid.mismatch.preparation import (
    check_pair,
    held_as_recorded,
    oversampling,
    prepared,
    set_aside,
    with_refined_noise,
    with_sigma,
)
from pikanid.mismatch.result import Diagnosis, Proof
from pikanid.mismatch.search import Search
from pikanid.mismatch.site import Site, sites
from pikanid.mismatch.symbols import symbolic_candidates
from pikanid.mismatch.verdict import WORTH, Answer, explanations, settle, with_formulas
from pikanid.mismatch.whitened import Records
from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS

SEARCHED = 6000  # rows that a search is made on before its best hypotheses get all
EXPLAINED = 0.05  # p-value above which a search need not go on
SAME, SAME_RHO = 0.05, 0.06  # changes of a noise level, and its correlation, that make none
BETTER = 0.9  # ratio of held-out RMSEs that makes one more effect worth while
Recordings = Recording | Sequence[Recording]


def diagnose(model: Model, train: Recordings, held_out: Recordings | None = None, *,
             alpha: float = 0.01, quiet: tuple[float, float] | None = None,
             tell: Callable[[str], None] = lambda text: None) -> Diagnosis:
    """What is missing in a model, according to recordings?

    The model is refitted, its residual whitened by the noise and tested against all that the
    catalogue could have left there; entries, and pairs of them, are added inside the equations and
    refitted; what explains the recording must then predict `held_out`.

    Args:
        model: Nominal model with a second-order coordinate (a state that is the rate of another).
        train: Recording, or several, to explain.
        held_out: Recording, or several, with another excitation, to prove it on.  Without one the
            end of the recording is set aside, and the verdict is at most "unconfirmed".
        alpha: Rate of false alarms.
        quiet: Start and stop [s] of a stretch known to show noise only.
        tell: Called with what is being done.

    Returns:
        The diagnosis; `model` is the extended model, `to_dict()` the content of diagnosis.json.

    Raises:
        BadModel: No coordinate is found, or nothing is free.
        BadRecording: A channel is missing or unusable; train and held-out are the same.
        BadSetting: alpha is no probability.
        SimulationFailed: The model cannot be simulated.

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
    if not model.free_names:
        raise errors.BadModel(errors.nothing_free(model.name))
    case = _opened(model, _several(train), None if held_out is None else _several(held_out),
                   quiet, tell)
    tell("detection")
    detection = case.test(case.base)
    if detection.p_value >= alpha:
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
        if case.relevelled(ranked[0], quiet):
            # the first level was read through the mismatch itself: now it is out of the way
            tell("noise again")
            search = case.search
            ranked = search.grow(case.adequate)
        tell("confirmation")
        case.clear_later(ranked[0])
        answer = settle(ranked, search.scale(), case.test, case.predicted,
                        case.later is not None, case.proves)
    shape = None
    if answer.verdict != "none":
        shape = force_shape(case.base, case.sites[0], case.candidates)
    if shape is not None and answer.verdict == "unnamed" and not answer.contested:
        tell("laws outside the catalogue")
        search = case.search
        search.offer(symbolic_candidates(shape, case.sites[0]))
        answer = with_formulas(answer, search.ranked(), search.scale(), case.test, case.predicted,
                               case.later is not None, case.proves)
    mend = None
    if shape is not None and answer.verdict == "unnamed" and case.later is not None:
        mend = patch(case.base, case.model, shape, case.sites[0], case.records, case.later,
                     case.predicted)
    return replace(_diagnosis(case, detection, answer, shape, alpha), patch=mend,
                   seconds=time.perf_counter() - begun)


@dataclass
class Case:
    """A model with the recordings to explain and those to prove it on, ready for tests."""

    model: Model
    records: Records
    later: Records | None
    proves: bool
    sites: tuple[Site, ...]
    candidates: tuple[Candidate, ...]
    search: Search
    base: Hypothesis
    before: Estimate
    notes: list[str]
    tests: dict[tuple[frozenset[str], float], Detection]
    predictions: dict[tuple[frozenset[str], float], HeldOut | None]

    @property
    def rate(self) -> float:
        """Natural frequency of the first coordinate [rad/s]."""
        return self.sites[0].rate

    def begin_search(self) -> Search:
        """A search on as much of the recordings as can be searched in a minute."""
        short = self.records.beginning(SEARCHED)
        return self.search if short is self.records else self.resumed(self.search, short)

    def resumed(self, search: Search, records: Records | None = None) -> Search:
        """A search with what it has found, on other records: by default on all."""
        self.search = search.carried_over(records or self.records)
        self.base = self.search.base()
        self.tests.clear()
        self.predictions.clear()
        return self.search

    def relevelled(self, best: Hypothesis, quiet: tuple[float, float] | None) -> bool:
        """Read the noise from what the best explanation leaves; whether that made a difference."""
        if best.far:
            return False
        fit = as_estimate(best, self.before)
        new, count = with_refined_noise(self.records, fit, self.rate, quiet)
        _note_outliers(count, "the recording", self.notes)
        same = all(
            abs(np.log(a[o].sigma / b[o].sigma)) < SAME and abs(a[o].rho - b[o].rho) < SAME_RHO
            for a, b in zip(self.records.levels, new.levels, strict=True) for o in a)
        if same and not count:
            return False
        self.records = new
        self.resumed(self.search)
        if self.later is not None:
            self.later = Records(self.later.recordings,
                                 tuple(new.levels[0] for _ in self.later.recordings))
        return True

    def clear_later(self, best: Hypothesis) -> None:
        """Leave the outliers of the held-out recordings out that the best prediction shows."""
        prediction = None if best.far else self.predicted(best)
        if self.later is None or prediction is None:
            return
        self.later, count = without_lone(self.later, prediction.residuals)
        if count:
            _note_outliers(count, "the held-out recording", self.notes)
            self.predictions.clear()

    def adequate(self, h: Hypothesis) -> bool:
        """Whether nothing is left in the train recordings."""
        return not h.far and self.test(h).p_value > EXPLAINED

    def test(self, h: Hypothesis) -> Detection:
        """What is left in the train recordings."""
        if h.fit not in self.tests:
            self.tests[h.fit] = residual_tests(
                h.whitened, h.minimum.theta, h.minimum.r, h.minimum.J, self.candidates, self.rate)
        return self.tests[h.fit]

    def predicted(self, h: Hypothesis) -> HeldOut | None:
        """What is left in the held-out recordings."""
        if self.later is None:
            return None
        if h.fit not in self.predictions:
            self.predictions[h.fit] = held_out(h, self.model, self.later, self.candidates,
                                               self.rate)
        return self.predictions[h.fit]

    def predicts(self, fewer: Hypothesis, more: Hypothesis) -> bool:
        """Whether a hypothesis is worth its effects beyond another one.

        Where a misfit is left anyway, an effect always gains on the recording that it is fitted to:
        then it has to predict the held-out recording clearly better.
        """
        if self.later is None or not more.far:
            return True
        old, new, nominal = (self.predicted(h) for h in (fewer, more, self.base))
        return old is None or nominal is None or (
            new is not None and new.rmse < min(BETTER * old.rmse, old.rmse - WORTH * nominal.rmse))


def _several(recordings: Recordings) -> tuple[Recording, ...]:
    return (recordings,) if isinstance(recordings, Recording) else tuple(recordings)


def _opened(model: Model, train: tuple[Recording, ...], later: tuple[Recording, ...] | None,
            quiet: tuple[float, float] | None, tell: Callable[[str], None]) -> Case:
    notes: list[str] = []
    proves = later is not None
    if later is not None:
        check_pair(train, later)
    else:
        train, later = set_aside(train, model, notes)
    model = held_as_recorded(model, train)
    tell("nominal fit")
    together = oversampling(model, train)
    if together > 1:
        notes.append(f"{together} neighbouring samples of the outputs count as one: nothing in "
                     "them moves fast enough to need more.")
    records = prepared(model, train, quiet, notes, together)
    short = records.beginning(SEARCHED)
    before = NLS().fit(model, with_sigma(short, model))
    if short is not records:
        before = NLS(starts=1).fit(before.fitted_model, with_sigma(records, model))
    nominal = before.fitted_model
    rate = sites(nominal, records.recordings)[0].rate
    records, count = with_refined_noise(records, before, rate, quiet)
    _note_outliers(count, "the recording", notes)
    held = None
    if later is not None:
        held = prepared(model, later, None, notes, together, records.levels[0])
    found = sites(nominal, records.recordings)
    listed = catalogue_of(found)
    search = Search(nominal, records, listed, tell)
    base = search.base()
    case = Case(nominal, records, held, proves, found, listed, search, base, before, notes, {}, {})
    search.predicts = case.predicts
    return case


def _note_outliers(count: int, where: str, notes: list[str]) -> None:
    if count:
        notes.append(f"{count} more outliers of {where} show beside a fit and are left out.")


def _diagnosis(case: Case, detection: Detection, answer: Answer, shape: ForceShape | None,
               alpha: float) -> Diagnosis:
    best = answer.given[0] if answer.given else case.base
    after = as_estimate(best, case.before) if answer.given else case.before
    given, rejected = explanations(answer, case.search.scale(), case.test, case.predicted)
    levels = [level.sentence(o) for o, level in case.records.levels[0].items()]
    force = None if answer.verdict == "none" else force_over_time(case.base, case.sites[0])
    return Diagnosis(
        answer.verdict, detection.p_value, alpha,
        locate(case.base, best, answer, case.sites, shape, force, alpha),
        given, rejected, case.before, after, _proof(case, answer, best), tuple(levels),
        tuple(case.notes), smallest(case.base, case.candidates),
        advice(answer.verdict, given, case.records, case.rate, case.proves), shape=shape,
        force_over_time=force)


def _proof(case: Case, answer: Answer, best: Hypothesis) -> Proof | None:
    before, after = case.predicted(case.base), case.predicted(best)
    if case.later is None or before is None or after is None:
        return None
    # all that a named model leaves is noise, not its highest frequencies alone
    share = best.noise if answer.verdict in ("named", "set") else 1.0
    sigma = next(iter(case.later.levels[0].values())).sigma * share
    return Proof(before.rmse, after.rmse, sigma, case.model.outputs[0].unit,
                 after.detection.p_value, after.t, after.measured, before.predicted,
                 after.predicted)
