"""A force that acts in a region of a state: what pushes a motion that keeps to a region as a
constant force does, and leaves the rest alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.forces import INF
from pikanid.mismatch.catalogue.site import Site
from pikanid.model.parts import Parameter

REGIONAL = "regional_force"
WIDEST = 0.3  # definition: of a state's range, half of a region in it: then its ends are at rest
CENTRES = np.linspace(0.1, 0.9, 9)  # numerical: of a state's range, where a region may lie
WIDTHS = (0.08, 0.2)  # numerical: of that range, how wide it may be
NARROWEST = 1e-9  # numerical: of a state's unit, so that a width is never nothing


def regional_forces(entry: Candidate) -> list[Candidate]:
    """k exp(-((s - h)/w)²) in place of a constant force, for each state s of its equation that can
    have a region of its own.
    """
    site = entry.site
    return [_regional(entry, s) for s in site.moving if s != site.q or site.placed]


def is_everywhere(law: Candidate, values: Mapping[str, float], motion: Mapping[str, np.ndarray]
                  ) -> bool:
    """Whether its region is as wide as a motion (L,), or has its middle outside of that: there the
    law is a constant force, with a slope at most.
    """
    _, at, wide = (values[p.name] for p in law.parameters)
    low, high = float(motion[law.variant].min()), float(motion[law.variant].max())
    return not low < at < high or wide > WIDEST * (high - low)


def _regional(entry: Candidate, s: str) -> Candidate:
    site: Site = entry.site
    unit = site.model.state(s).unit
    k = Parameter(site.name(f"k_region_{s}"), 0.0, site.force_unit)
    h = Parameter(site.name(f"h_region_{s}"), 0.0, unit)
    w = Parameter(site.name(f"w_region_{s}"), 1.0, unit, (NARROWEST, INF))
    text = f"{k.name}*exp(-(({s} - {h.name})/{w.name})**2)"

    def signs(view: View) -> Sequence[TangentDirection]:
        x = view.x[s]
        low, high = float(x.min()), float(x.max())
        if not high > low:
            return []
        return [TangentDirection({k.name: 1.0, h.name: at, w.name: wide},
                                 force=np.exp(-((x - at) / wide) ** 2))
                for at in (low + (high - low) * CENTRES).tolist()
                for wide in ((high - low) * np.array(WIDTHS)).tolist()]

    return replace(entry, ids=(REGIONAL,), name=f"a force in a region of {s}",
                   expression=text, parameters=(k, h, w), variant=s, twin="", families=(),
                   extend=lambda m: site.pushed(m, text), directions=lambda view: [], known=False,
                   form="", next_to=entry.key, signs=signs)
