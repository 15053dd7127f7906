"""Measurement data of ASAM (MDF 3 and 4, asammdf), channel by channel on the clock of its group.

A channel group has a master channel, the times of its samples [s], counted from the start of the
measurement.  Formulas that a file gives to turn counts into physical values are read by the
whitelist of `pikanid.formula`, never evaluated as code.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.formats import called
from pikanid.recording.reading import foreign
from pikanid.recording.reading.signals import Clock, Contents, Signal
from pikanid.storage.outputs import atomically

_CONSTANTS = {"P1", "P2", "P3", "P4", "P5", "P6", "P7"}  # of the conversions without a text
_TIME = (0, 1)  # definition: kinds of master channels that hold times, of the MDF 4 format
# Types of data that are numbers, of either format.
_NUMBERS = {3: {0, 1, 2, 3, *range(9, 17)}, 4: {*range(6)}}  # definition: of the MDF format

read = partial(foreign.table, "mdf", "asammdf", called(".mf4"))


def contents(content: bytes, where: str) -> Contents:
    """Every channel of every group."""
    from asammdf import MDF
    from asammdf.blocks import v2_v3_blocks, v4_blocks

    # asammdf has numexpr evaluate the text of a formula and, where that fails, SymPy.  This process
    # reads one file and ends: here neither is asked.
    for module in (v2_v3_blocks, v4_blocks):
        module.__dict__.update(evaluate=_formula, lambdify=_refused)
    # A file by name: what a logger that lost its power left is finished in a copy of it.
    path = Path("measurement.mf4")
    atomically(path, content)
    measurement: Any = MDF  # which passes arguments on that its annotations leave out
    file = measurement(path, process_bus_logging=False)
    began = file.header.start_time.timestamp()
    return Contents([s for k in range(len(file.groups)) for s in _group(file, k, where)],
                    began if began > 0 else None)


def _group(file: Any, k: int, where: str) -> Iterator[Signal]:
    group = file.groups[k]
    master = file.masters_db.get(k)
    count = int(group.channel_group.cycles_nr)
    label = _label(file, k)
    clock = None
    if master is not None and _measures_time(group.channels[master]):
        clock = Clock(f"{label}/{group.channels[master].name or 'time'}",
                      lambda: np.array(file.get_master(k), float), count)
    for index, channel in enumerate(group.channels):
        if index == master:
            continue
        name = str(channel.name)
        is_number = channel.data_type in _NUMBERS[4 if file.version >= "4" else 3]
        yield Signal(f"{label}/{name}", name, count, _samples(file, k, index),
                     str(file.get_channel_unit(group=k, index=index)).strip() or None, clock,
                     "" if is_number else errors.no_number_signal(where, f"{label}/{name}"))


def _label(file: Any, k: int) -> str:
    """What the file calls a group, or its number."""
    group = file.groups[k].channel_group
    source = getattr(group, "acq_source", None)
    given = str(getattr(group, "acq_name", "") or getattr(source, "name", "") or "").strip()
    known = [str(getattr(g.channel_group, "acq_name", "") or "").strip() for g in file.groups]
    return given if given and known.count(given) <= 1 else f"{given or 'group'} {k + 1}"


def _measures_time(channel: Any) -> bool:
    # a measurement may run over an angle or a distance; MDF 3 knows times only
    return getattr(channel, "sync_type", 1) in _TIME


def _samples(file: Any, group: int, index: int) -> Callable[[], Array]:
    def load() -> Array:
        found = file.get(group=group, index=index, ignore_invalidation_bits=True)
        values = np.asarray(found.samples)
        if values.dtype.kind not in "fiub":  # numbers that stand for texts: the numbers
            found = file.get(group=group, index=index, raw=True, ignore_invalidation_bits=True)
            values = np.asarray(found.samples)
        values = values.astype(float)
        if found.invalidation_bits is not None:
            values[np.asarray(found.invalidation_bits, bool)] = np.nan
        return values

    return load


def _formula(text: str) -> Array:
    """What asammdf asks numexpr for: the value of a text, at the variables of its caller."""
    import sympy as sp

    from pikanid.formula.expressions import parse, symbol

    known = sys._getframe(1).f_locals
    counts = np.asarray(known["X" if "X" in known else "X1"], float)
    at = {"X": counts, **{name: np.asarray(known[name], float)
                          for name in sorted(_CONSTANTS & known.keys())}}
    # the one variable is X or X1, which asammdf may have numbered once more
    expression = parse(re.sub(r"\bX1*\b", "X", text), list(at), "a conversion formula")
    value = sp.lambdify([symbol(name) for name in at], expression, "numpy")(*at.values())
    return np.broadcast_to(np.asarray(value, float), counts.shape)


def _refused(*_: object, **__: object) -> None:
    raise ValueError("a formula outside the grammar")
