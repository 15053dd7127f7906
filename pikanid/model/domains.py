"""Which catalogues of effects a model takes: those of its domain, or of the units of its states."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import chain

from pikanid.errors.wording import listed
from pikanid.formula import units
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.effects_file import catalogues, read_effects
from pikanid.model.lookup import Lookup
from pikanid.pieces.sentences import enumerated

# A catalogue is taken where some state or input has a unit that tells its domain, for the states
# that have such a unit or one that goes with it.  A voltage alone tells nothing: levels and angles
# are recorded in volts as well; nor does a length, which may be a level or a place: where something
# flows it is a level, unless its rate is a state.
STATES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "thermal": (("K",), ()), "kinetics": (("mol/l", "mol", "kg/l", "kg"), ("l",)),
    "electrical": (("A",), ("V", "C")), "hydraulics": (("Pa", "l/s"), ("l", "m"))}


def catalogues_of(model: Lookup) -> tuple[str, ...]:
    """Names of the catalogues of the model's domain, or else of the units of its states.

    >>> import pikanid as pk
    >>> catalogues_of(pk.systems.thermal_rc()), catalogues_of(pk.systems.cascaded_tanks())
    (('thermal',), ('hydraulics',))
    """
    return tuple(_states_of(model))


def _states_of(model: Lookup) -> dict[str, tuple[str, ...]]:
    """Of each catalogue that a model takes, the states for which it does; of several domains that a
    model names one is not for states whose units tell another one.
    """
    if model.domain is not None:
        own = {name: {*_in_units(model, STATES[name][0])} for name in model.domain
               if name in STATES}
        return {name: tuple(s for s in model.state_names if s in own.get(name, ()) or not any(
            s in others for others in own.values())) for name in model.domain}
    found = {name: _in_units(model, telling + beside)
             for name, (telling, beside) in STATES.items() if _tells(model, telling)}
    return {name: found[name] for name in catalogues() if found.get(name)}


def _in_units(model: Lookup, others: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(s.name for s in model.states
                 if _like(s.unit, others) and not _moved(model, s.name))


def _moved(model: Lookup, state: str) -> bool:
    """Whether a state's rate is another state, as of a place."""
    rate = model.equations[state]
    return bool(rate.is_Symbol) and rate.name in model.state_names


def _tells(model: Lookup, telling: tuple[str, ...]) -> bool:
    return any(_like(unit, telling) for unit in (
        *(s.unit for s in model.states), *(i.unit for i in model.inputs)))


def _like(unit: str, others: tuple[str, ...]) -> bool:
    return any(units.convertible(unit, other) for other in others)


def candidates_of(model: Lookup) -> tuple[Effect | EffectForm, ...]:
    """The effects of the catalogues that a model takes, for the states for which it does, and those
    that it lists: of two with one key the latter.
    """
    listed = (replace(e, within=states) if isinstance(e, EffectForm) else e
              for name, states in _states_of(model).items() for e in read_effects(name))
    return tuple({e.key: e for e in (*listed, *model.effects)}.values())


def not_taken(model: Lookup, known: Iterable[str]) -> str:
    """A sentence on the catalogues for models of its kind whose effects are not among the `known`
    ones; empty where the model names its domain, or the units of all of its states do.

    >>> import pikanid as pk
    >>> not_taken(pk.systems.sloshing(), ())[:58]
    'No effects of the catalogue mechanics were looked for: `do'
    """
    taken_for = _states_of(model)
    if model.domain is not None or {*model.state_names} == {*chain(*taken_for.values())}:
        return ""
    ids = {*known}
    moves = any(_moved(model, name) for name in model.state_names)
    left = [name for name in catalogues() if (name == "mechanics") == moves
            and name not in taken_for and not ids & {e.key for e in read_effects(name)}]
    return "" if not left else (
        f"No effects of the catalogue{'s' * (len(left) > 1)} {listed(left)} were looked for: "
        "`domain = \"...\"` in the model, or --catalogue, adds them.")


def taken(model: Lookup) -> str:
    """A sentence on the catalogues that a model takes; empty where it takes none.

    >>> import pikanid as pk
    >>> taken(pk.systems.thermal_rc())
    "Effects of the catalogue thermal are looked for as well, by the units of the model's states."
    """
    names = catalogues_of(model)
    if not names:
        return ""
    told = {*chain(*_states_of(model).values())}
    why = ("the model's domain" if model.domain is not None else
           "the units of the model's states" if told == {*model.state_names} else
           f"the units of {enumerated([s for s in model.state_names if s in told])}")
    return (f"Effects of the catalogue{'s' * (len(names) > 1)} {' and '.join(names)} are looked "
            f"for as well, by {why}.")
