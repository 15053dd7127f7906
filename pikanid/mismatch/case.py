"""A model with recordings, as it is diagnosed: what is fitted, tested and predicted so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pikanid import errors
from pikanid.estimate import Estimate
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.covered import covered
from pikanid.mismatch.data.outliers import without_lone
from pikanid.mismatch.data.own_noise import with_own_noise
from pikanid.mismatch.data.preparation import with_refined_noise
from pikanid.mismatch.data.put_back import put_back
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.remainder import residual_tests
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.as_estimate import as_estimate
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.fitting.lowest import lowest
from pikanid.mismatch.fitting.parallel import side_by_side
from pikanid.mismatch.fitting.repeats import Repeats
from pikanid.mismatch.judge.evidence import Evidence
from pikanid.mismatch.judge.prediction import HeldOut, held_out
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model


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
    repeats: Repeats | None = None
    excuse: str = ""  # why held-out recordings that were given prove nothing

    @property
    def settings(self) -> Settings:
        """By which it is diagnosed."""
        return self.records.settings

    @property
    def rate(self) -> float:
        """Natural frequency of the first coordinate [rad/s]."""
        return self.sites[0].rate

    def begin_search(self) -> Search:
        """A search on as much of the recordings as can be searched in a minute."""
        short = self.records.beginning(self.settings.budget.rows_searched)
        return self.search if short is self.records else self.resumed(self.search, short)

    def resumed(self, search: Search, records: Records | None = None) -> Search:
        """A search with what it has found, on other records: by default on all."""
        self.search = search.carried_over(records or self.records)
        self.base = self.search.base()
        self.tests.clear()
        self.predictions.clear()
        return self.search

    def uncovered(self, best: Hypothesis) -> bool:
        """Leave out what came after the inputs were recorded, by the delays of the best
        explanation; whether there is any.
        """
        new = covered(self.records, best.model, best.values)
        later = self.later and covered(self.later, best.model, best.values)
        if new is self.records and later is self.later:
            return False
        self.records, self.later = new, later
        self.notes.append(errors.after_the_inputs())
        self.resumed(self.search)
        return True

    def relevelled(self, best: Hypothesis, quiet: tuple[float, float] | None) -> bool:
        """Read the noise from what the best explanation leaves; whether that made a difference.

        What repeats have told of the noise needs no explanation.
        """
        if best.far or self.repeats is not None:
            return False
        heard = self.heard(best)
        fit = as_estimate(best, self.before)
        # a large misfit may have led the nominal model's natural frequency far away
        here = self.model.with_values({n: best.values[n] for n in self.model.free_names})
        rate = sites(here, self.records.recordings)[0].rate
        explained = self.adequate(best)
        records = self.records
        if explained:
            records = put_back(records, best.model, best.minimum.theta)
        new = with_refined_noise(records, fit, rate, quiet, explained)
        if not explained:
            # high frequencies tell little of the colour of noise: it may be all that is left
            other = with_refined_noise(self.records, fit, rate, quiet, True)
            if not self._same(other, new) and self._clears(best, other):
                new = other
        if self._same(self.records, new) and new.left_out == self.records.left_out:
            return heard
        self.records = new
        self.resumed(self.search)
        if self.later is not None:
            self.later = self.later.with_levels(new.levels[0])
            self.heard(self.search.ranked()[0])
        return True

    def noise_alone(self, quiet: tuple[float, float] | None) -> Records | None:
        """The records with noise, of whatever colour, that is all that the nominal model leaves;
        None where no such noise is, or repeats have told it.
        """
        if self.repeats is not None:
            return None
        other = with_refined_noise(self.records, as_estimate(self.base, self.before), self.rate,
                                   quiet, True)
        return other if self._clears(self.base, other) else None

    def heard(self, best: Hypothesis) -> bool:
        """Read the noise of held-out recordings from what the best explanation leaves of them;
        whether that made a difference.
        """
        prediction = None if self.repeats is not None else self.predicted(best)
        if self.later is None or prediction is None:
            return False
        new = with_own_noise(self.later, prediction.residuals, self.records.levels[0], self.rate,
                             self.model.input_names)
        if self._same(self.later, new):
            return False
        self.later = new
        self.predictions.clear()
        return True

    def _clears(self, h: Hypothesis, records: Records) -> bool:
        """Whether nothing is left where the noise is as these records have it."""
        whitened = Whitened(h.model, records)
        problem = whitened.problem
        if not whitened.choose_steps(h.minimum.theta):
            return False
        found = lowest(whitened, h.minimum.theta, self.settings.budget.noise_refit)
        return found is not None and residual_tests(
            whitened, found.theta, found.r, found.movable(problem.lower, problem.upper),
            self.candidates, self.rate
        ).p_value > self.settings.adequate

    def clear_later(self, best: Hypothesis) -> None:
        """Leave the outliers of the held-out recordings out that the best prediction shows."""
        prediction = None if best.far else self.predicted(best)
        if self.later is None or prediction is None:
            return
        before = self.later
        self.later = without_lone(before, prediction.residuals, self.model.input_names)
        if self.later.left_out != before.left_out:
            self.predictions.clear()

    def adequate(self, h: Hypothesis) -> bool:
        """Whether nothing is left in the train recordings, nor anything in the held-out ones that
        refutes it.
        """
        if h.far or self.test(h).p_value <= self.settings.needless:
            return False
        seen = self.predicted(h)
        return self.later is None or (
            seen is not None and not smaller(seen.detection.p_value, self.settings.adequate))

    def detected(self) -> Detection:
        """Whether the nominal model leaves anything; between repeats, what they differ by tells."""
        found = self.test(self.base)
        return found if self.repeats is None else replace(found, p_value=self.repeats.p_value)

    def refuted(self) -> Detection | None:
        """What held-out recordings alone show of the nominal model, far beyond chance; None where
        they do not, or where repeats tell.
        """
        seen = self.predicted(self.base) if self.proves and self.repeats is None else None
        found = seen and seen.detection
        return found if found and smaller(found.p_value, self.settings.refuted) else None

    def test(self, h: Hypothesis) -> Detection:
        """What is left in the train recordings."""
        if h.fit not in self.tests:
            self.tests[h.fit] = residual_tests(
                h.whitened, h.minimum.theta, h.minimum.r, h.movable, self.candidates, self.rate)
        return self.tests[h.fit]

    def predicted(self, h: Hypothesis) -> HeldOut | None:
        """What is left in the held-out recordings."""
        if self.later is None:
            return None
        if h.fit not in self.predictions:
            self.predictions[h.fit] = held_out(h, self.model, self.later, self.candidates,
                                               self.rate)
        return self.predictions[h.fit]

    def ahead(self, jobs: Sequence[Callable[[], object]]) -> None:
        """Do this side by side."""
        side_by_side(jobs, lambda job: job(), self.search.workers)

    def evidence(self, ranked: Sequence[Hypothesis]) -> Evidence:
        """What all recordings say of ranked hypotheses."""
        return Evidence(ranked, self.search.scale(), self.test, self.predicted,
                        self.later is not None, self.proves, self.settings, self.ahead)

    def predicts(self, fewer: Hypothesis, more: Hypothesis) -> bool:
        """Whether a hypothesis is worth its effects beyond another one.

        Where a misfit is left anyway, an effect always gains on the recording that it is fitted to:
        then it has to predict the held-out recording clearly better.
        """
        if self.later is None or not more.far:
            return True
        asks = self.settings.verdict
        old, new, nominal = (self.predicted(h) for h in (fewer, more, self.base))
        return old is None or nominal is None or (
            new is not None and smaller(
                new.misfit, min(asks.improvement * old.misfit,
                                old.misfit - asks.worth * nominal.misfit)))

    def _same(self, one: Records, other: Records) -> bool:
        noise = self.settings.noise
        return all(abs(np.log(a[o].sigma / b[o].sigma)) < noise.same
                   and abs(a[o].rho - b[o].rho) < noise.same_correlation
                   for a, b in zip(one.levels, other.levels, strict=True) for o in a)
