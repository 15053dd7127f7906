"""A place in a model where physics can be missing."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from pikanid.formula import units
from pikanid.formula.expressions import symbol
from pikanid.formula.names import free_name
from pikanid.model import Model
from pikanid.model.parts import Formula, Output, Parameter

SLOWEST = 0.005  # numerical: of the usual speed, the least at which a law changes its course


@dataclass(frozen=True)
class Site:
    """The equation v' = a(q, v, u; p) of a state in a model and what surrounds it.

    Attributes:
        model: The nominal model, its inputs held as recorded.
        q, v: Names of a coordinate and of its rate; of a state that is no other one's rate, an
            empty text and the state.
        output: In which q, or the state, is seen, or which it acts on through others.
        inputs: Recorded inputs that act on v'.
        extra: Recorded channels that the model does not use.
        rate: Natural frequency at the guesses [rad/s]; 0 without a restoring force.
        rest: Whether the model starts in equilibrium.
        alone: Whether a little of q leaves every other state at rest, so that what holds q in
            balance holds the model.
        still: Whether it does under the first values of its inputs as well, in every recording:
            only then is an input that comes late the same as an output that does.
        span: First and last time [s] of the first recording.
        half_range: Half the range of the output there, in its unit; of a coordinate that no output
            shows half its own, along the nominal motion.
        interval: Between its samples, as a rule [s].
        visited: Lowest and highest value of q in all recordings, where the output is q itself.
        suffix: Distinguishes names where a model has several coordinates.
        taken: Names that users' own effects have.
        lever: By names of states, what a force adds to their rates for each that it adds to v';
            empty where it acts on v' alone.
        along: The parameter whose damping acts so.
        unseen_speed: Largest value of a state that no output shows, along the nominal motion.
        operating: Inputs that do not begin at 0 in every recording: the rig need not be at rest.
        ranges: Lowest and highest values of its inputs in all recordings.
        pasts: Inputs that move, where it is not known what they were before the recordings, as the
            rig need not be at rest and no initial value follows them: about where that lies, their
            range in all recordings and as much on both sides.
        sensors: Of the first site: outputs in which none is seen, as a gyro beside an angle.
    """

    model: Model
    q: str
    v: str
    output: Output
    inputs: tuple[str, ...]
    extra: tuple[str, ...]
    rate: float
    rest: bool
    alone: bool
    still: bool
    span: tuple[float, float]
    half_range: float
    interval: float
    suffix: str = ""
    taken: frozenset[str] = frozenset()
    lever: Mapping[str, sp.Expr] = field(default_factory=dict, hash=False)
    along: str = ""
    unseen_speed: float = 0.0
    operating: tuple[str, ...] = ()
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict, hash=False)
    pasts: Mapping[str, tuple[float, float]] = field(default_factory=dict, hash=False)
    sensors: tuple[Site, ...] = ()
    visited: tuple[float, float] = (-np.inf, np.inf)

    def pushed(self, model: Model, force: Formula) -> Model:
        """A model with a force on the coordinate [force_unit]."""
        if not self.lever:
            return model.with_term(self.v, force)
        term = model.formula(force, f"the force on '{self.moving[0]}'")
        for state, share in self.lever.items():
            model = model.with_term(state, share * term)
        return model

    @property
    def mechanical(self) -> bool:
        """Whether its state is a speed, of which one says friction and drag."""
        return bool(self.q) or any(units.convertible(self.speed_unit, speed)
                                   for speed in ("m/s", "rad/s"))

    @property
    def acceleration(self) -> sp.Expr:
        """The right-hand side of v'."""
        return self.model.equations[self.v]

    @property
    def unit(self) -> str:
        """Of the coordinate, or of what a state would be the rate of."""
        if not self.q:
            return units.product((self.speed_unit, 1), ("s", 1))
        return self.model.state(self.q).unit or "1"

    @property
    def speed_unit(self) -> str:
        """Of the rate, or the state."""
        return f"{self.unit}/s" if self.q else self.model.state(self.v).unit or "1"

    @property
    def usual_speed(self) -> float:
        """About the largest value of the rate, or of the state; 0 where it is not known."""
        return self.half_range * (self.rate or 1.0) if self.shown else self.unseen_speed

    @property
    def shown(self) -> bool:
        """Whether an output shows how large the motion is."""
        shown = self.output.expression
        return shown.has(symbol(self.q)) if self.q else shown == symbol(self.v)

    def slow_speed(self, wanted: str, share: float = 1.0) -> Parameter:
        """A speed at which a law changes its course, from a share of the usual one on."""
        usual = self.usual_speed or 1.0
        return Parameter(self.name(wanted), share * usual, self.speed_unit,
                         (SLOWEST * usual, np.inf))

    def variant(self, u: str) -> str:
        """What tells an effect of one input from that of others; empty where it is the only one."""
        return u if len(self.inputs) > 1 else ""

    @property
    def force_unit(self) -> str:
        """Of what is added to v'."""
        return f"{self.unit}/s^2" if self.q else units.product((self.speed_unit, 1), ("s", -1))

    @property
    def placed(self) -> bool:
        """Whether the model depends on where its coordinate is: else no place of it is special."""
        return bool(self.q) and self.acceleration.has(symbol(self.q))

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of coordinate and rate, or of the state alone."""
        return (self.q, self.v) if self.q else (self.v,)

    @property
    def free_in_force(self) -> tuple[str, ...]:
        """Estimated parameters that v' depends on."""
        used = {s.name for s in self.acceleration.free_symbols}
        return tuple(p.name for p in self.model.parameters if p.free and p.name in used)

    @functools.cached_property
    def resisted(self) -> bool:
        """Whether a parameter of the model resists v itself in proportion, at rest: not a speed
        relative to another coordinate's.
        """
        own = {self.q, self.v}
        others = [symbol(n) for n in self.model.state_names if n not in own]

        def resists(p: Parameter) -> bool:
            slope = self.acceleration.diff(symbol(p.name))
            return (p.free or p.value != 0) and at_rest(
                self.model, slope.diff(symbol(self.v))) != 0 and all(
                at_rest(self.model, slope.diff(other)) == 0 for other in others)

        return any(resists(p) for p in self.model.parameters)

    @property
    def stiffness(self) -> sp.Expr:
        """-∂a/∂q in equilibrium without inputs: what a constant force is held by; 0 where there is
        no coordinate.
        """
        if not self.q:
            return sp.S.Zero
        return -at_rest(self.model, self.acceleration.diff(symbol(self.q)))

    def name(self, wanted: str, of: str = "") -> str:
        """A parameter or state name that neither the model nor an effect of a user uses yet; `of`
        one of several inputs or states.
        """
        return free_name(wanted + (f"_{of}" if of else "") + self.suffix, self.model.symbols,
                         self.taken)


def out_of_reach(reach: float) -> float:
    """A limit that nothing meets, in whatever unit.

    >>> out_of_reach(0.3), out_of_reach(1e9)
    (1000000.0, 10000000000.0)
    """
    return max(1e6, 10 * reach)


def estimates_a_start(model: Model) -> bool:
    """Whether some initial value is estimated."""
    return any(q.name in model.parameter_names and model.parameter(q.name).free
               for s in model.states for q in s.initial.free_symbols)


def estimates_all_starts(model: Model) -> bool:
    """Whether each is a free parameter by itself: the motion may be under way when a recording
    begins, as it is not where a dose or a given place says how.
    """
    return all(s.initial.is_Symbol and s.initial.name in model.free_names for s in model.states)


def may_be_under_way(model: Model) -> bool:
    """Whether inputs may have driven it before a recording begins, so that what no output shows is
    not in balance then.
    """
    return bool(model.inputs) and estimates_all_starts(model)


def at_rest(model: Model, e: sp.Expr) -> sp.Expr:
    """A formula where all states and inputs are zero."""
    still = {symbol(n): sp.Integer(0) for n in (*model.state_names, *model.input_names)}
    return e.subs(still).doit()
