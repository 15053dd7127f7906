"""The formulas of a tape, and their derivatives by the chain rule, as lines of machine code.

Each register has a name in the function that is written once its value is known there; what is not
known is loaded.  So the same lines serve a function of all registers and the inside of a step.
"""

from __future__ import annotations

from collections.abc import Callable

from pikanid.simulation import tape as ops
from pikanid.simulation.native_text import Writer, blocks, splat
from pikanid.simulation.tape import GROUPS, Tape

Known = dict[int, str]
Moved = dict[tuple[int, int], str]
_BINARY = {ops.ADD: "fadd", ops.MUL: "fmul", ops.DIV: "fdiv"}
_CALLED = {ops.SIN: "sin", ops.COS: "cos", ops.TAN: "tan", ops.EXP: "exp", ops.TANH: "tanh",
           ops.SINH: "sinh", ops.COSH: "cosh", ops.ATAN: "atan"}
_INSIDE = {ops.LOG: ("log", "ogt", "0.0"), ops.SQRT: ("llvm.sqrt.f64", "oge", "0.0"),
           ops.ASIN: ("asin", "ole", "1.0"), ops.ACOS: ("acos", "ole", "1.0")}
_TWO = (ops.ADD, ops.MUL, ops.DIV, ops.POSITIVE_POWER, ops.POWER_SLOPE, ops.POWER, ops.ATAN2)
_TURNED = {ops.SIN: ops.COS, ops.COS: ops.SIN, ops.SINH: ops.COSH, ops.COSH: ops.SINH}
_NAN = "0x7FF8000000000000"
_STEEP = "0x3EB0C6F7A0B5ED8D"  # 1e-6
_MULTIPLIED = 8  # numerical: exponents up to which products take less time than a power


def reached(tape: Tape, seeds: set[int]) -> set[int]:
    """Registers that depend on the seeds."""
    live = set(seeds)
    for group in GROUPS:
        for op, i, j, o in tape.code[group].tolist():
            if op != ops.SGN and (i in live or (op in _TWO and j in live)):
                live.add(o)
    return live


def values(w: Writer, tape: Tape, group: str, known: Known) -> None:
    """Compute a group; `known` gains what it needs and what it computes."""
    whole = _whole(tape)
    for op, i, j, o in tape.code[group].tolist():
        for k in (i, j) if op in _TWO else (i,):
            _loaded(w, known, k)
        if op in (ops.POSITIVE_POWER, ops.POWER_SLOPE) and j in whole:
            known[o] = _positive(w, known[i], whole[j], slope=op == ops.POWER_SLOPE)
        else:
            known[o] = _value(w, op, known[i], known.get(j, ""))


def results(w: Writer, tape: Tape, group: str, known: Known) -> list[str]:
    """The values that a group is for; some may be states, parameters or constants as they are."""
    return [_loaded(w, known, o) for o in tape.outputs[group].tolist()]


def tangents(w: Writer, tape: Tape, group: str, live: set[int], lanes: int, known: Known,
             moved: Moved) -> None:
    """Derivatives of what a group computes, whose values are known, or in their registers.

    `moved` holds derivatives by register and first lane, and gains those computed; `live` are the
    registers that have any.
    """
    code = [line for line in tape.code[group].tolist() if line[3] in live] if lanes else []
    there = {(op, i): o for g in ("prelude", group) for op, i, _, o in tape.code[g].tolist()}

    def value(k: int) -> str:
        return _loaded(w, known, k)

    def turned(op: int, i: int) -> str:
        if (op, i) in there:
            return value(there[op, i])
        return w.call(_CALLED[op], value(i))

    whole = _whole(tape)
    slopes = [_slopes(w, line, live, value, turned, whole) for line in code]
    for first, width in blocks(lanes):
        kind, wide = f"<{width} x double>", dict[str, str]()
        for (op, _, _, o), by in zip(code, slopes, strict=True):
            parts = []
            for k, slope in by:
                if (k, first) not in moved:
                    moved[k, first] = w.load("d", k * lanes + first, kind)
                if slope and slope not in wide:
                    wide[slope] = splat(w, slope, width)
                one = moved[k, first]
                parts.append(w.op("fmul", one, wide[slope], kind) if slope else one)
            total = parts[0] if len(parts) == 1 else w.op("fadd", parts[0], parts[1], kind)
            moved[o, first] = w.put(f"fneg {kind} {total}") if op == ops.NEGATE else total


def _loaded(w: Writer, known: Known, k: int) -> str:
    if k not in known:
        known[k] = w.load("r", k)
    return known[k]


def _whole(tape: Tape) -> dict[int, int]:
    """The registers of constants that are small whole numbers, from one on."""
    return {k: int(n) for k, n in zip(*(found.tolist() for found in tape.constants), strict=True)
            if n in range(1, _MULTIPLIED + 1)}


def _positive(w: Writer, x: str, n: int, slope: bool) -> str:
    """`positive_power`, or `power_slope`, of a small whole exponent: products instead of calls."""
    if n == 1 and slope:
        return "1.0"
    above = w.where(x, "ole", "0.0", "0.0", x)
    found = above
    for _ in range(n - 1 - slope):
        found = w.op("fmul", found, above)
    return w.op("fmul", f"{n}.0", found) if slope else found


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
                   ops.POWER_SLOPE: "power_slope", ops.ATAN2: "atan2"}[op], x, y)


def _slopes(w: Writer, line: list[int], live: set[int], value: Callable[[int], str],
            turned: Callable[[int, int], str], whole: dict[int, int]) -> list[tuple[int, str]]:
    """Those arguments of an operation that move, with its partial derivatives; "" stands for one.
    """
    op, i, j, _ = line
    if op == ops.POSITIVE_POWER and j in whole:
        return [(i, _positive(w, value(i), whole[j], slope=True))] if i in live else []
    first = [(i, _by_first(w, line, value, turned))] if i in live else []
    second = [(j, _by_second(w, line, value))] if op in _TWO and j in live else []
    return first + second


def _by_first(w: Writer, line: list[int], value: Callable[[int], str],
              turned: Callable[[int, int], str]) -> str:
    op, i, j, o = line
    if op in (ops.ADD, ops.NEGATE):
        return ""
    if op == ops.MUL:
        return value(j)
    if op == ops.DIV:
        return w.op("fdiv", "1.0", value(j))
    if op == ops.POSITIVE_POWER:
        return w.call("power_slope", value(i), value(j))
    if op == ops.POWER_SLOPE:
        return w.op("fmul", value(j), w.call(
            "power_slope", value(i), w.op("fsub", value(j), "1.0")))
    if op == ops.POWER:
        return w.op("fmul", value(j), w.call("pow", value(i), w.op("fsub", value(j), "1.0")))
    if op == ops.ATAN2:
        return w.op("fdiv", value(j), _squares(w, value(i), value(j)))
    if op in _TURNED:
        slope = turned(_TURNED[op], i)
        return w.put(f"fneg double {slope}") if op == ops.COS else slope
    return _slope(w, op, value(i), value(o))


def _by_second(w: Writer, line: list[int], value: Callable[[int], str]) -> str:
    op, i, j, o = line
    if op == ops.ADD:
        return ""
    if op == ops.MUL:
        return value(i)
    if op == ops.DIV:
        return w.op("fdiv", w.put(f"fneg double {value(o)}"), value(j))
    if op == ops.POSITIVE_POWER:
        return w.op("fmul", value(o), w.call("log_abs", value(i)))
    if op == ops.POWER_SLOPE:
        return w.op("fadd", w.call("positive_power", value(i), w.op("fsub", value(j), "1.0")),
                    w.op("fmul", value(o), w.call("log_abs", value(i))))
    if op == ops.POWER:
        log = w.where(value(i), "ogt", "0.0", w.call("log", value(i)), "0.0")
        return w.op("fmul", value(o), log)
    return w.op("fdiv", w.put(f"fneg double {value(i)}"), _squares(w, value(i), value(j)))


def _squares(w: Writer, x: str, y: str) -> str:
    return w.op("fadd", w.op("fmul", x, x), w.op("fmul", y, y))


def _slope(w: Writer, op: int, x: str, value: str) -> str:
    """Of a function of one argument."""
    if op == ops.SQUARE:
        return w.op("fmul", "2.0", x)
    if op in (ops.TAN, ops.TANH):
        return w.op("fadd" if op == ops.TAN else "fsub", "1.0", w.op("fmul", value, value))
    if op == ops.EXP:
        return value
    if op in (ops.LOG, ops.LOG_ABS):
        return w.op("fdiv", "1.0", x)
    if op == ops.SQRT:
        return w.op("fdiv", "0.5", value)
    square = w.op("fmul", x, x)
    if op == ops.ATAN:
        return w.op("fdiv", "1.0", w.op("fadd", "1.0", square))
    root = w.call("llvm.sqrt.f64", w.op("fsub", "1.0", square))
    return w.op("fdiv", "1.0" if op == ops.ASIN else "-1.0", root)


# that they change nothing lets the sine and the cosine of an angle be one call
DECLARED = "\n".join([
    *(f"declare double @{name}(double) nounwind readnone" for name in (
        *_CALLED.values(), *(name for name, *_ in _INSIDE.values()), "llvm.fabs.f64")),
    "declare double @pow(double, double)", "declare double @atan2(double, double)"])
HELPERS = {"log_abs": """
define internal double @log_abs(double %x) {
  %zero = fcmp oeq double %x, 0.0
  br i1 %zero, label %nothing, label %rest
nothing:
  ret double 0.0
rest:
  %size = call double @llvm.fabs.f64(double %x)
  %log = call double @log(double %size)
  ret double %log
}
""", "positive_power": """
define internal double @positive_power(double %base, double %n) {
  %low = fcmp ole double %base, 0.0
  br i1 %low, label %below, label %above
below:
  %flat = fcmp oeq double %n, 0.0
  %at = select i1 %flat, double 1.0, double 0.0
  ret double %at
above:
  %power = call double @pow(double %base, double %n)
  ret double %power
}
""", "power_slope": f"""
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
"""}
