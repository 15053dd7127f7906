"""What goes into a state in proportion to another one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pikanid.formula import units
from pikanid.mismatch.catalogue.candidate import Candidate, View
from pikanid.mismatch.catalogue.forces import term
from pikanid.mismatch.catalogue.site import Site
from pikanid.model.parts import Parameter


def coupled_state(site: Site) -> list[Candidate]:
    """k y: a linear coupling to any other state, of a motion to those of other coordinates; where
    the model has one its parameters take it up.
    """
    found = []
    for y in (s for s in site.model.states if s.name not in site.moving):
        unit = units.product((site.force_unit, 1), (y.unit or "1", -1))
        k = Parameter(site.name("k_of", y.name), 0.0, unit)
        found.append(term(
            site, "coupled_state", f"a part of {site.v}' in proportion to {y.name}",
            f"{k.name}*{y.name}", k, _course(y.name), one_sided=False, variant=y.name))
    return found


def _course(y: str) -> Callable[[View], np.ndarray]:
    return lambda w: w.x[y]
