"""Families of physics as they were fitted, and the equations in which they act."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from pikanid.mismatch.catalogue.candidate import Candidate, Family
from pikanid.mismatch.catalogue.regional_force import REGIONAL, is_everywhere
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.model.parts import Parameter

# definition: laws of a state, which every coordinate has or has not
OF_A_STATE = ("dry friction", "drag", "restoring force")


class Kind(NamedTuple):
    """A family of physics and, of laws of a state, the equation in which one acts; empty: any."""

    family: Family
    place: str = ""

    def among(self, kinds: Iterable[Kind]) -> bool:
        """Whether one of these is of it."""
        return any(k.family == self.family and self.place in ("", k.place) for k in kinds)


def families_of(effect: Candidate, h: Hypothesis, dry: float) -> tuple[Family, ...]:
    """Of an effect as it was fitted: dry friction is what hardly rises with speed, and a force in a
    region that the motion does not leave is constant.
    """
    if effect.key in h.blurred:
        return ("drag",)
    if effect.ids == (REGIONAL,) and is_everywhere(effect, h.values, h.whitened.motion(
            h.minimum.theta)):
        return ("constant force",)
    if isinstance(effect.exponent, Parameter) and h.values[effect.exponent.name] <= dry:
        return ("dry friction",)
    return effect.families


def kinds_of(effect: Candidate, h: Hypothesis, dry: float) -> tuple[Kind, ...]:
    """The families of an effect as it was fitted, and where."""
    return tuple(Kind(family, effect.site.v if family in OF_A_STATE else "")
                 for family in families_of(effect, h, dry))


def members(kind: Kind, h: Hypothesis, dry: float) -> list[Candidate]:
    """The effects of a hypothesis that are of a kind."""
    return [e for e in h.effects if kind.among(kinds_of(e, h, dry))]


def kinds_in(h: Hypothesis, dry: float) -> list[Kind]:
    """All kinds of its effects; of several places of one family, that family anywhere as well."""
    found = {k for e in h.effects for k in kinds_of(e, h, dry)}
    several = [k.family for k in found]
    return sorted(found | {Kind(f) for f in several if several.count(f) > 1})


def holds(h: Hypothesis, effect: Candidate) -> bool:
    """Whether a hypothesis holds an effect, another variant of it, or a twin."""
    return any((set(e.ids) & set(effect.ids) and e.site.v == effect.site.v)
               or (e.alike and e.alike == effect.alike) for e in h.effects)
