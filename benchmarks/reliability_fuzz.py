"""Fuzz of everything that reads what others wrote: files of every format, and the command line.

    python benchmarks/reliability_fuzz.py --n 100000 --seed 0 --workers 2

An input is made from its target, the seed and its number alone.  It passes if reading it, and
using what was read, ends within 10 s and 1 GB of memory, and raises nothing but a `PikanidError`.
Workers are processes of their own, so that a crash of a parser in C is counted too; what fails is
kept below ``build/fuzz/`` under the name of its target, seed and number.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import resource
import signal
import tempfile
import time
import warnings
import zlib
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from reliability_inputs import network_content
from reliability_targets import targets

# CPU time of one input, so that a busy machine fails none; by the clock it may take ten times that.
SECONDS = 10.0
MEMORY = 2**30  # bytes, for one input beyond what the libraries take
SLICE = 500  # inputs that a worker process takes at a time
KEPT = Path("build/fuzz")


@dataclass
class Tally:
    """What became of the inputs of one target."""

    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    failures: list[str] = field(default_factory=list)
    slowest: float = 0.0

    def add(self, other: Tally) -> None:
        """Count another slice of the same target."""
        self.inputs += other.inputs
        self.accepted += other.accepted
        self.refused += other.refused
        self.failures += other.failures
        self.slowest = max(self.slowest, other.slowest)


@dataclass(frozen=True)
class Fuzzed:
    """The whole run: inputs, seed, a tally a target, and the largest memory of any worker [B]."""

    n: int
    seed: int
    targets: dict[str, Tally]
    memory: int

    def markdown(self) -> str:
        """The table of the report."""
        lines = [f"{self.n} inputs, seed {self.seed}; largest process {self.memory / 2**20:.0f} "
                 "MiB.", "", "| target | inputs | read | refused | failures | slowest [s] |",
                 "| --- | --- | --- | --- | --- | --- |"]
        lines += [f"| {name} | {t.inputs} | {t.accepted} | {t.refused} | {len(t.failures)} | "
                  f"{t.slowest:.2f} |" for name, t in self.targets.items()]
        return "\n".join(lines)


class TooLong(BaseException):
    """An input takes more than `SECONDS`."""


def _alarm(*_: object) -> None:
    raise TooLong


def one(name: str, seed: int, number: int, folder: Path) -> str:
    """"read", "refused", or what went wrong with one input."""
    from pikanid.errors import PikanidError

    rng = np.random.default_rng([zlib.crc32(name.encode()), seed, number])
    try:
        signal.signal(signal.SIGPROF, _alarm)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            targets()[name](rng, folder)
        return "read"
    except PikanidError as problem:
        return "refused" if len(str(problem)) < 4000 else "a message of pages"
    except TooLong:
        return f"more than {SECONDS:g} s"
    except BaseException as failure:  # the net is what is tested: whatever comes through it counts
        return f"{type(failure).__name__}: {str(failure)[:200]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _warm(name: str, folder: Path) -> None:
    """Load the libraries: their seconds are no input's."""
    from pikanid.formula import units

    units.is_unit("no unit")
    if name == "network":
        from pikanid.approximators.kan.file import load

        (folder / "input.json").write_text(json.dumps(network_content()))
        load(folder / "input.json")


def _work(name: str, seed: int, start: int, stop: int, answers: Any) -> None:
    """A slice of inputs in a process of its own; says each number before it begins."""
    tally = Tally()
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        folder = Path(place)
        _warm(name, folder)
        one(name, seed, start, folder)
        pages = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (pages + MEMORY, resource.RLIM_INFINITY))
        for number in range(start, stop):
            for left in folder.iterdir():
                left.unlink()
            answers.send(number)
            begun = time.process_time()
            told = one(name, seed, number, folder)
            tally.slowest = max(tally.slowest, time.process_time() - begun)
            tally.inputs += 1
            tally.accepted += told == "read"
            tally.refused += told == "refused"
            if told not in ("read", "refused"):
                tally.failures.append(f"{name} {seed} {number}: {told}")
                _keep(name, seed, number, folder)
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    answers.send((tally, used))


def _keep(name: str, seed: int, number: int, folder: Path) -> None:
    kept = _ROOT / KEPT
    kept.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        label = f"{name.replace(' ', '-')}-{seed}-{number}-{path.name}"
        (kept / label).write_bytes(path.read_bytes())


_ROOT = Path(__file__).resolve().parents[1]


def _slice(job: tuple[str, int, int, int]) -> tuple[str, Tally, int]:
    """The tally of a slice, also where an input ends the process itself."""
    name, seed, start, stop = job
    total, memory = Tally(), 0
    # forked from a process that holds these libraries and nothing of its caller's
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    while start < stop:
        ours, theirs = context.Pipe(duplex=False)
        worker = context.Process(target=_work, args=(name, seed, start, stop, theirs))
        worker.start()
        theirs.close()
        last, done = start, False
        with contextlib.suppress(EOFError):
            while not done:
                if not ours.poll(10 * SECONDS):
                    worker.kill()
                    break
                told = ours.recv()
                if isinstance(told, tuple):
                    tally, memory = told[0], max(memory, told[1])
                    total.add(tally)
                    done = True
                else:
                    last = told
        worker.join()
        if not done:  # the inputs before it are made again: they are few, and pass
            total.failures.append(f"{name} {seed} {last}: the process ended ({worker.exitcode})")
            if last > start:
                again = _slice((name, seed, start, last))
                total.add(again[1])
            total.inputs += 1
            start = last + 1
        else:
            start = stop
    return name, total, memory


def fuzz(n: int = 100_000, seed: int = 0, workers: int = 2) -> Fuzzed:
    """Run `n` inputs, as many for each target; finished slices of earlier runs are not repeated.

    Args:
        n: Inputs of all targets together.
        seed: Of everything random.
        workers: Processes at a time.
    """
    from concurrent.futures import ThreadPoolExecutor

    names = list(targets())
    shares = {name: n // len(names) + (k < n % len(names)) for k, name in enumerate(names)}
    jobs = [(name, seed, start, min(start + SLICE, share)) for name, share in shares.items()
            for start in range(0, share, SLICE)]
    found = {name: Tally() for name in names}
    memory = 0
    with ThreadPoolExecutor(workers) as pool:
        for name, tally, used in pool.map(_stored, jobs):
            found[name].add(tally)
            memory = max(memory, used)
    return Fuzzed(n, seed, found, memory)


def _stored(job: tuple[str, int, int, int]) -> tuple[str, Tally, int]:
    """The slice from a file of an earlier run, or made and stored now."""
    name, seed, start, stop = job
    path = _ROOT / KEPT / f"slice-{name.replace(' ', '-')}-{seed}-{start}-{stop}.json"
    if path.exists():
        kept = json.loads(path.read_text())
        return name, Tally(**kept["tally"]), kept["memory"]
    _, tally, memory = _slice(job)
    if not tally.failures:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"tally": asdict(tally), "memory": memory}))
    return name, tally, memory


def main() -> int:
    """The command line of this script; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    found = fuzz(given.n, given.seed, given.workers)
    print(found.markdown())
    failures = [text for tally in found.targets.values() for text in tally.failures]
    print(*Counter(text.split(": ", 1)[1][:120] for text in failures).most_common(40), sep="\n")
    print(*failures[:60], sep="\n")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
