"""`Translated`: a simulator that runs a model from its tape, without compiling the model.

Three kernels, one for models whose right-hand side jumps, one for all others and an implicit one
for all, are compiled once and serve every model; its formulas become machine code in a few
milliseconds.
"""

from __future__ import annotations

import functools
import threading
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from pikanid.simulation.bound_tape import BoundTape, bound
from pikanid.simulation.compiled import Method, generated, kernel_text
from pikanid.simulation.native_tape import FUNCTIONS, Native, native
from pikanid.simulation.simulator import Simulator
from pikanid.simulation.structure import Structure
from pikanid.simulation.tape import GROUPS, Tape, can_run, tape

_NAMES = [name.upper() for name in FUNCTIONS]
_HEADER = f'''"""Integrators of tapes; generated from the kernels."""
import math

import numpy as np
from numba import njit

from pikanid.storage.jit import cached_jit
from pikanid.simulation.layout import Newton, Stages
from pikanid.simulation.native_call import call_look, call_native, call_step
from pikanid.simulation.sdirk_table import NODES, SDIRK
from pikanid.simulation.support import solve_small


def called(function):
    return cached_jit(error_model="numpy", _nrt=False)(function)


def inlined(function):
    return njit(error_model="numpy", inline="always", _nrt=False)(function)


{", ".join(name.upper() for name in GROUPS)} = range({len(GROUPS)})
({", ".join(_NAMES)}) = range({len(FUNCTIONS)})


'''


@dataclass(frozen=True)
class Translated(Simulator):
    """A `Simulator` of tapes: for models that are simulated a few dozen times only.

    Models with spline functions are compiled as usual.  `located`: the integrator stops at the
    corners of the right-hand side, which pays where they are sharp.  `estimated`: parameters whose
    sensitivities will be asked for; runs without any need no machine code of their own then.

    >>> import numpy as np
    >>> from pikanid.recording import excitation
    >>> from pikanid.model import systems
    >>> from pikanid.problem.problem import bind
    >>> model = systems.sloshing()
    >>> simulator = Translated(model, bind(model, excitation.two_pulse(), need_outputs=False))
    >>> simulator.run(np.array([0.045, 0.15, 0.3, 9.81]), states=True).states.shape[1]
    2
    """

    located: bool = False
    estimated: tuple[int, ...] = ()

    @functools.cached_property
    def corners(self) -> bool:
        """Whether it runs through corners that it could stop at."""
        return can_run(self.acting) and tape(Structure(self.acting), self.located).corners > 0

    def module(self, method: Method) -> Any:
        """The integrator, bound to the model's tape."""
        if not can_run(self.acting):
            return super().module(method)
        if method not in self._kept:
            delayed = not self._undelayed and bool(self._delayed_by[list(self.estimated)].any())
            self._kept[method] = machine(
                tape(Structure(self.acting), self.located), self.estimated, delayed, method)
        return self._kept[method]


class Machine:
    """What `Simulator` asks of a compiled module: `integrate`; each thread has its own registers.
    """

    def __init__(self, program: Tape, estimated: tuple[int, ...], delayed: bool, method: Method):
        self.program, self.estimated, self.delayed = program, estimated, delayed
        self.implicit = method == "implicit"
        self.kernel = _kernel("implicit" if self.implicit else
                              "hybrid" if program.sizes[4] else "smooth")
        self.own = threading.local()

    def integrate(self, T: np.ndarray, pieces: np.ndarray, U: np.ndarray, V: np.ndarray,
                  jumps: np.ndarray, dtau_in: np.ndarray, dtau_out: np.ndarray, delayed: bool,
                  x0: np.ndarray, S0: np.ndarray, p: np.ndarray, act: np.ndarray,
                  *rest: np.ndarray) -> tuple[int, int]:
        """As that of a compiled model."""
        status, stop = self.kernel.integrate_tape(
            self._bound(tuple(act.tolist()), delayed), T, pieces, U, V, jumps, dtau_in, dtau_out,
            delayed, x0, S0, p, *rest)
        return int(status), int(stop)

    def _bound(self, active: tuple[int, ...], delayed: bool) -> BoundTape:
        """The tape with registers for these derivatives."""
        kept: dict[tuple[tuple[int, ...], bool], tuple[BoundTape, Native]]
        kept = self.own.__dict__.setdefault("kept", {})
        key = (active, delayed)
        if key not in kept:
            wanted = (active, delayed) if active else (self.estimated, self.delayed)
            code = native(self.program, *wanted, self.implicit)
            kept[key] = bound(
                self.program, active, code.addresses if active else code.plain), code
        return kept[key][0]


@functools.lru_cache(maxsize=512)
def machine(program: Tape, estimated: tuple[int, ...], delayed: bool, method: Method) -> Machine:
    """The one machine of a tape, for the parameters whose sensitivities will be asked for."""
    return Machine(program, estimated, delayed, method)


_KERNELS = {"smooth": ("tape", "tape_smooth"),
            "hybrid": ("tape", "tape_signs", "tape_rk4", "tape_hybrid"),
            "implicit": ("tape", "tape_signs", "tape_sdirk", "tape_hybrid")}


@functools.cache
def _kernel(kind: str) -> ModuleType:
    return generated(f"tape_{kind}", "\n\n".join(
        [_HEADER.rstrip("\n") + "\n", *map(kernel_text, _KERNELS[kind])]))
