"""The latent force δ(t): what would have to push a fitted nominal model to explain its residual.

    -r = J dθ + G δ + e,   e white of unit variance,   δ(t) = Σ c_k B_k(t)

with r the whitened residual, J its derivatives by the free parameters, and G δ what a force in the
equation of a coordinate shows, integrated along the motion to first order: at first along the
fitted motion, then along the one that the force makes.  δ is a cubic
spline with penalised differences and sizes of its coefficients (P. H. C. Eilers and B. D. Marx,
Stat. Sci. 11, 1996): the prior of a force that forgets itself, after a fraction of a period or
hardly ever.  Which of the two, how strong it is and how large the noise, restricted maximum
likelihood says (S. N. Wood, J. R. Stat. Soc. B 73, 2011).  Standard errors are posterior ones,
which hold what the penalty hides, on average over time (D. Nychka, J. Am. Stat. Assoc. 83, 1988).

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
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import brentq
from scipy.stats import norm

from pikanid.channel import Channel
from pikanid.mismatch.candidate import Candidate, Sign
from pikanid.mismatch.hypothesis import Hypothesis
from pikanid.mismatch.judge import MOST_ROWS, condensed
from pikanid.mismatch.site import Site
from pikanid.mismatch.tangent import TOGETHER, Tangent
from pikanid.mismatch.whitened import Records, Whitened
from pikanid.model_parts import Input

DEGREE = 3
A_PERIOD = 8  # knots in a natural period: friction's third harmonic still fits between them
LEAST, MOST = 8, 800  # knot intervals
ROWS_EACH = 5  # samples to a knot interval, at least
RESOLVED = 4  # knots in a natural period from which on a force that follows the motion shows
POINTS = 4  # of the drawn grid to a knot interval
LEVEL = 0.95  # of the simultaneous band
MEMORIES = (2.0, 50.0)  # of the force, in knot intervals: it follows an oscillation, or does not
DECADES = 13  # of the penalty's weight, from almost no force downwards
HOPELESS = 60.0  # of -2 ln likelihood above the best: lighter weights only get worse
PASSES = 2  # the second along the motion that the force of the first one makes
GAUGE = 1e-6  # of the prior: tells apart forces that do the same as a parameter


@dataclass(frozen=True, eq=False)
class ForceOverTime:
    """The force that would explain what the nominal model leaves of the first recording.

    Attributes:
        t: (G,) times [s].
        values: (G,) δ, in `unit`: means over `resolution`, without what the free parameters can do.
        std: (G,) standard errors, pointwise.
        critical: Half the width, in standard errors, of the simultaneous band: it holds all of δ
            at once with probability `LEVEL`.
        resolution: Seconds that a value is the mean of: the recording's length over `freedom`.
        freedom: Effective degrees of freedom of the force.
        left: χ² per degree of freedom that it leaves: far above 1 where no force explains the
            recording (the band is that much wider).
        unit: Of q''.
        spacing: Of the knots [s].
        period: Natural period [s]; 0 without a restoring force.
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

    @property
    def resolved(self) -> bool:
        """Whether the knots are fine enough for a force that follows the motion."""
        return RESOLVED * self.spacing <= self.period or not self.period

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
    rows = len(nominal.r)
    intervals = int(min(max(A_PERIOD * (stop - start) / period, LEAST) if period else MOST, MOST,
                        rows // ROWS_EACH))
    if intervals < LEAST:
        return None
    edges = np.linspace(start, stop, intervals + 1)
    knots = np.concatenate([[start] * DEGREE, edges, [stop] * DEGREE])
    together = -(-rows // MOST_ROWS)
    fitted: _Fitted | None = None
    force = np.zeros(len(knots) - DEGREE - 1)
    for _ in range(PASSES):
        D = motion.columns(knots, together)
        if not np.isfinite(D).all():
            return None
        J, r = (condensed(part, rows, together) for part in (motion.J, motion.r))
        fitted = _Fitted(D, J, D @ force - r, fitted)
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
                         critical_value(spread, LEVEL), resolution, fitted.freedom, fitted.left,
                         f"{site.unit}/s^2", (stop - start) / intervals, period)


def critical_value(spread: np.ndarray, level: float) -> float:
    """Half the width, in standard errors, of a band that holds a whole Gaussian curve.

    The curve's unit vectors run on a sphere; the longer their way κ, the more independent chances
    there are to leave the band:  κ/π exp(-z²/2) + 2 (1 - Φ(z)) = 1 - level  (J. Sun and C. R.
    Loader, Ann. Stat. 22, 1994).  It grows with the effective degrees of freedom, as κ does.

    Args:
        spread: (K, G) root of the curve's covariance, which is spreadᵀ spread.
        level: Probability, between 0 and 1.

    >>> round(critical_value(np.ones((1, 5)), 0.95), 2)     # a constant: a single chance
    1.96
    """
    unit = spread / np.maximum(np.linalg.norm(spread, axis=0), 1e-300)
    way = float(np.sum(np.linalg.norm(np.diff(unit, axis=1), axis=0)))
    return float(brentq(lambda z: way / np.pi * np.exp(-z * z / 2) + 2 * norm.sf(z) - (1 - level),
                        0.0, 40.0))


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
        whitened = Whitened(model.with_term(site.v, name), Records((pushed,), records.levels[:1]))
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
        for k in range(0, splines.shape[1], TOGETHER):  # some at a time: all of them are large
            forces = splines[:, k:k + TOGETHER].toarray().T
            columns = self.line.columns([(candidate, Sign({}, force=f)) for f in forces])
            blocks.append(condensed(self.whitened.whiten(0, columns), len(columns), together))
        return np.concatenate(blocks, axis=1)


class _Fitted:
    """Penalised least squares of a target (N,) on columns D (N, K) beside J (N, p).

    Attributes:
        coefficients: (K,).
        root: (K, K) lower triangular; root rootᵀ is the penalised information at unit noise.
        gauge: (K, K) takes out of coefficients what J can do.
        freedom: Effective number of coefficients.
        left: Variance of what is left.
    """

    def __init__(self, D: np.ndarray, J: np.ndarray, target: np.ndarray, before: _Fitted | None):
        norms = np.linalg.norm(J, axis=0)
        u, s, _ = np.linalg.svd(J[:, norms > 0] / norms[norms > 0], full_matrices=False)
        q = u[:, s > 1e-9 * s[0]] if len(s) else u
        target = target - q @ (q.T @ target)
        inside, whole = q.T @ D, D.T @ D
        self.information = whole - inside.T @ inside
        self.pull = D.T @ target
        self.power = float(target @ target)
        self.count = len(target) - q.shape[1]
        self.weight, self.memory = self._coarse() if before is None else self._near(before)
        penalty = self.weight * _prior(len(whole), self.memory)
        self.root = np.linalg.cholesky(self.information + penalty)
        self.coefficients = cho_solve((self.root, True), self.pull)
        held = solve_triangular(self.root, np.linalg.cholesky(penalty), lower=True)
        self.freedom = len(whole) - float(np.sum(held**2))
        self.left = (self.power - float(self.pull @ self.coefficients)) / self.count
        alike = cho_solve((np.linalg.cholesky(whole + GAUGE * penalty), True), inside.T)
        self.gauge = np.eye(len(whole)) - alike @ inside

    def _coarse(self) -> tuple[float, float]:
        """(weight, memory) of the most likely prior.

        The heaviest weight leaves about one effective coefficient: an estimate of nothing at all
        would have no band.
        """
        found: list[tuple[float, float, float]] = []
        for memory in MEMORIES:
            prior = _prior(len(self.pull), memory)
            most = float(np.trace(np.linalg.solve(prior, self.information)))
            volume, least = float(np.linalg.slogdet(prior)[1]), np.inf
            for weight in most * 10.0 ** -np.arange(DECADES):
                criterion = self._unlikely(weight, prior) - volume
                found.append((criterion, float(weight), memory))
                least = min(least, criterion)
                if criterion > least + HOPELESS:
                    break
        return min(found)[1:]

    def _near(self, before: _Fitted) -> tuple[float, float]:
        """(weight, memory) about those of another fit."""
        prior = _prior(len(self.pull), before.memory)
        weights = before.weight * 10.0 ** np.array([-0.6, -0.3, 0.0, 0.3, 0.6])
        return float(min(weights, key=lambda w: self._unlikely(w, prior))), before.memory

    def _unlikely(self, weight: float, prior: np.ndarray) -> float:
        """-2 ln of the restricted likelihood, the noise's variance profiled, + ln |prior|."""
        root = np.linalg.cholesky(self.information + weight * prior)
        explained = float(np.sum(solve_triangular(root, self.pull, lower=True) ** 2))
        left = max(self.power - explained, 1e-12 * self.power)
        return float(self.count * np.log(left / self.count) + 2 * np.sum(np.log(np.diag(root)))
                     - len(root) * np.log(weight))


def _prior(count: int, memory: float) -> np.ndarray:
    """(K, K) inverse covariance, up to its size, of coefficients that forget after `memory` steps:
    those of an Ornstein-Uhlenbeck process.
    """
    steps = np.diff(np.eye(count), axis=0)
    return np.asarray(steps.T @ steps + np.eye(count) / memory**2)
