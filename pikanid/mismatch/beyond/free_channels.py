"""In which channels something is surely missing: free curves of each channel against the others.

A force δ(q) + δ(q') of free curves inside the equation, free curves of what is read and of what is
put in, and the catalogue's signs of each channel, all to first order, are all that a channel can
do.  A channel is sure where an explanation that needs it leaves far less than the best one that
does not, and than all that the other channels can do together; and the dynamics are where the free
force itself does.  A free force follows the motion so closely that it explains much of what a
sensor or an input does: that it explains something proves nothing, only that the others cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

import numpy as np
from scipy.interpolate import BSpline

from pikanid.approximators.bspline import uniform_knots
from pikanid.mismatch.catalogue.candidate import Candidate, Channel, TangentDirection, View
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.detect.tangent import directions
from pikanid.mismatch.fitting.decisions import smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.channels import acts_in, needed
from pikanid.mismatch.judge.explanations import Explanations, dominance
from pikanid.noise.projection import project

INTERVALS, DEGREE = 24, 3  # numerical: fine enough for a few periods of cogging
GAUGE = 1e-3  # numerical: of a sign: less is left when the free parameters can do the same
CURVE = "curve"


def sure_channels(base: Hypothesis, site: Site, candidates: Sequence[Candidate],
                  tried: Sequence[Hypothesis], explained: Explanations | None = None
                  ) -> tuple[Channel, ...]:
    """Channels in which something surely acts, whatever it is.

    Args:
        base: The nominal model's fit.
        site: Coordinate.
        candidates: The catalogue's.
        tried: Explanations that were refitted.
        explained: Explanations that were weighed.
    """
    left = _Left(base, site, candidates)
    sure = {"dynamics"} if _free_force(left, tried) else set()
    lead = None if explained is None else explained.lead(left.rule.share)
    if lead is not None and explained is not None:
        rule, found = left.rule, explained.weighed
        own = left.after(lead.hypothesis)
        for channel in needed(lead.hypothesis):
            others = [w for w in found if channel not in needed(w.hypothesis)]
            if not (smaller(1 - sum(w.weight for w in others), 1 - rule.rate)
                    or smaller(dominance(lead, others, rule), rule.dominance)
                    or smaller(left.by({*get_args(Channel)} - {channel}), rule.dominance * own)):
                sure.add(channel)
    return tuple(c for c in get_args(Channel) if c in sure)


def _free_force(left: _Left, tried: Sequence[Hypothesis]) -> bool:
    """Whether a free force explains what nothing that happens to inputs and sensors does."""
    rule, force = left.rule, left.of_force()
    theirs = min([left.by({"input", "sensor"}), *(
        left.after(h) for h in tried if not any(e.channel == "dynamics" for e in h.effects))])
    return smaller(force, (1 - rule.share) * left.by(set())) and smaller(
        rule.dominance * force, theirs)


class _Left:
    """Power of the nominal residual, beside noise, per degree of freedom, that is left by all that
    channels can do to first order.
    """

    def __init__(self, base: Hypothesis, site: Site, candidates: Sequence[Candidate]):
        self.rule = base.whitened.settings.part
        force = [_curve("dynamics", name, site) for name in site.moving]
        curves = [*force, *(_curve("sensor", s.output.name, s) for s in (site, *site.sensors)),
                  *(_curve("input", name, site) for name in site.inputs)]
        whole = [*curves, *(c for c in candidates if not c.per_recording)]
        found = directions(base.whitened, base.minimum.theta, whole)
        self.rows = base.whitened.rows
        fit = base.minimum
        padded = np.vstack([found.D, np.zeros((len(fit.r) - len(found.D), found.D.shape[1]))])
        size = np.linalg.norm(padded, axis=0)
        self.rest = project(base.movable, padded) / np.where(size > 0, size, np.inf)
        self.target = project(base.movable, -fit.r)
        self.owner = found.owner
        self.channels = [acts_in(c) for c in found.candidates]
        self.forces = len(force)

    def by(self, channels: set[Channel]) -> float:
        """Left by all curves and signs of channels."""
        mine = [bool(own & channels) for own in self.channels]
        return self._of(np.array(mine)[self.owner])

    def of_force(self) -> float:
        """Left by the free force alone."""
        return self._of(self.owner < self.forces)

    def after(self, h: Hypothesis) -> float:
        """Left by a refitted explanation."""
        return max(h.minimum.chi2 / max(self.rows - len(h.minimum.theta), 1) - 1, self.rule.floor)

    def _of(self, mine: np.ndarray) -> float:
        return max(_left(self.rest[:, mine], self.target, self.rows), self.rule.floor)


def _left(columns: np.ndarray, target: np.ndarray, rows: int) -> float:
    """Power that columns (n, m) leave of a target (n,), beside noise, per degree of freedom."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    u = u[:, s > GAUGE]
    rest = target - u @ (u.T @ target)
    return float(rest @ rest) / max(rows - u.shape[1], 1) - 1


def _curve(channel: Channel, name: str, site: Site) -> Candidate:
    """A free curve of a state as a force, of an output as what is read, of an input as a push."""
    span: list[float] = []

    def signs(view: View) -> list[TangentDirection]:
        values = {"dynamics": view.x, "sensor": view.y, "input": view.u}[channel][name]
        span[:] = span or [float(values.min()), float(values.max())]
        if span[0] == span[1]:
            return []
        knots = uniform_knots(span[0], span[1], intervals=INTERVALS, degree=DEGREE)
        inside = np.clip(values, span[0], span[1])
        columns = BSpline.design_matrix(inside, knots, DEGREE).toarray().T
        return [{"dynamics": TangentDirection({}, force=c), "sensor": TangentDirection({}, seen=c),
                 "input": TangentDirection({}, push={name: c})}[channel] for c in columns]

    return Candidate((CURVE,), name, name, channel, site, (), lambda m: m, signs,
                     variant=f"{channel} {name}")
