"""MINPACK's `lmder`, compiled, from one evaluation to the next: who asks brings r and J.

Levenberg-Marquardt in a trust region that is scaled by the largest norms of the columns so far
(J. J. Moré, in Numerical Analysis, Lecture Notes in Mathematics 630, 1978, p. 105): step by step
what `scipy.optimize.leastsq` does, whose calls back and forth take longer than all this on a short
recording.  Steps out of the box are refused without being evaluated.

Compiled once and kept on disk, which is why this module is imported only where it is used.
"""

from __future__ import annotations

import math

import numpy as np

from pikanid.optimise.trust_region import factor, inner, length, product, trust_step
from pikanid.storage.jit import cached_jit

# what to do next, or why it stopped
EVALUATE, LINEARISE = 0, 1  # definition: r at the trial point is wanted; J there as well
CONVERGED, SPENT = 2, 3  # definition: within the tolerance; evaluations, or digits, used up
FACTOR = 100.0  # numerical: MINPACK's first radius, in scaled norms of the start
FLAT = 1e-15  # numerical: cosine of the angle between r and every column, at which to stop
EPS = float(np.finfo(float).eps)  # definition: of numbers
# rows of the points (8, n)
(THETA, TRIAL, LOWER, UPPER, DIAG, NORMS, QTR, STEP) = range(8)  # definition: positions
# entries of the state (10,)
(COST, RADIUS, PAR, SIZE, SLOPE, COUNT, MOVED, LIMIT,
 TOLERANCE, ENOUGH) = range(10)  # definition: positions


class Descent:
    """Where a local fit is: its best point θ and the trial point; for one thread.

    Args:
        start, lower, upper: (n,) where it begins, and the box.
        rows: Number of residuals, at least n.
        tolerance: Relative change of θ and of the cost at which to stop.
        limit: Evaluations allowed.
        enough: Share of |r|² that a whole Gauss-Newton step must promise, else this is the end.
    """

    def __init__(self, start: np.ndarray, lower: np.ndarray, upper: np.ndarray, rows: int,
                 tolerance: float, limit: int, enough: float = 0.0):
        n = len(start)
        self.points, self.state = np.zeros((8, n)), np.zeros(10)
        self.points[:4] = start, start, lower, upper
        self.state[LIMIT:] = limit, tolerance, enough
        self.table = np.empty((n + 1, rows))
        # what `go_on` takes besides r and J
        self.work = (self.table, self.points, self.state, np.empty((2, n), np.int64),
                     np.empty((2, n, n)), np.empty((n + 2, 2 * n)))

    @property
    def theta(self) -> np.ndarray:
        """The best point so far (n,)."""
        return self.points[THETA].copy()

    @property
    def trial(self) -> np.ndarray:
        """The point (n,) to be evaluated."""
        return self.points[TRIAL].copy()

    @property
    def cost(self) -> float:
        """½|r|² at θ."""
        return 0.5 * float(self.state[COST]) ** 2

    @property
    def evaluations(self) -> int:
        """How many points were tried."""
        return int(self.state[COUNT])

    def linearise(self, r: np.ndarray, jacobian: np.ndarray) -> int:
        """Go on from θ with r (rows,) and J (rows, n) there; what to do next."""
        return self._go_on(LINEARISE, r, np.ascontiguousarray(jacobian.T, float))

    def judge(self, r: np.ndarray) -> int:
        """Take or refuse the trial point with residuals r (rows,); what to do next."""
        return self._go_on(EVALUATE, r, self.table)

    def _go_on(self, told: int, r: np.ndarray, columns: np.ndarray) -> int:
        return go_on(told, np.ascontiguousarray(r, float), columns, *self.work)


@cached_jit(error_model="numpy", _nrt=False, nogil=True)
def go_on(told: int, r: np.ndarray, columns: np.ndarray, table: np.ndarray, points: np.ndarray,
          state: np.ndarray, orders: np.ndarray, triangles: np.ndarray, spare: np.ndarray) -> int:
    """On to the next trial point inside the box from r (rows,) at the last one or, if `told` to
    linearise, from r and the columns Jᵀ (n, rows); what to do next.
    """
    step, R, order, norm = points[STEP], triangles[0], orders[0], math.sqrt(product(r, r, 0))
    while True:
        if told == LINEARISE:
            for i in range(r.size):
                table[order.size, i] = r[i]
            for j in range(order.size):
                for i in range(r.size):
                    table[j, i] = columns[j, i]
            told = _linearise(norm, table, points, state, order, R)
        else:
            told = _judge(norm, points, state, order, R)
        if told != EVALUATE:
            return told
        state[PAR] = trust_step(points[DIAG], points[QTR], state[RADIUS], state[PAR], order, R,
                                spare, orders[1], triangles[1], step)
        inside = True
        for j in range(order.size):
            if points[NORMS, j] == 0.0:
                step[j] = 0.0  # to the last digit
            q = points[THETA, j] + step[j]
            points[TRIAL, j] = q
            inside = inside and points[LOWER, j] <= q <= points[UPPER, j]
        if state[MOVED] == 0.0:
            state[RADIUS] = min(state[RADIUS], length(points[DIAG], step))
        if inside:
            return EVALUATE
        norm = math.inf


@inner
def _linearise(norm: float, table: np.ndarray, points: np.ndarray, state: np.ndarray,
               order: np.ndarray, R: np.ndarray) -> int:
    """Factors of J, the norms of its columns, and the tests of the gradient and of the promise."""
    n, norms, diag = order.size, points[NORMS], points[DIAG]
    factor(table, order, R)
    slope, promised = 0.0, 0.0
    for j in range(n):
        points[QTR, j] = table[n, j]
        promised += table[n, j] ** 2
        square, along = 0.0, 0.0
        for i in range(j + 1):
            square += R[i, j] ** 2
            along += R[i, j] * table[n, i]
        norms[order[j]] = math.sqrt(square)
        if along != 0.0:
            slope = max(slope, abs(along) / (norms[order[j]] * norm))
    if state[COUNT] == 0.0:
        for j in range(n):
            # a column of zeros is measured in its parameter's own size
            diag[j] = norms[j] if norms[j] != 0.0 else 1.0 / (abs(points[THETA, j]) or 1.0)
        state[COUNT], state[COST] = 1.0, norm
        state[SIZE] = length(diag, points[THETA])
        state[RADIUS] = FACTOR * (state[SIZE] or 1.0)
    for j in range(n):
        diag[j] = max(diag[j], norms[j])
    state[SLOPE] = slope
    if slope <= FLAT or promised <= state[ENOUGH] * norm**2:
        return CONVERGED
    return EVALUATE


@inner
def _judge(norm: float, points: np.ndarray, state: np.ndarray, order: np.ndarray, R: np.ndarray
           ) -> int:
    """Take or refuse the trial point, set the radius, and see whether this is the end."""
    step, cost, tolerance = points[STEP], state[COST], state[TOLERANCE]
    far = length(points[DIAG], step)
    state[COUNT] += 1.0
    fall = 1.0 - (norm / cost) ** 2 if 0.1 * norm < cost else -1.0
    linear = 0.0
    for i in range(order.size):
        total = 0.0
        for j in range(i, order.size):
            total += R[i, j] * step[order[j]]
        linear += (total / cost) ** 2
    damped = state[PAR] * (far / cost) ** 2
    foretold = linear + 2.0 * damped
    ratio = fall / foretold if foretold != 0.0 else 0.0
    if ratio <= 0.25:
        shrink = 0.5 if fall >= 0.0 else 0.5 * (linear + damped) / (linear + damped - 0.5 * fall)
        if 0.1 * norm >= cost or shrink < 0.1:
            shrink = 0.1
        state[RADIUS] = shrink * min(state[RADIUS], 10.0 * far)
        state[PAR] /= shrink
    elif state[PAR] == 0.0 or ratio >= 0.75:
        state[RADIUS] = 2.0 * far
        state[PAR] *= 0.5
    taken = ratio >= 1e-4
    if taken:
        for j in range(order.size):
            points[THETA, j] = points[TRIAL, j]
        state[SIZE] = length(points[DIAG], points[THETA])
        state[COST], state[MOVED] = norm, 1.0
    for limit, told in ((tolerance, CONVERGED), (EPS, SPENT)):
        calm = abs(fall) <= limit and foretold <= limit and ratio <= 2.0
        if calm or state[RADIUS] <= limit * state[SIZE]:
            return told
    if state[COUNT] >= state[LIMIT] or state[SLOPE] <= EPS:
        return SPENT
    return LINEARISE if taken else EVALUATE
