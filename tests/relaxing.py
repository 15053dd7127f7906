"""Small problems that the tests of the relaxation strategies share."""

from __future__ import annotations

from functools import cache

import numpy as np

import pikanid as pk
from pikanid.approximators.tables import gauss_nodes
from pikanid.objective.functional import Functional, bind
from pikanid.optimise.gauss_newton import Point
from pikanid.problem.chains import Form, find_chains
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import default_grid

DEGREE = np.pi / 180
TRUTH = np.array([0.045, 0.15])
# Cramér-Rao standard deviations of (l, d): stride and noise in degrees
BOUND = {(1, 0.1): (9.89e-6, 9.5e-4), (1, 1.0): (9.89e-5, 9.5e-3),
         (10, 0.1): (3.08e-5, 3.0e-3), (10, 1.0): (3.08e-4, 3.0e-2)}


@cache
def clean() -> pk.Recording:
    """The paper's experiment without noise: 501 samples over 5 s."""
    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse())


def slosh(degrees: float = 0.0, seed: int = 0, stride: int = 1, known: bool = True
          ) -> pk.Recording:
    """The paper's recording with noise of `degrees`, every `stride`-th sample of θ."""
    whole = clean()
    u, theta = whole["u_x"], whole["theta"]
    noise = np.random.default_rng(seed).normal(size=theta.values.size) * degrees * DEGREE
    sigma = degrees * DEGREE if known and degrees else None
    return pk.Recording({
        "u_x": u, "theta": pk.Channel("theta", theta.time[::stride],
                                      (theta.values + noise)[::stride], "rad", sigma)})


def guessed(l_theta: float = 0.06, d_theta: float = 0.05) -> pk.Model:
    """The sloshing model at the paper's starting values."""
    return pk.systems.sloshing().with_values(l_theta=l_theta, d_theta=d_theta)


def collocated(model: pk.Model, recordings: pk.Recording | list[pk.Recording],
               form: Form = "second_order", intervals: int = 30) -> Functional:
    """Eq. (2) on a collocation grid."""
    problem = Problem(model, recordings)
    field, chains = VectorField(model), find_chains(model, form)
    grid = default_grid(problem, field, chains, degree=None, intervals=intervals)
    return bind(problem, field, chains, grid.splines(problem, chains),
                [gauss_nodes(b, 4) for b in grid.breakpoints])


def random_point(functional: Functional, seed: int = 0) -> Point:
    """Random coefficients around rest, held ones as the initial state says."""
    rng, theta = np.random.default_rng(seed), functional.problem.guess
    return Point(tuple(
        functional.complete(r, 0.1 * rng.normal(size=part.n_coefficients), theta)
        for r, part in enumerate(functional.parts)), theta)
