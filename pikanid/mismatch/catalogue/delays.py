"""Catalogue: an output or one of several inputs comes late, or was recorded late, more and more.

Alone, an input that comes late is a twin of an output that does.  Where another input acts as well,
or something moves at first, it is not.  What acted before a recording begins is not known, unless
the model says so, and goes on to act for as long as the input is late: it is another unknown of
each recording.  An input whose recorder lags behind that of the outputs acts before it is recorded.

One of several sensors that is late shows, of a motion under way, what was before the recording.
In its time all else is otherwise: inputs act late by as much, and other outputs are shown early.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site, estimates_a_start, estimates_all_starts
from pikanid.model import Model
from pikanid.model.parts import Parameter

SHIFTS = (0.3, 3.0, 8.0)  # numerical: samples, from where fits begin
LEADS = (1.5, 3.0, 8.0)  # numerical: the same of what acts before it is recorded


def delay(site: Site) -> list[Candidate]:
    """A shift in time: of all inputs or of the output, which are exact twins out of rest, and in
    operation, where a recording begins anywhere and what was before is not known.
    """
    tau = Parameter(site.name("tau"), 0.0, "s", (0.0, float("inf")))
    o = site.output.name
    several = len(site.model.outputs) > 1
    formulas = (*site.model.equations.values(), *(y.expression for y in site.model.outputs))
    under_way = several and estimates_all_starts(site.model) and not any(
        e.has(TIME) for e in formulas)
    past = pasts(site, site.pasts) if under_way or not several else {}

    def directions(view: View) -> list[TangentDirection]:
        step = float(np.median(np.diff(view.t)))
        return [TangentDirection({tau.name: shift}, one_sided=True, seen=np.interp(
            view.t - shift, view.t, view.y[o]) - view.y[o]) for shift in step * np.array(SHIFTS)]

    own = Candidate(
        ("sensor_delay",), "a delay of the sensor", f"{o}(t - {tau.name})", "sensor", site, (tau,),
        partial(Model.map_output, name=o, delay=tau.name), directions, twin="delay")
    either = replace(own, ids=("input_delay", "sensor_delay"),
                     name="a delay of the input or of the sensor")
    held = either if site.inputs and site.still else own
    if not (past or under_way):
        return [held]
    moving = replace(
        either if len(past) == 1 and not several else own, parameters=(tau, *past.values()),
        expression=f"{own.expression}{_before(past)}",
        extend=partial(_seen_late, o, tau.name, past),
        begins=tuple(p.name for p in past.values()))
    return [moving] if estimates_a_start(site.model) else [
        held, replace(moving, variant="moving", beside=("initial_state",))]


def input_delay(site: Site) -> list[Candidate]:
    """A delay of each input by itself; of a lone one only beside a channel that acts as well, where
    it is the same as one of the output.
    """
    tau = Parameter(site.name("tau_in"), 0.0, "s", (0.0, float("inf")))
    same = len(site.inputs) == 1 and (site.still or (
        len(site.pasts) == len(site.model.outputs) == 1 and estimates_a_start(site.model)))
    return [Candidate(
        ("input_delay",), f"a delay of {u}", f"{u}(t - {tau.name}){_before(past)}", "input", site,
        (tau, *past.values()), partial(delayed, {u: tau.name}, past),
        partial(_shifted, u, tau, SHIFTS, 1), variant=u, twin="delay",
        beside=("cross_axis",) if same else (), begins=tuple(p.name for p in past.values()))
        for u in site.inputs for past in [pasts(site, (u,))]]


def pasts(site: Site, inputs: Iterable[str]) -> dict[str, Parameter]:
    """What those inputs were before each recording, where that is not known."""
    return {u: Parameter(site.name("u_past", u if len(site.pasts) > 1 else ""),
                         sum(site.pasts[u]) / 2, site.model.input(u).unit, site.pasts[u],
                         scope="recording") for u in inputs if u in site.pasts}


def _before(past: Mapping[str, Parameter]) -> str:
    return "".join(f", {u} = {p.name} before" for u, p in past.items())


def delayed(by: Mapping[str, str], past: Mapping[str, Parameter], model: Model) -> Model:
    """The model whose inputs come late by so much, after what they were before a recording."""
    for u, tau in by.items():
        before = past[u].name if u in past else None
        # beside another delay of the same input it was no other
        told = before is not None and model.input(u).past == symbol(before)
        model = model.map_input(u, delay=tau, past=None if told else before)
    return model


def _seen_late(output: str, tau: str, past: Mapping[str, Parameter], model: Model) -> Model:
    """The model in the time of an output that is late by so much."""
    for other in model.output_names:
        if other != output:
            model = model.map_output(other, delay=f"-{tau}")
    return delayed(dict.fromkeys(model.input_names, tau), past, model)


def input_lead(site: Site) -> list[Candidate]:
    """Each input recorded late: what acts is what is written a while later, by a sample at least.

    Less is how the input runs between samples, or a digital filter behind the sensor.
    """
    tau = Parameter(site.name("tau_lead"), site.interval, "s", (site.interval, float("inf")))
    return [Candidate(
        ("input_lead",), f"{u} acts before it is recorded", f"{u}(t + {tau.name})", "input", site,
        (tau,), partial(delayed, {u: f"-{tau.name}"}, {}),
        partial(_shifted, u, tau, LEADS, -1), variant=u, undoes="input_delay")
        for u in site.inputs]


def clock_error(site: Site) -> list[Candidate]:
    """The clock of a sensor that loses against that of the inputs, or gains: both agree when the
    first recording begins.  Where no input acts, time is what the sensor says.
    """
    if not site.model.inputs:
        return []
    e, o = Parameter(site.name("clock"), 0.0, "", (-0.5, 0.5)), site.output.name
    since = f"(t - {site.span[0]!r})" if site.span[0] else "t"
    return [Candidate(
        ("clock_error",), "a clock error of the sensor", f"{o}(t + {e.name}*{since})", "sensor",
        site, (e,), partial(Model.map_output, name=o, delay=f"-{e.name}*{since}"),
        lambda view: [TangentDirection(
            {e.name: 1.0}, seen=(view.t - site.span[0]) * view.y_rate[o])])]


def _shifted(u: str, tau: Parameter, shifts: Sequence[float], later: int, view: View
             ) -> Sequence[TangentDirection]:
    """An input by so many samples later, or, of -1, earlier."""
    step = float(np.median(np.diff(view.t)))
    return [TangentDirection({tau.name: shift * step}, one_sided=True, push={
        u: np.interp(view.t - later * shift * step, view.t, view.u[u]) - view.u[u]})
        for shift in shifts]
