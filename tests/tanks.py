"""A tank with a missing law, and edges fitted to it: what tests of `discrepancy` share."""

from __future__ import annotations

from functools import cache

import numpy as np

import pikanid as pk
from pikanid.discrepancy.edges import plan_edges
from pikanid.discrepancy.level import Level
from pikanid.discrepancy.levels import Search
from pikanid.problem.problem import Problem
from pikanid.strategies.nls import NLS

SIGMA = 0.01


def tank(name: str = "tank") -> pk.Model:
    """x' = -a x + u, measured: no second argument can take the place of x."""
    return pk.Model.from_dict({
        "name": name, "states": {"x": {"unit": "m"}}, "inputs": {"u": {"unit": "m/s"}},
        "parameters": {"a": {"guess": 1.0, "unit": "1/s", "bounds": [0.0, 10.0]}},
        "equations": {"x": "-a*x + u"}, "outputs": {"x": {"unit": "m", "expression": "x"}}})


def recording(cube: float, seed: int) -> pk.Recording:
    """20 s of a multisine; a missing law -cube·x³."""
    model = tank().with_term("x", "-c*x**3", [pk.Parameter("c", cube)])
    drive = pk.excitation.multisine(np.arange(0.05, 0.5, 0.05), 20.0, 0.05, 3.0, seed=1,
                                    channel="u", unit="m/s")
    return pk.simulate(model, drive, sigma=SIGMA, seed=seed)


@cache
def searching() -> Search:
    """A search of edges, begun with the nominal fit."""
    model, data = tank(), recording(0.3, 0)
    nominal = NLS().fit(model, data)
    return Search(nominal, Problem(nominal.fitted_model, data), "x", False, False)


@cache
def coarse() -> Level:
    """The edge of x on a grid of eight intervals."""
    return searching().first(plan_edges(tank(), ["x"], 8), 8)
