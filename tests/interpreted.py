"""Models without compiling each of them, which takes about ten seconds a model.

By Python: the kernels' source text with ``njit`` replaced by a decorator that does nothing, so that
every index is checked; good for small models.  From tapes: by the integrators that serve all
models.
"""

from __future__ import annotations

import functools
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pikanid.model import Model, systems
from pikanid.problem.problem import bind
from pikanid.recording import Recording
from pikanid.simulation import compiled as compiler
from pikanid.simulation import support, translated
from pikanid.simulation.compiled import Method
from pikanid.simulation.simulator import Simulator
from pikanid.simulation.structure import Structure
from pikanid.simulation.synthetic import with_outputs
from pikanid.simulation.tape import can_run, tape


def _plain(*_: Any, **__: Any) -> Callable[[Any], Any]:
    return lambda function: function


def _fields(record: np.dtype) -> types.SimpleNamespace:
    """Zeros for the fields of a record, under their names."""
    assert record.fields is not None and record.names is not None
    return types.SimpleNamespace(
        **{n: np.zeros(record[n].shape, record[n].base) for n in record.names})


def module(model: Model, method: Method = "explicit") -> types.ModuleType:
    """The model's generated module with plain Python functions."""
    return _module(Structure(model), method)


@functools.cache
def _module(structure: Structure, method: Method) -> types.ModuleType:
    model = structure.model
    source = compiler._source(model, method)
    source = source.replace("from numba import njit\n", "")
    source = source.replace("from pikanid.storage.jit import cached_jit\n", "")
    source = source.replace("np.zeros(1, WORK)", "[fields_of(WORK)]")
    made = types.ModuleType("interpreted")
    made.__dict__.update(njit=_plain, cached_jit=_plain, fields_of=_fields)
    exec(compile(source, f"<{model.name}>", "exec"), made.__dict__)
    for name in ("solve_small", "positive_power", "power_slope", "log_abs", "sgn", "spline_basis"):
        setattr(made, name, getattr(support, name).py_func)
    integrate = made.integrate

    def quiet(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):  # numba's error model: division by zero gives infinity
            return integrate(*arguments)

    made.integrate = quiet
    return made


def simulator(model: Model, recording: Recording, t: np.ndarray | None = None) -> Simulator:
    """A simulator of `model` under `recording`, outputs at t (N,), run by Python."""
    made = Simulator(model, bind(model, with_outputs(model, recording, t)))
    methods: tuple[Method, ...] = ("explicit", "implicit")
    for method in methods:
        made._kept[method] = module(model, method)
    return made


def instead_of_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let everything in this test run by Python: for fits of small models of their own."""
    monkeypatch.setattr("pikanid.simulation.simulator.compiled", module)


def from_tapes(model: Model, method: Method = "explicit") -> Any:
    """Stands for `compiled`: tapes for all but the slosh pendulum, which many tests share."""
    structure = Structure(model)
    if method == "explicit" and can_run(model) and structure != Structure(systems.sloshing()):
        return translated.Machine(tape(structure), (), False, method)
    return compiler.compiled(model, method)
