"""Where in a model physics can be missing: coordinates, inputs and outputs, from its formulas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula.expressions import symbol
from pikanid.model import Model
from pikanid.model.parts import Output
from pikanid.recording import Recording


@dataclass(frozen=True)
class Site:
    """A second-order coordinate q'' = a(q, q', u; p) of a model and what surrounds it.

    Attributes:
        model: The nominal model, its inputs held as recorded.
        q, v: Names of the coordinate and of its rate.
        output: In which q is seen.
        inputs: Recorded inputs that act on q''.
        extra: Recorded channels that the model does not use.
        rate: Natural frequency at the guesses [rad/s]; 0 without a restoring force.
        rest: Whether the model starts in equilibrium.
        span: First and last time [s] of the first recording.
        half_range: Half the range of the output there, in its unit.
        interval: Between its samples, as a rule [s].
        suffix: Distinguishes names where a model has several coordinates.
    """

    model: Model
    q: str
    v: str
    output: Output
    inputs: tuple[str, ...]
    extra: tuple[str, ...]
    rate: float
    rest: bool
    span: tuple[float, float]
    half_range: float
    interval: float
    suffix: str = ""

    @property
    def acceleration(self) -> sp.Expr:
        """The right-hand side of q''."""
        return self.model.equations[self.v]

    @property
    def unit(self) -> str:
        """Of the coordinate."""
        return self.model.state(self.q).unit or "1"

    @property
    def free_in_force(self) -> tuple[str, ...]:
        """Estimated parameters that q'' depends on."""
        used = {s.name for s in self.acceleration.free_symbols}
        return tuple(p.name for p in self.model.parameters if p.free and p.name in used)

    @property
    def stiffness(self) -> sp.Expr:
        """-∂a/∂q in equilibrium without inputs: what a constant force is held by."""
        return -_at_rest(self.model, self.acceleration.diff(symbol(self.q)))

    def name(self, wanted: str) -> str:
        """A parameter or state name that the model does not use yet."""
        name = wanted + self.suffix
        while name in self.model.symbols:
            name += "_x"
        return name


def sites(model: Model, recordings: tuple[Recording, ...]) -> tuple[Site, ...]:
    """The coordinates that an output shows, one site each.

    Raises:
        BadModel: If no state is the rate of another one, or none of these is seen.
    """
    pairs = [(s.name, e.name) for s in model.states
             if (e := model.equations[s.name]).is_Symbol and e.name in model.state_names
             and e.name != s.name]
    seen = [(q, v, o) for q, v in pairs for o in model.outputs if o.expression.has(symbol(q))]
    chosen = {q: (q, v, o) for q, v, o in reversed(seen)}
    if not chosen:
        raise errors.BadModel(errors.no_coordinate(model.name))
    ordered = [chosen[q] for q, _ in pairs if q in chosen]
    return tuple(_site(model, recordings, q, v, o, f"_{q}" if len(ordered) > 1 else "")
                 for q, v, o in ordered)


def _site(model: Model, recordings: tuple[Recording, ...], q: str, v: str, output: Output,
          suffix: str) -> Site:
    a = model.equations[v]
    first = recordings[0]
    inputs = tuple(i.name for i in model.inputs
                   if i.name in first and a.has(symbol(i.name)) and _moves(first, i.name))
    used = {*model.input_names, *model.output_names, *model.state_names}
    extra = tuple(n for n in first.names
                  if n not in used and all(n in r and _moves(r, n) for r in recordings))
    at = {symbol(n): value for n, value in model.values.items()}
    slope = _at_rest(model, a.diff(symbol(q))).subs(at)
    k = -float(slope) if slope.is_number else 0.0
    force = _at_rest(model, a)
    starts = [s.initial for s in model.states if s.name in (q, v)]
    return Site(model, q, v, output, inputs, extra, k**0.5 if k > 0 else 0.0,
                sp.simplify(force) == 0 and all(e == 0 for e in starts),
                (first.start, first.stop), _swing(first, output.name),
                _interval(first, output.name), suffix)


def _interval(recording: Recording, name: str) -> float:
    if name not in recording:
        name = recording.names[0]  # an experiment that is only planned
    return float(np.median(np.diff(recording[name].time)))


def _swing(recording: Recording, name: str) -> float:
    if name not in recording:
        return 0.0
    values = recording[name].values
    seen = values[np.isfinite(values)]
    return float(np.ptp(seen)) / 2 if len(seen) else 0.0


def _moves(recording: Recording, name: str) -> bool:
    values = recording[name].values
    return bool(np.all(np.isfinite(values)) and np.ptp(values) > 0)


def _at_rest(model: Model, e: sp.Expr) -> sp.Expr:
    still = {symbol(n): sp.Integer(0) for n in (*model.state_names, *model.input_names)}
    return e.subs(still).doit()
