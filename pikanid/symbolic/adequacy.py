"""Whether a named curve leaves anything behind: the lack-of-fit test, and the free spline.

The residual of a candidate is regressed on smooth functions of x, cubic splines with 6 to 48
pieces.  If they find anything in it, at level α over all of them together, the candidate is not
what the edge is, however well it ranks (F test; Seber & Lee, Linear Regression Analysis, 2003,
sec. 4.3).  The same splines compete as "no simple form".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as fisher

from pikanid.approximators.bspline import BSpline, knots_from_breakpoints
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import FormFit
from pikanid.symbolic.numeric import Array

PIECES = (6, 12, 24, 48)  # numerical: cells of the splines that look at what is left


@dataclass(frozen=True, eq=False)
class Smoother:
    """Orthonormal smooth directions (r, K) of a curve, at several finenesses."""

    curve: Curve
    bases: tuple[Array, ...]

    @staticmethod
    def of(curve: Curve) -> Smoother:
        """Splines on quantiles of x, fewer than a quarter of the samples."""
        bases: list[Array] = []
        if curve.weight.ndim == 2:  # it is a spline already
            return Smoother(curve, ())
        for pieces in PIECES:
            if pieces + 3 > len(curve.x) // 4:
                break
            inner = np.quantile(curve.x, np.linspace(0.0, 1.0, pieces + 1))
            if np.any(np.diff(inner) <= 0.0):
                inner = np.linspace(curve.low, curve.high, pieces + 1)
            knots = knots_from_breakpoints(inner, 3)
            columns = curve.whiten(BSpline(3, knots).basis(curve.x).toarray().T)
            u, s, _ = np.linalg.svd(curve.project(columns).T, full_matrices=False)
            bases.append(np.asarray(u[:, s > 1e-9 * s[0]]))
        return Smoother(curve, tuple(bases))

    def free(self) -> tuple[float, float, int]:
        """Smallest BIC of a free spline, its residual sum of squares and its parameters."""
        curve = self.curve
        if curve.weight.ndim == 2:
            return curve.score(0.0, curve.rows), 0.0, curve.rows
        found = []
        for basis in self.bases:
            found_in = basis.T @ curve.centred
            rss = max(curve.total - float(found_in @ found_in), 0.0)
            count = basis.shape[1] + curve.fixed.shape[1]
            found.append((curve.score(rss, count), rss, count))
        return min(found, default=(np.inf, curve.total, 1))

    def p_value(self, fit: FormFit) -> float:
        """Probability of a residual as smooth as this if the form were right."""
        curve = self.curve
        if curve.weight.ndim == 2:
            dof = curve.rows - fit.form.count + 1
            return float(chi2.sf(fit.rss, dof)) if dof > 0 else 1.0
        left = curve.centred - fit.shape
        found = []
        for basis in self.bases:
            part = basis.T @ left
            seen = float(part @ part)
            k, rest = basis.shape[1], curve.rows - basis.shape[1] - fit.form.count
            if curve.known:
                found.append(float(chi2.sf(seen, k)))
                continue
            floor = curve.rows * 100.0 * curve.floor
            noise = (max(fit.rss - seen, 0.0) + floor) / max(rest, 1)
            found.append(float(fisher.sf(seen / k / noise, k, max(rest, 1))))
        return min(1.0, len(found) * min(found)) if found else 1.0
