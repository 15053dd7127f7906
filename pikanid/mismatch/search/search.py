"""Which effects explain a recording: screened to first order, then refitted one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pikanid import errors
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.decisions import below, in_order
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis, near_guess
from pikanid.mismatch.fitting.parallel import ordered_parallel_map
from pikanid.mismatch.fitting.progressive_horizon import hits, lost
from pikanid.mismatch.search import leaders, neighbours, places
from pikanid.mismatch.search.neighbours import Job, Starts
from pikanid.mismatch.search.overdispersion import overdispersion
from pikanid.mismatch.search.screen import Screen, drag, entry, fixed, kept, law, nothing
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.settings.thresholds import price
from pikanid.model import Model

Adequate = Callable[[Hypothesis], bool]


@dataclass
class Search:
    """Finds hypotheses about records; keeps every fit it has made.

    Attributes:
        nominal: Model, at its refitted parameters.
        records: To explain.
        candidates: Entries of the catalogue and decoys.
        tell: Called with what is being done.
        predicts: Whether other recordings say that the second hypothesis is worth its effects.
        fits: The closest fit of each set of effects.
        begun: Where fits have begun.
        failed_searches: Effects that were looked for beyond all hills, and explained nothing.
        screens: What may be added to hypotheses, by their fits and the candidates.
        workers: Threads that fit side by side; the results do not depend on their number.
    """

    nominal: Model
    records: Records
    candidates: tuple[Candidate, ...]
    tell: Callable[[str], None] = lambda text: None
    predicts: Callable[[Hypothesis, Hypothesis], bool] = lambda fewer, more: True
    fits: dict[frozenset[str], Hypothesis] = field(default_factory=dict)
    begun: set[object] = field(default_factory=set)
    failed_searches: set[frozenset[str]] = field(default_factory=set)
    screens: dict[object, Screen] = field(default_factory=dict)
    spent: float = 0.0
    workers: int = 1

    @property
    def settings(self) -> Settings:
        """By which the records are judged."""
        return self.records.settings

    @property
    def budget_exhausted(self) -> bool:
        """Whether so much has been simulated that what has been found must do."""
        return self.spent > self.settings.budget.effort

    @property
    def choices(self) -> int:
        """Number of entries to choose from."""
        return sum(c.known and c.suits() and not c.refines for c in self.candidates)

    def base(self) -> Hypothesis:
        """The nominal model, refitted; SimulationFailed where that cannot be."""
        self._fit_all([((), [{}])], always=True)
        if frozenset() not in self.fits:
            raise errors.SimulationFailed(errors.too_rough_to_diagnose(self.nominal.name))
        return self.fits[frozenset()]

    def run(self, adequate: Adequate) -> list[Hypothesis]:
        """All hypotheses tried, best first; `adequate` says of one that nothing is left."""
        every, budget = [c for c in self.candidates if c.fits and c.suits()], self.settings.budget
        self.tell("single effects")
        for count in range(budget.nominal_again):
            screen = Screen(base := self.base(), every, self.records.guess)
            self._fit_all([((c,), starts) for c, starts in screen.singles(
                budget.singles, always=entry if base.far else law)], again=count > 0, always=True)
            self._fit_all([((), [h.point]) for h in leaders.leading(self.ranked())[
                :budget.leading]], again=True, always=True)
            if self.base() is base:
                break  # else effects had led out of a minimum that only the nominal model was in
        # where what is missing has led the nominal model away, effects show about the guess
        for other in places.other_places(self.base(), near_guess(self.nominal, self.records)):
            self._fit_all([((c,), starts) for c, starts in Screen(other, every).singles(
                budget.singles)], again=True, always=True, reach=self.base().minimum.chi2)
        self.spent = 0.0  # every effect has had its turn: effort is what combinations cost
        self._simplify()
        if not adequate(best := self.ranked()[0]):
            self._fit_all([*neighbours.afresh(best, self.records.guess)], again=True)
        if not adequate(self.ranked()[0]):
            self.tell("pairs of effects")
            self._fit_all(screen.pairs(budget.pairs))
            self._simplify()
        return self.grow(adequate)

    def grow(self, adequate: Adequate) -> list[Hypothesis]:
        """Add effects to the best hypotheses as long as something is left and that helps."""
        settings, budget = self.settings, self.settings.budget
        for count in range(1, budget.effects):
            if not adequate(best := self.ranked()[0]):
                self._fit_all([*neighbours.afresh(best, self.records.guess)], again=True)
            event = leaders.an_event(best := self.ranked()[0])
            if adequate(best) or (self.budget_exhausted and not event):
                break
            self.tell(f"{count + 1} effects together")
            rows = best.whitened.rows
            near = rows + settings.fits.far * max(best.minimum.chi2 - rows, float(np.sqrt(rows)))
            simple = leaders.to_extend(self.ranked(), self.fits)
            for h in simple[: budget.leading if count == 1 else 1]:
                if len(h.effects) < budget.effects and (h is simple[0] or h.minimum.chi2 < near):
                    self._extend(h, budget.beside_one if count == 1 else budget.beside_more,
                                 always=law if count == 1 and h is simple[0] else nothing,
                                 anyway=event and h is best)
            if self.ranked()[0] is best or (
                    len(best.effects) > 1 and not self.predicts(best, self.ranked()[0])):
                break
            self._simplify()  # what led out of a dead end may have done its part
        self._simplify()
        if not adequate(best := self.ranked()[0]):
            self._fit_all([*neighbours.with_events(best, self.candidates, self.fits)], again=True)
            self._simplify()
        if not (best := self.ranked()[0]).known:
            self._exchange(best, anyway=True)
        if not (self.ranked()[0].known and adequate(self.ranked()[0])):
            for h in leaders.leading(self.ranked())[:budget.leading]:
                self._fit_all([job for job in neighbours.with_wider(h, self.candidates)
                               if all(e.known for e in job[0])], again=True, always=True)
        best = self.ranked()[0]
        if any(e.other_minima for e in best.effects) and not adequate(best):
            best = self._fit(best.effects, [best.point], again=True)  # hills left for later
        if adequate(best):
            # what a test of everything misses may still be worth its penalty, or nearly
            least = price(1, 1, best.whitened.rows, self.choices, settings.choice_weight)
            self._extend(best, budget.beside_more, anyway=True,
                         least=self.scale() * (least - settings.verdict.indistinct))
            for h in self._contenders():
                self._exchange(h)
            for h in self.ranked()[:budget.rivals]:
                # fewer effects that explain almost as much may do with another one
                reach = best.score(self.scale()) + 2 * settings.verdict.indistinct
                if (0 < len(h.effects) < len(best.effects) and not self.budget_exhausted
                        and not adequate(h) and below(h.score(self.scale()), reach)):
                    self._extend(h, budget.beside_one)
            self._simplify()
        # even without budget, no name without the laws that keep wrong ones away, of parts as well
        parts = [h for h in self.ranked() if h.key <= self.ranked()[0].key]
        for h in (*parts, *self._contenders()):
            for job in neighbours.with_other_form(h, self.candidates, self.fits):
                self._fit_all([job], again=not job[0][-1].known, always=True, settled=h.key)
        return self.ranked()

    def _contenders(self, wide: float = 1.0, anyway: bool = False) -> Iterator[Hypothesis]:
        """The hypotheses about as good as the best, within so many times that."""
        scale, ranked = self.scale(), self.ranked()
        reach = ranked[0].score(scale) + wide * self.settings.verdict.indistinct
        for h in ranked[:self.settings.budget.rivals]:
            if below(h.score(scale), reach) and (anyway or not self.budget_exhausted):
                yield h

    def _simplify(self) -> None:
        """Try less than the best: what led there may have only led out of a local minimum."""
        if self.ranked()[0].far:
            for closest in leaders.closest_of_each(self.fits.values()):
                self._fit_all([*neighbours.without_one(closest)], again=True, always=True)
        for _ in range(self.settings.budget.effects):
            best = self.ranked()[0]
            self._fit_all([*neighbours.reduced(best, self.candidates)], again=True, always=True,
                          settled=best.key if self.budget_exhausted else frozenset())
            if self.ranked()[0] is best:
                break

    def _exchange(self, best: Hypothesis, anyway: bool = False) -> None:
        """Put others in the place of each effect: rivals that no path led to."""
        for effect in best.effects if len(best.effects) > 1 or anyway else ():
            rest = tuple(e for e in best.effects if e is not effect)
            without = self._fit(rest, [best.point])
            if without.key == frozenset(e.key for e in rest):
                gap = without.minimum.chi2 - best.minimum.chi2
                # a law outside the catalogue takes up what no first step to an entry sees
                always = (partial(entry, channel=effect.channel) if not effect.known
                          else drag if anyway else nothing)
                self._extend(without, self.settings.budget.beside_one,
                             self.settings.search.promising * gap, always, anyway)

    def closer(self, hypotheses: Sequence[Hypothesis]) -> bool:
        """Fit neighbours of hypotheses on from where these stand; whether that found anything."""
        before, wide = {h.fit for h in self.fits.values()}, self.settings.verdict.behind
        for h in hypotheses[:self.settings.budget.asked_again]:
            self.refine((*neighbours.without_one(h), *neighbours.with_twins(h, self.candidates),
                         *places.elsewhere(h, self.candidates),
                         *neighbours.from_its_place(h, self._contenders(wide), self.base())), h.key)
            self._exchange(h, anyway=True)
            self.refine(neighbours.from_its_place(
                h, leaders.siblings(h, self.ranked()), self.base()), h.key)
        self._fit_all([job for h in self._contenders(anyway=True)
                       for job in neighbours.with_shapes(h, self.candidates)], always=True)
        return {h.fit for h in self.fits.values()} != before

    def refine(self, jobs: Iterable[Job], settled: frozenset[str] = frozenset()) -> bool:
        """Fit these effects from these starts, known or not; whether that found anything."""
        before = {h.fit for h in self.fits.values()}
        self._fit_all([*jobs], again=True, always=True, settled=settled)
        return {h.fit for h in self.fits.values()} != before

    def offer(self, jobs: Sequence[Job]) -> None:
        """Fit laws that no catalogue holds."""
        self.candidates += tuple(law for laws, _ in jobs for law in laws)
        self._fit_all(jobs, always=True)

    def carried_over(self, records: Records) -> Search:
        """The same search with other noise levels; the best hypotheses are refitted to them."""
        new = replace(self, records=records, fits={}, begun=set(), screens={},
                      failed_searches=set(self.failed_searches))
        new._fit_all([((), [self.base().point])], always=True)
        new.base()
        budget, ranked = self.settings.budget, self.ranked()
        near = self.settings.fits.far * (ranked[0].minimum.chi2 + ranked[0].whitened.rows)
        count = budget.carried_far if ranked[0].far else budget.carried
        new._fit_all([(h.effects, [h.point]) for h in ranked[:count]
                      if h.effects and h.minimum.chi2 < near], always=True,
                     settled=frozenset(c.key for c in self.candidates))
        return new

    def ranked(self) -> list[Hypothesis]:
        """Best first; the noise counts as what the best explanation leaves."""
        score = partial(Hypothesis.score, scale=self.scale())
        return in_order(self.fits.values(), score, Hypothesis.place)

    def scale(self) -> float:
        """The overdispersion: what χ² is divided by."""
        return overdispersion(self.fits.values())

    def _extend(self, hypothesis: Hypothesis, count: int, least: float = 0.0,
                always: Callable[[Candidate], bool] = nothing, anyway: bool = False) -> None:
        if len(hypothesis.effects) >= self.settings.budget.effects:
            return
        screen = kept(self.screens, hypothesis, neighbours.beside(hypothesis, self.candidates))
        needs, bent = self.settings.search, any(e.channel == "input" for e in hypothesis.effects)
        least = needs.much * hypothesis.minimum.chi2 if hypothesis.far else least
        jobs: list[Job] = [((*hypothesis.effects, candidate), starts)
                           for candidate, starts in screen.singles(
                               count, least, lambda c: always(c) or (bent and fixed(c)))]
        # from far off a fit of the same effects may have lost its way
        lost = [] if hypothesis.far else [
            job for job in jobs if (known := self.fits.get(frozenset(e.key for e in job[0])))
            and known.minimum.chi2 > hypothesis.minimum.chi2 - needs.kept * screen.promised(
                job[0][-1])]
        settled = frozenset() if hypothesis.far else hypothesis.key
        self._fit_all(jobs, always=anyway, settled=settled)
        self._fit_all(lost, again=True, settled=settled)

    def _fit(self, effects: Sequence[Candidate], starts: Starts, again: bool = False) -> Hypothesis:
        self._fit_all([(effects, starts)], again, always=True)
        return self.fits.get(frozenset(e.key for e in effects), self.base())

    def _fit_all(self, jobs: Sequence[Job], again: bool = False, always: bool = False,
                 reach: float = 0.0, settled: frozenset[str] = frozenset()) -> None:
        """Fit these effects from these starts, one after the other, and keep what is better; what
        is known is fitted `again` only, and nothing once the budget is exhausted, except `always`.
        Fits far above the closest one, and above `reach` [χ²], are given up; effects that are
        `settled` are not looked for beyond hills.
        """
        order = {c.key: k for k, c in enumerate(self.candidates)}
        failed = frozenset(self.failed_searches)

        def work(job: Job, chi2: float) -> tuple[Hypothesis | None, Closest]:
            closest, key = Closest(chi2), frozenset(e.key for e in job[0])
            return fitted(self.nominal, sorted(job[0], key=lambda e: order[e.key]), self.records,
                          job[1], self.choices, closest, key if key in failed else settled), closest

        def take(job: Job, result: tuple[Hypothesis | None, Closest]) -> None:
            found, _ = result
            self.spent += self.settings.budget.setup + (found.whitened.work if found else 0.0)
            key = frozenset(e.key for e in job[0])
            self.begun.add(neighbours.signature(job))
            if found and hits(found.effects) and lost(
                    found.minimum.chi2, found.whitened.rows, self.settings):
                self.failed_searches.add(key)
            if found and (key not in self.fits or found.improves_on(self.fits[key])):
                self.fits[key] = found

        jobs = [job for job in jobs if all(e.suits(job[0]) for e in job[0])
                and (again or frozenset(e.key for e in job[0]) not in self.fits)
                and neighbours.signature(job) not in self.begun]  # it would end where it did
        ordered_parallel_map(
            jobs, lambda: max(min((h.minimum.chi2 for h in self.fits.values()), default=np.inf),
                              reach), work, take, lambda: always or not self.budget_exhausted,
            self.workers, lambda result, chi2: result[1].stands(chi2))
