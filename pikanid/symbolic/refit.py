"""All constants of a composed formula fitted together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pikanid.symbolic.composed import Composition
from pikanid.symbolic.curve import EXACT
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.settings import USUAL

REFUSED = 1e10  # numerical: times the spread: no step towards it survives
RANK = 1e-7  # numerical: of column-scaled Jacobians
CROSSING = 0.3  # numerical: of its spread: a typical sum's mean


@dataclass(frozen=True, eq=False)
class Refit:
    """A composition at the least squares of data (x, y).

    `theta` (count,) with `held` (count,) marking those fixed at their values; the columns of
    `generic` depend on each other as the Jacobian's do at a typical place; `floor` is the mean
    square that counts as none.
    """

    composition: Composition
    theta: Array
    held: Array
    rss: float
    generic: Array
    samples: int
    floor: float

    @cached_property
    def rank(self) -> int:
        """Parameters that data can see at all: scales and offsets that trade count once."""
        return _rank(self.generic[:, ~self.held])

    @property
    def score(self) -> float:
        """BIC up to a constant."""
        n = self.samples
        noise = self.rss / n + self.floor + 1e-300
        return n * float(np.log(noise)) + self.rank * float(np.log(n))


def refit(composition: Composition, theta: Array, x: Array, y: Array, generic: Array,
          held: Array | None = None, exact: float = EXACT,
          evaluations: int = USUAL.evaluations) -> Refit | None:
    """Least squares from θ with some parameters held; None where the formula is not finite."""
    from scipy.optimize import least_squares

    fixed = np.zeros(composition.count, bool) if held is None else held
    full = _solved_last(composition, np.array(theta, float), x, y, fixed)
    value, J = composition.evaluate(full, x)
    if not (np.isfinite(value).all() and np.isfinite(J).all()):
        return None
    free = ~fixed
    spread = float(np.std(y))
    scale = 1.0 / np.maximum(np.linalg.norm(J[:, free], axis=0), 1e-12 * max(spread, 1e-300))
    scale = np.minimum(scale, 1e6 * np.maximum(np.abs(full[free]), 1.0))
    memory: dict[bytes, tuple[Array, Array]] = {}

    def both(z: Array) -> tuple[Array, Array]:
        key = z.tobytes()
        if key not in memory:
            memory.clear()
            full[free] = z
            memory[key] = composition.evaluate(full, x)
        return memory[key]

    def residual(z: Array) -> Array:
        r = both(z)[0] - y
        return r if np.isfinite(r).all() else np.full(len(y), REFUSED * max(spread, 1.0))

    def slopes(z: Array) -> Array:
        return np.nan_to_num(both(z)[1][:, free], posinf=0.0, neginf=0.0)

    if free.any() and len(y) >= free.sum():
        found = least_squares(residual, full[free].copy(), slopes, method="lm", x_scale=scale,
                              ftol=1e-10, xtol=1e-10, gtol=1e-12, max_nfev=evaluations)
        full[free] = found.x
    value, J = composition.evaluate(full, x)
    if not (np.isfinite(value).all() and np.isfinite(J).all()):
        return None
    return Refit(composition, full.copy(), fixed, float(np.sum((y - value) ** 2)),
                 generic, len(y), (exact * spread) ** 2)


def _solved_last(composition: Composition, theta: Array, x: Array, y: Array, fixed: Array
                 ) -> Array:
    """θ with the last layer's amplitudes and offset, linear as they are, at their best."""
    last = len(composition.groups) - 1
    if any(len(g) > 1 for g in composition.groups[last]):
        return theta
    linear = [k for place, form, at in composition.edges if place[0] == last
              for k in range(at.start, at.start + len(form.columns))]
    linear = [k for k in [*linear, composition.count - 1] if not fixed[k]]
    value, J = composition.evaluate(theta, x)
    if not linear or not (np.isfinite(value).all() and np.isfinite(J).all()):
        return theta
    columns = J[:, linear]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    rest = y - value + columns @ theta[linear]
    solved = np.array(theta)
    solved[linear] = np.linalg.lstsq(columns / size, rest, rcond=1e-10)[0] / size
    return solved


def generic_jacobian(composition: Composition, x: Array, theta: Array | None = None,
                     held: Array | None = None) -> Array:
    """The Jacobian at a typical place, as a square matrix of the same dependencies.

    Parameters `held` (count,) are at their θ.

    At the solution its rank may be lower, where a form has degenerated to a simpler one: those
    parameters were there to be fitted all the same, and BIC must count them.
    """
    generator = np.random.default_rng(0)
    place = generator.uniform(0.5, 1.5, composition.count)
    if theta is not None and held is not None:
        place = np.where(held, theta, place)
    fixed = np.zeros(composition.count, bool) if held is None else held
    with np.errstate(all="ignore"):
        for layer in range(len(composition.groups)):
            u = composition.stages(place, x)[layer][0]
            for (depth, i, _), form, at in composition.edges:
                if depth != layer:
                    continue
                seen = u[np.isfinite(u[:, i]), i]
                if len(seen) and np.ptp(seen) > 0.0:
                    inside = slice(at.start + len(form.columns), at.stop)
                    usual = form.typical(float(seen.min()), float(seen.max()))
                    place[inside] = np.where(fixed[inside], place[inside], usual)
            _centre(composition, place, fixed, layer, x)
    J = composition.evaluate(place, x)[1]
    J = J[np.isfinite(J).all(axis=1)]
    if len(J) <= composition.count:
        return np.eye(composition.count)
    size = np.linalg.norm(J, axis=0)
    return np.asarray(np.linalg.qr(J / np.where(size > 0.0, size, 1.0), mode="r"))


def _centre(composition: Composition, place: Array, fixed: Array, layer: int, x: Array) -> None:
    """Moves a layer's free offsets to where its sums cross zero.

    Far from it a limiting form behind them, all of it at its limit, would hide what is inside.
    """
    sums = composition.stages(place, x)[layer][1]
    for s, v in enumerate(sums.T):
        seen, at = v[np.isfinite(v)], composition.offsets[layer] + s
        if len(seen) and not fixed[at]:
            place[at] += CROSSING * float(seen.std()) - float(seen.mean())


def _rank(J: Array) -> int:
    size = np.linalg.norm(J, axis=0)
    good = size > 0.0
    if not good.any():
        return 0
    s = np.linalg.svd(J[:, good] / size[good], compute_uv=False)
    return int(np.sum(s > RANK * s[0]))


def covariance(fit: Refit, x: Array, y: Array) -> Array:
    """Of all parameters (count, count) by Gauss-Newton; zero for those held."""
    _, J = fit.composition.evaluate(fit.theta, x)
    free = ~fit.held
    size = np.linalg.norm(J[:, free], axis=0)
    size[size == 0.0] = 1.0
    scaled = J[:, free] / size
    variance = fit.rss / max(fit.samples - fit.rank, 1)
    inverse = np.linalg.pinv(scaled.T @ scaled, 1e-13, True) / np.outer(size, size)
    full = np.zeros((len(free), len(free)))
    full[np.ix_(free, free)] = variance * inverse
    return full
