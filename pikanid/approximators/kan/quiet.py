"""Keeps what pykan does to its surroundings inside this room.

pykan 0.2.8 seeds torch, NumPy and `random` whenever a model is constructed, prints, and writes
checkpoints.  Here its module sees stand-ins whose seeding does nothing, so that neither CPU nor
CUDA generators of the caller move, and its standard output is dropped.
"""

from __future__ import annotations

import io
import random
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from functools import lru_cache
from importlib import import_module
from threading import RLock
from types import ModuleType
from typing import Any

import numpy as np

from pikanid import errors

_LOCK = RLock()


class _Veiled:
    """A module of which some names are replaced; everything else passes through."""

    def __init__(self, module: ModuleType, **replaced: Any) -> None:
        self._module = module
        self.__dict__.update(replaced)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)


def _nothing(*_: Any, **__: Any) -> None:
    """Stands in for a seeding function."""


@lru_cache(maxsize=1)
def pykan_module() -> ModuleType:
    """pykan's module `kan.MultKAN`, imported on first use (seconds).

    Raises:
        BadSetting: If torch or pykan is not installed.
    """
    # scikit-learn, which pykan imports, adds to the warning filters: the context undoes that.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            # Not `import kan.MultKAN as m`: the package hides its submodule behind the class.
            return import_module("kan.MultKAN")
        except ImportError as missing:
            module = missing.name or "kan"
            raise errors.BadSetting(errors.not_installed("A KAN", module, "kan")) from missing


@contextmanager
def undisturbed(*, double: bool = False, silent: bool = True) -> Iterator[ModuleType]:
    """Run pykan without traces: generators, default dtype and output are as before afterwards.

    Args:
        double: Whether torch's default dtype is float64 meanwhile: pykan's scores, plots and
            pruning make tensors of the default dtype and fail on a float64 model otherwise.
        silent: Whether printed lines are dropped.
    """
    pykan = pykan_module()
    torch = import_module("torch")
    veils = {
        "torch": _Veiled(torch, manual_seed=_nothing),
        "np": _Veiled(np, random=_Veiled(np.random, seed=_nothing)),
        "random": _Veiled(random, seed=_nothing),
    }
    with _LOCK, redirect_stdout(io.StringIO()) if silent else _as_it_is():
        before = {name: pykan.__dict__[name] for name in veils}
        generators = torch.random.get_rng_state(), np.random.get_state(), random.getstate()
        dtype = torch.get_default_dtype()
        pykan.__dict__.update(veils)
        if double:
            torch.set_default_dtype(torch.float64)
        try:
            yield pykan
        finally:
            torch.set_default_dtype(dtype)
            torch.random.set_rng_state(generators[0])
            np.random.set_state(generators[1])
            random.setstate(generators[2])
            pykan.__dict__.update(before)


@contextmanager
def _as_it_is() -> Iterator[None]:
    yield
