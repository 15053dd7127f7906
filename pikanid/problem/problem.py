"""A model bound to recordings: which channel drives or measures what, in the model's units.

`Problem` lays out the vector θ of everything that is estimated (shared parameters once, the others
once a recording); `Experiment` is one recording as the model sees it.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pikanid import errors
from pikanid.model import Input, Model, Output
from pikanid.problem.arguments import a_model, several
from pikanid.problem.evaluated import InitialState, delays, initial_state, paths
from pikanid.problem.held import HeldInput, PiecewiseInput, acting, held_input
from pikanid.recording import Recording


@dataclass(frozen=True)
class Samples:
    """The measurements of one output: times (N,), values (N,), noise σ (N,) or None."""

    output: int
    t: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None

    def part(self, rows: slice | np.ndarray) -> Samples:
        """Some of them."""
        return Samples(self.output, self.t[rows], self.y[rows],
                       None if self.sigma is None else self.sigma[rows])


@dataclass(frozen=True)
class Experiment:
    """One recording as the model sees it.

    The simulation starts at `t0`, the first instant of any channel that the model uses; an input
    has its first value before its record begins and its last one after it ends.  `unused` are
    channels that the model does not know, `uncertain` inputs with a sigma, which no residual has.
    """

    model: Model
    name: str
    t0: float
    t1: float
    held: tuple[HeldInput, ...]
    samples: tuple[Samples, ...]
    unused: tuple[str, ...] = ()
    uncertain: tuple[str, ...] = ()

    @functools.cached_property
    def fixed_delays(self) -> np.ndarray:
        """Input delays (m,) at the model's own parameter values."""
        return delays(self.model.inputs, self.model, np.array(list(self.model.values.values())))

    def inputs(self, t: np.ndarray, side: Literal["left", "right"] = "right") -> np.ndarray:
        """Inputs (M, m) at times t (M,), right-continuous at switches unless `side="left"`."""
        columns = np.zeros((len(t), len(self.held)))
        for j, (parts, late) in enumerate(zip(self._parts, self.fixed_delays, strict=True)):
            for part, factor in parts:
                columns[:, j] += factor * part.at(t, late, side)
        return columns

    def breakpoints(self) -> np.ndarray:
        """Interior times at which an input jumps or kinks, sorted, after its delay."""
        return self._breakpoints

    @functools.cached_property
    def _breakpoints(self) -> np.ndarray:
        pairs = zip(self._parts, self.fixed_delays, strict=True)
        times = np.concatenate([np.empty(0), *(
            part.switches + late for parts, late in pairs for part, _ in parts)])
        return np.unique(times[(times > self.t0) & (times < self.t1)])

    @functools.cached_property
    def _parts(self) -> list[list[tuple[HeldInput | PiecewiseInput, float]]]:
        """What each input (m,) is the sum of at the model's own parameter values, with factors."""
        if not any(item.shaped for item in self.model.inputs):
            return [[(held, 1.0)] for held in self.held]
        values = np.array(list(self.model.values.values()))
        found: list[list[tuple[HeldInput | PiecewiseInput, float]]] = []
        for held, item, half, rate, start, before in zip(
                self.held, self.model.inputs, *paths(self.model, values), strict=True):
            play = None if item.backlash == 0 else half
            acts = acting(held, play, rate, start, bool(np.isfinite(before)))
            found.append([*acts.parts(half, rate, start, before)] if item.shaped
                         else [(held, 1.0)])
        return found

    def initial(self, p: np.ndarray) -> np.ndarray:
        """The initial state x0 (n,) for all parameters p (P,)."""
        return self._initial.value(p, self._first_inputs)

    def initial_jacobian(self, p: np.ndarray) -> np.ndarray:
        """∂x0/∂p (n, P)."""
        return self._initial.jacobian(p, self._first_inputs)

    @property
    def starts_fixed(self) -> bool:
        """Whether the initial state depends on no parameter."""
        return self._initial.fixed

    @functools.cached_property
    def _initial(self) -> InitialState:
        return initial_state(self.model)

    @functools.cached_property
    def _first_inputs(self) -> np.ndarray:
        if not self._initial.driven:
            return np.zeros(len(self.held))
        return self.inputs(np.array([self.t0]))[0]

    @property
    def n_samples(self) -> int:
        """Number of measurements over all outputs."""
        return sum(len(s.t) for s in self.samples)


@dataclass(frozen=True)
class FreeParameter:
    """One entry of θ; `recording` is None for a shared parameter."""

    name: str
    recording: int | None
    guess: float
    bounds: tuple[float, float]
    unit: str = ""

    @property
    def label(self) -> str:
        """The name, with the recording's number where each has its own."""
        return self.name if self.recording is None else f"{self.name}[{self.recording}]"


class Problem:
    """A model and the recordings that it is fitted to jointly.

    Args:
        model: The model.
        recordings: One recording or several; a DataFrame or the path of a file stands for one.
        need_outputs: Whether the recordings must hold the model's outputs (False to simulate only).

    Raises:
        BadRecording: A channel is missing or cannot be used.
        BadUnit: A unit is unknown or does not fit.
    """

    def __init__(self, model: Model, recordings: Recording | Sequence[Recording],
                 need_outputs: bool = True):
        self.model = a_model(model)
        self.recordings = several(recordings)
        self.experiments = tuple(bind(model, r, need_outputs) for r in self.recordings)
        self.free = self._layout()
        if need_outputs:
            self._check_freedom()

    def _check_freedom(self) -> None:
        """Refuse what leaves no degree of freedom: any model explains as many numbers as it has."""
        if 0 < len(self.free) >= self.n_samples:
            raise errors.BadRecording(errors.too_few_samples(self.n_samples, len(self.free)))
        for r, e in enumerate(self.experiments):
            own = [f.name for f in self.free if f.recording == r]
            if e.n_samples < len(own):
                raise errors.BadRecording(errors.too_few_of_its_own(e.name, e.n_samples, own))

    def _layout(self) -> tuple[FreeParameter, ...]:
        free = []
        for p in self.model.parameters:
            owners: Sequence[int | None] = (
                [None] if p.scope == "shared" else range(len(self.experiments)))
            if p.free:
                free += [FreeParameter(p.name, r, p.value if r is None else
                                       self.recordings[r].begins.get(p.name, p.value),
                                       p.bounds, p.unit) for r in owners]
        return tuple(free)

    @property
    def n_samples(self) -> int:
        """Number of measurements over all recordings and outputs."""
        return sum(e.n_samples for e in self.experiments)

    @property
    def guess(self) -> np.ndarray:
        """θ at the model's guesses (n_free,)."""
        return np.array([f.guess for f in self.free], float)

    @property
    def lower(self) -> np.ndarray:
        """Lower bounds of θ."""
        return np.array([f.bounds[0] for f in self.free], float)

    @property
    def upper(self) -> np.ndarray:
        """Upper bounds of θ."""
        return np.array([f.bounds[1] for f in self.free], float)

    def columns(self, r: int) -> tuple[np.ndarray, np.ndarray]:
        """Positions in p and in θ of the parameters that recording r is estimated with."""
        return self._columns[r]

    @functools.cached_property
    def _columns(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        names = self.model.parameter_names
        found = []
        for r in range(len(self.experiments)):
            here = [(names.index(f.name), k) for k, f in enumerate(self.free)
                    if f.recording in (None, r)]
            found.append((np.array([inside for inside, _ in here], np.int64),
                          np.array([outside for _, outside in here], np.int64)))
        return tuple(found)

    @functools.cached_property
    def _values(self) -> np.ndarray:
        return np.array(list(self.model.values.values()))

    def parameters(self, theta: np.ndarray, r: int) -> np.ndarray:
        """All parameters p (P,) of recording r."""
        p = self._values.copy()
        inside, outside = self._columns[r]
        p[inside] = theta[outside]
        return p


def bind(model: Model, recording: Recording, need_outputs: bool = True) -> Experiment:
    """Find the model's channels in a recording and convert them to the model's units."""
    held = tuple(_held(recording, item) for item in model.inputs)
    samples = tuple(_samples(recording, o, k) for k, o in enumerate(model.outputs)
                    if need_outputs or o.name in recording.channels)
    times = [s.t for s in samples] + [h.time for h in held if h.name in recording.channels]
    if not samples:
        times.append(recording.t)
    used = {*model.input_names, *model.output_names}
    unused = tuple(n for n in recording.channels if n not in used)
    uncertain = tuple(n for n in model.input_names
                      if n in recording.channels and recording[n].sigma is not None)
    return Experiment(model, recording.name, min(float(t[0]) for t in times),
                      max(float(t[-1]) for t in times), held, samples, unused, uncertain)


def _held(recording: Recording, item: Input) -> HeldInput:
    known = item.name in recording.channels or item.name in recording.unreadable
    if not known and item.default is not None:
        return HeldInput(item.name, np.array([recording.start]), np.array([item.default]), "zero")
    channel = recording.as_input(item.name, _unit(recording, item))
    return held_input(item.name, channel.time, channel.values, channel.hold or item.hold)


def _samples(recording: Recording, output: Output, index: int) -> Samples:
    channel = recording.as_output(output.name, _unit(recording, output))
    finite = np.isfinite(channel.values)
    seen = slice(None) if finite.all() else finite
    sigma = output.sigma if channel.sigma is None else channel.sigma
    t = np.array(channel.time[seen])
    spread = (None if sigma is None else np.array(sigma[seen]) if isinstance(sigma, np.ndarray)
              else np.full(len(t), sigma))
    return Samples(index, t, np.array(channel.values[seen]), spread)


def _unit(recording: Recording, item: Input | Output) -> str | None:
    """The model's unit, or None where either side leaves the unit open: then it is taken as is."""
    return item.unit if item.unit and recording[item.name].unit else None
