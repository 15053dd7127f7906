"""A model as a list of elementary operations that becomes machine code in a few milliseconds.

Compiling a model by numba costs seconds, which pays where it is simulated many thousands of times.
A search that tries a hundred extended models a few dozen times each runs them from tapes instead:
the same integrators and events, derivatives exact by forward mode (Griewank & Walther, Evaluating
Derivatives, 2008, ch. 3).

A formula that is continuous where a sign in it changes (|v|v, clip) is run through like any other;
only where the right-hand side jumps (dry friction) does a sign become a switching function that the
integrator stops at.  Where corners are sharp (a stiff wall) they can be made such functions too.

Registers hold time, states, inputs, parameters, signs of the switching functions, rates of the
inputs, constants and what the operations compute.  What depends on parameters alone is computed
once a simulation ("prelude"), the rest at each call of the right-hand side, outputs or switches.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from pikanid.formula.expanding import expanded
from pikanid.formula.expressions import TIME, symbol
from pikanid.formula.functions import log_abs
from pikanid.model import Model
from pikanid.simulation.lowering import (
    LoweredModel,
    lower_model,
    positive_power,
    power_slope,
    switch_symbol,
)
from pikanid.simulation.structure import Structure

(ADD, MUL, DIV, SQUARE, POWER, POSITIVE_POWER, SIN, COS, TAN, EXP, LOG, SQRT, TANH, SINH, COSH,
 ATAN, ASIN, ACOS, ATAN2, LOG_ABS, SGN, NEGATE,
 POWER_SLOPE) = range(23)  # definition: numbers of the operations
_BINARY = {positive_power: POSITIVE_POWER, power_slope: POWER_SLOPE, sp.atan2: ATAN2}
_UNARY = {sp.sin: SIN, sp.cos: COS, sp.tan: TAN, sp.exp: EXP, sp.log: LOG, sp.tanh: TANH,
          sp.sinh: SINH, sp.cosh: COSH, sp.atan: ATAN, sp.asin: ASIN, sp.acos: ACOS,
          log_abs: LOG_ABS}
GROUPS = ("prelude", "f", "h", "h_rate", "g", "g_rate")


@dataclass(frozen=True, eq=False)
class Tape:
    """Operations (ops, 4) of each group: opcode, two arguments, result; all by register.

    `outputs` names the registers that hold a group's results; `constants` the registers and values
    to set beforehand; `sizes` = states, inputs, parameters, outputs, switching functions that the
    integrator stops at; `corners` counts those of the states that it runs through.
    """

    code: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]
    registers: int
    constants: tuple[np.ndarray, np.ndarray]
    sizes: tuple[int, int, int, int, int]
    corners: int


@functools.lru_cache(maxsize=512)
def tape(structure: Structure, located: bool = False) -> Tape:
    """The tape of a model's formulas; `located`: the integrator stops at corners, too."""
    return _Recorder(structure.model, lower_model(structure.model)).tape(located)


def can_run(model: Model) -> bool:
    """Whether tapes can hold everything in the model: it has no spline functions."""
    return not model.splines


@dataclass
class _Recorder:
    """Walks formulas and notes operations; equal parts are computed once."""

    model: Model
    lowered: LoweredModel
    known: dict[sp.Expr, int] = field(default_factory=dict)
    fixed: set[int] = field(default_factory=set)
    numbers: dict[float, int] = field(default_factory=dict)
    prelude: list[tuple[int, int, int, int]] = field(default_factory=list)
    group: list[tuple[int, int, int, int]] = field(default_factory=list)
    local: dict[sp.Expr, int] = field(default_factory=dict)
    kinks: dict[sp.Expr, sp.Expr] = field(default_factory=dict)
    count: int = 0

    def tape(self, located: bool) -> Tape:
        f, h = self.lowered.rhs, self.lowered.outputs
        jumps = [k for k in range(self.lowered.n_dynamic)
                 if (located and self._moves(k)) or self._jumps(k)]
        x, u, p = self._lay_out(jumps)
        self.kinks = {switch_symbol(k): e for k, e in enumerate(self.lowered.switches)
                      if k not in jumps}
        g = [self.lowered.switches[k] for k in jumps]
        rates = {q: e for q, e in zip(x, f, strict=True)}
        rates.update({q: sp.Symbol(f"_v_{q.name}", real=True) for q in u})
        formulas = {"f": f, "h": h, "h_rate": [_rate(e, rates) for e in h],
                    "g": g, "g_rate": [_rate(e, rates) for e in g]}
        code, outputs = {}, {}
        for name, exprs in formulas.items():
            self.group, self.local = [], {}
            registers = [self.register(e) for e in exprs]
            code[name] = np.array(self.group, np.int64).reshape(-1, 4)
            outputs[name] = np.array(registers, np.int64)
        code["prelude"] = np.array(self.prelude, np.int64).reshape(-1, 4)
        return Tape(
            code, outputs, self.count,
            (np.array(list(self.numbers.values()), np.int64),
             np.array(list(self.numbers), float)),
            (len(x), len(u), len(p), len(h), len(g)),
            sum(self._moves(k) for k in range(self.lowered.n_dynamic) if k not in jumps))

    def _moves(self, k: int) -> bool:
        """Whether the k-th switching function depends on the states."""
        states = {symbol(n) for n in self.model.state_names}
        return bool(states & self.lowered.switches[k].free_symbols)

    def _jumps(self, k: int) -> bool:
        """Whether the right-hand side jumps where the k-th switching function is zero."""
        g, sign = self.lowered.switches[k], switch_symbol(k)
        for q in sorted(g.free_symbols, key=str):
            slope = g.diff(q)
            if slope.is_number and slope != 0:
                surface = {q: expanded(q - g / slope)}
                break
        else:
            return True
        for e in self.lowered.rhs:
            if sign not in e.free_symbols:
                continue
            gap = e.diff(sign).subs(surface)
            if gap.has(positive_power):
                gap = gap.replace(lambda z: isinstance(z, positive_power) and z.args[0] == 0,
                                  lambda z: sp.Integer(0))
            if expanded(gap) != 0:
                return True
        return False

    def _lay_out(self, jumps: Sequence[int]
                 ) -> tuple[list[sp.Symbol], list[sp.Symbol], list[sp.Symbol]]:
        x = [symbol(n) for n in self.model.state_names]
        u = [symbol(n) for n in self.model.input_names]
        p = [symbol(n) for n in self.model.parameter_names]
        v = [sp.Symbol(f"_v_{q.name}", real=True) for q in u]
        for q in (TIME, *x, *u, *p, *(switch_symbol(k) for k in jumps), *v):
            self.known[q] = self.count
            self.count += 1
        self.fixed = {self.known[q] for q in p}
        return x, u, p

    def register(self, e: sp.Expr) -> int:
        """The register that holds a formula's value; notes the operations that put it there."""
        for memory in (self.known, self.local):
            if e in memory:
                return memory[e]
        if e.is_number:
            return self._number(float(e))
        if e in self.kinks:
            self.local[e] = self._note(SGN, self.register(self.kinks[e]))
            return self.local[e]
        found = self._operation(e)
        (self.known if found in self.fixed else self.local)[e] = found
        return found

    def _operation(self, e: sp.Expr) -> int:
        if isinstance(e, sp.Add | sp.Mul):
            return self._chain(ADD if isinstance(e, sp.Add) else MUL, e.args)
        if isinstance(e, sp.Pow):
            return self._power(*e.as_base_exp())
        if type(e) in _BINARY:
            a, b = map(self.register, e.args)
            return self._note(_BINARY[type(e)], a, b)
        return self._note(_UNARY[type(e)], self.register(e.args[0]))

    def _chain(self, op: int, args: Sequence[sp.Expr]) -> int:
        """A sum or product, what depends on parameters alone first, so that it becomes prelude."""
        if op == MUL:
            below = [a for a in args if isinstance(a, sp.Pow) and a.exp == -1]
            if below and len(below) < len(args):
                top = [a for a in args if a not in below]
                return self._note(DIV, self._joined(MUL, [self.register(a) for a in top]),
                                  self._joined(MUL, [self.register(a.base) for a in below]))
        return self._joined(op, [self.register(a) for a in args])

    def _joined(self, op: int, registers: list[int]) -> int:
        constant = set(self.numbers.values()) | self.fixed
        ordered = sorted(registers, key=lambda r: (r not in constant, r))
        if op == MUL and len(ordered) > 1 and ordered[0] == self.numbers.get(-1.0):
            return self._note(NEGATE, self._joined(op, ordered[1:]))
        result = ordered[0]
        for other in ordered[1:]:
            result = self._note(op, result, other)
        return result

    def _power(self, base: sp.Expr, n: sp.Expr) -> int:
        if n == -1:
            return self._note(DIV, self._number(1.0), self.register(base))
        if n == sp.Rational(1, 2):
            return self._note(SQRT, self.register(base))
        if n.is_Integer and 2 <= int(n) <= 8:
            result = square = self.register(base)
            result = self._note(SQUARE, square)
            for _ in range(int(n) - 2):
                result = self._note(MUL, result, square)
            return result
        return self._note(POWER, self.register(base), self.register(n))

    def _number(self, value: float) -> int:
        if value not in self.numbers:
            self.numbers[value] = self.count
            self.count += 1
        return self.numbers[value]

    def _note(self, op: int, a: int, b: int = -1, fixed: bool = True) -> int:
        constant = set(self.numbers.values()) | self.fixed
        fixed = fixed and a in constant and (b < 0 or b in constant)
        result, self.count = self.count, self.count + 1
        (self.prelude if fixed else self.group).append((op, a, max(b, 0), result))
        if fixed:
            self.fixed.add(result)
        return result


def _rate(e: sp.Expr, rates: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
    """d e/dt along the flow."""
    return sp.Add(e.diff(TIME), *(e.diff(q) * r for q, r in rates.items() if e.has(q)))
