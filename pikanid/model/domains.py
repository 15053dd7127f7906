"""Which catalogues of effects a model takes: those of its domain, or of the units of its states."""

from __future__ import annotations

from pikanid.formula import units
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm
from pikanid.model.effects_file import catalogues, read_effects
from pikanid.model.lookup import Lookup

# A catalogue is taken where every state has such a unit.  A voltage alone tells nothing: levels
# and angles are recorded in volts as well.
STATES = {"thermal": ("K",), "kinetics": ("mol/l", "mol", "kg/l"), "electrical": ("A",)}


def catalogues_of(model: Lookup) -> tuple[str, ...]:
    """Names of the catalogues of the model's domain, or else of the units of its states.

    >>> import pikanid as pk
    >>> catalogues_of(pk.systems.thermal_rc()), catalogues_of(pk.systems.cascaded_tanks())
    (('thermal',), ('hydraulics',))
    """
    if model.domain is not None:
        return model.domain
    return tuple(name for name in catalogues() if name in STATES and all(
        any(units.convertible(s.unit, unit) for unit in STATES[name]) for s in model.states))


def candidates_of(model: Lookup) -> tuple[Effect | EffectForm, ...]:
    """The effects of the catalogues that a model takes, and those that it lists: of two with one
    key the latter.
    """
    listed = (e for name in catalogues_of(model) for e in read_effects(name))
    return tuple({e.key: e for e in (*listed, *model.effects)}.values())


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
