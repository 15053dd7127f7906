"""Where in a model physics can be missing: equations, inputs and outputs, from its formulas."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import sympy as sp

from pikanid import errors
from pikanid.formula import units
from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import TIME, symbol
from pikanid.formula.names import free_name
from pikanid.mismatch.catalogue.lever import lever
from pikanid.model import Model
from pikanid.model.parts import Formula, Output, Parameter
from pikanid.recording import Recording

SLOWEST = 0.005  # numerical: of the usual speed, the least at which a law changes its course
NEAR_ZERO = 0.01  # numerical: of an input's largest value, from where on it does not begin at 0


@dataclass(frozen=True)
class Site:
    """The equation v' = a(q, v, u; p) of a state in a model and what surrounds it.

    Attributes:
        model: The nominal model, its inputs held as recorded.
        q, v: Names of a coordinate and of its rate; of a state that is no other one's rate, an
            empty text and the state.
        output: In which q, or the state, is seen.
        inputs: Recorded inputs that act on v'.
        extra: Recorded channels that the model does not use.
        rate: Natural frequency at the guesses [rad/s]; 0 without a restoring force.
        rest: Whether the model starts in equilibrium.
        alone: Whether a little of q leaves every other state at rest, so that what holds q in
            balance holds the model.
        still: Whether it does under the first values of its inputs as well, in every recording:
            only then is an input that comes late the same as an output that does.
        span: First and last time [s] of the first recording.
        half_range: Half the range of the output there, in its unit.
        interval: Between its samples, as a rule [s].
        suffix: Distinguishes names where a model has several coordinates.
        taken: Names that users' own effects have.
        lever: By names of states, what a force adds to their rates for each that it adds to v';
            empty where it acts on v' alone.
        along: The parameter whose damping acts so.
        unseen_speed: Largest value of a state that no output shows, along the nominal motion.
        operating: Inputs that do not begin at 0 in every recording: the rig need not be at rest.
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

    def pushed(self, model: Model, force: Formula) -> Model:
        """A model with a force on the coordinate [force_unit]."""
        if not self.lever:
            return model.with_term(self.v, force)
        term = model.formula(force, f"the force on '{self.moving[0]}'")
        for state, share in self.lever.items():
            model = model.with_term(state, share * term)
        return model

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
        return bool(self.q) or self.output.expression == symbol(self.v)

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
            return (p.free or p.value != 0) and _at_rest(
                self.model, slope.diff(symbol(self.v))) != 0 and all(
                _at_rest(self.model, slope.diff(other)) == 0 for other in others)

        return any(resists(p) for p in self.model.parameters)

    @property
    def stiffness(self) -> sp.Expr:
        """-∂a/∂q in equilibrium without inputs: what a constant force is held by; 0 where there is
        no coordinate.
        """
        if not self.q:
            return sp.S.Zero
        return -_at_rest(self.model, self.acceleration.diff(symbol(self.q)))

    def name(self, wanted: str, of: str = "") -> str:
        """A parameter or state name that neither the model nor an effect of a user uses yet; `of`
        one of several inputs or states.
        """
        return free_name(wanted + (f"_{of}" if of else "") + self.suffix, self.model.symbols,
                         self.taken)


def coordinates(model: Model) -> list[tuple[str, str]]:
    """States whose rate is another state, with that one."""
    return [(s.name, e.name) for s in model.states
            if (e := model.equations[s.name]).is_Symbol and e.name in model.state_names
            and e.name != s.name]


def sites(model: Model, recordings: tuple[Recording, ...]) -> tuple[Site, ...]:
    """The coordinates that an output shows, one site each, and after them another one for each
    coordinate on which forces act through a lever, and the equations of all other states that reach
    an output: a current beside a position, or all there are without any coordinate.

    Raises:
        BadModel: If no state reaches an output.
    """
    pairs = coordinates(model)
    seen = [(q, v, o) for q, v in pairs for o in model.outputs if o.expression.has(symbol(q))]
    chosen = {q: (q, v, o) for q, v, o in reversed(seen)}
    if not chosen:
        first = _of_first_order(model, recordings, model.state_names, alone=True)
        if not first:
            raise errors.BadModel(errors.nothing_seen(model.name))
        return first
    ordered = [chosen[q] for q, _ in pairs if q in chosen]
    found = [_site(model, recordings, q, v, o, f"_{q}" if len(ordered) > 1 else "")
             for q, v, o in ordered]
    others = [s.name for s in model.states if s.name not in {n for pair in pairs for n in pair}]
    found += _of_first_order(model, recordings, others, alone=False)
    rates = [*(v for _, v in pairs), *others]
    return (*found, *(_along_lever(site, *how) for site in found if (
        how := lever(model, site.v, rates)) is not None))


def _along_lever(site: Site, along: str, shares: Mapping[str, sp.Expr]) -> Site:
    # forces on others' rates leave no balance in this coordinate alone
    return replace(site, lever=shares, along=along, alone=False,
                   suffix=f"{site.suffix}_{along}")


def _of_first_order(model: Model, recordings: tuple[Recording, ...], states: Sequence[str],
                    alone: bool) -> tuple[Site, ...]:
    """One site for each of these states, in the output that it reaches through the fewest others;
    `alone`: there are no other sites.
    """
    found = [(v, o) for v in states if (o := _reached(model, v)) is not None]
    # what is seen itself comes first
    found.sort(key=lambda pair: not pair[1].expression.has(symbol(pair[0])))
    return tuple(_site(model, recordings, "", v, o, "" if alone and len(found) == 1 else f"_{v}")
                 for v, o in found)


def _reached(model: Model, state: str) -> Output | None:
    """The output that a state acts on, directly or through the equations of the fewest others."""
    reached = {state}
    for _ in model.states:
        for o in model.outputs:
            if any(o.expression.has(symbol(n)) for n in reached):
                return o
        reached |= {s.name for s in model.states
                    if any(model.equations[s.name].has(symbol(n)) for n in reached)}
    return None


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
    slope = _at_rest(model, a.diff(symbol(q))).subs(at) if q else sp.S.Zero
    k = -float(slope) if slope.is_number else 0.0
    force = _at_rest(model, a)
    starts = [s.initial for s in model.states if s.name in (q, v)]
    alone = all(_at_rest(model, e.diff(symbol(q))).subs(at) == 0
                for n, e in model.equations.items() if n not in (q, v))
    return Site(model, q, v, output, inputs, extra, k**0.5 if k > 0 else 0.0,
                expanded(force) == 0 and all(e == 0 for e in starts), alone,
                all(_starts_still(model, r) for r in recordings),
                (first.start, first.stop), _swing(first, output.name),
                _interval(first, output.name), suffix,
                operating=tuple(n for n in inputs if not all(
                    n in r and _begins_at_zero(r[n].values) for r in recordings)))


def _begins_at_zero(values: np.ndarray) -> bool:
    seen = values[np.isfinite(values)]
    return not seen.size or abs(float(seen[0])) <= NEAR_ZERO * float(np.abs(seen).max())


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


def _starts_still(model: Model, recording: Recording) -> bool:
    if any(q.name in model.parameter_names and model.parameter(q.name).free
           for s in model.states for q in s.initial.free_symbols):
        return False
    at = {symbol(n): value for n, value in model.values.items()}
    at |= {symbol(i.name): float(recording[i.name].values[0]) if i.name in recording
           else i.default or 0.0 for i in model.inputs}
    at |= {symbol(s.name): s.initial.subs(at) for s in model.states}
    return all(e.subs(at).subs(TIME, recording.start).doit() == 0 for e in model.equations.values())


def _at_rest(model: Model, e: sp.Expr) -> sp.Expr:
    still = {symbol(n): sp.Integer(0) for n in (*model.state_names, *model.input_names)}
    return e.subs(still).doit()
