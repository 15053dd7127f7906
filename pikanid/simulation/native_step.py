"""What surrounds a tape's formulas, as machine code: steps of the classical Runge-Kutta method, and
looks at a state.  That bookkeeping costs more than the formulas of a small model do.
"""

from __future__ import annotations

from pikanid.simulation.native_formulas import Known, Moved, results, tangents, values
from pikanid.simulation.native_text import Writer, blocks, splat
from pikanid.simulation.tape import Tape

LOOK = "ptr %r, ptr %d, double %t, double %gap, ptr %x, ptr %S, ptr %u, ptr %v, ptr %dtau"
STEP = f"{LOOK}, double %h, ptr %xn, ptr %Sn"
STAGES = 4  # definition: of the classical method
# shares of a step after which its stages look, and the weights of what they see
TABLES = """
@shares = private unnamed_addr constant [4 x double] [
  double 0.0, double 0.5, double 0.5, double 1.0]
@weights = private unnamed_addr constant [4 x double] [
  double 1.0, double 2.0, double 2.0, double 1.0]
"""


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

    The stages are a loop, in which states and what follows from them need no registers.
    """
    n, m = tape.sizes[:2]
    w = Writer(name, STEP)
    if moving_inputs:
        _put_inputs(w, n, m, lanes)
    parts = list(blocks(lanes))
    last, total = w.zeros(n), w.zeros(n)
    last_S, total_S = w.zeros(n * lanes), w.zeros(n * lanes)
    stage = w.loop("stages")
    share, weight = w.element("shares", stage), w.element("weights", stage)
    ahead = w.op("fmul", share, "%h")
    gap = w.op("fadd", "%gap", ahead)
    known: Known = {0: w.op("fadd", "%t", ahead)}
    moved: Moved = {}
    for i in range(n):
        known[1 + i] = w.op("fadd", w.load("x", i), w.op("fmul", ahead, w.load(last, i)))
        for first, width in parts:
            kind, at = f"<{width} x double>", i * lanes + first
            change = w.op("fmul", splat(w, ahead, width), w.load(last_S, at, kind), kind)
            moved[1 + i, first] = w.op("fadd", w.load("S", at, kind), change, kind)
    for j in range(m):
        known[1 + n + j] = w.op("fadd", w.load("u", j), w.op("fmul", w.load("v", j), gap))
    values(w, tape, "f", known)
    slopes = results(w, tape, "f", known)
    tangents(w, tape, "f", live, lanes, known, moved)
    for i, (slope, o) in enumerate(zip(slopes, tape.outputs["f"].tolist(), strict=True)):
        w.store(slope, last, i)
        w.add(w.op("fmul", weight, slope), total, i)
        for first, width in parts if o in live else ():
            kind, at = f"<{width} x double>", i * lanes + first
            if (o, first) not in moved:
                moved[o, first] = w.load("d", o * lanes + first, kind)
            w.store(moved[o, first], last_S, at, kind)
            w.add(w.op("fmul", splat(w, weight, width), moved[o, first], kind), total_S, at, kind)
    w.again("stages", stage, STAGES)
    sixth = w.op("fdiv", "%h", "6.0")
    for i in range(n):
        w.store(w.op("fadd", w.load("x", i), w.op("fmul", sixth, w.load(total, i))), "xn", i)
        for first, width in parts:
            kind, at = f"<{width} x double>", i * lanes + first
            change = w.op("fmul", splat(w, sixth, width), w.load(total_S, at, kind), kind)
            w.store(w.op("fadd", w.load("S", at, kind), change, kind), "Sn", at, kind)
    return w.text()


def _put_inputs(w: Writer, n: int, m: int, lanes: int) -> None:
    """Derivatives -v dtau of inputs that move."""
    for j in range(m):
        slope = w.put(f"fneg double {w.load('v', j)}")
        for first, width in blocks(lanes):
            kind, at = f"<{width} x double>", j * lanes + first
            value = w.op("fmul", splat(w, slope, width), w.load("dtau", at, kind), kind)
            w.store(value, "d", (1 + n) * lanes + at, kind)
