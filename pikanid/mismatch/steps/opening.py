"""From a model and recordings to a case: prepare, fit the nominal model, read the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.bound_effects import (
    bound_to,
    motion_along,
    reserved,
    with_unseen_speeds,
)
from pikanid.mismatch.catalogue.catalogue import candidates as catalogue_of
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.pieces import in_pieces
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
from pikanid.mismatch.data.stretches import as_one
from pikanid.mismatch.fitting.repeats import repeats
from pikanid.mismatch.judge.beginning import begun
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings.settings import Settings
from pikanid.mismatch.steps.unlike import unlike
from pikanid.model import Effect, Model
from pikanid.model.domains import candidates_of, taken
from pikanid.model.rates import in_rates
from pikanid.model.shown_rates import shown_rates
from pikanid.problem.problem import bind
from pikanid.recording import Recording
from pikanid.strategies.nls import NLS


def open_case(model: Model, train: tuple[Recording, ...], later: tuple[Recording, ...] | None,
              quiet: tuple[float, float] | None, tell: Callable[[str], None], settings: Settings,
              workers: int = 1) -> Case:
    """A case ready for tests: recordings prepared, noise known, nominal model fitted.

    Args:
        model: Nominal model.
        train: Recordings to explain.
        later: Held-out recordings, if there are any.
        quiet: Start and stop [s] of a stretch known to show noise only.
        tell: Called with what is being done.
        settings: What is taken as given.
        workers: Threads of the search.

    Raises:
        BadModel: No state reaches an output.
        BadRecording: A channel is missing or unusable; there are too few samples; train and
            held-out are the same.
        SimulationFailed: The model cannot be simulated, or not as exactly as the noise asks.
    """
    notes = list(dict.fromkeys(f"Recording '{rec.name}': {note}" for rec in (*train, *(later or ()))
                               for note in rec.notes))
    proves = later is not None
    for recording in train:
        bind(model, recording)  # a channel that it lacks is no fault of the held-out one
    notes += unlike(model, train, later or ())
    if later is not None:
        check_pair(train, later)
        later = beginnings(model, later, "the held-out recording", notes, settings.budget)
    train = beginnings(model, train, "the recording", notes, settings.budget)
    if later is None:
        train, later = set_aside(train, model, notes, settings.noise)
    model, changes = in_rates(model)
    effects, said = candidates_of(model), taken(model)
    notes += [*changes, said] if said else changes
    notes += [f"'{shows}' shows the rate of '{state}': what acts on that acts on it as well."
              for shows, state in shown_rates(model).items()]
    model = held_as_recorded(model.replace(effects=()), train)
    # a model in which nothing can be looked for is refused before any fit, as a wrong effect is
    catalogue_of(sites(model, train), [e for e in effects if isinstance(e, Effect)])
    tell("nominal fit")
    together = oversampling(model, train, settings.budget)
    if together > 1:
        notes.append(f"{together} neighbouring samples of the outputs count as one: nothing in "
                     "them moves fast enough to need more.")
    records = prepared(model, train, quiet, notes, settings, together)
    check_freedom(model, records)
    short = records.beginning(settings.budget.rows_searched)
    model = begun(model, short)
    nls = NLS(adequacy=settings.adequacy, uncertainty=settings.uncertainty)
    before = nls.fit(model, with_sigma(short, model))
    if short is not records:
        before = replace(nls, starts=1).fit(before.fitted_model, with_sigma(records, model))
    nominal = before.fitted_model
    rate = sites(nominal, records.recordings)[0].rate
    records = with_refined_noise(records, before, rate, quiet)
    held, excuse = None, ""
    if later is not None:
        held = prepared(model, later, None, notes, settings, together, records.levels[0])
        count, _, needed = freedom(model, held)
        if count < needed:
            held, proves = None, False
            excuse = (f"the held-out recording has {count} usable samples, and at least {needed} "
                      "are needed to confirm anything")
    again = None
    if "pieces" in before.settings:
        nominal, records, held = in_pieces(nominal, records, held, nls)
        notes.append(before.warnings[0])
    else:
        again = repeats(nominal, records, held if proves else None)
    if again is not None:
        notes += again.notes
        records = records.with_levels(again.levels)
        held = None if held is None else held.with_levels(again.levels)
    motion = cache(lambda: motion_along(nominal, records))
    found = with_unseen_speeds(sites(nominal, records.recordings), motion)
    whole = tuple(as_one([records.recordings[k] for k in own]) for own in records.stretches)
    own = bound_to(effects, found, whole, motion)
    found = reserved(found, own)
    listed = catalogue_of(found, own)
    records = replace(records, guess={
        n: model.parameter(n).value for n in model.free_names if n in nominal.free_names})
    search = Search(nominal, records, listed, tell)
    base = search.base()
    alone = tuple(c for c in listed if c.suits())
    case = Case(nominal, records, held, proves, found, alone, search, base, before, notes, {}, {},
                again, excuse)
    search.predicts, search.workers = case.predicts, workers
    case.heard(base)
    return case
