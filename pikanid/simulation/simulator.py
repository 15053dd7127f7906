"""`Simulator`: outputs of an experiment and their exact sensitivities, at a stated accuracy."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, Literal, NamedTuple

import numpy as np

from pikanid import errors
from pikanid.model import Input, Model, Output
from pikanid.problem.evaluated import delay_jacobian, delays, paths
from pikanid.problem.late import sample_delay_jacobian, sample_delays
from pikanid.problem.problem import Experiment
from pikanid.simulation.compiled import Method, compiled
from pikanid.simulation.grid import Grid, build_grid
from pikanid.simulation.input_paths import split, with_parts

MethodChoice = Literal["auto", "explicit", "implicit"]
_NOTHING = np.empty(0, np.int64)  # definition: an empty array
SPARE = 2.0  # numerical: times less than is allowed, the error that steps are foretold for
FORETOLD = 64  # numerical: times finer: beyond that an error is far from what the order says
CONVERGING = 0.1  # numerical: of the error, that half the step leaves at most where all is smooth
FINEST = 4096  # limit: sub-steps of the median interval beyond which the explicit route gives up


@dataclass(frozen=True)
class Steps:
    """How finely to integrate: the method, the longest sub-step [s], and its error as found."""

    method: Method
    longest: float
    error: float = np.nan


class Response(NamedTuple):
    """What a simulation gives: outputs y (rows,), their sensitivities (rows, A), states at `t`.

    `finished` is False where the trajectory left the finite numbers or switched without end near
    `stopped_at` [s]; rows behind that point are not filled.
    """

    y: np.ndarray
    sensitivity: np.ndarray
    t: np.ndarray
    states: np.ndarray
    finished: bool = True
    stopped_at: float = np.nan
    status: int = 0


Trial = Callable[[Steps, bool], Response]
_Prepared = tuple[Grid, Callable[..., Any], tuple[Any, ...], np.ndarray | None]


@dataclass(frozen=True)
class Simulator:
    """Simulates one model for one experiment; immutable, safe to use from several threads.

    >>> import numpy as np
    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> from pikanid.problem.problem import bind
    >>> model = systems.sloshing()
    >>> simulator = Simulator(model, bind(model, excitation.two_pulse(), need_outputs=False))
    >>> simulator.run(np.array([0.045, 0.15, 0.3, 9.81]), states=True).states.shape[1]
    2
    """

    model: Model
    experiment: Experiment
    _kept: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    def module(self, method: Method) -> ModuleType:
        """The compiled functions."""
        if method not in self._kept:
            self._kept[method] = compiled(self.acting, method)
        return self._kept[method]

    @functools.cached_property
    def acting(self) -> Model:
        """The model with the inputs of `grid`: the parts of shaped ones are inputs of their own."""
        return with_parts(self.model)

    @functools.cached_property
    def _delayed_by(self) -> np.ndarray:
        """Which parameters (P,) any delay depends on."""
        channels: list[Input | Output] = [*self.model.inputs, *self.model.outputs]
        names = {q.name for c in channels for q in c.delay.free_symbols}
        return np.array([n in names for n in self.model.parameter_names])

    @functools.cached_property
    def _undelayed(self) -> bool:
        channels: list[Input | Output] = [*self.model.inputs, *self.model.outputs]
        return all(c.delay.is_zero for c in channels)

    @functools.cached_property
    def fixed(self) -> bool:
        """Whether parameters move no stop."""
        return self._undelayed and not any(i.shaped for i in self.model.inputs)

    def grid(self, p: np.ndarray) -> Grid:
        """The stops at parameters p; kept, since only delays and paths change them."""
        if self.fixed:
            return self._fixed_grid
        delay_in = delays(self.acting.inputs, self.model, p)
        delay_out = sample_delays(self.model, self.experiment.samples, p)
        shapes = paths(self.model, p)
        key = b"".join(a.tobytes() for a in (delay_in, *map(np.asarray, delay_out), *shapes))
        if self._kept.get("delays") != key:
            held = split(self.model, self.experiment.held, shapes)
            self._kept.update(
                delays=key, grid=build_grid(self.experiment, held, delay_in, delay_out))
        return self._kept["grid"]

    @functools.cached_property
    def _fixed_grid(self) -> Grid:
        zeros = np.zeros(len(self.model.inputs)), [0.0] * len(self.experiment.samples)
        return build_grid(self.experiment, self.experiment.held, *zeros)

    def run(self, p: np.ndarray, active: np.ndarray | None = None, steps: Steps | None = None,
            states: bool = False) -> Response:
        """Simulate at parameters p (P,).

        Args:
            p: All parameters in model order.
            active: Indices (A,) of the parameters whose sensitivities are wanted.
            steps: Method and step length (`choose_steps`); by default chosen for 1e-8 of the
                signal.
            states: Whether to return the states at every stop.
        """
        p = np.ascontiguousarray(p, dtype=float)
        active = _NOTHING if active is None else active
        steps = steps or self.choose_steps(p)
        if not len(active) and not states:
            for at, of, found in self._kept.get("tried", ()):
                if (of.method, of.longest) == (steps.method, steps.longest) and np.array_equal(
                        at, p):
                    return found  # it was run when the steps were chosen
        grid, integrate, arguments, S0 = self.prepared(p, active, steps)
        if S0 is None:
            S0 = np.ascontiguousarray(self.experiment.initial_jacobian(p).T[active])
        X = np.empty((len(grid.T) if states else 0, len(self.model.states)))
        both = np.empty(grid.rows * (1 + len(active)))
        Y, J = both[:grid.rows], both[grid.rows:].reshape(grid.rows, len(active))
        status, stop = integrate(
            *arguments, self.experiment.initial(p), S0, p, active, *grid.seen, X, Y, J)
        # a sum of squares is finite only if everything in it is, and the cheapest of all to take;
        # a trajectory whose squares overflow is as good as infinite
        finite = status == 0 and math.isfinite(np.vdot(both, both))
        return Response(Y, J, grid.T, X, finite, float(grid.T[stop]), int(status))

    def prepared(self, p: np.ndarray, active: np.ndarray, steps: Steps) -> _Prepared:
        """What a run at parameters p takes besides them; kept while the stops are the same."""
        grid, key = self.grid(p), (steps.method, steps.longest, active.tobytes())
        kept: dict[tuple[Method, float, bytes], _Prepared] = self._kept.get("prepared", {})
        if key in kept and kept[key][0] is grid:
            return kept[key]
        moved = self._moved(p, active)
        S0 = (np.ascontiguousarray(self.experiment.initial_jacobian(p).T[active])
              if self.experiment.starts_fixed else None)
        made: _Prepared = (
            grid, self.module(steps.method).integrate,
            (grid.T, grid.pieces(steps.longest), grid.U, grid.V, grid.jumps, *moved), S0)
        if not moved[-1]:
            # the last few, between which accuracies alternate
            self._kept["prepared"] = {**dict(list(kept.items())[-3:]), key: made}
        return made

    def _moved(self, p: np.ndarray, active: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """∂delay/∂θ of inputs (m, A) and of samples (rows, A), and whether any is not zero."""
        if self._undelayed or not self._delayed_by[active].any():
            return (*_zeros(len(self.acting.inputs), len(self.model.outputs), len(active)), False)
        dtau_in = delay_jacobian(self.acting.inputs, self.model, p)[:, active]
        return np.ascontiguousarray(dtau_in), sample_delay_jacobian(
            self.model, self.experiment.samples, p, active), True

    def choose_steps(self, p: np.ndarray, tolerance: float | None = None,
                     method: MethodChoice = "auto", known: Steps | None = None,
                     finest: float = 0.0, trial: Trial | None = None,
                     scale: np.ndarray | None = None, enough: float = 0.0) -> Steps:
        """The longest sub-step whose error, by step doubling, is below `tolerance`.

        Runs with steps h and h/2 and takes |y_h - y_{h/2}|·16/15 as the error of h (order 4:
        Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, sec. II.4).  Where the
        explicit method would need very short steps the implicit one is tried.

        Args:
            tolerance: Of the outputs, in their own units or in those of `scale`; default 1e-8 of
                the largest output.
            known: Steps in use, kept where fine enough; else others follow by the method's order.
            finest: Give up below this step [s]; at least 1/4096 of the median interval is tried.
            trial: The response at p for steps, likely chosen or not; default: no sensitivities.
            scale: (rows,) in which the error of each sample is measured, as its σ: what outputs of
                several units need; the error of the steps found is in it too.
            enough: Error that does where halving gains less than it should: at kinks.

        Raises:
            SimulationFailed: The trajectory is not finite at p with any step.
        """
        if trial is None:
            def trial(steps: Steps, _: bool) -> Response:
                return self._outputs(p, steps)
        grid = self.grid(p)
        unit = 1.0 if scale is None else scale
        if known is not None and tolerance:
            foretold = _foretold(trial, tolerance, known, finest, unit)
            if foretold is not None:
                return foretold
        spacing, usual = grid.spacings
        candidates: list[Method] = ["explicit", "implicit"] if method == "auto" else [method]
        best: Steps | None = None
        failure = Response(*(np.empty(0),) * 4)
        for candidate in candidates:
            longest = usual
            rough = trial(Steps(candidate, longest), True)
            failure = failure if rough.finished else rough
            before = np.inf
            while longest > max(spacing / FINEST, finest):
                fine = trial(Steps(candidate, longest / 2), False)
                if rough.finished and fine.finished:
                    allowed = tolerance or 1e-8 * max(_largest(fine.y, unit), 1e-12)
                    error = _largest(fine.y - rough.y, unit) * 16 / 15
                    if best is None or error < best.error:
                        best = Steps(candidate, longest, error)
                    if error <= allowed:
                        return best
                else:
                    error, failure = np.inf, fine
                # what is smooth is there soon; kinks, and what is stiff, may need another method
                stuck, before = not error < CONVERGING * before, error
                if stuck and best is not None and best.error <= enough:
                    return best
                rough, longest = fine, longest / 2
                if stuck and candidate == "explicit" and method == "auto" and (
                        longest < spacing / 64):
                    break
        if best is None:
            raise errors.SimulationFailed(
                errors.too_many_events(failure.stopped_at) if failure.status == 2
                else errors.not_finite(failure.stopped_at, self._where(p)))
        return best

    def _where(self, p: np.ndarray) -> str:
        return ", ".join(f"{n} = {v:.4g}" for n, v in zip(
            self.model.parameter_names, p, strict=True))

    def _outputs(self, p: np.ndarray, steps: Steps) -> Response:
        """The outputs, or the states where there are none, as one vector."""
        response = self.run(p, steps=steps, states=not self.experiment.samples)
        if self.experiment.samples:
            self._kept["tried"] = ((p.copy(), steps, response), *self._kept.get("tried", ())[:1])
            return response
        finite = response.finished and bool(np.isfinite(response.states).all())
        return Response(response.states.ravel(), response.sensitivity, response.t,
                        response.states, finite, response.stopped_at, response.status)


@functools.lru_cache(maxsize=64)
def _zeros(inputs: int, outputs: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Of delays that no parameter moves: kernels only read them, so that one pair serves all."""
    return np.zeros((inputs, columns)), np.zeros((outputs, columns))


def _largest(y: np.ndarray, unit: np.ndarray | float) -> float:
    return float(np.abs(y / unit).max(initial=0.0))


def _foretold(trial: Trial, tolerance: float, known: Steps, finest: float,
              unit: np.ndarray | float) -> Steps | None:
    """Steps for `tolerance` by the known order, checked, or the known ones where these do; None
    where that does not hold, or asks for steps below `finest`.
    """
    if not known.error > 0:
        return None
    if known.error <= tolerance:
        rough, fine = trial(known, True), trial(Steps(known.method, known.longest / 2), False)
        error = _largest(fine.y - rough.y, unit) * 16 / 15
        enough = rough.finished and fine.finished and error <= tolerance
        return Steps(known.method, known.longest, error) if enough else None
    error = known.error
    for _ in range(2):  # the second time from the error that is found here
        ratio = min((tolerance / (SPARE * error)) ** 0.25, 0.5)
        if ratio < 1.0 / FORETOLD or known.longest * ratio < finest:
            return None
        finer = Steps(known.method, known.longest * ratio)
        rough, fine = trial(known, False), trial(finer, True)
        if not rough.finished or not fine.finished:
            return None
        gap = _largest(fine.y - rough.y, unit)
        if not gap < 1e-3 * _largest(fine.y, unit):
            return None  # far from what the order says
        error = gap / (1 - ratio**4)
        if error * ratio**4 <= tolerance:
            return Steps(known.method, finer.longest, error * ratio**4)
    return None
