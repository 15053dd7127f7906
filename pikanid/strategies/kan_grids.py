"""Grids of a PIKAN: uniform pykan knots, the known kinks beside them, Gauss nodes in between.

pykan's knots are uniform and simple, so that its curve is smoother than a trajectory whose input
switches.  The jumps of the derivatives at a switch are therefore added as basis functions of their
own (`ShallowKAN` kinks), from the order of the differential equation up to the degree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN, planned_kan
from pikanid.approximators.tables import gauss_nodes
from pikanid.problem.chains import Chains
from pikanid.problem.problem import Experiment, Problem

MOST_CELLS = 20_000  # limit: of a grid whose cells follow the switches
MOST_TO_RESOLVE = 5_000  # limit: cells of a first grid that tells every two switches apart
# Switches that are nearer are hard to tell apart.
APART = 1.0  # numerical: cells between two switches that both get kinks


@dataclass(frozen=True)
class KanGrid:
    """`intervals` uniform grid cells for every recording.

    Args:
        degree: Spline degree k of the edges.
        exact_switches: Whether to add kinks where an input switches.
        quadrature: "gauss" (integral, no node straddles a switch) or "sum" (over `count` evenly
            spaced collocation points, Table II).
        base: "zero" (w_b = 0) or "silu".
        seed: Of pykan's initial coefficients, which a fit overwrites.
        points: Gauss nodes in a cell.
    """

    intervals: int
    degree: int = 5
    exact_switches: bool = True
    quadrature: Literal["gauss", "sum"] = "gauss"
    count: int = 501
    base: Literal["zero", "silu"] = "zero"
    seed: int = 0
    points: int = 3

    knots = "kan"
    locks = True

    @property
    def n_intervals(self) -> int:
        """Grid cells of a recording."""
        return self.intervals

    def splines(self, problem: Problem, chains: Chains) -> list[tuple[ShallowKAN, ...]]:
        """One shallow KAN a chain, for every recording.

        Raises:
            BadSetting: If the degree cannot carry the order of the differential equation.
        """
        longest = max(chains.lengths)
        if self.degree < longest + 1:
            raise errors.BadSetting(errors.degree_too_low(self.degree, longest))
        found = []
        for e in problem.experiments:
            switches = self._switches(e.breakpoints(), e.t0, e.t1)
            found.append(tuple(
                ShallowKAN(
                    planned_kan([1, 1], self.intervals, self.degree, (e.t0, e.t1), base=self.base,
                                seed=self.seed),
                    kinks=switches, orders=range(m, self.degree + 1))
                for m in chains.lengths))
        return found

    def _switches(self, times: Array, start: float, stop: float) -> list[float]:
        if not self.exact_switches:
            return []
        # nearer kinks would make the basis all but dependent: the grid must resolve them
        least = (APART - 1e-6) * (stop - start) / self.intervals
        if len(times) > 1 and np.min(np.diff(times)) < least:
            times = times[np.concatenate([[True], np.diff(times) >= least])]
        return [float(t) for t in times]

    def nodes(self, problem: Problem, chains: Chains) -> list[tuple[Array, Array]]:
        """Times and weights of the physics residual, for every recording."""
        found = []
        for e in problem.experiments:
            if self.quadrature == "sum":
                t = np.linspace(e.t0, e.t1, self.count)
                found.append((t, np.ones(self.count)))
                continue
            found.append(gauss_nodes(self.panels(e), self.points))
        return found

    def panels(self, experiment: Experiment) -> Array:
        """Grid cells (E + 1,), split where an input switches: no Gauss node may straddle that."""
        cells = np.linspace(experiment.t0, experiment.t1, self.intervals + 1)
        return np.union1d(cells, experiment.breakpoints()) if self.exact_switches else cells

    @staticmethod
    def crowded(problem: Problem, order: int, cells: float) -> KanGrid | None:
        """A grid for inputs that switch all the time; None where they do not, or too unevenly.

        Where there are more than a quarter as many switches as cells that the motion asks for, the
        cells are as wide as the shortest time between switches.  With a switch in every cell, and
        kinks of the equation's order there beside splines of one degree more, the space is that of
        collocation at two Gauss points: as many coefficients as conditions.
        """
        if any(4 * e.breakpoints().size <= cells for e in problem.experiments):
            return None
        intervals = int(np.ceil(max(_between(problem), cells) - 1e-6))
        return None if intervals > MOST_CELLS else KanGrid(intervals, order + 1, points=2)

    @staticmethod
    def resolving(problem: Problem) -> float:
        """Cells that tell every two switches apart; 0 where that takes too many."""
        cells = APART * _between(problem)
        return cells if cells <= MOST_TO_RESOLVE else 0.0

    def refined(self) -> KanGrid:
        """Every cell halved."""
        return replace(self, intervals=2 * self.intervals)


def _between(problem: Problem) -> float:
    """Times that the shortest stretch without a switch fits into its recording."""
    shortest = [np.diff([e.t0, *e.breakpoints(), e.t1]).min() / (e.t1 - e.t0)
                for e in problem.experiments]
    return 1.0 / float(min(shortest))
