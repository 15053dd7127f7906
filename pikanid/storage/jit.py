"""Functions compiled by numba, kept as entries of `cache`.

Numba's own cache believes its files: half of one is a traceback, a flipped bit a crash, and a
function that is called from another module may change unnoticed.  Here the name of an entry is made
from all that the machine code is made from: the function, the functions and constants that it
refers to, wherever they are written, the options, and the types of the arguments.

Imported where it is used: numba takes its time.
"""

from __future__ import annotations

import functools
import hashlib
import pickle
from collections.abc import Callable, Iterable
from types import CodeType, FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from pikanid.storage import cache

_Function = TypeVar("_Function", bound=Callable[..., Any])
_PLAIN = (bool, int, float, complex, str, bytes, np.dtype, np.generic, type(None), type(...))


def cached_jit(**options: Any) -> Callable[[_Function], _Function]:
    """As `numba.njit(cache=True, **options)`, with files that are checked before they are used.

    >>> @cached_jit(error_model="numpy")
    ... def double(x):
    ...     return 2 * x
    >>> double(21)
    42
    """
    def decorate(function: _Function) -> _Function:
        made = njit(**options)(function)
        made._cache = Kept(made)
        return cast(_Function, made)
    return decorate


def inner_jit(**options: Any) -> Callable[[_Function], _Function]:
    """For functions that allocate nothing and that compiled ones alone call: the cheapest to make.
    """
    def decorate(function: _Function) -> _Function:
        lean: dict[str, Any] = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return cast(_Function, njit(**options, **lean)(function))
    return decorate


class Kept:
    """What a dispatcher of numba asks of its cache."""

    cache_path = None  # shown by `Dispatcher.stats`

    def __init__(self, made: Any):
        self.made = made

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function for arguments of these types, or None."""
        target_context.refresh()
        content = cache.find(self._name(sig))
        if content is None:
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(content))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and all(x.can_cache for x in data.lifted):
            cache.keep(self._name(sig), dumps(data._reduce()))

    def flush(self) -> None:
        """Nothing to do: an entry is never out of date."""

    def _name(self, sig: Any) -> str:
        return cache.named(self.made.__name__, self._meaning, str(sig), *_fields(sig))

    @functools.cached_property
    def _meaning(self) -> str:
        function = self.made.py_func
        text = repr((function.__module__, function.__qualname__, _meaning(self.made, {})))
        return hashlib.sha256(text.encode()).hexdigest()


def _fields(types: Any) -> Iterable[str]:
    """The names that named tuples have; their types do not show them."""
    for kind in types if isinstance(types, tuple) else types.args:
        fields = getattr(kind, "fields", None)
        if isinstance(fields, tuple):
            yield repr(fields)


def _meaning(value: object, met: dict[int, int]) -> object:
    """What machine code takes from a value: all that a function refers to, down to constants.

    `met` numbers the functions met on the way, for those that call each other.
    """
    if isinstance(value, Dispatcher):
        return sorted(map(repr, value.targetoptions.items())), _meaning(value.py_func, met)
    value = getattr(value, "_defn", value)  # of an intrinsic
    if isinstance(value, FunctionType):
        if id(value) in met:
            return met[id(value)]
        met[id(value)] = len(met)
        known = value.__globals__
        return (_meaning(value.__code__, met), repr(value.__defaults__),
                [_meaning(cell.cell_contents, met) for cell in value.__closure__ or ()],
                [(name, _meaning(known[name], met))
                 for name in sorted(_names(value.__code__)) if name in known])
    if isinstance(value, CodeType):
        return (value.co_code, value.co_names, value.co_varnames,
                [_meaning(constant, met) for constant in value.co_consts])
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.shape, value.tobytes()
    if isinstance(value, tuple | list):
        return [type(value).__name__, *(_meaning(one, met) for one in value)]
    if isinstance(value, frozenset):
        return sorted(repr(_meaning(one, met)) for one in value)
    if isinstance(value, _PLAIN):
        return repr(value)
    kind = type(value)
    return (kind.__module__, kind.__qualname__, getattr(value, "__module__", ""),
            getattr(value, "__qualname__", getattr(value, "__name__", "")),
            getattr(value, "_fields", ()))


def _names(code: CodeType) -> set[str]:
    inner = (c for c in code.co_consts if isinstance(c, CodeType))
    return set(code.co_names).union(*map(_names, inner))
