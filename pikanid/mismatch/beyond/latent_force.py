"""The latent force δ(t): what would have to push a fitted nominal model to explain its residual.

    -r = J dθ + G δ + e,   e white of unit variance,   δ(t) = Σ c_k B_k(t)

with r the whitened residual, J its derivatives by the free parameters, and G δ what a force in the
equation of a coordinate shows, integrated to first order: along the fitted motion, and then along
the motion that the force of this first pass makes.  δ is a cubic spline with penalised differences
and sizes of its coefficients (P. H. C. Eilers and B. D. Marx, Stat. Sci. 11, 1996): the prior of a
force that forgets itself, after a fraction of a period or hardly ever.  Which of the two, how
strong it is and how large the noise, restricted maximum likelihood says (S. N. Wood, J. R. Stat.
Soc. B 73, 2011).  Standard errors are posterior ones, which hold what the penalty hides on average
over time (D. Nychka, J. Am. Stat. Assoc. 83, 1988); sharp peaks come out too low.

A force shows only after it has been integrated twice, so that its quick changes drown in noise.
Given are means over the time that one effective coefficient has: a finer course cannot be told.
Forces that the free parameters can make instead are no part of δ (the gauge): their size is
unknown, not zero.  What a sensor or an input gets wrong can be explained by a force as well: δ
locates a mismatch in time and does not say that it is one of the dynamics.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solve_triangular

from pikanid.approximators.bspline import uniform_knots
from pikanid.mismatch.beyond.penalised import Penalised, critical_value
from pikanid.mismatch.catalogue.candidate import Candidate, TangentDirection
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.detect.remainder import condensed
from pikanid.mismatch.detect.tangent import SIGNS, Tangent
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import Settings
from pikanid.model.parts import Input
from pikanid.recording.channel import Channel

DEGREE = 3  # numerical: cubic, as smooth as a motion is
POINTS = 4  # numerical: of the drawn grid to a knot interval


@dataclass(frozen=True, eq=False)
class ForceOverTime:
    """The force that would explain what the nominal model leaves of the first recording.

    Attributes:
        t: (G,) times [s].
        values: (G,) δ, in `unit`: means over `resolution`, without what the free parameters can do.
        std: (G,) standard errors, pointwise.
        critical: Half the width, in standard errors, of the simultaneous band: it holds all of δ
            at once with the probability that the settings ask for.
        resolution: Seconds that a value is the mean of: the recording's length over `freedom`.
        freedom: Effective degrees of freedom of the force.
        left: χ² per degree of freedom that it leaves: far above 1 where no force explains the
            recording (the band is that much wider).
        unit: Of q''.
        spacing: Of the knots [s].
        period: Natural period [s]; 0 without a restoring force.
        enough: Knots in a natural period from which on a force that follows the motion shows.
    """

    t: np.ndarray
    values: np.ndarray
    std: np.ndarray
    critical: float
    resolution: float
    freedom: float
    left: float
    unit: str
    spacing: float
    period: float
    enough: int

    @property
    def resolved(self) -> bool:
        """Whether the knots are fine enough for a force that follows the motion."""
        return self.enough * self.spacing <= self.period or not self.period

    @property
    def windows(self) -> tuple[tuple[float, float], ...]:
        """Seconds in which δ is not zero: those whose means the simultaneous band keeps from zero.

        What lies less than a natural period apart is one: a force that follows the motion changes
        its sign twice in each.
        """
        outside = np.flatnonzero(np.abs(self.values) > self.critical * self.std)
        if not len(outside):
            return ()
        half = self.resolution / 2
        cuts = np.flatnonzero(np.diff(self.t[outside]) > max(self.period, 2 * half)) + 1
        digits = max(int(np.ceil(-np.log10(half))), 0)
        return tuple((round(float(max(self.t[part[0]] - half, self.t[0])), digits),
                      round(float(min(self.t[part[-1]] + half, self.t[-1])), digits))
                     for part in np.split(outside, cuts))


def force_over_time(base: Hypothesis, site: Site) -> ForceOverTime | None:
    """The force over time that is missing in the equation of one coordinate; the first recording's.

    Args:
        base: The nominal model's fit.
        site: Coordinate.

    Returns:
        The force; None where the recording is too short, or the motion grows out of bounds.
    """
    start, stop = site.span
    period = 2 * np.pi / site.rate if site.rate else 0.0
    nominal = motion = _Motion.of(base, site, np.array(site.span), np.zeros(2))
    if nominal is None or motion is None:
        return None
    rows, settings = len(nominal.r), base.whitened.settings
    intervals = _intervals(stop - start, period, rows, settings)
    if intervals < settings.budget.force_knots[0]:
        return None
    knots = uniform_knots(start, stop, intervals=intervals, degree=DEGREE)
    together = -(-rows // settings.budget.rows_tested)
    fitted: Penalised | None = None
    force = np.zeros(len(knots) - DEGREE - 1)
    for _ in range(settings.budget.force_passes):
        D = motion.columns(knots, together)
        if not np.isfinite(D).all():
            return None
        J, r = (condensed(part, rows, together) for part in (motion.J, motion.r))
        try:
            fitted = Penalised(D, J, D @ force - r, fitted)
        except np.linalg.LinAlgError:  # forces that differ by less than rounding
            return None
        force = fitted.gauge @ fitted.coefficients
        t = motion.line.t
        pushed = _Motion.of(base, site, t, BSpline(knots, force, DEGREE)(t))
        if pushed is None or pushed.chi2 > nominal.chi2:
            return None
        motion = pushed
    assert fitted is not None
    t = np.linspace(start, stop, POINTS * intervals + 1)
    resolution = (stop - start) / max(fitted.freedom, 1.0)
    means = _means(t, knots, resolution)
    spread = solve_triangular(fitted.root, (means @ fitted.gauge).T, lower=True)
    spread *= max(fitted.left, 1.0) ** 0.5
    return ForceOverTime(t, means @ force, np.linalg.norm(spread, axis=0),
                         critical_value(spread, 1 - settings.band), resolution, fitted.freedom,
                         fitted.left, site.force_unit, (stop - start) / intervals, period,
                         settings.beyond.resolved)


def _intervals(span: float, period: float, rows: int, settings: Settings) -> int:
    """Number of knot intervals, as fine as the motion asks for and the recording can pay."""
    (least, limit), asks = settings.budget.force_knots, settings.beyond
    most = min(limit, rows // asks.rows_a_knot)
    if not period:
        return most
    periods = span / period
    if asks.resolved * periods > limit:
        return min(settings.budget.slow_knots, most)
    return min(max(int(asks.knots_a_period * periods), least), most)


def _means(t: np.ndarray, knots: np.ndarray, width: float) -> np.ndarray:
    """Means (G, K) of every spline over a width about times t; less of it at the ends."""
    whole = BSpline(knots, np.eye(len(knots) - DEGREE - 1), DEGREE).antiderivative()
    low, high = np.maximum(t - width / 2, knots[0]), np.minimum(t + width / 2, knots[-1])
    return np.asarray((whole(high) - whole(low)) / (high - low)[:, None])


@dataclass(frozen=True)
class _Motion:
    """The first recording simulated with a force: residual r (rows,), J (rows, p), linearised."""

    whitened: Whitened
    site: Site
    theta: np.ndarray
    r: np.ndarray
    J: np.ndarray

    @staticmethod
    def of(base: Hypothesis, site: Site, t: np.ndarray, force: np.ndarray) -> _Motion | None:
        """The fitted nominal model with a force (N,) at times t; None where it cannot be run."""
        name, records = site.name("delta"), base.whitened.records
        model = base.model.replace(inputs=(*base.model.inputs, Input(name, hold="first")))
        pushed = records.recordings[0].with_channels(Channel(name, t, force))
        whitened = Whitened(site.pushed(model, name), Records(
            (pushed,), records.levels[:1], records.settings))
        theta = np.array([base.values[f.name] for f in whitened.problem.free])
        whitened.steps = base.whitened.steps[:1]
        found = whitened.residual(theta)
        return None if found is None else _Motion(whitened, site, theta, *found)

    @functools.cached_property
    def line(self) -> Tangent:
        """Its linearisation."""
        states = self.whitened.responses(self.theta, states=True)[0].states
        return Tangent(self.whitened, self.theta, 0, states)

    @property
    def chi2(self) -> float:
        """Sum of squares of the residual."""
        return float(self.r @ self.r)

    def columns(self, knots: np.ndarray, together: int) -> np.ndarray:
        """What each spline of δ shows: whitened columns (rows / together, K)."""
        candidate = Candidate(("force",), "force", "", "dynamics", self.site, (), lambda m: m,
                              lambda view: [])
        splines = BSpline.design_matrix(self.line.t, knots, DEGREE).tocsc()
        blocks = []
        for k in range(0, splines.shape[1], SIGNS):  # some at a time: all of them are large
            forces = splines[:, k:k + SIGNS].toarray().T
            columns = self.line.columns(
                [(candidate, TangentDirection({}, force=f)) for f in forces])
            blocks.append(condensed(self.whitened.whiten(0, columns), len(columns), together))
        return np.concatenate(blocks, axis=1)
