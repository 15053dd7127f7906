"""Catalogue: a recorded channel that the model does not use."""

from __future__ import annotations

from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.model import Model
from pikanid.model.parts import Input, Parameter


def cross_axis(site: Site) -> list[Candidate]:
    """A recorded channel that the model does not use acts along an input, or as a force.

    Along the input it reaches all that the input drives, a second mode as well; in the other
    reading it acts on the coordinate alone.
    """
    found = []
    goal = site.inputs[0] if site.inputs else site.v
    unit = site.model.input(goal).unit if site.inputs else site.force_unit
    for c in site.extra:
        k = Parameter(site.name(f"kappa_{c}"), 0.0, unit)  # for each unit of the channel

        def added(model: Model, c: str = c) -> Model:
            known = c in model.input_names
            return model if known else model.replace(inputs=(*model.inputs, Input(c)))

        def extend(model: Model, c: str = c, k: Parameter = k) -> Model:
            if site.inputs:
                return added(model, c).map_input(goal, function=f"{goal} + {k.name}*{c}")
            return added(model, c).with_term(site.v, f"{k.name}*{c}")

        def directly(model: Model, c: str = c, k: Parameter = k) -> Model:
            rate = model.equations[site.v]
            if symbol(goal) not in rate.free_symbols:  # what acts has another name by now
                return extend(model)
            along = symbol(goal) + symbol(k.name) * symbol(c)
            return added(model, c).replace(
                equations={**model.equations, site.v: rate.subs(symbol(goal), along)})

        def directions(view: View, c: str = c, k: Parameter = k) -> list[TangentDirection]:
            if site.inputs:
                return [TangentDirection({k.name: 1.0}, push={goal: view.extra[c]})]
            return [TangentDirection({k.name: 1.0}, force=view.extra[c])]

        found.append(Candidate(("cross_axis",), f"{c} acts as well", f"{k.name}*{c}", "dynamics",
                               site, (k,), extend, directions, variant=c,
                               other=directly if site.inputs else None))
    return found
