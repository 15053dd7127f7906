"""What Table II leaves open for iPDA, and what each choice does to the estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pikanid.optimise.schedules import Fixed
from pikanid.problem.chains import Form, find_chains
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.grids import Grid, Knots, Quadrature, chosen_grid, paper_intervals
from pikanid.strategies.ipda import PAPER_DEGREE, PAPER_LAMBDA, PAPER_WARMUP
from pikanid.strategies.kan_grids import KanGrid
from pikanid.strategies.relaxation import Setup, relax
from pikanid.validation.study import slosh

COLUMNS = tuple(s for s in slosh.SCENARIOS if slosh.noise(s) < 0.5)  # clean and 0.1°


@dataclass(frozen=True)
class Choice:
    """One reading of Table II; the defaults are those of `protocol="paper"`."""

    form: Form = "second_order"
    physics: Quadrature = "sum"
    knots: Knots = "adaptive"
    start: Literal["free", "given"] = "free"
    base: Literal["off", "on"] = "off"  # w_b of Eq. (3)
    warmup: int = PAPER_WARMUP
    lam: float = PAPER_LAMBDA

    def cells(self) -> tuple[str, ...]:
        """The choices in words, as in `HEADERS`."""
        form = self.form.replace("_", " ")
        return (form, self.physics, "uniform" if self.base == "on" else self.knots, self.start,
                self.base, str(self.warmup), f"{self.lam:g}")


# Tables III and IV: clean and 0.1°, dense, then sparse.
PUBLISHED = (0.0496, 0.173, 0.0496, 0.178, 0.0547, 0.377, 0.0550, 0.382)
HEADERS = ("form", "physics", "knots", "start", "base", "warm-up", "λ")


def choices() -> list[Choice]:
    """The protocol, then one or two changes of it at a time."""
    first = Choice()
    forms: tuple[Form, ...] = ("second_order", "state")
    sums: tuple[Quadrature, ...] = ("sum", "integral", "gauss")
    found = [replace(first, form=f, physics=q) for f in forms for q in sums]
    found += [replace(first, start="given"), replace(first, start="given", physics="integral"),
              replace(first, form="state", start="given"),
              replace(first, knots="uniform"), replace(first, knots="curvature"),
              replace(first, knots="aligned"), replace(first, base="on"),
              replace(first, warmup=0)]
    return [*found, *(replace(first, lam=PAPER_LAMBDA * f) for f in (0.01, 0.1, 2.0, 10.0))]


def estimate(choice: Choice, recording: Recording) -> np.ndarray:
    """l [m] and d [N s/m], (2,), from Table II's start."""
    problem = Problem(slosh.model().with_values(slosh.START), recording)
    setup = Setup(problem, VectorField(problem.model), find_chains(problem.model, choice.form),
                  given_start=choice.start == "given", weighted=False, nondimensional=False)
    grid: Grid | KanGrid = chosen_grid(
        problem, choice.knots, degree=PAPER_DEGREE, intervals=paper_intervals(problem),
        quadrature=choice.physics)
    if choice.base == "on":
        samples = problem.experiments[0].n_samples
        grid = KanGrid(paper_intervals(problem), PAPER_DEGREE, exact_switches=False,
                       quadrature="sum", count=samples, base="silu")
    schedule = [Fixed(choice.lam, choice.warmup)]
    return relax(setup, grid, lambda noise: schedule, refine=False).theta  # type: ignore[arg-type]  # list
