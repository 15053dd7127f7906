"""Random damages of the files that compiled code is kept in: is every one healed?

Usage: python benchmarks/reliability_cache.py SEED FILE.json

Every entry of a cache of its own is damaged in turn and used again: machine code of tapes, that of
functions compiled by numba, the generated source of a model, and the compiled model.  Healed is
what gives the same numbers, bit for bit, and has left a whole entry behind.
"""

from __future__ import annotations

import collections
import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, astuple, dataclass
from pathlib import Path

import numpy as np

from pikanid.storage.outputs import atomically

SEEDS = (20, 21, 22, 23)
DAMAGES = 50  # with each seed, in a process of its own
# A model takes seconds to compile anew, its tape milliseconds.
SHARES = {"tape": 0.7, "function": 0.23, "source": 0.05, "model": 0.02}


@dataclass(frozen=True)
class Damaged:
    """One trial: what was damaged, how, and whether it was healed."""

    kind: str
    damage: str
    healed: bool


def _cut(path: Path, rng: np.random.Generator) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: rng.integers(len(data))])


def _flip(path: Path, rng: np.random.Generator) -> None:
    data = bytearray(path.read_bytes())
    for place in rng.integers(len(data), size=rng.integers(1, 9)):
        data[place] ^= 1 << rng.integers(8)
    if bytes(data) != path.read_bytes():
        path.write_bytes(data)
    else:  # a bit flipped twice is none
        _cut(path, rng)


def _swap(path: Path, rng: np.random.Generator) -> None:
    others = sorted(p for p in path.parent.iterdir() if p != path and p.is_file())
    other = others[rng.integers(len(others))]
    aside = path.with_name("aside")
    path.rename(aside)
    other.rename(path)
    aside.rename(other)


def _link(path: Path, rng: np.random.Generator) -> None:
    path.rename(path.parents[1] / f"linked{rng.integers(1 << 30)}")
    path.symlink_to(path.parents[1])


def _folder_in_the_way(path: Path, rng: np.random.Generator) -> None:
    path.unlink()
    path.mkdir()


HOW: Mapping[str, Callable[[Path, np.random.Generator], object]] = {
    "cut short": _cut,
    "emptied": lambda path, rng: path.write_bytes(b""),
    "bits flipped": _flip,
    "exchanged for another entry": _swap,
    "garbage": lambda path, rng: path.write_bytes(rng.bytes(path.stat().st_size)),
    "garbage behind it": lambda path, rng: path.write_bytes(path.read_bytes() + rng.bytes(9)),
    "open for others to write": lambda path, rng: path.chmod(0o666),
    "closed to all": lambda path, rng: path.chmod(0),
    "a link": _link,
    "a folder in its place": _folder_in_the_way,
    "deleted": lambda path, rng: path.unlink(),
}


class Cached:
    """What is kept, and the numbers that it gives when it is loaded again."""

    def __init__(self) -> None:
        from pikanid.model import systems
        from pikanid.recording import excitation
        from pikanid.simulation import compiled, translated
        from pikanid.simulation.native_tape import native
        from pikanid.simulation.structure import Structure
        from pikanid.simulation.tape import tape

        self.model, self.drive = systems.sloshing(), excitation.two_pulse(1.0, 0.02)
        self.compiled, self.translated, self.native = compiled, translated, native
        self.program = tape(Structure(self.model))

    def tape(self) -> bytes:
        """Samples of a simulation that runs from a tape."""
        from pikanid.problem.problem import bind

        self.native.cache_clear()
        self.translated.machine.cache_clear()
        found = self.translated.Translated(
            self.model, bind(self.model, self.drive, need_outputs=False)).run(
                np.array([0.045, 0.15, 0.3, 9.81]), np.arange(4), states=True)
        return np.asarray(found.states).tobytes()

    def function(self) -> bytes:
        """What functions of three modules give that numba has compiled."""
        from pikanid.approximators.local_basis import tabulate
        from pikanid.mismatch.detect.propagation import step_matrices
        from pikanid.problem.backlash import play
        from pikanid.storage.jit import cached_jit

        t = np.linspace(0.0, 1.0, 50)
        (found_play, found_steps) = (cached_jit()(f.py_func) for f in (play, step_matrices))
        found_tabulate = cached_jit(error_model="numpy", nogil=True)(tabulate.py_func)
        carried = found_play(t, np.sin(9 * t), np.cos(9 * t), 0.1)
        moved = found_steps(np.full((3, 49, 2, 2), -0.5), np.diff(t), 2)
        first, values = np.empty(50, int), np.empty((50, 4))
        found_tabulate(np.r_[[0.0] * 3, np.linspace(0, 1, 8), [1.0] * 3], 3, 0, t, first, values)
        return b"".join(np.ascontiguousarray(a).tobytes() for a in (*carried, *moved, values))

    def source(self) -> bytes:
        """Samples of a compiled model."""
        from pikanid.problem.problem import bind
        from pikanid.simulation.simulator import Simulator

        self.compiled.compiled.cache_clear()
        self.compiled._load.cache_clear()
        found = Simulator(self.model, bind(self.model, self.drive, need_outputs=False)).run(
            np.array([0.045, 0.15, 0.3, 9.81]), np.arange(4), states=True)
        return np.asarray(found.states).tobytes()



def damages(seed: int, number: int = DAMAGES) -> list[Damaged]:
    """Damage and use again `number` times, in a cache folder of its own."""
    with tempfile.TemporaryDirectory() as place:
        before = os.environ.get("PIKANID_CACHE")
        os.environ["PIKANID_CACHE"] = place
        try:
            return _damages(number, np.random.default_rng(seed))
        finally:
            if before is None:
                del os.environ["PIKANID_CACHE"]
            else:
                os.environ["PIKANID_CACHE"] = before


def _damages(number: int, rng: np.random.Generator) -> list[Damaged]:
    from pikanid.storage import cache

    cached = Cached()
    uses = {"tape": cached.tape, "function": cached.function, "source": cached.source,
            "model": cached.source}
    known = {kind: use() for kind, use in uses.items()}
    folder = cache.cache_folder()
    assert folder is not None
    titles = {"tape": ("object_",), "function": ("play_", "step_matrices_", "tabulate_"),
              "source": ("model_",), "model": ("integrate_",)}
    # The integrator of tapes stays in memory: its entry would not be used again in this process.
    entries = {kind: sorted(p for p in folder.iterdir() if p.name.startswith(titles[kind])
                            and not p.name.startswith("integrate_tape_")) for kind in uses}
    found = []
    kinds = list(SHARES)
    for _ in range(number):
        kind = kinds[rng.choice(len(kinds), p=list(SHARES.values()))]
        how = list(HOW)[rng.integers(len(HOW))]
        path = entries[kind][rng.integers(len(entries[kind]))]
        HOW[how](path, rng)
        same = uses[kind]() == known[kind]
        whole = path.is_dir() or cache.find(path.name) is not None
        found.append(Damaged(kind, how, same and whole))
        print(len(found), *astuple(found[-1]), file=sys.stderr, flush=True)
        if path.is_dir():  # it stays, and code is made anew each time: the next trial has a file
            path.rmdir()
            uses[kind]()
    return found


def main(seed: str, file: str) -> None:
    """Damage, and print how many were healed; keep every trial for the report."""
    found = damages(int(seed))
    atomically(file, json.dumps([asdict(d) for d in found]).encode())
    counts = collections.Counter((d.kind, d.damage, d.healed) for d in found)
    for (kind, damage, healed), count in sorted(counts.items()):
        print(f"{kind}, {damage}: {count} {'healed' if healed else 'NOT HEALED'}")
    print(f"{sum(d.healed for d in found)} of {len(found)} healed, seed {seed}")


if __name__ == "__main__":
    main(*sys.argv[1:])
