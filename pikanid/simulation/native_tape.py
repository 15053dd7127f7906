"""Tapes as machine code, so that a model need not be compiled to be simulated a few dozen times.

The text is written for LLVM (C. Lattner and V. Adve, Proc. CGO 2004), without its optimisers: a
tape is in static single assignment form as it stands.  What has been translated once is kept beside
the compiled models.
"""

from __future__ import annotations

import functools
import threading
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
             "tangents_g", "values_g_rate", "tangents_g_rate", "signs_g_rate")
# that take the place of others where no derivatives are asked for
_WITHOUT = {"put_tangents": "put", "step_tangents": "step", "look_h": "look_h_only"}
_NOTHING = "nothing"
_lock = threading.Lock()


@dataclass(frozen=True)
class Native:
    """Addresses of `FUNCTIONS`: `values_*` of groups, derivatives by the estimated parameters
    (`tangents_*`) and by signs, all of (registers, derivatives); and what is around them
    (`native_step`).  In `plain` they are those of runs without derivatives.  `code` keeps them
    alive.
    """

    addresses: np.ndarray
    plain: np.ndarray
    code: Any


@functools.lru_cache(maxsize=512)
def native(tape: Tape, active: tuple[int, ...], moving_inputs: bool) -> Native:
    """The functions of a tape for derivatives by the `active` parameters and initial states.

    `moving_inputs`: the inputs move with the parameters, too, as where delays are estimated.
    """
    from llvmlite import binding

    writers = (Path(__file__).with_name(f"{name}.py") for name in (
        "tape", "native_tape", "native_formulas", "native_step", "native_text"))
    name = named("object", sources(*writers), tape.sizes, active, moving_inputs, *(
        (name, found.tolist()) for table in (tape.code, tape.outputs)
        for name, found in table.items()))
    with _lock:
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        code = kept(name, lambda: _compiled(_text(tape, active, moving_inputs)))
        machine = binding.Target.from_default_triple().create_target_machine()
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()

    def addresses(*names: str) -> np.ndarray:
        return np.array([engine.get_function_address(name) or engine.get_function_address(_NOTHING)
                         for name in names])

    return Native(addresses(*FUNCTIONS), addresses(*(
        _NOTHING if name.startswith("tangents") else _WITHOUT.get(name, name)
        for name in FUNCTIONS)), engine)


def _text(tape: Tape, active: tuple[int, ...], moving_inputs: bool) -> str:
    """All functions that an integrator of this tape may call; the others do `nothing`."""
    n, m, P, _, K = tape.sizes
    lanes, moving = len(active), moving_inputs and len(active) > 0
    states, inputs = range(1, 1 + n), range(1 + n, 1 + n + m)
    signs = [1 + n + m + P + k for k in range(K)]
    seeds = {*states, *(inputs if moving else ()), *(1 + n + m + a for a in active if a < P),
             *signs}
    live, signed = reached(tape, seeds), reached(tape, set(signs))
    parts = [DECLARED, TABLES, Writer(_NOTHING).text(), _values(tape, "prelude"),
             look("put", tape, 0, False), step("step", tape, 0, live, False),
             _values(tape, "h"), look("look_h_only", tape, 0, False, "values_h")]
    if moving or K:
        parts += [_values(tape, "f"), _values(tape, "h_rate")]
    if lanes:
        parts += [*(_tangents(tape, group, f"tangents_{group}", live, lanes)
                    for group in ("prelude", "h")),
                  look("put_tangents", tape, lanes, moving),
                  look("look_h", tape, lanes, moving, "values_h", "tangents_h"),
                  step("step_tangents", tape, lanes, live, moving)]
    if K:
        parts += [*(_values(tape, group) for group in ("g", "g_rate")),
                  look("look_g", tape, 0, False, "values_g"),
                  _tangents(tape, "g_rate", "signs_g_rate", signed, K)]
    if K and lanes:
        parts += [_tangents(tape, group, f"tangents_{group}", live, lanes)
                  for group in ("f", "g", "g_rate")]
    parts += [text for name, text in HELPERS.items() if any(f"@{name}(" in p for p in parts)]
    return "\n".join(parts)


def _compiled(text: str) -> bytes:
    """Object code for the processor that numba compiles for, too."""
    from llvmlite import binding

    triple, cpu, features = processor()
    machine = binding.Target.from_triple(triple).create_target_machine(
        opt=1, cpu=cpu, features=features)
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
