"""Tapes as machine code, so that a model need not be compiled to be simulated a few dozen times.

The text is written for LLVM (C. Lattner and V. Adve, Proc. CGO 2004), without its optimisers: a
tape is in static single assignment form as it stands.  What has been translated once is kept beside
the compiled models.
"""

from __future__ import annotations

import functools
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pikanid.simulation import tape as ops
from pikanid.simulation.native_step import look, step
from pikanid.simulation.native_text import Writer, blocks, splat
from pikanid.simulation.tape import GROUPS, Tape
from pikanid.storage.cache import kept, named, processor, sources

FUNCTIONS = ("values_prelude", "tangents_prelude", "put", "put_tangents", "step", "step_tangents",
             "values_f", "tangents_f", "look_h", "values_h_rate", "look_g", "values_g",
             "tangents_g", "values_g_rate", "tangents_g_rate", "signs_g_rate", "values_h",
             "tangents_h")
_BINARY = {ops.ADD: "fadd", ops.MUL: "fmul", ops.DIV: "fdiv"}
_CALLED = {ops.SIN: "sin", ops.COS: "cos", ops.TAN: "tan", ops.EXP: "exp", ops.TANH: "tanh",
           ops.SINH: "sinh", ops.COSH: "cosh", ops.ATAN: "atan"}
_INSIDE = {ops.LOG: ("log", "ogt", "0.0"), ops.SQRT: ("llvm.sqrt.f64", "oge", "0.0"),
           ops.ASIN: ("asin", "ole", "1.0"), ops.ACOS: ("acos", "ole", "1.0")}
_TWO = (ops.ADD, ops.MUL, ops.DIV, ops.POSITIVE_POWER, ops.POWER, ops.ATAN2)
_NAN = "0x7FF8000000000000"
_STEEP = "0x3EB0C6F7A0B5ED8D"  # 1e-6
_lock = threading.Lock()


@dataclass(frozen=True)
class Native:
    """Addresses of `FUNCTIONS`: `values_*` of groups, derivatives by the estimated parameters
    (`tangents_*`) and by signs, all of (registers, derivatives); and what is around them
    (`native_step`).  `code` keeps them alive.
    """

    addresses: np.ndarray
    code: Any


@functools.lru_cache(maxsize=512)
def native(tape: Tape, active: tuple[int, ...], moving_inputs: bool) -> Native:
    """The functions of a tape for derivatives by the `active` parameters and initial states.

    `moving_inputs`: the inputs move with the parameters, too, as where delays are estimated.
    """
    from llvmlite import binding

    writers = (Path(__file__).with_name(f"{name}.py") for name in
               ("tape", "native_tape", "native_step", "native_text"))
    name = named("object", sources(*writers), tape.sizes, active, moving_inputs, *(
        (name, found.tolist()) for table in (tape.code, tape.outputs)
        for name, found in table.items()))
    with _lock:
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        code = kept(name, lambda: _compiled(_text(tape, active, moving_inputs)))
        machine = binding.Target.from_default_triple().create_target_machine()
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
    return Native(np.array([engine.get_function_address(name) for name in FUNCTIONS]), engine)


def _text(tape: Tape, active: tuple[int, ...], moving_inputs: bool) -> str:
    n, m, P, _, K = tape.sizes
    lanes, moving = len(active), moving_inputs and len(active) > 0
    states, inputs = range(1, 1 + n), range(1 + n, 1 + n + m)
    signs = [1 + n + m + P + k for k in range(K)]
    seeds = {*states, *(inputs if moving else ()), *(1 + n + m + a for a in active if a < P),
             *signs}
    live, signed = _reached(tape, seeds), _reached(tape, set(signs))
    return "\n".join([
        _HELPERS, *(_values(tape, group) for group in GROUPS),
        *(_tangents(tape, group, f"tangents_{group}", live, lanes)
          for group in GROUPS if group != "h_rate"),
        _tangents(tape, "g_rate", "signs_g_rate", signed, K),
        look("put", tape, 0, False), look("put_tangents", tape, lanes, moving),
        look("look_h", tape, lanes, moving, "values_h", "tangents_h"),
        look("look_g", tape, 0, False, "values_g"),
        step("step", tape, 0, live, False), step("step_tangents", tape, lanes, live, moving)])


def _compiled(text: str) -> bytes:
    """Object code for the processor that numba compiles for, too."""
    from llvmlite import binding

    triple, cpu, features = processor()
    machine = binding.Target.from_triple(triple).create_target_machine(
        opt=1, cpu=cpu, features=features)
    return bytes(machine.emit_object(binding.parse_assembly(text)))


def _reached(tape: Tape, seeds: set[int]) -> set[int]:
    """Registers that depend on the seeds."""
    live = set(seeds)
    for group in GROUPS:
        for op, i, j, o in tape.code[group].tolist():
            if op != ops.SGN and (i in live or (op in _TWO and j in live)):
                live.add(o)
    return live


def _values(tape: Tape, group: str) -> str:
    w, known = Writer(f"values_{group}"), dict[int, str]()
    for op, i, j, o in tape.code[group].tolist():
        for k in (i, j) if op in _TWO else (i,):
            if k not in known:
                known[k] = w.load("r", k)
        known[o] = _value(w, op, known[i], known.get(j, ""))
        w.store(known[o], "r", o)
    return w.text()


def _value(w: Writer, op: int, x: str, y: str) -> str:
    if op in _BINARY:
        return w.op(_BINARY[op], x, y)
    if op == ops.SQUARE:
        return w.op("fmul", x, x)
    if op == ops.NEGATE:
        return w.put(f"fneg double {x}")
    if op in _CALLED:
        return w.call(_CALLED[op], x)
    if op in _INSIDE:
        function, relation, bound = _INSIDE[op]
        size = w.call("llvm.fabs.f64", x) if bound == "1.0" else x
        return w.where(size, relation, bound, w.call(function, x), _NAN)
    if op == ops.SGN:
        return w.where(x, "ogt", "0.0", "1.0", w.where(x, "olt", "0.0", "-1.0", "0.0"))
    if op == ops.LOG_ABS:
        return w.call("log_abs", x)
    return w.call({ops.POWER: "pow", ops.POSITIVE_POWER: "positive_power",
                   ops.ATAN2: "atan2"}[op], x, y)


def _tangents(tape: Tape, group: str, name: str, live: set[int], lanes: int) -> str:
    """Derivatives d (registers, lanes) of the results, by the chain rule."""
    w, r = Writer(name), dict[int, str]()

    def value(k: int) -> str:
        if k not in r:
            r[k] = w.load("r", k)
        return r[k]

    code = [line for line in tape.code[group].tolist() if line[3] in live] if lanes else []
    partial: list[tuple[str, str]] = []
    for op, i, j, o in code:
        if op in (ops.ADD, ops.NEGATE):
            partial.append(("", ""))
        elif op == ops.MUL:
            partial.append((value(j) if i in live else "", value(i) if j in live else ""))
        else:
            partial.append(_slopes(w, op, value(i), value(j) if op in _TWO else "", value(o)))
    results = set(tape.outputs[group].tolist() if group in tape.outputs else
                  tape.code[group][:, 3].tolist())
    for first, width in blocks(lanes):
        kind, d, wide = f"<{width} x double>", dict[int, str](), dict[str, str]()
        for (op, i, j, o), (by_x, by_y) in zip(code, partial, strict=True):
            parts = []
            for k, slope in ((i, by_x), (j, by_y)) if op in _TWO else ((i, by_x),):
                if k not in live:
                    continue
                if k not in d:
                    d[k] = w.load("d", k * lanes + first, kind)
                if slope and slope not in wide:
                    wide[slope] = splat(w, slope, width)
                parts.append(w.op("fmul", d[k], wide[slope], kind) if slope else d[k])
            d[o] = parts[0] if len(parts) == 1 else w.op("fadd", parts[0], parts[1], kind)
            if op == ops.NEGATE:
                d[o] = w.put(f"fneg {kind} {d[o]}")
            if o in results:
                w.store(d[o], "d", o * lanes + first, kind)
    return w.text()


def _slopes(w: Writer, op: int, x: str, y: str, value: str
            ) -> tuple[str, str]:
    """The partial derivatives of an operation by its arguments x and y."""
    one = "1.0"
    if op == ops.DIV:
        return w.op("fdiv", one, y), w.op("fdiv", w.put(f"fneg double {value}"), y)
    if op == ops.POSITIVE_POWER:
        return (w.call("power_slope", x, y), w.op("fmul", value, w.call("log_abs", x)))
    if op == ops.POWER:
        log = w.where(x, "ogt", "0.0", w.call("log", x), "0.0")
        less = w.call("pow", x, w.op("fsub", y, one))
        return w.op("fmul", y, less), w.op("fmul", value, log)
    square = w.op("fmul", x, x)
    if op == ops.ATAN2:
        both = w.op("fadd", square, w.op("fmul", y, y))
        return w.op("fdiv", y, both), w.op("fdiv", w.put(f"fneg double {x}"), both)
    return _slope(w, op, x, value, square), ""


def _slope(w: Writer, op: int, x: str, value: str, square: str) -> str:
    one = "1.0"
    if op == ops.SQUARE:
        return w.op("fmul", "2.0", x)
    if op in (ops.SIN, ops.SINH, ops.COSH):
        return w.call({ops.SIN: "cos", ops.SINH: "cosh", ops.COSH: "sinh"}[op], x)
    if op == ops.COS:
        return w.put(f"fneg double {w.call('sin', x)}")
    if op in (ops.TAN, ops.TANH):
        return w.op("fadd" if op == ops.TAN else "fsub", one, w.op("fmul", value, value))
    if op == ops.EXP:
        return value
    if op in (ops.LOG, ops.LOG_ABS):
        return w.op("fdiv", one, x)
    if op == ops.SQRT:
        return w.op("fdiv", "0.5", value)
    if op == ops.ATAN:
        return w.op("fdiv", one, w.op("fadd", one, square))
    root = w.call("llvm.sqrt.f64", w.op("fsub", one, square))
    return w.op("fdiv", one if op == ops.ASIN else "-1.0", root)


_HELPERS = "\n".join(
    [*(f"declare double @{name}(double)" for name in (
        *_CALLED.values(), *(name for name, *_ in _INSIDE.values()), "llvm.fabs.f64")),
     "declare double @pow(double, double)", "declare double @atan2(double, double)",
     f"""
define internal double @log_abs(double %x) {{
  %zero = fcmp oeq double %x, 0.0
  br i1 %zero, label %nothing, label %rest
nothing:
  ret double 0.0
rest:
  %size = call double @llvm.fabs.f64(double %x)
  %log = call double @log(double %size)
  ret double %log
}}
define internal double @positive_power(double %base, double %n) {{
  %low = fcmp ole double %base, 0.0
  br i1 %low, label %below, label %above
below:
  %flat = fcmp oeq double %n, 0.0
  %at = select i1 %flat, double 1.0, double 0.0
  ret double %at
above:
  %power = call double @pow(double %base, double %n)
  ret double %power
}}
define internal double @power_slope(double %base, double %n) {{
  %low = fcmp ole double %base, 0.0
  %root = fcmp olt double %n, 1.0
  %near = fcmp olt double %base, {_STEEP}
  %steep = and i1 %root, %near
  %no = or i1 %low, %steep
  br i1 %no, label %below, label %above
below:
  %line = fcmp oeq double %n, 1.0
  %at = select i1 %line, double 1.0, double 0.0
  ret double %at
above:
  %less = fsub double %n, 1.0
  %power = call double @pow(double %base, double %less)
  %slope = fmul double %n, %power
  ret double %slope
}}
"""])
