"""Everything that can hide, in one place."""

from __future__ import annotations

from pikanid.validation.concealed import (
    effects_beyond,
    effects_channel,
    effects_dynamics,
    effects_unforeseen,
)
from pikanid.validation.concealed.effect import Effect

CATALOGUE: tuple[Effect, ...] = (*effects_dynamics.EFFECTS, *effects_channel.EFFECTS)
NEAR: tuple[Effect, ...] = effects_beyond.NEAR
OUTSIDE: tuple[Effect, ...] = effects_beyond.OUTSIDE
UNFORESEEN: tuple[Effect, ...] = effects_unforeseen.UNFORESEEN
# A truth that is no setting of the rig at all: liquid in a tank.
POTENTIAL_FLOW = "potential_flow"

IDS: tuple[str, ...] = tuple(dict.fromkeys(effect.id for effect in CATALOGUE))


def variants(identifier: str) -> tuple[Effect, ...]:
    """The catalogue's effects of one id.

    >>> [effect.variant for effect in variants("parameter_drift")], len(IDS)
    (['length', 'damping'], 27)
    """
    return tuple(effect for effect in CATALOGUE if effect.id == identifier)
