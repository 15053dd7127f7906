"""Any model simulated by SciPy, from its formulas alone: the simulator of concealed recordings.

Nothing of the kit's own simulator takes part.  Between two instants at which a recorded input has a
sample, a delay begins or ends, or an output is read, the right-hand side is smooth in time, and the
Dormand-Prince method of order 8 (E. Hairer, S. P. Nørsett and G. Wanner, Solving Ordinary
Differential Equations I, 2nd ed., section II.10) goes from one to the next; it restarts there.
Where that takes very many steps, as a fast decay does, LSODA goes on from there to the end (L.
Petzold, SIAM Journal on Scientific and Statistical Computing 4, 1983), which changes to a method
for stiff equations.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import ode
from scipy.interpolate import CubicSpline

from pikanid import errors
from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model
from pikanid.model.parts import Hold
from pikanid.recording import Channel, Recording
from pikanid.validation.concealed.arrays import Array

RELATIVE, ABSOLUTE = 1e-8, 1e-10  # numerical: tolerances; the second one times a state's range
MOST_STEPS = 60  # limit: of the explicit method between two instants; beyond it is stiff
MOST_STIFF = 20_000  # limit: of LSODA's steps there
MOST_EVALUATIONS = 3_000_000  # limit: of the right-hand side in one simulation
LARGEST = 1e12  # limit: of a state; beyond, the model has diverged


def _signed_power(x: float, n: float) -> float:
    return math.copysign(abs(x) ** n, x) if x else 0.0


def _abs_power(x: float, n: float) -> float:
    return abs(x) ** n if x else 0.0


def _log_abs(x: float) -> float:
    return math.log(abs(x)) if x else 0.0


def _step(x: float, at: float = 0.5) -> float:  # 0.5: as SymPy's Heaviside has it
    return at if x == 0 else float(x > 0)


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "clip": lambda x, low, high: min(max(x, low), high), "signed_power": _signed_power,
    "abs_power": _abs_power, "log_abs": _log_abs, "Heaviside": _step,
    "sign": _sign, "Max": max, "Min": min, "Abs": abs}


class Plant:
    """A model as SciPy simulates it.

    Args:
        model: Without play or rate limits of inputs, half derivatives or splines.
        under_way: Whether the motion of a model whose initial state is estimated begins as long
            before an experiment as an output is late, so that it shows a motion from its first
            sample on; else, as of one that begins at rest, it shows the initial state until then.

    Raises:
        BadModel: If it has any of these.

    >>> from pikanid.model import systems
    >>> from pikanid.recording import excitation
    >>> plant = Plant(systems.sloshing())
    >>> seen = plant.outputs({}, excitation.two_pulse())
    >>> round(float(abs(seen["theta"]).max()), 4)
    0.1979
    """

    def __init__(self, model: Model, under_way: bool = False) -> None:
        if model.splines or any(i.shaped for i in model.inputs):
            raise errors.BadModel(errors.not_for_scipy(model.name))
        free = {symbol(n) for n in model.free_names}
        self.model = model
        self.under_way = under_way and all(s.initial in free for s in model.states)

    @cached_property
    def _arguments(self) -> list[Any]:
        return [TIME, [symbol(n) for n in self.model.state_names],
                [symbol(n) for n in self.model.input_names],
                [symbol(n) for n in self.model.parameter_names]]

    def _compiled(self, formulas: Sequence[sp.Expr]) -> Callable[..., list[float]]:
        made: Callable[..., list[float]] = sp.lambdify(
            self._arguments, list(formulas), modules=[dict(FUNCTIONS), "math"], cse=True)
        return made

    @cached_property
    def _rates(self) -> Callable[..., list[float]]:
        return self._compiled([self.model.equations[n] for n in self.model.state_names])

    @cached_property
    def _starts(self) -> Callable[..., list[float]]:
        return self._compiled([s.initial for s in self.model.states])

    @cached_property
    def _seen(self) -> Callable[..., list[float]]:
        return self._compiled([o.expression for o in self.model.outputs])

    @cached_property
    def _delays(self) -> Callable[..., list[float]]:
        late = [*(i.delay for i in self.model.inputs), *(o.delay for o in self.model.outputs)]
        return self._compiled(late)

    def outputs(self, values: Mapping[str, float], experiment: Recording) -> dict[str, Array]:
        """(N,) of each output at the instants of its channel, or of the first channel.

        Args:
            values: Of parameters that differ from the model's.
            experiment: With the model's inputs.

        Raises:
            SimulationFailed: If the motion diverges or is too stiff.
        """
        return self.simulated(values, experiment)[0]

    def simulated(self, values: Mapping[str, float], experiment: Recording,
                  ) -> tuple[dict[str, Array], dict[str, tuple[float, float]]]:
        """The same, and the lowest and the highest value of each state."""
        model = self.model
        given = {**model.values, **values}
        # Formulas take several times as long, and warn, with NumPy's scalars.
        p = [float(given[n]) for n in model.parameter_names]
        nothing = [0.0] * len(model.states)
        late = self._delays(0.0, nothing, [0.0] * len(model.inputs), p)
        start = experiment.start
        signals = [_Signal(experiment.channels.get(i.name), i.default, i.hold,
                           start, delay) for i, delay in zip(model.inputs, late, strict=False)]
        reads = [np.array([t - self._delays(t, nothing, [0.0] * len(signals), p)[k]
                           for t in _instants(experiment, o.name)])
                 for k, o in enumerate(model.outputs, len(signals))]
        if self.under_way:
            start = min(start, *(float(times.min()) for times in reads))
        wanted = np.maximum(np.concatenate(reads), start)
        last = float(wanted.max())
        stops = np.unique(np.concatenate(
            [wanted, *(s.switches[(s.switches > start) & (s.switches < last)] for s in signals)]))
        x = np.array(self._starts(start, nothing, [s.at(start) for s in signals], p))
        path = self._path(x, start, stops, signals, p)
        ranges = {n: (float(path[:, k].min()), float(path[:, k].max()))
                  for k, n in enumerate(model.state_names)}
        found = {}
        for k, (o, times) in enumerate(zip(model.outputs, reads, strict=True)):
            rows = np.searchsorted(stops, np.maximum(times, start))
            found[o.name] = np.array([
                self._seen(stops[r], path[r], [s.at(stops[r]) for s in signals], p)[k]
                for r in rows])
        return found, ranges

    def _path(self, x: Array, start: float, stops: Array, signals: Sequence[_Signal],
              p: Sequence[float]) -> Array:
        """(M, n) states at the stops."""
        rates, evaluations = self._rates, 0

        def field(t: float, state: Array, pieces: list[tuple[float, float, float]]) -> list[float]:
            nonlocal evaluations
            evaluations += 1
            u = [value + slope * (t - at) for at, value, slope in pieces]
            return rates(t, state.tolist(), u, p)

        # The whole way to the next instant is tried first: a step that SciPy chooses itself is made
        # for the start of an unknown motion, and takes thrice the evaluations here.
        solver = explicit = ode(field).set_integrator(
            "dop853", rtol=RELATIVE, atol=ABSOLUTE, nsteps=MOST_STEPS,
            first_step=float(np.diff(stops, prepend=start).max()))
        stiff = ode(field).set_integrator(
            "lsoda", rtol=RELATIVE, atol=ABSOLUTE, nsteps=MOST_STIFF)
        path = np.empty((len(stops), len(x)))
        t = start
        for k, stop in enumerate(stops.tolist()):
            if stop > t:
                pieces = [s.piece(t) for s in signals]
                before, x = x, _step_to(solver, x, t, stop, pieces)
                if not solver.successful() and solver is explicit:
                    solver = stiff
                    x = _step_to(solver, before, t, stop, pieces)
                if not np.all(np.abs(x) < LARGEST) or evaluations > MOST_EVALUATIONS:
                    raise errors.SimulationFailed(errors.conceal_diverged())
                t = stop
            path[k] = x
        return path


def _step_to(solver: ode, x: Array, t: float, stop: float,
             pieces: list[tuple[float, float, float]]) -> Array:
    """(n,) the state at the next stop; NaN where the solver does not get there."""
    solver.set_initial_value(x, t).set_f_params(pieces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # said by what is raised for NaN
        try:
            found = solver.integrate(stop)
        except (ArithmeticError, ValueError):  # of functions outside their domain
            return np.full(len(x), np.nan)
    return np.asarray(found) if solver.successful() else np.full(len(x), np.nan)


class _Signal:
    """A recorded input, held as its model says and shifted by a delay."""

    def __init__(self, channel: Channel | None, default: float | None, hold: Hold, start: float,
                 delay: float) -> None:
        if channel is None:
            if default is None:
                raise errors.BadRecording(errors.conceal_needs_inputs())
            self.switches, self.values = np.array([start]), np.array([default])
        else:
            hold = channel.hold or hold
            time, values = channel.time, np.asarray(channel.values)
            if hold == "cubic" and len(values) > 1:  # fine enough for the integrator's tolerance
                spline = CubicSpline(time, values)
                count = len(time)
                time = np.interp(np.linspace(0, count - 1, 32 * (count - 1) + 1),
                                 np.arange(count), time)
                values = spline(time)
            self.switches, self.values = time + delay, values
        self.first = hold != "zero" and len(self.values) > 1

    def piece(self, t: float) -> tuple[float, float, float]:
        """An instant, the value there and the slope from t on to the next switch."""
        k = int(np.searchsorted(self.switches, t, side="right")) - 1
        if k < 0:
            return t, float(self.values[0]), 0.0
        if not self.first or k + 1 == len(self.values):
            return t, float(self.values[k]), 0.0
        rise = self.values[k + 1] - self.values[k]
        slope = float(rise / (self.switches[k + 1] - self.switches[k]))
        return float(self.switches[k]), float(self.values[k]), slope

    def at(self, t: float) -> float:
        """Value from t on."""
        at, value, slope = self.piece(t)
        return value + slope * (t - at)


def _instants(experiment: Recording, output: str) -> Array:
    name = output if output in experiment else experiment.names[0]
    return np.asarray(experiment[name].time, dtype=float)
