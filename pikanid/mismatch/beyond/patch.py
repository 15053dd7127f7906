"""The KAN patch: one edge inside the equation where no law can be named, with its range.

The edge is a cubic spline of one argument, refitted by simulation together with the parameters.
It says nothing beyond the range that the motion visited, and is offered only where it improves
the prediction of recordings that it never saw and that stay inside that range.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp
from scipy.interpolate import BSpline

from pikanid.approximators.bspline import knots_from_breakpoints
from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.mismatch.beyond.force_shape import Edge, ForceShape
from pikanid.mismatch.catalogue.candidate import Candidate, Channel
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.model import Model
from pikanid.model.parts import Parameter, Spline
from pikanid.model.units import of_difference

INTERVALS, DEGREE = 5, 3  # numerical: of a law that nobody knows: a few pieces, cubic
GRID = 201  # numerical: points at which an edge is drawn


@dataclass(frozen=True, eq=False)
class Patch:
    """An edge δ(argument) that improves the prediction without a name.

    Attributes:
        model: The nominal model at its new estimates with the edge in it.
        argument, unit: What it is a function of, and the unit of its values.
        grid, values, std: (G,) over the range, without mean and slope, which constants and
            parameters share; outside the range the edge means nothing.
        inside: Share of the held-out motion in that range.
        rmse: Held out, of each output by name: before, after, and its unit.
    """

    model: Model
    argument: str
    unit: str
    grid: np.ndarray
    values: np.ndarray
    std: np.ndarray
    inside: float
    rmse: Mapping[str, tuple[float, float, str]]

    def sentence(self) -> str:
        """What it does, where."""
        changes = [f"{f'of {name!r} ' if len(self.rmse) > 1 else ''}from {before:.3g} to "
                   f"{after:.3g} {unit}".rstrip()
                   for name, (before, after, unit) in self.rmse.items()]
        return (f"a KAN edge of {self.argument} over {self.grid[0]:.3g} ... {self.grid[-1]:.3g} "
                f"takes the held-out RMSE {', '.join(changes)}; it holds in that range only and "
                "has no name")


def patch(base: Hypothesis, nominal: Model, shape: ForceShape, site: Site, records: Records,
          later: Records, predict: Callable[[Hypothesis], HeldOut | None]) -> Patch | None:
    """The patch of the state whose edge explains most alone; None where it is no help.

    Args:
        base: Fit of the nominal model.
        nominal: That model.
        shape: What is missing, to first order.
        site: Coordinate.
        records, later: To fit, and held out.
        predict: What a hypothesis makes of the held-out recordings.
    """
    edges = [e for e in shape.edges if e.argument in site.moving]
    if not edges:
        return None
    edge = max(edges, key=lambda e: e.alone)
    basis = FreeCurve(edge.argument, edge.curve.low, edge.curve.high, nominal)
    found = fitted(nominal, [basis.candidate(site)], records, [base.point], 1)
    before = predict(base)
    if found is None or before is None or found.minimum.chi2 >= base.minimum.chi2:
        return None
    after = predict(found)
    settings = records.settings
    if after is None or after.misfit > settings.verdict.improvement * before.misfit:
        return None
    inside = _inside(found, later, edge)
    if inside < settings.beyond.inside:
        return None
    grid = np.linspace(basis.low, basis.high, GRID)
    free = [f.name for f in found.whitened.problem.free]
    at = [free.index(n) for n in basis.names]
    line = np.column_stack([np.ones(GRID), grid])
    seen = basis.matrix(grid)
    seen = seen - line @ np.linalg.lstsq(line, seen, rcond=None)[0]
    spread = np.einsum("gi,ij,gj->g", seen, found.covariance[np.ix_(at, at)], seen)
    return Patch(basis.extended(nominal, site, found), edge.argument, shape.unit, grid,
                 seen @ found.minimum.theta[at], np.sqrt(np.maximum(spread, 0.0)), inside,
                 {o.name: (before.rmse[o.name], after.rmse[o.name], o.unit)
                  for o in nominal.outputs if o.name in before.rmse and o.name in after.rmse})


@dataclass(frozen=True)
class Difference:
    """An argument in formulas that take its powers: a temperature in degC has none, its distance
    from a fixed one has.

    Attributes:
        text: Of the argument.
        unit: Of the argument, which its powers and products have as well.
        zeros: Fixed parameters that the text takes.
    """

    text: str
    unit: str
    zeros: tuple[Parameter, ...] = ()

    @property
    def distance(self) -> str:
        """The unit of a distance by itself."""
        return of_difference(self.unit)

    @classmethod
    def of(cls, argument: str, unit: str, name: str) -> Difference:
        """Of an argument in this unit; a parameter may have this name."""
        if not unit or not units.begins_elsewhere(unit):
            return cls(argument, unit)
        zero = Parameter(name, 0.0, unit, free=False)
        return cls(f"({argument} - {name})", unit, (zero,))


class FreeCurve:
    """Cubic splines of a state, an input or an output as truncated powers, of the argument scaled
    to ±1.

    Without the straight line, which belongs to the free parameters.  One that is `zero_at_zero` of
    its argument holds no constant: a spring at rest, a damper that stands, an input that is off.
    """

    def __init__(self, argument: str, low: float, high: float, model: Model,
                 intervals: int = INTERVALS, unit: str | None = None, zero_at_zero: bool = False):
        self.argument = argument
        self.low, self.high = low, high
        self.inner = np.linspace(-1.0, 1.0, intervals + 1)[1:-1]
        self.name = "delta"
        while any(taken.startswith(self.name) for taken in model.symbols):
            self.name += "_x"
        self.zero_at_zero = zero_at_zero
        self.names = [f"{self.name}_{k}" for k in range(3 - zero_at_zero + len(self.inner))]
        self.difference = Difference.of(
            argument, model.state(argument).unit if unit is None else unit, f"{self.name}_zero")

    def _scaled(self, x: np.ndarray) -> np.ndarray:
        return (2 * x - self.low - self.high) / (self.high - self.low)

    def matrix(self, x: np.ndarray) -> np.ndarray:
        """(N, n) at arguments (N,)."""
        columns = self._powers(self._scaled(x))
        return (columns - self._at_zero())[:, 1:] if self.zero_at_zero else columns

    def _powers(self, z: np.ndarray) -> np.ndarray:
        return np.column_stack([np.ones(len(z)), z**2, z**3, *(
            np.maximum(z - k, 0.0) ** 3 for k in self.inner)])

    def _at_zero(self) -> np.ndarray:
        return self._powers(self._scaled(np.zeros(1)))[0]

    def candidate(self, site: Site) -> Candidate:
        """The edge as a force whose coefficients are estimated."""
        return self._effect(site, "dynamics", site.force_unit,
                            lambda m: site.pushed(m, self.formula))

    def of_input(self, site: Site) -> Candidate:
        """The edge as what an input does beside what is recorded of it."""
        return self._effect(site, "input", self.difference.unit, lambda m: m.map_input(
            self.argument, function=f"{self.argument} + {self.formula}"))

    def of_sensor(self, site: Site) -> Candidate:
        """The edge as what an output shows beside what it should."""
        return self._effect(site, "sensor", self.difference.unit, lambda m: m.map_output(
            self.argument, function=f"{self.argument} + {self.formula}"))

    @property
    def _shapes(self) -> list[str]:
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        z = f"(({self.difference.text} - ({middle!r}))/{half!r})"
        shapes = ["1", f"{z}**2", f"{z}**3", *(f"max({z} - ({k!r}), 0)**3"
                                              for k in map(float, self.inner))]
        if not self.zero_at_zero:
            return shapes
        return [f"({shape} - ({value!r}))"
                for shape, value in zip(shapes, self._at_zero().tolist(), strict=True)][1:]

    @property
    def formula(self) -> str:
        """Of the argument and the coefficients."""
        return " + ".join(f"{n}*{p}" for n, p in zip(self.names, self._shapes, strict=True))

    def _effect(self, site: Site, channel: Channel, unit: str,
                extend: Callable[[Model], Model]) -> Candidate:
        # z is a number, but carries the unit of what it is made from
        constant = self.difference.distance if unit == self.difference.unit else unit
        own = [constant, *(units.product((unit or "1", 1), (self.difference.unit or "1", -power))
                           for power in (2, *(3 for _ in (0, *self.inner))))][self.zero_at_zero:]
        return Candidate(("patch",), "a KAN edge", self.formula, channel, site,
                         tuple(Parameter(n, 0.0, unit)
                               for n, unit in zip(self.names, own, strict=True)),
                         lambda m: extend(m.with_parameters(*self.difference.zeros)),
                         lambda view: (), known=False)

    def extended(self, nominal: Model, site: Site, found: Hypothesis) -> Model:
        """The nominal model, at the estimates, with the edge as a B-spline."""
        inner = (self.inner + 1) / 2 * (self.high - self.low) + self.low
        knots = knots_from_breakpoints(np.array([self.low, *inner, self.high]), DEGREE)
        x = np.linspace(self.low, self.high, GRID)
        values = self.matrix(x) @ np.array([found.values[n] for n in self.names])
        coefficients = np.linalg.lstsq(
            BSpline.design_matrix(x, knots, DEGREE).toarray(), values, rcond=None)[0]
        spline = Spline(self.name, DEGREE, tuple(map(float, knots)))
        model = nominal.with_values({n: v for n, v in found.values.items()
                                     if n in nominal.parameter_names})
        model = model.with_spline(spline, site.force_unit)
        edge = sp.Function(spline.name, real=True)(symbol(self.argument))
        return site.pushed(model, edge).fix(
            **dict(zip(spline.coefficient_names, map(float, coefficients), strict=True)))


def _inside(found: Hypothesis, later: Records, edge: Edge) -> float:
    """Share of the held-out motion, as predicted, in the range of the edge."""
    whitened = Whitened(found.model.with_values(
        {n: v for n, v in found.values.items() if n in found.model.parameter_names}), later)
    theta = whitened.problem.guess
    if not whitened.choose_steps(theta, misfit=found.minimum.chi2 / max(whitened.rows, 1)):
        return 0.0
    column = found.model.state_names.index(edge.argument)
    visited = np.concatenate([r.states[:, column] for r in whitened.responses(theta, states=True)])
    return float(np.mean((visited >= edge.curve.low) & (visited <= edge.curve.high)))
