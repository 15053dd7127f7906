"""What an experiment could reveal, before there is any data.

Each effect of the catalogue is added to the model in turn and made as strong as it takes to be
seen; then the nominal model and the effect's rivals are refitted to the recording that it would
give, without noise.  D = |y_true - y_refitted|/σ is the distance that is left, and D² the
non-centrality of the likelihood-ratio test between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import inf

import numpy as np

from pikanid import errors
from pikanid.mismatch.catalogue.bound_effects import (
    bound_to,
    motion_along,
    reserved,
    with_unseen_speeds,
)
from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.catalogue import candidates as catalogue_of
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.design.response import Sigma
from pikanid.mismatch.design.sizing import Sized, recorded, sized
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.search.screen import Screen
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.model import Model
from pikanid.model.domains import candidates_of
from pikanid.model.rates import in_rates
from pikanid.problem.arguments import a_model, one_recording
from pikanid.recording import Recording


@dataclass(frozen=True)
class Rival:
    """Another explanation of what an effect would show: its key, and D [σ] after a refit."""

    key: str
    distance: float


@dataclass(frozen=True)
class Visible:
    """One effect in one experiment.

    Attributes:
        key: Of the effect, ids and variant.
        ids: Names in reports; all of a group of exact twins.
        name: For people.
        parameter: That is its size; empty if it is there or not.
        unit: Of the size.
        smallest: Detectable size, as a departure from no effect, of its most visible form;
            infinite where none is detected.
        falling: Whether `smallest` is a limit that shows the more the lower it lies.
        value: Of that parameter at `strength`.
        strength: Distance of the refitted nominal model [σ] at which rivals are compared.
        rivals: The closest first; none where the nominal model itself explains the effect.
    """

    key: str
    ids: tuple[str, ...]
    name: str
    parameter: str
    unit: str
    smallest: float
    falling: bool
    value: float
    strength: float
    rivals: tuple[Rival, ...]


@dataclass(frozen=True)
class Confusable:
    """What an experiment can and cannot tell.

    Attributes:
        effects: In the order of the catalogue.
        separated: Distance from which two effects count as told apart [σ].
    """

    effects: tuple[Visible, ...]
    separated: float

    @property
    def pairs(self) -> tuple[tuple[str, str, float], ...]:
        """(true effect, rival, D) that the experiment cannot separate, the closest first."""
        found = [(e.key, r.key, r.distance) for e in self.effects for r in e.rivals
                 if r.distance < self.separated]
        return tuple(sorted(found, key=lambda pair: pair[2]))

    def smallest(self, key: str) -> float:
        """Smallest detectable size of an effect.

        Raises:
            BadSetting: If the experiment could not show such an effect at all.
        """
        sizes = {e.key: e.smallest for e in self.effects}
        if key not in sizes:
            raise errors.BadSetting(errors.not_in_catalogue(key, sizes))
        return sizes[key]

    def to_dict(self) -> dict[str, object]:
        """For JSON: sizes below (limits: above) which effects stay undetected, and the pairs."""
        def sizes(falling: bool) -> dict[str, object]:
            return {e.key: {"value": e.smallest if e.smallest < inf else None, "unit": e.unit}
                    for e in self.effects if e.parameter and e.falling == falling}

        return {
            "undetectable_below": sizes(False), "undetectable_above": sizes(True),
            "confusable": [{"true": a, "rival": b, "distance": d} for a, b, d in self.pairs]}

    def __str__(self) -> str:
        width = max((len(e.key) for e in self.effects), default=0)
        lines = [f"{'effect':{width}}  {'detectable':30}  cannot be told from"]
        for e in self.effects:
            size = ("not at all" if e.smallest == inf else
                    f"{e.parameter} {'<' if e.falling else '>'} {e.smallest:.3g} {e.unit}"
                    if e.parameter else "not at all" if e.strength < self.separated else "always")
            near = [f"{r.key} ({r.distance:.1f} σ)" for r in e.rivals
                    if r.distance < self.separated]
            if e.strength < self.separated:
                near = [f"the nominal model ({e.strength:.1f} σ)"]
            lines.append(f"{e.key:{width}}  {size:30}  {', '.join(near) or '-'}")
        return "\n".join(lines)


def confusable(model: Model, excitation: Recording, sigma: Sigma = None, *,
               only: Sequence[str] | None = None, strength: float = 30.0, refit: bool = True,
               settings: Settings = DEFAULTS, tell: Callable[[str], None] = lambda text: None
               ) -> Confusable:
    """Smallest detectable size of every effect, and the pairs that an experiment cannot separate.

    Args:
        model: Nominal, at its parameter values; its free parameters are refitted.
        excitation: The experiment: inputs, and further channels that would be recorded.
        sigma: White noise of the outputs, if neither model nor recording carries it.
        only: Ids of the effects that are asked about; all by default.  Rivals are always all.
        strength: How visible each effect is made before its rivals are compared [σ].
        refit: Whether the closest rivals are refitted by simulation; else all distances are those
            of the first order.
        settings: From which distance on an effect is seen, and two are told apart; budgets.
        tell: Called with the effect that is being looked at.

    Raises:
        BadModel: If no state reaches an output.
        BadSetting: If σ is unknown for an output, an id in `only` is none of this model's, or
            `strength` does not tell effects apart (above 4 σ by default).
        SimulationFailed: If the nominal model cannot be simulated.

    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> found = confusable(systems.sloshing(), excitation.two_pulse(), 0.1*np.pi/180,
    ...                    only=["sensor_offset"])
    >>> [(pair[0], pair[1]) for pair in found.pairs]
    [('sensor_offset', 'static_bias')]
    """
    separated = settings.separated
    if not separated < strength < inf:
        raise errors.BadSetting(errors.bad_value("strength", strength, f"above {separated:g}"))
    model, _ = in_rates(a_model(model))
    effects, model = candidates_of(model), model.replace(effects=())
    nothing = recorded(model, one_recording(excitation), sigma, settings)
    motion = cache(lambda: motion_along(model, nothing))
    found = with_unseen_speeds(sites(model, nothing.recordings), motion)
    given = bound_to(effects, found, nothing.recordings, motion)
    catalogue = tuple(c for c in catalogue_of(reserved(found, given), given)
                      if c.known and c.fits and c.suits() and not c.refines)
    base = fitted(model, (), nothing, [{}], len(catalogue))
    if base is None:
        raise errors.SimulationFailed(errors.too_rough_to_plan(model.name, excitation.name))
    screen = Screen(base, catalogue)
    asked = [k for k, c in enumerate(catalogue) if only is None or set(only) & set(c.ids)]
    unknown = set(only or ()) - {i for c in catalogue for i in c.ids}
    if unknown:
        known = [i for c in catalogue for i in c.ids]
        raise errors.BadSetting(errors.not_in_catalogue(min(unknown), known))
    shown = []
    for k in asked:
        candidate = catalogue[k]
        tell(candidate.key)
        own = np.flatnonzero(screen.found.owner == k)
        if not np.any(screen.lengths[own] > 0):
            shown.append(_visible(candidate, None, None, (), settings))
            continue
        first = sized(candidate, screen, own, settings.visible, base, excitation, sigma)
        strong = sized(candidate, screen, own, strength, base, excitation, sigma, typical=True)
        seen = strong is not None and strong.distance >= separated
        rivals = _rivals(model, strong, candidate, catalogue, refit) if strong and seen else ()
        shown.append(_visible(candidate, first, strong, rivals, settings))
    return Confusable(tuple(shown), separated)


def _visible(candidate: Candidate, first: Sized | None, strong: Sized | None,
             rivals: Sequence[Rival], settings: Settings) -> Visible:
    name = strong.parameter if strong else ""
    unit = next((p.unit for p in candidate.parameters if p.name == name), "")
    found = first is not None and first.distance >= settings.reached * settings.visible
    smallest = first.departure if first and found else inf
    return Visible(candidate.key, candidate.ids, candidate.name, name, unit, smallest,
                   first.falling if first else False,
                   strong.values.get(name, 0.0) if strong else 0.0,
                   strong.distance if strong else 0.0, tuple(rivals))


def _rivals(model: Model, truth: Sized, candidate: Candidate, catalogue: Sequence[Candidate],
            refit: bool) -> list[Rival]:
    """Every other effect's distance from the truth, the closest first."""
    # A law that contains the effect as a special case is no rival: the special case is the name.
    others = [c for c in catalogue if c.key != candidate.key and candidate.key not in c.covers]
    screen = Screen(truth.nominal, others)
    left = truth.nominal.minimum.chi2
    distances = {}
    for k, other in enumerate(others):
        gains = screen.gain[screen.found.owner == k]
        distances[other.key] = float(np.sqrt(max(left - gains.max(initial=0.0), 0.0)))
    if refit:
        for other, starts in screen.singles(truth.records.settings.budget.planned_refits):
            found = fitted(model, (other,), truth.records, starts, len(catalogue))
            if found is not None:
                distances[other.key] = float(np.sqrt(found.minimum.chi2))
    return sorted((Rival(key, d) for key, d in distances.items()), key=lambda r: r.distance)
