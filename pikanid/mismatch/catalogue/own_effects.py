"""Catalogue: effects that users describe as text, in the names of their model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from pikanid import errors
from pikanid.mismatch.catalogue.begun import begun
from pikanid.mismatch.catalogue.candidate import Candidate, Channel, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site, may_be_under_way
from pikanid.model import Effect, Model
from pikanid.model.parts import Parameter

WITHIN = (0.1, 0.3, 0.5, 0.7, 0.9)  # numerical: shares of a range at which a parameter is tried
AROUND = (1.0, 0.3, 3.0)  # numerical: times a positive guess without a range
MOST_PROBES = 25  # limit: values at which one effect's sign is taken


def own_effects(effects: Iterable[Effect], sites: Sequence[Site],
                taken: Mapping[str, Candidate]) -> list[Candidate]:
    """One candidate for each effect.

    Args:
        effects: In the names of the sites' model.
        sites: Of the model.
        taken: The catalogue's own candidates, by key.

    Raises:
        BadModel: An id that the catalogue has already, an unknown family or twin, or a symbol that
            the model does not have.
    """
    made: dict[str, Candidate] = {}
    effects = list(effects)
    ids = {*(i for c in taken.values() for i in c.ids), *(e.key for e in effects)}
    for effect in effects:
        known = effect.key + effect.variant
        if known in made or any(effect.key in c.ids for c in taken.values()):
            raise errors.BadModel(errors.effect_twice(effect.key))
        for twin in effect.twins:
            if twin not in ids:
                raise errors.BadModel(errors.not_in_catalogue(twin, sorted(ids)))
        made[known] = own = _candidate(effect, sites)
        for state in _begun_as_another(effect, sites[0].model):
            made[f"{known} begun"] = begun(own, f"d_{state}", effect.states[state].unit)
    return [*made.values()]


def _candidate(effect: Effect, sites: Sequence[Site]) -> Candidate:
    site, nominal = _site(effect, sites), sites[0].model
    nominal.with_effect(effect)  # which is refused before anything is fitted
    size = effect.size
    others = tuple(p for p in effect.parameters if p.free and p.name != size.name)
    probes = tuple(_probes(others))

    def extend(model: Model) -> Model:
        return model.with_effect(effect, nominal)

    def directions(view: View) -> list[TangentDirection]:
        return [TangentDirection({size.name: 1.0, **probe}, null=size.value, scales=True,
                                 one_sided=size.bounds[0] >= size.value) for probe in probes]

    return Candidate(
        (effect.key,), effect.name, effect.expression, _channel(effect, nominal), site,
        (size, *others), extend, directions, effect.variant,
        families=(effect.family or effect.name,), probes=probes,
        argument=_argument(effect, site, nominal),
        levels=tuple({size.name: effect.start, **probe} for probe in probes))


def _begun_as_another(effect: Effect, model: Model) -> list[str]:
    """Its state if it has one, which begins where one of the model's does, and nobody knows where
    that is.
    """
    starts = [str(s.initial) for s in model.states] if may_be_under_way(model) else []
    return [n for n, state in effect.states.items()
            if len(effect.states) == 1 and state.initial.strip("()") in starts]  # as forms bind it


def _site(effect: Effect, sites: Sequence[Site]) -> Site:
    """Where it acts: the first equation, input or output that it names, else the first site."""
    named = [*effect.add, *effect.replace, *effect.initial, *effect.inputs, *effect.outputs]
    return next((s for n in named for s in sites
                 if n in (*s.moving, *s.inputs, s.output.name)), sites[0])


def _argument(effect: Effect, site: Site, nominal: Model) -> str:
    """The one state of the site that its own equation then depends on by it, if there is one."""
    before, after = nominal.equations[site.v], nominal.with_effect(effect).equations[site.v]
    used = {s.name for s in (after - before).free_symbols} & {*site.moving}
    return used.pop() if len(used) == 1 else ""


def _channel(effect: Effect, nominal: Model) -> Channel:
    replaced = {*nominal.state_names, *(s.name for e in nominal.equations.values()
                                        for s in e.free_symbols)} & effect.replace.keys()
    if effect.add or replaced or effect.states or effect.initial:
        return "dynamics"
    return "input" if effect.inputs else "sensor"


def _probes(parameters: Sequence[Parameter]) -> list[dict[str, float]]:
    """Values of the parameters but the size at which the effect's sign is taken: about each guess,
    all together where they are few, else one after the other.
    """
    tried = {p.name: _values(p) for p in parameters}
    if math.prod(map(len, tried.values())) <= MOST_PROBES:
        return [dict(zip(tried, values, strict=True))
                for values in itertools.product(*tried.values())]
    usual = {p.name: p.value for p in parameters}
    found = [usual, *({**usual, n: v} for n, values in tried.items() for v in values[1:])]
    return found[:MOST_PROBES]


def _values(p: Parameter) -> list[float]:
    low, high = p.bounds
    if math.isfinite(low) and math.isfinite(high):
        return [p.value, *(low + share * (high - low) for share in WITHIN)]
    return [v for share in AROUND if low <= (v := share * p.value) <= high] or [p.value]


def with_twins(candidates: Iterable[Candidate], effects: Iterable[Effect]) -> list[Candidate]:
    """The candidates, with effects and all that these name as twins in one group."""
    listed, groups = list(candidates), dict[str, str]()
    for c in listed:
        groups |= dict.fromkeys(c.ids, c.twin)
    changed: set[str] = set()
    for effect in effects:
        if effect.twins:
            one = (effect.key, *effect.twins)
            joined = {groups[i] for i in one if groups[i]}
            name = min(joined, default=effect.key)
            moved = {i: name for i, group in groups.items() if i in one or group in joined}
            changed |= moved.keys()
            groups |= moved
    return [replace(c, twin=groups[c.ids[0]]) if c.ids[0] in changed else c for c in listed]
