"""Reads the spline edges of an estimate, as it was saved: a discrepancy that comes from a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.discrepancy.edges import MARGIN, EdgePlan
from pikanid.estimate import Estimate
from pikanid.formula.expressions import symbol, to_text
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.laws import chosen, reading_unrefitted, sum_of_laws
from pikanid.symbolic.library import Form
from pikanid.symbolic.naming import name_curve
from pikanid.symbolic.reading import Reading
from pikanid.symbolic.settings import USUAL, SymbolicSettings
from pikanid.symbolic.significance import Contribution

DRAWN = 120  # numerical: points of an edge that are compared
REST = 1e-9  # numerical: of the range: as good as zero


def read_estimate(estimate: Estimate, library: Sequence[Form],
                  settings: SymbolicSettings = USUAL) -> Reading:
    """Every edge that `kan_discrepancy` put into the model, with its covariance.

    What edges and parameters can do in each other's place has a large variance, and so does not
    speak for or against a law.

    Raises:
        BadSetting: The model holds no such edges.
    """
    plans = _plans(estimate)
    if not plans:
        raise errors.BadSetting(errors.no_edges(estimate.model.name))
    named, weights = {}, []
    for k, plan in enumerate(plans):
        at = [estimate.index(n) for n in plan.coefficient_names]
        c, V = estimate.theta[at], estimate.covariance[np.ix_(at, at)]
        reach = plan.halfwidth / (1.0 + 2.0 * MARGIN)  # what was visited
        a = np.linspace(plan.centre - reach, plan.centre + reach, DRAWN)
        basis = plan.basis(a)
        curve = Curve.of_spline(a, basis, c, np.nan_to_num(V), samples=estimate.n,
                                argument=plan.argument)
        edge = named[0, k, 0] = name_curve(curve, library, settings)
        nothing = next(x for x in edge.candidates if not x.form.columns)
        values = basis @ c
        std = np.zeros(len(a)) if curve.std is None else curve.std
        weights.append(Contribution(0, k, 0, float(np.std(values)),
                                    float(np.sqrt(np.mean(std**2))), nothing.adequacy))
    arguments = [p.argument for p in plans]
    ranges = [e.range for e in named.values()]
    laws = sum_of_laws(estimate.model, arguments, chosen(named), ranges)
    stuck = [p.argument for p in plans if p.step and _rests(estimate, p.argument, settings)]
    return reading_unrefitted(laws, named, arguments, ranges, weights, stuck, settings)


def _rests(estimate: Estimate, argument: str, settings: SymbolicSettings) -> bool:
    """Whether the fitted motion stays where an argument is zero; taken for granted where unseen."""
    names = estimate.model.state_names
    if argument not in names:
        return True
    a = np.concatenate([np.abs(p.x[:, names.index(argument)]) for p in estimate.trajectories])
    return bool(np.mean(a < REST * a.max()) > settings.resting)


def _plans(estimate: Estimate) -> list[EdgePlan]:
    """Argument, place and steps of every edge, from the model's own formulas."""
    model, plans = estimate.model, []
    for spline in model.splines:
        own = {f"{spline.name}_{part}": 0.0 for part in ("centre", "halfwidth")}
        applied = [f for e in model.equations.values() for f in e.atoms(sp.Function)
                   if f.func.__name__ == spline.name]
        if not applied or not set(own) <= set(model.parameter_names):
            continue
        centre, half = (symbol(name) for name in own)
        argument = to_text(sp.simplify(applied[0].args[0] * half + centre))
        plans.append(EdgePlan(
            spline.name, argument, model.parameter(centre.name).value,
            model.parameter(half.name).value, len(spline.knots) - 7,
            f"{spline.name}_step" in model.parameter_names))
    return plans
