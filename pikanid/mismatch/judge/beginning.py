"""Where a motion begins, read off its first samples."""

from __future__ import annotations

import numpy as np

from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.site import Site
from pikanid.problem.problem import Problem

SHARE = 0.4  # numerical: of the time in which a phase turns by one radian: a parabola follows that


def own_beginning(problem: Problem, theta: np.ndarray, sites: tuple[Site, ...]) -> np.ndarray:
    """θ (n,) with each free initial position and rate of every recording as its data begin.

    A fit from another motion's start may end at a wrong phase.  Positions count that an output
    shows in proportion; the parabola spans at least five samples.
    """
    found = theta.copy()
    model = problem.model
    for r, experiment in enumerate(problem.experiments):
        values = dict(zip(model.parameter_names, problem.parameters(theta, r), strict=True))
        inside = {problem.free[k].name: k for k in problem.columns(r)[1]
                  if problem.free[k].recording is not None}
        for site in sites:
            h = model.output(site.output.name).expression.subs(
                {TIME: experiment.t0, **{symbol(n): v for n, v in values.items()}})
            slope = h.diff(symbol(site.moving[0]))
            samples = [s for s in experiment.samples
                       if model.outputs[s.output].name == site.output.name]
            shift = h.subs({symbol(n): 0 for n in model.state_names})
            if not (slope.is_number and shift.is_number) or slope == 0 or not samples or not inside:
                continue
            t, y = samples[0].t, samples[0].y
            count = max(5, int(np.searchsorted(t, t[0] + SHARE / site.rate)) if site.rate else 5)
            rate, level = np.polyfit(t[:count] - experiment.t0, y[:count], 2)[1:]
            begun = ((level - float(shift)) / float(slope), rate / float(slope))
            for name, value in zip(site.moving, begun, strict=False):
                start = model.state(name).initial
                if start.is_Symbol and start.name in inside:
                    found[inside[start.name]] = value
    return np.clip(found, problem.lower, problem.upper)
