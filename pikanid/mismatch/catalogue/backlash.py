"""Catalogue: play behind an input."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model.parts import Parameter
from pikanid.problem.held import HeldInput, acting

SIZES = (0.003, 0.01, 0.03, 0.08, 0.2, 0.4)  # numerical: half plays, of the input's largest value
STARTS = (-1.0, 0.0, 1.0)  # numerical: where in it a recording in operation begins


def input_backlash(site: Site) -> list[Candidate]:
    """Play behind the input: each time that it turns round it moves nothing for a while.

    Where an input that does not begin at 0 begins in its play is another unknown of each recording.
    """
    return [_behind(site, u) for u in site.inputs]


def _behind(site: Site, u: str) -> Candidate:
    unit = site.model.input(u).unit
    half = Parameter(site.name("half_play", site.variant(u)), 0.0, unit, (0.0, float("inf")))
    begun = Parameter(site.name("play_start", site.variant(u)), 0.0, "", (-1.0, 1.0),
                      scope="recording")
    operating = u in site.operating

    def directions(view: View) -> list[TangentDirection]:
        d = HeldInput(u, view.t, view.u[u], "zero")
        top = float(np.abs(d.values).max(initial=0.0))
        found = []
        for size in top * np.array(SIZES) if top else ():
            for start in STARTS if operating else (np.nan,):
                acts = acting(d, size, start=start).parts(size, start=start)
                moved = sum((factor * part.at(view.t) for part, factor in acts), -d.values)
                point = {half.name: float(size)} | ({begun.name: start} if operating else {})
                found.append(TangentDirection(point, push={u: moved}, one_sided=True,
                                              scales=False))
        return found

    first = f", {begun.name} half plays above it at first" if operating else ""
    return Candidate(
        ("hysteresis",), "backlash of the input", f"{u} behind a play of ±{half.name}{first}",
        "input", site, (half, begun) if operating else (half,), lambda m: m.map_input(
            u, backlash=half.name, backlash_start=begun.name if operating else None), directions,
        ",".join(filter(None, ("backlash", site.variant(u)))),
        begins=(begun.name,) if operating else ())
