"""What surrounds a tape's formulas, as machine code: steps of the classical Runge-Kutta method, and
looks at a state.  That bookkeeping costs more than the formulas of a small model do.
"""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.simulation.native_text import Writer, blocks, splat
from pikanid.simulation.tape import Tape

LOOK = "ptr %r, ptr %d, double %t, double %gap, ptr %x, ptr %S, ptr %u, ptr %v, ptr %dtau"
STEP = f"{LOOK}, double %h, ptr %xn, ptr %Sn"
_SHARES = ("", "%half", "%half", "%h")  # of the step, after which the stages look
_WEIGHTS = ("", "2.0", "2.0", "")


def look(name: str, tape: Tape, lanes: int, moving_inputs: bool, *then: str) -> str:
    """The function `name`: time t, states x (n,), inputs u + v gap, their rates v and derivatives S
    (n, lanes) put into their registers; `then` the functions of these names are called.
    """
    n, m, P, _, K = tape.sizes
    w = Writer(name, LOOK)
    w.store("%t", "r", 0)
    for i in range(n):
        w.store(w.load("x", i), "r", 1 + i)
    for j in range(m):
        rate = w.load("v", j)
        w.store(w.op("fadd", w.load("u", j), w.op("fmul", rate, "%gap")), "r", 1 + n + j)
        w.store(rate, "r", 1 + n + m + P + K + j)
    for i in range(n):
        for first, width in blocks(lanes):
            kind, at = f"<{width} x double>", i * lanes + first
            w.store(w.load("S", at, kind), "d", lanes + at, kind)
    if moving_inputs:
        _put_inputs(w, n, m, lanes)
    for function in then:
        w.run(function)
    return w.text()


def step(name: str, tape: Tape, lanes: int, live: set[int], moving_inputs: bool) -> str:
    """The function `name`: one step of length h from time t, states x (n,) and derivatives S
    (n, lanes) to xn and Sn; inputs are u + v gap at its start, and have delays dtau (m, lanes).

    Calls `values_f` and, for any lanes, `tangents_f`.
    """
    n, m = tape.sizes[:2]
    w = Writer(name, STEP)
    w.lines.append("  %half = fmul double %h, 0.5")
    if moving_inputs:
        _put_inputs(w, n, m, lanes)
    x = [w.load("x", i) for i in range(n)]
    u, v = ([w.load(name, j) for j in range(m)] for name in "uv")
    wide = {width: {c: splat(w, c, width) for c in ("%half", "%h", "2.0")}
            for width in {width for _, width in blocks(lanes)}}
    S = {(i, first): w.load("S", i * lanes + first, f"<{width} x double>")
         for i in range(n) for first, width in blocks(lanes)}
    kx: list[str] = []
    kS: dict[tuple[int, int], str] = {}
    sum_x, sum_S = list[str](), dict[tuple[int, int], str]()
    for c, weight in zip(_SHARES, _WEIGHTS, strict=True):
        w.store(w.op("fadd", "%t", c) if c else "%t", "r", 0)
        gap = w.op("fadd", "%gap", c) if c else "%gap"
        for j in range(m):
            w.store(w.op("fadd", u[j], w.op("fmul", v[j], gap)), "r", 1 + n + j)
        for i in range(n):
            w.store(w.op("fadd", x[i], w.op("fmul", c, kx[i])) if c else x[i], "r", 1 + i)
            for first, width in blocks(lanes):
                kind, at = f"<{width} x double>", S[i, first]
                if c:
                    at = w.op("fadd", at, w.op("fmul", wide[width][c], kS[i, first], kind), kind)
                w.store(at, "d", (1 + i) * lanes + first, kind)
        w.run("values_f")
        if lanes:
            w.run("tangents_f")
        out = tape.outputs["f"].tolist()
        kx = [w.load("r", o) for o in out]
        kS = {(i, first): w.load("d", o * lanes + first, f"<{width} x double>") if o in live
              else "zeroinitializer" for i, o in enumerate(out) for first, width in blocks(lanes)}
        sum_x = _summed(w, sum_x, kx, weight)
        for (i, first), slope in kS.items():
            width = dict(blocks(lanes))[first]
            kind = f"<{width} x double>"
            part = w.op("fmul", wide[width][weight], slope, kind) if weight else slope
            sum_S[i, first] = w.op("fadd", sum_S[i, first], part, kind) if c else part
    sixth = w.op("fdiv", "%h", "6.0")
    for i in range(n):
        w.store(w.op("fadd", x[i], w.op("fmul", sixth, sum_x[i])), "xn", i)
    for first, width in blocks(lanes):
        kind, factor = f"<{width} x double>", splat(w, sixth, width)
        for i in range(n):
            change = w.op("fmul", factor, sum_S[i, first], kind)
            w.store(w.op("fadd", S[i, first], change, kind), "Sn", i * lanes + first, kind)
    return w.text()


def _put_inputs(w: Writer, n: int, m: int, lanes: int) -> None:
    """Derivatives -v dtau of inputs that move."""
    for j in range(m):
        slope = w.put(f"fneg double {w.load('v', j)}")
        for first, width in blocks(lanes):
            kind, at = f"<{width} x double>", j * lanes + first
            value = w.op("fmul", splat(w, slope, width), w.load("dtau", at, kind), kind)
            w.store(value, "d", (1 + n) * lanes + at, kind)


def _summed(w: Writer, total: Sequence[str], slopes: Sequence[str], weight: str) -> list[str]:
    parts = [w.op("fmul", weight, k) if weight else k for k in slopes]
    return [w.op("fadd", t, p) for t, p in zip(total, parts, strict=True)] if total else parts
