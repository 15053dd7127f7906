"""Fits one form to one curve by variable projection.

For given parameters inside a form its amplitudes follow from linear least squares, so that only the
one or two parameters inside are searched: over a grid, all of it at once, then by
Levenberg-Marquardt on the projected residual (Golub & Pereyra, SIAM J. Numer. Anal. 10, 1973,
p. 413; the Jacobian is Kaufman's, BIT 15, 1975, p. 49).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pikanid.optimise.levenberg_marquardt import descend
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.library import Form
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.settings import USUAL, SymbolicSettings

ROUNDING = 1e-9  # numerical: of the range: samples that are closer are one
GAIN = 1e-6  # numerical: relative decrease below which no ranking changes


@dataclass(frozen=True, eq=False)
class FormFit:
    """A form at its best on a curve.

    `amplitudes` (k,), `inside` (q,) and `offset`; `covariance` (k + q + 1,) squared in this order;
    `values` (n,) on the curve's x, the free columns' part left out; `shape` (r,) whitened, without
    constant and free parts.
    """

    form: Form
    amplitudes: Array
    inside: Array
    offset: float
    rss: float
    covariance: Array
    values: Array
    shape: Array

    @property
    def finite(self) -> bool:
        """Whether there is a fit at all."""
        return bool(np.isfinite(self.rss))


def fit_form(form: Form, curve: Curve, settings: SymbolicSettings = USUAL
             ) -> FormFit | None:
    """The least-squares fit; None where there is none on the curve's range."""
    if not form.fits_range(curve.low, curve.high) or curve.rows < form.count:
        return None  # or the curve knows fewer numbers than the form has
    if not form.knobs:
        return _finish(form, curve, np.empty(0))
    starts = _search(form, curve, settings)
    if form.smooth:
        starts = [_descend(form, curve, start, settings.iterations) for start in starts]
    fits = [f for f in (_finish(form, curve, p) for p in starts) if f is not None]
    return min(fits, key=lambda f: f.rss, default=None)


def _search(form: Form, curve: Curve, settings: SymbolicSettings) -> list[Array]:
    """The best places of a grid, apart from each other."""
    count = len(curve.x)
    thin = curve.thinned(settings.searched)
    x, free = thin(curve.x), thin(curve.free.T)
    grids = [k.grid(curve.low, curve.high, count) for k in form.knobs]
    if not form.smooth:  # a step: between any two samples
        grids = [_gaps(x)]
    mesh = np.stack([g.ravel() for g in np.meshgrid(*grids, indexing="ij")], axis=1)
    rss = _profile(form, curve, mesh, x, free, thin)
    order = np.argsort(rss)
    found: list[Array] = []
    for i in order[np.isfinite(rss[order])]:
        near = [np.all(np.abs(mesh[i] - q) <= 2.01 * _spacing(grids, q)) for q in found]
        if not any(near):
            found.append(mesh[i])
        if len(found) == settings.starts:
            break
    if not form.smooth and found:
        found = [_nearest_gap(form, curve, q, settings.searched) for q in found]
    return found


def _spacing(grids: list[Array], q: Array) -> Array:
    return np.array([np.max(np.diff(g)[max(0, np.searchsorted(g, v) - 1):][:2], initial=0.0)
                     for g, v in zip(grids, q, strict=True)])


def _gaps(x: Array) -> Array:
    """Middles between samples that are apart: what rests at zero is there but for rounding."""
    at = np.sort(x)
    gap = np.diff(at)
    return (at[:-1] + 0.5 * gap)[gap > ROUNDING * (at[-1] - at[0])]


def _nearest_gap(form: Form, curve: Curve, q: Array, searched: int) -> Array:
    """The best place of a step among all samples around q."""
    middle = _gaps(curve.x)
    k = int(np.searchsorted(middle, q[0]))
    width = 1 + len(middle) // searched
    near = middle[max(0, k - 2 * width):k + 2 * width + 1]
    rss = _profile(form, curve, near[:, None], curve.x, curve.free.T, lambda f: f)
    return near[[int(np.argmin(rss))]]


def _profile(form: Form, curve: Curve, mesh: Array, x: Array, free: Array,
             thin: Callable[[Array], Array]) -> Array:
    """Residual sums of squares (P,) at parameters mesh (P, q), amplitudes at their best."""
    if curve.weight.ndim == 1:
        weight = thin(curve.weight)
        base = np.vstack([np.ones(len(x)), free]) * weight
        u, s, _ = np.linalg.svd(base.T, full_matrices=False)
        fixed = u[:, s > 1e-10 * s[0]]
        y = thin(curve.target)
        y = y - fixed @ (fixed.T @ y)
    else:
        weight, fixed, y = None, curve.fixed, curve.centred
    raw = form.values(x, *(mesh[:, [j]] for j in range(mesh.shape[1])))
    with np.errstate(all="ignore"):
        columns = [np.broadcast_to(c, (len(mesh), len(x))) for c in raw]
        seen = np.all([curve.visible(c) for c in columns], axis=0)
        columns = [c * weight if weight is not None else c @ curve.weight.T for c in columns]
        columns = [c - (c @ fixed) @ fixed.T for c in columns]
        left = np.broadcast_to(y, columns[0].shape).copy()
        sizes: list[Array] = []
        for k, c in enumerate(columns):  # Gram-Schmidt
            whole = np.einsum("pn,pn->p", c, c)
            for b in columns[:k]:
                c = c - np.einsum("pn,pn->p", b, c)[:, None] * b
            norm = np.sqrt(np.einsum("pn,pn->p", c, c))
            c = np.where((norm > 1e-7 * np.sqrt(whole))[:, None], c / norm[:, None], 0.0)
            columns[k] = c
            sizes.append(norm)
            left = left - np.einsum("pn,pn->p", c, left)[:, None] * c
        rss = np.einsum("pn,pn->p", left, left)
    return np.where(np.isfinite(rss) & seen, rss, np.inf)


@dataclass(frozen=True, eq=False)
class _Projected:
    """A form at fixed parameters inside, p (q,): amplitudes (k,) in closed form.

    `raw` (n, k) are its columns, `phi` (r, k) the same whitened, without constant and free parts,
    `basis` (r, k) orthonormal, `left` (r,) the residual.
    """

    form: Form
    curve: Curve
    p: Array
    raw: Array
    phi: Array
    basis: Array
    amplitudes: Array
    left: Array

    @property
    def cost(self) -> float:
        return float(self.left @ self.left)

    def normal(self) -> tuple[Array, Array]:
        J = _inside_jacobian(self.form, self.curve, self.p, self.amplitudes)
        if not np.isfinite(J).all():  # nothing is known of a way down
            return np.eye(len(self.p)), np.zeros(len(self.p))
        J = self.basis @ (self.basis.T @ J) - J
        return J.T @ J, J.T @ self.left


def _linear(form: Form, curve: Curve, p: Array) -> _Projected | None:
    """None where the form is not finite, or the curve cannot show it."""
    raw = np.column_stack(form.values(curve.x, *p)) if form.columns else np.empty(
        (len(curve.x), 0))
    if not np.isfinite(raw).all() or not curve.visible(raw.T).all():
        return None
    phi = curve.project(curve.whiten(raw.T)).T
    with np.errstate(over="ignore"):  # what is no number then is told from nothing by no curve
        size = np.linalg.norm(phi, axis=0)
        whole = np.linalg.norm(raw, axis=0) * float(np.abs(curve.weight).max())
    if np.any(size <= 1e-9 * whole) or not np.all(size > 0):
        return None
    q, r = np.linalg.qr(phi / size)
    if r.size and np.abs(np.diag(r)).min() < 1e-9:
        return None
    part = q.T @ curve.centred
    a = np.linalg.solve(r, part) / size if r.size else np.empty(0)
    return _Projected(form, curve, p, raw, phi, q, a, curve.centred - q @ part)


def _descend(form: Form, curve: Curve, start: Array, iterations: int) -> Array:
    """Levenberg-Marquardt on the projected residual, within the parameters' limits."""
    lower, upper = np.array([k.limits(curve.low, curve.high, len(curve.x)) for k in form.knobs]).T
    found = descend(lambda p: _linear(form, curve, p), start, lower, upper, iterations,
                    lambda at: max(GAIN * at.cost, 1e-26 * curve.total))
    return start if found is None else found.theta


def _inside_jacobian(form: Form, curve: Curve, p: Array, amplitudes: Array) -> Array:
    """Derivative (r, q) of the whitened candidate by its parameters inside, constant removed."""
    q = len(form.knobs)
    table = np.array(form.derivatives(curve.x, *p)).reshape(len(form.columns), q, -1)
    return curve.project(curve.whiten(np.einsum("k,kqn->qn", amplitudes, table))).T


def _finish(form: Form, curve: Curve, p: Array) -> FormFit | None:
    found = _linear(form, curve, p)
    if found is None:
        return None
    a, rss, shape = found.amplitudes, found.cost, found.phi @ found.amplitudes
    values = found.raw @ a
    offset, base = _offset(curve, values)
    covariance = _covariance(form, curve, p, found.raw, a, base)
    covariance = covariance * curve.variance(rss, form.count + curve.free.shape[1])
    return FormFit(form, a, p, offset, rss, covariance, values + offset, shape)


def _offset(curve: Curve, values: Array) -> tuple[float, Array]:
    """The constant d beside given values, and the whitened constant and free columns (r, m)."""
    if curve.weight.ndim == 2:
        columns = np.column_stack([np.ones(len(curve.x)), curve.free])
        found = np.linalg.lstsq(columns, curve.y - values, rcond=1e-10)[0]
        return float(found[0]), np.zeros((curve.rows, columns.shape[1]))
    base = curve.whiten(np.vstack([np.ones(len(curve.x)), curve.free.T])).T
    found = np.linalg.lstsq(base, curve.target - curve.whiten(values), rcond=1e-10)[0]
    return float(found[0]), base


def _covariance(form: Form, curve: Curve, p: Array, raw: Array, a: Array, base: Array) -> Array:
    """(k + q + 1,) squared: amplitudes, parameters inside, offset, at unit variance."""
    q = len(form.knobs)
    columns = curve.whiten(raw.T).T
    if q:
        table = np.array(form.derivatives(curve.x, *p)).reshape(len(form.columns), q, -1)
        columns = np.hstack([columns, curve.whiten(np.einsum("k,kqn->qn", a, table)).T])
    J = np.hstack([columns, base])
    if not np.isfinite(J).all():
        return np.full((len(a) + q + 1,) * 2, np.nan)
    size = np.linalg.norm(J, axis=0)
    flat = size <= 0.0
    size[flat] = 1.0
    inverse = np.linalg.pinv((J / size).T @ (J / size), 1e-13, True)
    with np.errstate(over="ignore"):  # of a column that is next to nothing nothing is known
        inverse = inverse / size[:, None] / size
    inverse[flat] = inverse[:, flat] = np.nan
    keep = len(a) + q + 1
    return np.asarray(inverse[:keep, :keep])
