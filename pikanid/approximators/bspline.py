"""B-splines of any degree over any knots, evaluated by SciPy, and ways to place the knots.

A knot of multiplicity r leaves degree - r continuous derivatives.  Where an input switches, the
highest derivative in the model jumps; a spline that is smoother than the solution there biases the
parameters (the error of l falls only as the knot spacing), so aligned knots repeat the switches.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pikanid import errors
from pikanid.approximators import local_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BSpline:
    """The spline space of a degree over a knot sequence (K,), both ends included.

    Evaluation is from the right at knots (from the left at the last one), as the inputs are.

    >>> spline = BSpline(3, uniform_knots(0.0, 1.0, intervals=4, degree=3))
    >>> spline.n_basis, spline.basis(np.array([0.0, 0.5, 1.0])).shape
    (7, (3, 7))
    >>> bool(np.allclose(spline.basis(np.linspace(0, 1, 9)).sum(axis=1), 1.0))
    True
    """

    degree: int
    knots: Array = field(repr=False)

    def __post_init__(self) -> None:
        knots = np.array(self.knots, dtype=float)
        if self.degree < 1 or knots.size < 2 * (self.degree + 1):
            raise errors.BadSetting(errors.spline_knots(self.degree, knots.size))
        if (knots[1:] < knots[:-1]).any() or not np.isfinite(knots).all():
            raise errors.BadSetting(errors.spline_knots_unsorted())
        knots.flags.writeable = False
        object.__setattr__(self, "knots", knots)

    @property
    def n_basis(self) -> int:
        """Number of basis functions."""
        return int(self.knots.size - self.degree - 1)

    @property
    def n_coefficients(self) -> int:
        """Number of adjustable coefficients (the basis functions)."""
        return self.n_basis

    @property
    def start(self) -> float:
        """First time that the basis spans."""
        return float(self.knots[self.degree])

    @property
    def stop(self) -> float:
        """Last time that the basis spans."""
        return float(self.knots[-self.degree - 1])

    @property
    def breakpoints(self) -> Array:
        """Distinct knots from start to stop (E + 1,): between two of them it is a polynomial."""
        return np.unique(self.knots[self.degree : self.n_basis + 1])

    @property
    def greville(self) -> Array:
        """Means of `degree` neighbouring knots (n_basis,): good points to interpolate at."""
        total = self.knots.cumsum()
        means = (total[self.degree : -1] - total[: self.n_basis]) / self.degree
        return np.minimum(np.maximum(means, self.start), self.stop)

    def basis(self, t: Array, derivative: int = 0) -> sparse.csr_array:
        """Basis matrix or its time derivative at ``t`` (M,): csr (M, n_basis), degree + 1 a row."""
        first, values = self.local(t, derivative)
        return local_matrix(first, values, self.n_basis)

    def local(self, t: Array, derivative: int = 0) -> tuple[NDArray[np.int64], Array]:
        """First basis function that is not zero at ``t`` (M,), and degree + 1 values (M, degree+1).

        Raises:
            ValueError: If a time lies outside [start, stop].
        """
        t = np.array(t, dtype=float)  # writeable and contiguous: one compiled form serves all
        first, values = np.empty(t.size, np.int64), np.empty((t.size, self.degree + 1))
        self.fill(t, derivative, first, values)
        return first, values

    def fill(self, t: Array, derivative: int, first: NDArray[np.int64], values: Array) -> None:
        """The same as ``local`` into arrays of the caller's; all of them writeable, contiguous.

        Raises:
            ValueError: If a time lies outside [start, stop].
        """
        from pikanid.approximators.local_basis import tabulate

        if not tabulate(self.knots, self.degree, derivative, t, first, values):
            raise ValueError(errors.outside_spline(self.start, self.stop))

    def values(self, t: Array, coefficients: Array, derivative: int = 0) -> Array:
        """The ``derivative``-th time derivative at ``t`` (M,) for coefficients (n_basis,)."""
        first, values = self.local(np.asarray(t, dtype=float), derivative)
        window = first[:, None] + np.arange(values.shape[1])
        return np.einsum("ma,ma->m", values, coefficients[window])

    def jacobian(self, t: Array, coefficients: Array, derivative: int = 0) -> sparse.csr_array:
        """Derivative of ``values`` by the coefficients: the basis, whatever the coefficients."""
        return self.basis(t, derivative)


def knots_from_breakpoints(breakpoints: Array, degree: int,
                           multiplicity: int | NDArray[np.int64] = 1) -> Array:
    """Clamped knots over breakpoints (E + 1,), interior ones repeated ``multiplicity`` times.

    >>> knots_from_breakpoints(np.array([0.0, 1.0, 2.0]), degree=2, multiplicity=2)
    array([0., 0., 0., 1., 1., 2., 2., 2.])
    """
    times = np.full(breakpoints.size, degree + 1, dtype=np.int64)
    times[1:-1] = multiplicity
    return np.repeat(np.asarray(breakpoints, dtype=float), times)


def uniform_knots(start: float, stop: float, *, intervals: int, degree: int) -> Array:
    """Clamped knots, ``intervals`` equal pieces [s]."""
    return knots_from_breakpoints(np.linspace(start, stop, intervals + 1), degree)


def sample_breakpoints(t: Array, start: float, stop: float, intervals: int) -> Array:
    """Breakpoints (intervals + 1,) with equally many samples t between them: uniform for uniform t.

    >>> sample_breakpoints(np.array([0.0, 1.0, 2.0, 4.0, 8.0]), 0.0, 8.0, 2)
    array([0., 2., 8.])
    """
    place = np.linspace(0.0, t.size - 1.0, intervals + 1)[1:-1]
    return np.concatenate([[start], np.interp(place, np.arange(t.size), t), [stop]])


def curvature_breakpoints(t: Array, y: Array, start: float, stop: float, intervals: int) -> Array:
    """Breakpoints (intervals + 1,) denser where the data (t, y) bend, by equidistribution.

    The monitor is 1 + |y''| / mean|y''| of a smoothed second difference, so that half of the knots
    follow the curvature and half are spread evenly (de Boor, ch. XII, regularised).
    """
    if t.size < 5:
        return np.linspace(start, stop, intervals + 1)
    slope = np.diff(y) / np.diff(t)
    middle = 0.5 * (t[1:] + t[:-1])
    bend = np.abs(np.diff(slope) / np.diff(middle))
    window = max(3, t.size // intervals)
    bend = np.convolve(np.pad(bend, window // 2, mode="edge"), np.ones(window) / window, "valid")
    bend = bend[: t.size - 2]
    mean = float(bend.mean())
    density = np.ones(t.size) if mean == 0.0 else 1.0 + np.pad(bend, 1, mode="edge") / mean
    mass = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(t))])
    inner = np.interp(np.linspace(0.0, mass[-1], intervals + 1), mass, t)[1:-1]
    return np.concatenate([[start], inner, [stop]])


def aligned_breakpoints(start: float, stop: float, switches: Array, spacing: float) -> Array:
    """Breakpoints at every switch (S,), the stretches between split evenly to <= spacing [s].

    >>> aligned_breakpoints(0.0, 1.0, np.array([0.25]), 0.4)
    array([0.   , 0.25 , 0.625, 1.   ])
    """
    fixed = np.concatenate([[start], switches, [stop]])
    lengths = np.diff(fixed)
    # A hair of slack keeps an exact division from being rounded up to one piece more.
    pieces = np.maximum(1, np.ceil(lengths / spacing * (1 - 1e-9))).astype(np.int64)
    which = np.repeat(np.arange(lengths.size), pieces)
    within = np.arange(which.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.append(fixed[which] + lengths[which] * (within / pieces[which]), stop)


def split_breakpoints(breakpoints: Array) -> Array:
    """Every interval halved: (E + 1,) -> (2E + 1,)."""
    halved = np.empty(2 * breakpoints.size - 1)
    halved[::2] = breakpoints
    halved[1::2] = 0.5 * (breakpoints[1:] + breakpoints[:-1])
    return halved
