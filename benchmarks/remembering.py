"""Results of pure functions kept by what their arguments say.

A diagnosis repeated with one threshold changed then computes only what that threshold changes, and
comes to the very numbers that it would have come to.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Hashable, Mapping, Sequence, Set
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import sympy as sp

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.closest import Closest
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import Settings

PLAIN = (str, int, float, bool, type(None), sp.Basic)


class Memory:
    """Remembers what functions returned; arguments are told apart by their content.

    Fits and whitened residuals are told apart by identity: whoever remembers the function that
    made them gets the same ones again.  `unread` names settings that none of the functions looks
    up: they tell nothing apart.

    >>> calls = []
    >>> double = Memory().of(lambda rows: calls.append(1) or 2 * rows)
    >>> [double(np.ones(2)).tolist() for _ in range(2)], len(calls)
    ([[2.0, 2.0], [2.0, 2.0]], 1)
    """

    def __init__(self, unread: Set[str] = frozenset()) -> None:
        self.unread = unread
        self.results: dict[Hashable, tuple[Any, float | None]] = {}
        self.marks: dict[int, tuple[Any, Hashable]] = {}

    def fork(self) -> Memory:
        """Another memory that begins with the same; what it learns this one does not."""
        other = Memory(self.unread)
        other.results, other.marks = dict(self.results), dict(self.marks)
        return other

    def of(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The same function with a memory; what it cannot tell apart it computes every time."""
        @functools.wraps(function)
        def remembered(*args: Any, **named: Any) -> Any:
            try:
                key = (function.__module__, function.__qualname__, self.mark((args, named)))
            except TypeError:
                return function(*args, **named)
            if key not in self.results:
                made = function(*args, **named)
                self.results[key] = made, _work(made)
            made, work = self.results[key]
            if work is not None:
                # a search adds up the work of its fits; later simulations must not count as theirs
                made.whitened.work = work
            return made

        return remembered

    def mark(self, thing: Any) -> Hashable:
        """What tells an argument apart.

        Raises:
            TypeError: If nothing does.
        """
        if isinstance(thing, PLAIN):
            return thing
        if isinstance(thing, np.ndarray | np.generic):
            rows = np.ascontiguousarray(thing)
            return rows.shape, rows.dtype.str, hashlib.sha256(rows.tobytes()).digest()
        if isinstance(thing, Mapping):
            return tuple((self.mark(k), self.mark(v)) for k, v in thing.items())
        if isinstance(thing, Sequence):
            return tuple(self.mark(element) for element in thing)
        if isinstance(thing, frozenset):
            return frozenset(self.mark(element) for element in thing)
        if isinstance(thing, Closest):
            return "Closest", thing.chi2  # what was asked of it serves fits side by side only
        return self._mark_of_object(thing)

    def _mark_of_object(self, thing: Any) -> Hashable:
        if id(thing) in self.marks:
            return self.marks[id(thing)][1]
        if isinstance(thing, Hypothesis | Whitened):
            mark: Hashable = (type(thing).__name__, id(thing))
        elif isinstance(thing, Candidate):
            # its functions follow from the entry, its formula and the place in the model
            mark = thing.key, thing.expression, self.mark((thing.parameters, thing.site))
        elif isinstance(thing, Settings):
            mark = tuple(item for item in thing.items() if item[0] not in self.unread)
        elif is_dataclass(thing) and vars(type(thing))["__dataclass_params__"].frozen:
            mark = (type(thing).__name__, *(self.mark(getattr(thing, f.name))
                                            for f in fields(thing)))
        else:
            raise TypeError(type(thing).__name__)
        # keeps the object alive: its id stays its own
        self.marks[id(thing)] = thing, mark
        return mark


def _work(made: Any) -> float | None:
    return float(made.whitened.work) if isinstance(made, Hypothesis) else None
