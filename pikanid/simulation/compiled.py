"""Compiled models: generated source, compiled once and found again by every process.

The source and what numba makes of it are entries of `pikanid.storage.cache`, the source under a
name made from the model's formulas and from the generator's own text.  Parameter values and which
parameters are estimated do not enter: one compiled model serves them all.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.util
import logging
import sys
from pathlib import Path
from types import ModuleType
from typing import Literal

from pikanid.formula.expressions import to_text
from pikanid.model import Model
from pikanid.simulation.structure import Structure
from pikanid.storage.cache import kept, named, sources

Method = Literal["explicit", "implicit"]
_HERE = Path(__file__).parent
_LOG = logging.getLogger(__name__)


@functools.lru_cache(maxsize=256)  # what a structure is takes longer to tell than which model
def compiled(model: Model, method: Method = "explicit") -> ModuleType:
    """The module of compiled functions for `model`; generated at the first call ever.

    `method` chooses the classical Runge-Kutta step or the L-stable implicit one.
    """
    return _load(Structure(model), method)


@functools.lru_cache(maxsize=256)
def _load(structure: Structure, method: Method) -> ModuleType:
    name = _name(structure.model, method)
    return generated(name, kept(name, lambda: _source(structure.model, method).encode()).decode())


class _Text(importlib.abc.ExecutionLoader):
    """Loads a module from its text, which tracebacks show."""

    def __init__(self, text: str):
        self.text = text

    def get_filename(self, fullname: str) -> str:
        return f"generated {fullname}"  # names in brackets would be taken for a console's

    def get_source(self, fullname: str) -> str:
        return self.text


def generated(name: str, source: str) -> ModuleType:
    """The module that a generated source makes."""
    spec = importlib.util.spec_from_loader(f"pikanid_{name}", _Text(source))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # before it runs: numba looks for the module of a function
    spec.loader.exec_module(module)
    return module


def _source(model: Model, method: Method) -> str:
    from pikanid.simulation.codegen import constants_function, generate
    from pikanid.simulation.smooth_step import step_functions

    _LOG.info("compiling %s, once", model.name)
    source, writer = generate(model)
    kind = "hybrid" if writer.lowered.n_dynamic else "smooth"
    step = "rk4" if method == "explicit" else "sdirk"
    if (kind, step) == ("smooth", "rk4"):
        source, step = source + step_functions(writer), "rk4_smooth"
    pieces = [f"field_{kind}", step, f"drive_{kind}", "integrate"]
    source += constants_function(writer)
    return source + "\n\n".join(kernel_text(p) for p in pieces)


def kernel_text(name: str) -> str:
    """The source of a kernel, to be pasted behind the functions that it calls."""
    return (_HERE / "kernels" / f"{name}.py").read_text()


def _name(model: Model, method: Method) -> str:
    """Of the source: from the formulas, the spline functions in them, and the generator."""
    splines = tuple((s.name, s.degree, s.knots) for s in model.splines)
    kernels = sorted(k for k in (_HERE / "kernels").glob("*.py") if not k.name.startswith("tape"))
    generators = (_HERE / f"{n}.py" for n in (
        "compiled", "codegen", "smooth_step", "spline_lines", "printing", "constants", "lowering",
        "support", "layout", "sdirk_table"))
    return named(
        "model", method, model.state_names, model.input_names, model.parameter_names,
        [to_text(e) for e in model.equations.values()],
        [to_text(o.expression) for o in model.outputs], splines,
        any(i.delay.free_symbols for i in model.inputs), sources(*kernels, *generators))
