"""`Interpreted`: a simulator that runs a model from its tape, without compiling the model.

Two kernels, one for models whose right-hand side jumps and one for all others, are compiled once
and serve every model.
"""

from __future__ import annotations

import functools
import sys
import threading
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from pikanid.simulation.bound_tape import NOTHING, BoundTape, bound
from pikanid.simulation.compiled import Method, kernel_text, written
from pikanid.simulation.native_tape import Native, native
from pikanid.simulation.simulator import Simulator
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import Tape, can_run, tape

OFTEN = 8000  # steps of a tape after which translating it takes less than interpreting it has
_HEADER = '''"""The interpreter of tapes; generated from the kernels."""
import math

import numpy as np
from numba import njit

from pikanid.simulation.native_call import call_look, call_native, call_step
from pikanid.simulation.native_tape import AROUND, AROUND_TANGENTS
from pikanid.simulation.support import (
    log_abs, positive_power, power_slope, sgn, solve_small)
from pikanid.simulation.tape import (
    ACOS, ADD, ASIN, ATAN, ATAN2, COS, COSH, DIV, EXP, LOG, LOG_ABS, MUL, NEGATE, POSITIVE_POWER,
    POWER, SGN, SIN, SINH, SQRT, SQUARE, TAN, TANH)


def called(function):
    return njit(cache=True, error_model="numpy", _nrt=False)(function)


PRELUDE, F, H, H_RATE, G, G_RATE = range(6)


'''


@dataclass(frozen=True)
class Interpreted(Simulator):
    """A `Simulator` that interprets: for models that are simulated a few dozen times only.

    Models with spline functions are compiled as usual.  `located`: the integrator stops at the
    corners of the right-hand side, which pays where they are sharp.

    >>> import numpy as np
    >>> from pikanid import excitation, systems
    >>> from pikanid.problem import bind
    >>> model = systems.sloshing()
    >>> simulator = Interpreted(model, bind(model, excitation.two_pulse(), need_outputs=False))
    >>> simulator.run(np.array([0.045, 0.15, 0.3, 9.81]), states=True).states.shape[1]
    2
    """

    located: bool = False

    @functools.cached_property
    def corners(self) -> bool:
        """Whether it runs through corners that it could stop at."""
        return can_run(self.acting) and tape(Structure(self.acting), self.located).corners > 0

    def module(self, method: Method) -> Any:
        """The interpreter, bound to the model's tape."""
        if method != "explicit" or not can_run(self.acting):
            return super().module(method)
        if method not in self._kept:
            self._kept[method] = machine(tape(Structure(self.acting), self.located))
        return self._kept[method]


class Machine:
    """What `Simulator` asks of a compiled module: `integrate`; each thread has its own registers.

    What has been interpreted for as long as a translation takes is translated to machine code.
    """

    def __init__(self, program: Tape):
        self.program = program
        self.kernel = _kernel(program.sizes[4] > 0)
        self.own = threading.local()
        self.steps = 0

    def integrate(self, T: np.ndarray, pieces: np.ndarray, U: np.ndarray, V: np.ndarray,
                  jumps: np.ndarray, dtau_in: np.ndarray, dtau_out: np.ndarray, delayed: bool,
                  x0: np.ndarray, S0: np.ndarray, p: np.ndarray, act: np.ndarray,
                  *rest: np.ndarray) -> tuple[int, int]:
        """As that of a compiled model."""
        self.steps += int(pieces.sum())
        status, stop = self.kernel.integrate_tape(
            self._bound(tuple(act.tolist()), delayed), T, pieces, U, V, jumps, dtau_in, dtau_out,
            delayed, x0, S0, p, act, *rest)
        return int(status), int(stop)

    def _bound(self, active: tuple[int, ...], delayed: bool) -> BoundTape:
        """The tape with registers for these derivatives."""
        kept: dict[tuple[tuple[int, ...], bool, bool], tuple[BoundTape, Native | None]]
        kept = self.own.__dict__.setdefault("kept", {})
        often = self.steps > OFTEN
        key = (active, delayed, often)
        if key not in kept:
            code = native(self.program, active, delayed) if often else None
            kept[key] = bound(self.program, len(active), code.addresses if code else NOTHING), code
        return kept[key][0]


@functools.lru_cache(maxsize=512)
def machine(program: Tape) -> Machine:
    """The one machine of a tape: simulators of the same equations count their steps together."""
    return Machine(program)


@functools.cache
def _kernel(hybrid: bool) -> ModuleType:
    import importlib.util

    kind = "hybrid" if hybrid else "smooth"
    name = f"pikanid_interpreter_{kind}"
    spec = importlib.util.spec_from_file_location(name, written(f"interpreter_{kind}",
                                                                _source(kind)))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _source(kind: str) -> str:
    parts = ["interpreter", *(["interpreter_signs"] if kind == "hybrid" else []),
             f"interpreter_{kind}"]
    return "\n\n".join([_HEADER.rstrip("\n") + "\n", *map(kernel_text, parts)])
