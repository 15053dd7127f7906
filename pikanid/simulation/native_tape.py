"""Tapes as machine code, so that a model need not be compiled to be simulated a few dozen times.

The text is written for LLVM (C. Lattner and V. Adve, Proc. CGO 2004), without its optimisers: a
tape is in static single assignment form as it stands.  What has been translated once is kept beside
the compiled models.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pikanid.simulation.native_formulas import DECLARED, HELPERS, reached, tangents, values
from pikanid.simulation.native_step import TABLES, look, step
from pikanid.simulation.native_text import Writer, blocks
from pikanid.simulation.tape import Tape
from pikanid.storage.cache import kept, named, processor, sources

FUNCTIONS = ("values_prelude", "tangents_prelude", "put", "put_tangents", "step", "step_tangents",
             "values_f", "tangents_f", "look_h", "values_h_rate", "look_g", "values_g",
             "tangents_g", "values_g_rate", "tangents_g_rate", "signs_g_rate", "states_f",
             "states_g_rate")
# that take the place of others where no derivatives are asked for
_WITHOUT = {"put_tangents": "put", "step_tangents": "step", "look_h": "look_h_only"}
_NOTHING = "nothing"
_lock = threading.Lock()


@dataclass(frozen=True)
class Native:
    """Addresses of `FUNCTIONS`: `values_*` of groups, derivatives by the estimated parameters
    (`tangents_*`), by signs and by states, all of (registers, derivatives); and what is around them
    (`native_step`).  In `plain` they are those of runs without derivatives.  `code` keeps them
    alive.
    """

    addresses: np.ndarray
    plain: np.ndarray
    code: Any


@functools.lru_cache(maxsize=512)
def native(tape: Tape, active: tuple[int, ...], moving_inputs: bool, implicit: bool = False
           ) -> Native:
    """What integrators of a tape call, for derivatives by the `active` parameters and initial
    states.

    `moving_inputs`: the inputs move with the parameters, too, as where delays are estimated;
    `implicit`: the integrator asks for derivatives by the states.
    """
    engine = _linked(tape, ("integrated", active, moving_inputs, implicit),
                     lambda: _text(tape, active, moving_inputs, implicit))
    plain = (_NOTHING if name.startswith("tangents") else _WITHOUT.get(name, name)
             for name in FUNCTIONS)
    return Native(_addresses(engine, FUNCTIONS), _addresses(engine, tuple(plain)), engine)


@functools.lru_cache(maxsize=512)
def native_field(tape: Tape, active: tuple[int, ...], group: str) -> tuple[np.ndarray, Any]:
    """Addresses of a tape's prelude and its derivatives, and of a group and its derivatives by the
    `active` parameters and states; what keeps them alive.
    """
    names = [f"{kind}_{part}" for part in ("prelude", group) for kind in ("values", "tangents")]
    engine = _linked(tape, ("field", active, group), lambda: "\n".join(
        _with_helpers([DECLARED, *(text for part in ("prelude", group) for text in _of_group(
            tape, part, _live(tape, active, False), len(active)))])))
    return _addresses(engine, names), engine


def _linked(tape: Tape, key: tuple[object, ...], text: Callable[[], str]) -> Any:
    """Machine code of a text, from the cache if the same has been translated before."""
    from llvmlite import binding

    writers = (Path(__file__).with_name(f"{name}.py") for name in (
        "tape", "native_tape", "native_formulas", "native_step", "native_text"))
    name = named("object", sources(*writers), tape.sizes, *key, *(
        (name, found.tolist()) for table in (tape.code, tape.outputs)
        for name, found in table.items()))
    with _lock:
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        code = kept(name, lambda: _compiled(text()))
        machine = binding.Target.from_default_triple().create_target_machine()
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
    return engine


def _addresses(engine: Any, names: Sequence[str]) -> np.ndarray:
    found = [engine.get_function_address(name) or engine.get_function_address(_NOTHING)
             for name in names]
    if not all(found):
        raise LookupError(f"of {', '.join(names)} not all have been written")
    return np.array(found)


def _text(tape: Tape, active: tuple[int, ...], moving_inputs: bool, implicit: bool) -> str:
    """All functions that an integrator of this tape may call; the others do `nothing`."""
    lanes, moving, K = len(active), moving_inputs and len(active) > 0, tape.sizes[4]
    live, signed = _live(tape, active, moving), reached(tape, set(_signs(tape)))
    groups = ["prelude", "h", *(["f", "g", "g_rate"] if K else ["f"] if moving or implicit else [])]
    parts = [DECLARED, TABLES, Writer(_NOTHING).text(),
             *(text for group in groups for text in _of_group(tape, group, live, lanes)),
             step("step", tape, 0, live, False), look("look_h_only", tape, 0, False, "values_h")]
    if K or moving or implicit:  # else a smooth model is not looked at
        parts.append(look("put", tape, 0, False))
    if (K or implicit) and lanes:
        parts.append(look("put_tangents", tape, lanes, moving))
    if moving:
        parts.append(_values(tape, "h_rate"))
    if lanes:
        parts += [look("look_h", tape, lanes, moving, "values_h", "tangents_h"),
                  step("step_tangents", tape, lanes, live, moving)]
    if K:
        parts += [look("look_g", tape, 0, False, "values_g"),
                  _tangents(tape, "g_rate", "signs_g_rate", signed, K)]
    if implicit:
        n = tape.sizes[0]
        by_states = reached(tape, {*range(1, 1 + n), *_signs(tape)})
        parts += [_tangents(tape, group, f"states_{group}", by_states, n)
                  for group in (["f", "g_rate"] if K else ["f"])]
    return "\n".join(_with_helpers(parts))


def _with_helpers(parts: Sequence[str]) -> Iterator[str]:
    yield from parts
    yield from (text for name, text in HELPERS.items() if any(f"@{name}(" in p for p in parts))


def _of_group(tape: Tape, group: str, live: set[int], lanes: int) -> Iterator[str]:
    """The functions that compute a group, and its derivatives if there are any."""
    yield _values(tape, group)
    if lanes:
        yield _tangents(tape, group, f"tangents_{group}", live, lanes)


def _signs(tape: Tape) -> range:
    n, m, P, _, K = tape.sizes
    return range(1 + n + m + P, 1 + n + m + P + K)


def _live(tape: Tape, active: tuple[int, ...], moving: bool) -> set[int]:
    """Registers that move with the active parameters, with states or with signs."""
    n, m, P = tape.sizes[:3]
    inputs = range(1 + n, 1 + n + m) if moving else ()
    return reached(tape, {*range(1, 1 + n), *inputs, *_signs(tape),
                          *(1 + n + m + a for a in active if a < P)})


def _compiled(text: str) -> bytes:
    """Object code for the processor that numba compiles for, too."""
    from llvmlite import binding

    triple, cpu, features = processor()
    machine = binding.Target.from_triple(triple).create_target_machine(
        opt=2, cpu=cpu, features=features)
    return bytes(machine.emit_object(binding.parse_assembly(text)))


def _values(tape: Tape, group: str) -> str:
    """The function that computes a group into its registers."""
    w, known = Writer(f"values_{group}"), dict[int, str]()
    values(w, tape, group, known)
    for o in tape.code[group][:, 3].tolist():
        w.store(known[o], "r", o)
    return w.text()


def _tangents(tape: Tape, group: str, name: str, live: set[int], lanes: int) -> str:
    """The function that computes the derivatives d (registers, lanes) of a group's results."""
    w, moved = Writer(name), dict[tuple[int, int], str]()
    tangents(w, tape, group, live, lanes, {}, moved)
    own = set(tape.code[group][:, 3].tolist())
    wanted = own & set(tape.outputs[group].tolist()) if group in tape.outputs else own
    for o in sorted(wanted & live):
        for first, width in blocks(lanes):
            w.store(moved[o, first], "d", o * lanes + first, f"<{width} x double>")
    return w.text()
