"""PIKAN: a Kolmogorov-Arnold network as the trajectory, fitted together with the parameters.

The approximator of Table I is a real pykan network.  A shallow one with w_b = 0 is a spline
(Eq. 4), so that Gauss-Newton on all unknowns is banded, as in iPDA (kan_shallow.py); a deeper one
is banded in its first layer alone and needs Levenberg-Marquardt (kan_deep.py).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from pikanid import errors
from pikanid.approximators.kan.device import check_device
from pikanid.approximators.kan.plan import Base
from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.optimise.schedules import Stage
from pikanid.problem.chains import Form, find_chains
from pikanid.problem.problem import Problem
from pikanid.recording import Recording
from pikanid.settings import of_kind
from pikanid.simulation.vectorfield import VectorField
from pikanid.strategies.kan_deep import Shape, deep_fit
from pikanid.strategies.kan_grids import MOST_CELLS, MOST_TO_RESOLVE, KanGrid
from pikanid.strategies.kan_paper import paper_fit
from pikanid.strategies.kan_shallow import cells_of, shallow_fit
from pikanid.strategies.kan_trajectories import KanTrajectories
from pikanid.strategies.relaxation import RelaxedFit, Setup, start_is_estimated
from pikanid.strategies.relaxed_estimate import relaxed_estimate
from pikanid.strategies.settings import RELAXATION, RelaxationSettings, recorded

FIRST_GRID = 10  # numerical: cells, from which grids are refined
# In cells, and in times the cells that the motion needs.
LEAST_FINEST, FINER = 640, 10  # limit: of the finest grid
SHALLOW = (1, 1)  # definition: a network without hidden nodes
LAMBDA_RULE = "x10 from the weakest until no parameter moves by 0.05 standard errors"
Progress = Callable[[dict[str, float]], None]


@dataclass(frozen=True)
class PIKAN:
    """Physics-informed KAN.

    Args:
        protocol: "default": refinement until the discretisation no longer shows, switches exact;
            "paper": Table II (shallow, cubic, 10 → 20 → 40, λ 0 → 0.1, then 500 L-BFGS steps at λ =
            1 with 501 collocation points), where the gradient norm at the stop is reported.
        width: Nodes of every layer; (1, 1) is shallow, in (1, 5, 1) or (1, [3, 1], 1) hidden nodes
            add or multiply.  Every chain of states has a network of its own.  A deeper network
            starts from the shallow fit, which it contains, and is trained as a whole from there.
        base: "zero" (w_b = 0 in Eq. 3) or "silu".
        grid: Cells of the only grid over time, in place of refinement.
        hidden_grid: Cells of the grids of hidden values.
        degree: Of the edges' splines.
        lam: A fixed λ (dimensionless, as in `IPDA`), in place of continuation: λ rises tenfold
            until no parameter moves by more than 0.05 of its standard error, or until a grid that
            cannot meet the physics would lock the fit.
        exact_switches: Add the known kinks of the trajectory at the input switches.
        form: "second_order" or "state", as in `IPDA`.
        max_grid: Finest grid tried; by default ten times the cells that the fastest linearised
            motion (a radian a cell) or the switches ask for, between 640 and 20000.
        seed: Of the starting coefficients of a deeper network.
        device: "cpu", or "cuda" for a pykan model that lives on a GPU.  The fit itself is NumPy and
            runs on the CPU either way: at these sizes a GPU has nothing to gain.
        progress: Called with loss parts, λ and grid after every stage.
        settings: When grid and λ count as settled.

    >>> import numpy as np, pikanid as pk
    >>> model = pk.systems.sloshing()
    >>> rec = pk.simulate(model, pk.excitation.two_pulse(), sigma=0.1*np.pi/180, seed=0)
    >>> est = PIKAN().fit(model.with_values(l_theta=0.06, d_theta=0.05), rec)
    >>> round(est.value("l_theta"), 4), type(est.approximator.kan).__mro__[1].__name__
    (0.045, 'MultKAN')
    """

    name: ClassVar[str] = "pikan"
    slow: ClassVar[bool] = False
    protocol: Literal["default", "paper"] = "default"
    width: Sequence[int | Sequence[int]] = SHALLOW
    base: Base = "zero"
    grid: int | None = None
    hidden_grid: int = 6
    degree: int | None = None
    lam: float | None = None
    exact_switches: bool = True
    form: Form = "second_order"
    max_grid: int | None = None
    seed: int = 0
    device: str = "cpu"
    progress: Progress | None = None
    settings: RelaxationSettings = RELAXATION

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        `estimate.approximator` holds the networks (`.kan` is the pykan model of the first
        recording and chain, `.networks` all of them), which evaluate to the fitted curve.

        Raises:
            BadRecording: A channel is missing or unusable.
            BadSetting: Options that cannot work, or a delay to be estimated.
        """
        begun = time.perf_counter()
        self._check()
        problem = Problem(model, recordings)
        settings = recorded(self)
        settings["width"] = [entry if isinstance(entry, int) else list(entry)
                             for entry in self.width]
        # A right-hand side that overflows is a failed step, and said where it cannot be helped.
        with np.errstate(all="ignore"):
            if self.protocol == "paper":
                fit, more = paper_fit(self._setup(problem), self.degree or 3, self.seed,
                                      self.progress)
                settings |= more
            else:
                fit = self._default(problem)
                settings["lam_rule"] = "given" if self.lam else LAMBDA_RULE
            found = relaxed_estimate(self.name, fit, settings, begun,
                                     KanTrajectories.of(fit, self.device))
        if found.adequacy.verdict == "misfit" and fit.effective > 2 * fit.theta.size + 2:
            note = errors.curve_follows_data(fit.effective, fit.theta.size, fit.lam)
            found = replace(found, warnings=(*found.warnings, note))
        return found

    def _default(self, problem: Problem) -> RelaxedFit:
        setup = self._setup(problem)
        # w_b's column is full, as those of later layers are: both are trained beside the band
        deep = len(self.width) > 2 or self.base != "zero"
        longest = max(setup.chains.lengths)
        grid = KanGrid(self.grid or FIRST_GRID, self.degree or max(5, longest + 3),
                       self.exact_switches, seed=self.seed)
        cells = min(cells_of(setup), MOST_TO_RESOLVE)
        crowded = (KanGrid.crowded(problem, longest, cells)
                   if self.grid is None and self.exact_switches and self.degree is None else None)
        if crowded is not None:
            grid, cells = crowded, float(crowded.intervals)
        elif self.exact_switches:
            cells = max(cells, KanGrid.resolving(problem))
        finest = self.max_grid or max(LEAST_FINEST, min(int(FINER * cells), MOST_CELLS))
        fit = shallow_fit(setup, grid, cells=cells if self.grid is None else None, max_grid=finest,
                          lam=self.lam, tell=self._tell)
        if not deep or not fit.stages:
            return fit
        if self.grid is not None:  # what the shallow one lacks on this grid, this one may have
            fit = replace(fit, warnings=())
        shape = Shape(tuple(self.width), self.hidden_grid, self.base, self.seed)
        return deep_fit(setup, fit, shape, self.lam, self._tell)

    def _setup(self, problem: Problem) -> Setup:
        paper = self.protocol == "paper"
        return Setup(problem, VectorField(problem.model), find_chains(problem.model, self.form),
                     given_start=not paper or start_is_estimated(problem), weighted=not paper,
                     nondimensional=not paper,
                     settings=self.settings)

    def _check(self) -> None:
        """Refuse options that cannot work."""
        of_kind(self.settings, RelaxationSettings)
        choices = {"protocol": ("default", "paper"), "form": get_args(Form),
                   "base": get_args(Base)}
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise errors.BadSetting(errors.bad_value(
                    name, getattr(self, name), "one of " + ", ".join(known)))
        for name, least in {"grid": 1, "hidden_grid": 1, "degree": 2, "max_grid": 1}.items():
            value = getattr(self, name)
            if value is not None and not (isinstance(value, int) and value >= least):
                raise errors.BadSetting(errors.bad_value(name, value, f"a number >= {least}"))
        if self.lam is not None and not self.lam > 0.0:
            raise errors.BadSetting(errors.bad_value("lam", self.lam, "positive"))
        if len(self.width) < 2 or self.width[0] != 1 or self.width[-1] != 1:
            raise errors.BadSetting(errors.kan_not_a_curve(list(self.width)))
        if self.protocol == "paper" and (tuple(self.width) != SHALLOW or self.base != "zero"):
            raise errors.BadSetting(errors.bad_value(
                "protocol", "paper", "used with width=(1, 1) and base='zero' (Table II)"))
        check_device(self.device)

    def _tell(self, intervals: int, stages: Sequence[Stage]) -> None:
        if self.progress is not None:
            for s in stages:
                self.progress({"grid": float(intervals), "lam": s.lam, "data": s.data_cost,
                               "physics": s.physics_cost})
