"""Whether something is surely missing in the dynamics: free curves of one channel against others.

A force δ(q) + δ(q') of free curves inside the equation, to first order, is compared with everything
that inputs and sensors can do together: free curves of what is read and of what is put in, and
their lags, delays, gains and drifts; and with what refits without any force in the equation leave,
as a long delay or a lag is none to first order.  Who explains with the few what the many cannot
leaves no doubt about the channel.  The reverse proves nothing: a free force follows the motion so
closely that it explains much of what a sensor or an input does, and where it does not, memory or a
mode of the dynamics may.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BSpline

from pikanid.approximators.bspline import uniform_knots
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.residual_tests import project
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis

INTERVALS, DEGREE = 24, 3  # numerical: fine enough for a few periods of cogging
GAUGE = 1e-3  # numerical: of a sign: less is left when the free parameters can do the same
FORCE, ELSEWHERE = "force", "elsewhere"


def surely_in_dynamics(base: Hypothesis, site: Site, candidates: Sequence[Candidate],
                       tried: Sequence[Hypothesis]) -> bool:
    """Whether a free force of the coordinate and its rate explains what nothing that happens to
    inputs and outputs does.

    Args:
        base: The nominal model's fit.
        site: Coordinate.
        candidates: The catalogue's: what inputs and sensors can do.
        tried: Explanations that were refitted.
    """
    rule = base.whitened.settings.part
    force = [_curve(FORCE, name, site) for name in (site.q, site.v)]
    others = [_curve(ELSEWHERE, name, site) for name in (site.output.name, *site.inputs)]
    others += [c for c in candidates if not c.per_recording and (
        c.channel != "dynamics" or len(c.ids) > 1)]
    found = directions(base.whitened, base.minimum.theta, [*force, *others])
    fit, rows = base.minimum, base.whitened.rows
    padded = np.vstack([found.D, np.zeros((len(fit.r) - len(found.D), found.D.shape[1]))])
    size = np.linalg.norm(padded, axis=0)
    rest = project(fit.J, padded) / np.where(size > 0, size, np.inf)
    target = project(fit.J, -fit.r)
    whole = max(_left(rest[:, :0], target, rows), rule.floor)
    mine = found.owner < len(force)
    own, theirs = (max(_left(rest[:, k], target, rows), rule.floor) for k in (mine, ~mine))
    theirs = min([theirs, *(
        max(h.minimum.chi2 / max(rows - len(h.minimum.theta), 1) - 1, rule.floor) for h in tried
        if not any(e.channel == "dynamics" for e in h.effects))])
    return smaller(own, (1 - rule.share) * whole) and smaller(rule.dominance * own, theirs)


def _left(columns: np.ndarray, target: np.ndarray, rows: int) -> float:
    """Power that columns (n, m) leave of a target (n,), beside noise, per degree of freedom."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > GAUGE]
    rest = target - u @ (u.T @ target)
    return float(rest @ rest) / max(rows - u.shape[1], 1) - 1


def _curve(kind: str, name: str, site: Site) -> Candidate:
    """A free curve of a state as a force, of an output as what is read, of an input as a push."""
    span: list[float] = []

    def signs(view: View) -> list[TangentDirection]:
        values = (view.x if kind == FORCE else view.y if name in view.y else view.u)[name]
        span[:] = span or [float(values.min()), float(values.max())]
        if span[0] == span[1]:
            return []
        knots = uniform_knots(span[0], span[1], intervals=INTERVALS, degree=DEGREE)
        inside = np.clip(values, span[0], span[1])
        columns = BSpline.design_matrix(inside, knots, DEGREE).toarray().T
        if kind == FORCE:
            return [TangentDirection({}, force=c) for c in columns]
        if name in view.y:
            return [TangentDirection({}, seen=c) for c in columns]
        return [TangentDirection({}, push={name: c}) for c in columns]

    return Candidate((kind,), name, name, "dynamics", site, (), lambda m: m, signs,
                     variant=f"{kind} {name}")
