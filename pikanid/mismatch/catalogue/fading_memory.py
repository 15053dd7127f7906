"""A state that remembers where it was: a store behind it, or what drives it away from there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pikanid.mismatch.catalogue.begun import begun
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.forces import INF
from pikanid.mismatch.catalogue.site import Site, may_be_under_way
from pikanid.model import Model
from pikanid.model.parts import Parameter, State

MEMORIES = (0.01, 0.03, 0.1, 0.3)  # numerical: of a recording, how long a state is remembered


def fading_memory(site: Site) -> list[Candidate]:
    """k (w - x), w' = r (x - w): of a state x that is no other one's rate, or of a rate that the
    model resists, without a restoring force at the guesses.  With one it is a boundary layer's next
    form (`neighbouring_forms`); without any resistance it would stand for that.
    """
    if site.q and (site.rate or not site.resisted):
        return []
    span, x, w = site.span[1] - site.span[0], site.v, site.name("wake")
    k = Parameter(site.name("k_wake"), 0.0, "1/s")
    slow, fast = 0.5 / span, max(0.5 / site.interval, 2 / span)
    r = Parameter(site.name("r_wake"), min(10 / span, 0.5 * (slow + fast)), "1/s", (slow, fast))
    text = f"{k.name}*({w} - {x})"

    def extend(model: Model) -> Model:
        state = model.state(x)
        return model.with_state(State(w, unit=state.unit, initial=state.initial),
                                f"{r.name}*({x} - {w})").with_term(x, text)

    def directions(view: View) -> list[TangentDirection]:
        from pikanid.mismatch.catalogue.recurrences import lagged

        return [TangentDirection(
            {k.name: 1.0, r.name: 1 / (share * span)},
            force=lagged(view.t, view.x[x], view.rates[x], share * span) - view.x[x])
            for share in MEMORIES]

    memory = Candidate(("fading_memory",), "a memory that fades", text, "dynamics", site, (k, r),
                       extend, directions, known=False)
    return [memory, *([begun(memory, site.name("d_wake"), site.model.state(x).unit)]
                      if may_be_under_way(site.model) else [])]


def without_store(memory: Candidate) -> Candidate:
    """The same where an entry is the store: what drives the state away from where it was."""
    k, *others = memory.parameters

    def directions(view: View) -> list[TangentDirection]:
        return [replace(one, start={**one.start, k.name: -1.0}, force=-np.asarray(one.force),
                        one_sided=True) for one in memory.directions(view)]

    return replace(memory, parameters=(replace(k, bounds=(-INF, 0.0)), *others),
                   directions=directions)
