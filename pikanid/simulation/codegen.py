"""From a `Model` to the Python source of its compiled functions.

The source holds, for numba: the right-hand side; the variational equation
S' = f_x S + f_u ∂u/∂θ + f_p for the columns of S that are asked for; outputs and their
sensitivities; and, for models with switches, switching functions, their rates along the flow and
the sensitivities of both.  SymPy differentiates and finds common subexpressions; which parameters
are estimated is decided at run time (`act`), so that one compiled model serves every choice.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from pikanid.formula.expressions import TIME, symbol
from pikanid.model import Model
from pikanid.simulation.constants import Constants
from pikanid.simulation.lowering import lower_model, spline_value, switch_symbol
from pikanid.simulation.printing import printed
from pikanid.simulation.spline_lines import Splines

HEADER = '''"""Generated from a model; not meant to be edited."""
import math

import numpy as np
from numba import njit

from pikanid.storage.jit import cached_jit
from pikanid.simulation.sdirk_table import NODES, SDIRK
from pikanid.simulation.support import (
    Seen, log_abs, positive_power, power_slope, sgn, solve_small, spline_basis, work_dtype)


def called(function):
    return njit(error_model="numpy", _nrt=False, no_cpython_wrapper=True,
                no_cfunc_wrapper=True)(function)


def inlined(function):
    return njit(error_model="numpy", inline="always", _nrt=False)(function)


'''

Partials = list[tuple[int, str]]  # of an expression: index of what by, local name of the value

# called once per stage or stop: pasted into the caller, most of the time of small models
HOT = ("variational", "observe", "observe_sensitivity")


class Writer:
    """Writes the bodies of a model's functions; knows its symbols and splines."""

    def __init__(self, model: Model):
        self.model, self.lowered = model, lower_model(model)
        self.x = [symbol(n) for n in model.state_names]
        self.u = [symbol(n) for n in model.input_names]
        self.p = [symbol(n) for n in model.parameter_names]
        self.s = [switch_symbol(k) for k in range(len(self.lowered.switches))]
        self.constants = Constants(self.p)  # of all functions written so far
        # an input whose delay is not estimated has values that no parameter moves
        self.still = not any(i.delay.free_symbols for i in model.inputs)
        self.v = [sp.Symbol(f"_v_{n}", real=True) for n in model.input_names]

    def unpack(self, exprs: Sequence[sp.Expr]) -> list[str]:
        """Lines that bring the symbols used in `exprs` into local names."""
        used = set().union(*(e.free_symbols for e in exprs)) if exprs else set()
        lines = []
        for array, symbols in (("x", self.x), ("u", self.u), ("v", self.v),
                               ("p", [*self.p, *self.constants.symbols.values()])):
            lines += [f"{printed(q)} = {array}[{i}]" for i, q in enumerate(symbols) if q in used]
        dynamic = self.s[: self.lowered.n_dynamic]
        return lines + [f"{printed(q)} = s[{i}]" for i, q in enumerate(dynamic) if q in used]

    def block(self, targets: Sequence[tuple[str, sp.Expr]], splines: Splines) -> list[str]:
        """Assignments `target = expression`, common subexpressions taken out first."""
        if not targets:
            return []
        exprs = [splines.swap(e) for _, e in targets]
        shared, reduced = sp.cse(exprs, symbols=sp.numbered_symbols("_c"), order="none")
        lines = [f"{printed(name)} = {printed(value)}" for name, value in shared]
        return lines + [f"{t} = {printed(e)}"
                        for (t, _), e in zip(targets, reduced, strict=True)]

    def values(self, name: str, arguments: str, out: str, exprs: Sequence[sp.Expr],
               inline_switches: bool = False) -> str:
        """A function that fills `out` with the values of `exprs`."""
        exprs, own = self.taken_out(exprs), self.own_switches(inline_switches)
        splines = Splines(self.model, [*exprs, *own])
        body = self.unpack([*exprs, *splines.arguments, *own]) + self.prelude(splines, own)
        body += self.block([(f"{out}[{i}]", e) for i, e in enumerate(exprs)], splines)
        return _function(name, arguments, body)

    def sensitivities(self, name: str, arguments: str, exprs: Sequence[sp.Expr], out: str,
                      values: str | None, more: Sequence[tuple[str, sp.Expr]] = (),
                      inline_switches: bool = False) -> str:
        """A function that fills ``out`` with ∂e/∂x S + ∂e/∂u ud + ∂e/∂p of the active parameters.

        `fp` (rows, P + 1) is scratch whose last column stays zero: the "parameter" of an initial
        state.  `values` names an array for the expressions themselves.
        """
        body, by_x, by_u = self.linearised(
            exprs, f"{values}[{{}}]" if values else None, more, inline_switches)
        body += ["for a in range(len(act)):", "    k = act[a]"]
        for r in range(len(exprs)):
            terms = [f"{n}*S[a, {j}]" if n != "1" else f"S[a, {j}]" for j, n in by_x[r]]
            terms += [f"{n}*ud[{j}, a]" for j, n in by_u[r]]
            place = f"dS[a, {r}]" if out == "dS" else f"{out}[{r}, a]"
            body.append(f"    {place} = " + " + ".join([*terms, f"fp[{r}, k]"]))
        return _function(name, arguments, body)

    def linearised(self, exprs: Sequence[sp.Expr], value: str | None,
                   more: Sequence[tuple[str, sp.Expr]] = (), inline_switches: bool = False
                   ) -> tuple[list[str], list[Partials], list[Partials]]:
        """Lines that assign the partial derivatives of `exprs`, those by parameters to `fp`.

        With the lines come, for each expression, indices and local names of those by states and by
        inputs.  `value` is a place such as ``f[{}]`` for the expressions themselves.
        """
        by_x, by_u, targets = [], [], list(more)
        for r, e in enumerate(exprs):
            if value:
                targets.append((value.format(r), e))
            by_x.append(self._partials(e, self.x, f"_x{r}", targets))
            by_u.append([] if self.still else self._partials(e, self.u, f"_u{r}", targets))
            for k, q in enumerate(self.p):
                derivative = e.diff(q)
                if derivative != 0:
                    targets.append((f"fp[{r}, {k}]", derivative))
        own = self.own_switches(inline_switches)
        targets = [(name, self.constants.taken_out(e)) for name, e in targets]
        used = [*(e for _, e in targets), *own]
        splines = Splines(self.model, used)
        edge_targets, clear, edge_lines = splines.coefficient_columns(self.taken_out(exprs))
        # a coefficient inside the argument of another spline needs that one's derivative as well
        splines = Splines(self.model, [*used, *(e for _, e in edge_targets)])
        body = self.unpack([*used, *splines.arguments, *(e for _, e in edge_targets)])
        body += self.prelude(splines, own) + clear
        return body + self.block([*targets, *edge_targets], splines) + edge_lines, by_x, by_u

    def _partials(self, e: sp.Expr, symbols: Sequence[sp.Symbol], prefix: str,
                  targets: list[tuple[str, sp.Expr]]) -> Partials:
        found = []
        for j, q in enumerate(symbols):
            derivative = e.diff(q)
            if derivative == 1:
                found.append((j, "1"))
            elif derivative != 0:
                targets.append((f"{prefix}_{j}", derivative))
                found.append((j, f"{prefix}_{j}"))
        return found

    def own_switches(self, inline: bool) -> list[sp.Expr]:
        """The switching functions that only outputs have, where these are evaluated inline."""
        own = self.lowered.switches[self.lowered.n_dynamic:] if inline else ()
        return self.taken_out(own)

    def taken_out(self, exprs: Sequence[sp.Expr]) -> list[sp.Expr]:
        """The formulas with symbols for what is evaluated once a run."""
        return [self.constants.taken_out(e) for e in exprs]

    def prelude(self, splines: Splines, own: Sequence[sp.Expr]) -> list[str]:
        """Splines and the outputs' own switches, each after what its argument needs."""
        start = self.lowered.n_dynamic
        pending = {self.s[start + i]: g for i, g in enumerate(own)}
        lines: list[str] = []
        for n, (_, z) in enumerate(splines.keys):
            lines += self._switches_for([z], pending, splines)
            lines += splines.lines(n)
        return lines + self._switches_for(list(pending), pending, splines)

    def _switches_for(self, exprs: Sequence[sp.Expr], pending: dict[sp.Symbol, sp.Expr],
                      splines: Splines) -> list[str]:
        lines: list[str] = []
        wanted = set().union(*(e.free_symbols for e in exprs)) if exprs else set()
        for q in [q for q in self.s if q in wanted and q in pending]:
            if q in pending:
                g = pending.pop(q)
                lines += self._switches_for([g], pending, splines)
                lines.append(f"{printed(q)} = sgn({printed(splines.swap(g))})")
        return lines


def _function(name: str, arguments: str, body: Sequence[str]) -> str:
    lines = "".join(f"    {line}\n" for line in (body or ["pass"]))
    mark = "inlined" if name in HOT else "called"
    return f"@{mark}\ndef {name}({arguments}):\n{lines}\n\n"


def generate(model: Model) -> tuple[str, Writer]:
    """The model's functions as source, and who wrote them; `constants_function` has to follow."""
    w = Writer(model)
    lowered = w.lowered
    knots = "".join(f"KNOTS_{i} = np.array({list(map(float, s.knots))})\n"
                    for i, s in enumerate(model.splines))
    f, h = lowered.rhs, lowered.outputs
    edges = len({(a.args[0], a.args[2]) for e in (*f, *h, *lowered.switches)
                 for a in e.atoms(spline_value)})
    width = max((s.degree + 1 for s in model.splines), default=1)
    h_rate = [_rate(w, e) for e in h]
    source = HEADER + knots + f"hot = {'called' if lowered.n_dynamic else 'inlined'}\n" + (
        f"N, M, P, Q, K = {len(w.x)}, {len(w.u)}, {len(w.p)}, {len(h)}, {lowered.n_dynamic}\n"
        f"BUFFERS = ({3 * edges}, {width})  # basis: (argument, derivative) rows\n\n\n")
    source += w.values("rhs", "b, t, x, u, p, s, f", "f", f)
    source += w.sensitivities(
        "variational", "b, t, x, S, u, ud, p, s, act, f, fp, dS", f, "dS", "f")
    source += w.values("observe", "b, t, x, u, p, s, y", "y", h, inline_switches=True)
    source += w.sensitivities(
        "observe_sensitivity", "b, t, x, S, u, ud, p, s, act, y, fp, J", h, "J", "y",
        inline_switches=True)
    source += w.values("observe_rate", "b, t, x, u, v, p, s, y", "y", h_rate, inline_switches=True)
    if lowered.n_dynamic:
        g = lowered.switches[: lowered.n_dynamic]
        rate = [_rate(w, e) for e in g]
        dynamic = w.s[: lowered.n_dynamic]
        moving = {TIME, *w.x, *dynamic}
        source += f"INPUT_ONLY = np.array({[not e.free_symbols & moving for e in g]})\n\n\n"
        push = [(f"Fs[{r}, {k}]", e.diff(q))
                for r, e in enumerate(f) for k, q in enumerate(dynamic) if e.diff(q) != 0]
        slope = [(f"Gs[{r}, {k}]", e.diff(q))
                 for r, e in enumerate(rate) for k, q in enumerate(dynamic) if e.diff(q) != 0]
        source += w.values("switching", "b, t, x, u, p, s, g", "g", g)
        source += w.sensitivities(
            "switching_sensitivity", "b, t, x, S, u, ud, p, s, act, fp, gS", g, "gS", None)
        source += w.values("switching_rate", "b, t, x, u, v, p, s, G", "G", rate)
        source += w.sensitivities(
            "switching_rate_sensitivity", "b, t, x, S, u, v, ud, p, s, act, fp, GS, Gs, Fs", rate,
            "GS", None, [*push, *slope])
        source += _slopes(w, "switching_gain", slope, "b, t, x, u, v, p, s, Gs")
        shown = [(f"Hs[{r}, {k}]", e.diff(q))
                 for r, e in enumerate(h) for k, q in enumerate(dynamic) if e.diff(q) != 0]
        source += f"SHOWS_SIGNS = {bool(shown)}\n\n\n"
        source += _slopes(w, "observe_gain", shown, "b, t, x, u, v, p, s, Hs", True)
    return source, w


def constants_function(w: Writer) -> str:
    """A function that puts the parameters p (P,) and all constants into c: the last to be written.
    """
    parts = [(f"c[{len(w.p) + i}]", e) for i, e in enumerate(w.constants.symbols)]
    body = ["for k in range(P):", "    c[k] = p[k]", *w.unpack(list(w.constants.symbols))]
    return f"CONSTANTS = {len(parts)}\n\n\n" + _function(
        "evaluate_constants", "p, c", body + w.block(parts, Splines(w.model, [])))


def _rate(w: Writer, e: sp.Expr) -> sp.Expr:
    """d e/dt along the flow, with the inputs' slopes v."""
    total = e.diff(TIME)
    for q, fq in zip(w.x, w.lowered.rhs, strict=True):
        total += e.diff(q) * fq
    for q, vq in zip(w.u, w.v, strict=True):
        total += e.diff(q) * vq
    return total


def _slopes(w: Writer, name: str, targets: Sequence[tuple[str, sp.Expr]], arguments: str,
            inline_switches: bool = False) -> str:
    own = w.own_switches(inline_switches and bool(targets))
    targets = [(name, w.constants.taken_out(e)) for name, e in targets]
    used = [*(e for _, e in targets), *own]
    splines = Splines(w.model, used)
    body = w.unpack([*used, *splines.arguments]) + w.prelude(splines, own)
    return _function(name, arguments, body + w.block(targets, splines))
