"""Which catalogues of effects a model takes: those of its domain, or of the units of its states."""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.errors.wording import listed
from pikanid.formula import units
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.effects_file import catalogues, read_effects
from pikanid.model.lookup import Lookup

# A catalogue is taken where some state has a unit that tells its domain, and every other one such a
# unit or one that goes with it.  A voltage alone tells nothing: levels and angles are recorded in
# volts as well; nor does a length, which may be a level or a place.
STATES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "thermal": (("K",), ()), "kinetics": (("mol/l", "mol", "kg/l"), ("l",)),
    "electrical": (("A",), ("V", "C")), "hydraulics": (("Pa",), ("l", "l/s"))}


def catalogues_of(model: Lookup) -> tuple[str, ...]:
    """Names of the catalogues of the model's domain, or else of the units of its states.

    >>> import pikanid as pk
    >>> catalogues_of(pk.systems.thermal_rc()), catalogues_of(pk.systems.cascaded_tanks())
    (('thermal',), ('hydraulics',))
    """
    if model.domain is not None:
        return model.domain
    return tuple(name for name in catalogues() if name in STATES and _of(model, *STATES[name]))


def _of(model: Lookup, telling: tuple[str, ...], beside: tuple[str, ...]) -> bool:
    def like(unit: str, others: tuple[str, ...]) -> bool:
        return any(units.convertible(unit, other) for other in others)

    return any(like(s.unit, telling) for s in model.states) and all(
        like(s.unit, telling + beside) for s in model.states)


def candidates_of(model: Lookup) -> tuple[Effect | EffectForm, ...]:
    """The effects of the catalogues that a model takes, and those that it lists: of two with one
    key the latter.
    """
    listed = (e for name in catalogues_of(model) for e in read_effects(name))
    return tuple({e.key: e for e in (*listed, *model.effects)}.values())


def not_taken(model: Lookup, known: Iterable[str]) -> str:
    """A sentence on the catalogues for models of its kind whose effects are not among the `known`
    ones; empty where the model names its domain, or its units do.

    >>> import pikanid as pk
    >>> not_taken(pk.systems.sloshing(), ())[:58]
    'No effects of the catalogue mechanics were looked for: `do'
    """
    if model.domain is not None or catalogues_of(model):
        return ""
    ids = {*known}
    moves = any(e.is_Symbol and e.name in model.state_names for e in model.equations.values())
    left = [name for name in catalogues() if (name == "mechanics") == moves
            and not ids & {e.key for e in read_effects(name)}]
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
    why = "the model's domain" if model.domain is not None else "the units of the model's states"
    return (f"Effects of the catalogue{'s' * (len(names) > 1)} {' and '.join(names)} are looked "
            f"for as well, by {why}.")
