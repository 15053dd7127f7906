"""Catalogue: one of several inputs comes late.

Alone, an input that comes late is a twin of an output that does.  Where another input acts as well,
or something moves at first, it is not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model.parts import Parameter

SHIFTS = (0.3, 3.0, 8.0)  # numerical: samples, from where fits begin


def input_delay(site: Site) -> list[Candidate]:
    """A delay of each input by itself; of a lone one out of rest only beside a channel that acts as
    well.
    """
    found = []
    for u in site.inputs:
        tau = Parameter(site.name("tau_in"), 0.0, "s", (0.0, float("inf")))

        def directions(view: View, u: str = u, tau: Parameter = tau) -> Sequence[TangentDirection]:
            step = float(np.median(np.diff(view.t)))
            return [TangentDirection({tau.name: shift * step}, one_sided=True, push={
                u: np.interp(view.t - shift * step, view.t, view.u[u]) - view.u[u]})
                for shift in SHIFTS]

        found.append(Candidate(
            ("input_delay",), f"a delay of {u}", f"{u}(t - {tau.name})", "input", site, (tau,),
            lambda m, u=u, tau=tau: m.map_input(u, delay=tau.name),  # type: ignore[misc]  # defaults
            directions, variant=u, twin="delay",
            beside=() if len(site.inputs) > 1 or not site.still else ("cross_axis",)))
    return found
