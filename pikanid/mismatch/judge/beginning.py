"""Where a motion begins, read off its first samples."""

from __future__ import annotations

import numpy as np

from pikanid.formula.expressions import TIME, symbol
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.model import Model
from pikanid.problem.problem import Problem

SHARE = 0.4  # numerical: of the time in which a phase turns by one radian: a parabola follows that
ROUGH = 1e4  # numerical: chi2 per row: a start need not be simulated more closely than to 100 sigma


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
            states = [symbol(n) for n in model.state_names]
            slope = h.diff(symbol(site.moving[0]))
            samples = [s for s in experiment.samples
                       if model.outputs[s.output].name == site.output.name]
            # what bends need have no value at zero, as 1/T
            if slope == 0 or not samples or not inside or not all(
                    h.diff(s).is_number for s in states):
                continue
            shift = h.subs({s: 0 for s in states})
            if not shift.is_number:
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


def begun(model: Model, records: Records) -> Model:
    """The model, with the guesses of its free initial values as the data begin where it is closer
    to them from there: populations guessed at zero stay there, and no fit moves them.

    Of several recordings, whose starts differ, the guesses stay.
    """
    if len(records.recordings) > 1:
        return model
    whitened = Whitened(model, records)
    guess = whitened.problem.guess

    def apart(theta: np.ndarray) -> float:
        return whitened.chi2(theta) if whitened.choose_steps(theta, misfit=ROUGH) else np.inf

    theta = own_beginning(whitened.problem, guess, sites(model, records.recordings))
    if not apart(theta) < apart(guess):
        return model
    return model.with_values({f.name: float(v) for f, v in zip(
        whitened.problem.free, theta, strict=True) if f.recording is not None})
