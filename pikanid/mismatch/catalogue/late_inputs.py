"""Catalogue: one of several inputs comes late, or was recorded late.

Alone, an input that comes late is a twin of an output that does.  Where another input acts as well,
or something moves at first, it is not.  An input whose recorder lags behind that of the outputs
acts before it is recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Parameter

SHIFTS = (0.3, 3.0, 8.0)  # numerical: samples, from where fits begin
LEADS = (1.5, 3.0, 8.0)  # numerical: the same of what acts before it is recorded


def input_delay(site: Site) -> list[Candidate]:
    """A delay of each input by itself; of a lone one out of rest only beside a channel that acts as
    well.
    """
    tau = Parameter(site.name("tau_in"), 0.0, "s", (0.0, float("inf")))
    return [Candidate(
        ("input_delay",), f"a delay of {u}", f"{u}(t - {tau.name})", "input", site, (tau,),
        partial(_delayed, u, tau.name),
        partial(_shifted, u, tau, SHIFTS, 1), variant=u, twin="delay",
        beside=() if len(site.inputs) > 1 or not site.still else ("cross_axis",))
        for u in site.inputs]


def input_lead(site: Site) -> list[Candidate]:
    """Each input recorded late: what acts is what is written a while later, by a sample at least.

    Less is how the input runs between samples, or a digital filter behind the sensor.
    """
    tau = Parameter(site.name("tau_lead"), site.interval, "s", (site.interval, float("inf")))
    return [Candidate(
        ("input_lead",), f"{u} acts before it is recorded", f"{u}(t + {tau.name})", "input", site,
        (tau,), partial(_delayed, u, f"-{tau.name}"),
        partial(_shifted, u, tau, LEADS, -1), variant=u, undoes="input_delay")
        for u in site.inputs]


def _delayed(u: str, by: str, model: Model) -> Model:
    return model.map_input(u, delay=by)


def _shifted(u: str, tau: Parameter, shifts: Sequence[float], later: int, view: View
             ) -> Sequence[TangentDirection]:
    """An input by so many samples later, or, of -1, earlier."""
    step = float(np.median(np.diff(view.t)))
    return [TangentDirection({tau.name: shift * step}, one_sided=True, push={
        u: np.interp(view.t - later * shift * step, view.t, view.u[u]) - view.u[u]})
        for shift in shifts]
