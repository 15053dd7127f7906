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
import gzip
import io
import json
import multiprocessing
import resource
import signal
import tempfile
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

# CPU time of one input, so that a busy machine fails none; by the clock it may take ten times that.
SECONDS = 10.0
MEMORY = 2**30  # bytes, for one input beyond what the libraries take
SLICE = 500  # inputs that a worker process takes at a time
KEPT = Path("build/fuzz")
RECORDINGS = (".csv", ".csv.gz", ".xlsx", ".xls", ".parquet", ".mat", ".v73.mat", ".npz")
CODE = "__import__('os').abort()"


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


# --- what is fuzzed ------------------------------------------------------------------------------


def sound_recording(ending: str) -> bytes:
    """A small sound file."""
    t = np.arange(30) * 0.1
    columns = {"t": t, "theta [deg]": np.sin(t), "u": np.cos(t)}
    buffer = io.BytesIO()
    if ending.startswith(".csv"):
        rows = [",".join(columns), *(",".join(map(repr, r)) for r in np.c_[t, t**2, -t].tolist())]
        text = "\n".join(rows).encode()
        return gzip.compress(text, mtime=0) if ending.endswith("gz") else text
    if ending == ".xls":  # the header of an old workbook; a whole one nobody writes any more
        return b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16) + b"\x3e\0\x03\0\xfe\xff\x09\0" + (
            bytes(480) + bytes(range(256)) * 8)
    if ending == ".xlsx":
        import openpyxl

        book = openpyxl.Workbook(write_only=True)
        page = book.create_sheet("run")
        for row in [list(columns), *np.column_stack(list(columns.values())).tolist()]:
            page.append(row)
        book.save(buffer)
    elif ending == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(columns), buffer)
    elif ending == ".npz":
        np.savez(buffer, t=t, theta=t**2, pair=np.stack([t, -t]))
    elif ending == ".v73.mat":
        import h5py

        with h5py.File(buffer, "w") as file:
            file["t"], file["y"] = t, t**2
            file.create_group("s")["values"] = -t
            file.create_dataset("z", data=t, chunks=(10,), compression="gzip")
    else:
        from scipy.io import savemat

        cells = np.empty(2, dtype=object)
        cells[:] = [t, -t]
        savemat(buffer, {"t": t, "y": t**2, "s": {"time": t, "values": -t}, "c": cells},
                do_compression=True)
    return buffer.getvalue()


MODEL = """
name = "pendulum"
[states]
theta = { unit = "rad", initial = "free", guess = 0.1, bounds = [-1, 1] }
omega = { unit = "rad/s" }
[inputs]
u = { unit = "m/s^2", hold = "first", gain = "k", delay = 0.1, saturation = 3.0, lag = "l" }
[parameters]
l = { unit = "m", guess = 0.06, bounds = [0.005, 0.5] }
k = { value = 1.0 }
[equations]
theta = "omega"
omega = "u/l*cos(theta) - 9.81/l*sin(theta) + edge(omega) - max(k, 0.1)*sign(omega)"
[outputs]
theta = { unit = "rad", expression = "theta", sigma = 0.01, offset = "k", clip = [-1, 1] }
[splines]
edge = { degree = 1, knots = [0, 0, 1, 2, 2] }
"""


@cache
def estimate_content() -> dict[str, Any]:
    """What a saved estimate holds."""
    import tomllib

    from pikanid import Model

    t = [0.0, 0.1, 0.2]
    fit = {"recording": "r", "output": "theta", "unit": "rad", "t": t, "measured": t, "fitted": t,
           "sigma": None}
    model = Model.from_dict(tomllib.loads(MODEL))
    return {"pikanid_estimate": 1, "model": model.to_dict(), "strategy": "nls",
            "free": [{"name": "l", "recording": None, "guess": 0.1, "bounds": [0.0, 1.0],
                      "unit": "m"}],
            "theta": [0.05], "covariance": [[1e-6]], "fits": [fit],
            "trajectories": [{"t": t, "x": [[0.0] * len(model.states)] * 3}], "cost": 0.5,
            "adequacy": {"value": 3.0, "dof": 2, "p_value": 0.2, "verdict": "fits",
                         "source": "given"},
            "converged": True, "settings": {"grid": [1, 2]}, "history": [{"cost": 1.0}],
            "warnings": ["note"], "seconds": 0.1, "seed": None, "version": "0.1"}


@cache
def network_content() -> dict[str, Any]:
    """What a saved network [1, 1] of three intervals holds."""
    ones = [[1.0]]
    layer = {"grid": [[-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]], "coef": [[[0.1, 0.2, 0.3, 0.4]]],
             "scale_base": ones, "scale_sp": ones, "mask": ones, "node_scale": [1.0],
             "node_bias": [0.0], "subnode_scale": [1.0], "subnode_bias": [0.0],
             "symbolic_mask": [[0.0]], "symbolic_affine": [[[1.0, 0.0, 1.0, 0.0]]]}
    return {"format": "pikanid-kan", "version": 1, "width": [[1, 0], [1, 0]], "k": 1,
            "base": "zero", "arity": 2, "symbols": [[["0"]]], "kinks": None,
            "arrays": {"batch": [[0.5]], **{f"layer0_{n}": v for n, v in layer.items()}}}


CASE: dict[str, Any] = {
    "id": "001", "class": "single", "nameable": True, "base": {"l_theta": {"value": 0.045}},
    "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""}],
    "visibility": {"nominal": 40.0, "effects": [40.0], "best_rival": ["a"],
                   "best_rival_distance": 9.0}}
ANSWER: dict[str, Any] = {
    "verdict": "named", "mismatch": True, "held_out": {"rmse_after": 0.1, "noise": 0.1},
    "hypotheses": [{"effects": [{"ids": ["sensor_delay"]}], "probability": 0.97}],
    "parameters": {"after": {"l_theta": {"value": 0.044, "std": 0.001}}}}
TRUTH = {"schema_version": 1, "sealed": False, "seed": "1", "nonce": "ab", "settings": {},
         "cases": [{"sha256": {"001.csv": "0"}}]}
SEAL = {"schema_version": 1, "sealed": False, "sha256": "0"}
WORDS = ("identify", "simulate", "models", "diagnose", "extract", "design", "confusable", "conceal",
         "equivalence", "study", "--model", "-m", "sloshing", "pendulum", "run.csv", "model.toml",
         "absent.csv", "--sigma", "0.1deg", "theta=", "--set", "l_theta=0.05", "--rate", "--unit",
         "theta=m", "t=h", "--column", "--strategy", "nls", "--json", "--out", "--help", "-1",
         "1e309", "nan", "\0", "\x1b[2J", CODE, "x" * 5000,
         "--version", "--decimate", "--from", "--to",
         "", "--free", "--fix", "--input", "--output", "--seed", "--cases", "0", "--duration", "=")


# --- making inputs -------------------------------------------------------------------------------


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Bits flipped, bytes cut, spliced, doubled, or replaced by telling ones, at 1 to 4 places."""
    data = bytearray(content)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 4]))):
        at = int(rng.integers(0, max(len(data), 1)))
        length = int(rng.choice([1, 2, 4, 8, 64]))
        match int(rng.integers(0, 7)):
            case 0:
                data[at : at + 1] = bytes([data[at] ^ (1 << int(rng.integers(8)))]) if data else b""
            case 1:
                del data[at:]
            case 2:
                data[at : at + length] = rng.bytes(length)
            case 3:
                del data[at : at + length]
            case 4:
                other = int(rng.integers(0, max(len(data), 1)))
                data[at:at] = data[other : other + 8 * length]
            case 5:
                telling = [b"\xff" * length, b"\0" * length, b"\x7f\xff\xff\xff", b"1e999", b"nan"]
                data[at : at + length] = telling[int(rng.integers(len(telling)))]
            case _:
                data[at : at + 1] = [b"\n", b",", b'"', b"[", b"-", b"9" * 400][rng.integers(6)]
    return bytes(data)


def _leaf(rng: np.random.Generator) -> Any:
    values: list[Any] = [
        None, True, False, 0, 1, -1, 2, 10**9, 10**18, 10**400, -(10**400), 0.5, 1e308, 5e-324,
        float("nan"), float("inf"), "", "x", "theta", "free", "sin(theta)", CODE, "a" * 30_000,
        "1+" * 300_000 + "1", "max(theta," * 50 + "1" + ")" * 50, "theta**1000**1000", "\x1b[2J",
        "\ud800", [], {}, [CODE], {"a": CODE}, [[1, 2], [3]], [0.0] * 10_000, {"a": {"b": []}}]
    value = values[int(rng.integers(len(values)))]
    if rng.random() < 0.02:
        for _ in range(300):
            value = [value]
    return value


def altered(content: Any, rng: np.random.Generator) -> Any:
    """The content with one to three of its places replaced, removed, added or exchanged."""
    content = json.loads(json.dumps(content))
    for _ in range(int(rng.integers(1, 4))):
        places: list[tuple[Any, Any]] = []
        waiting = [content]
        while waiting:
            here = waiting.pop()
            for key in list(here) if isinstance(here, dict) else range(len(here)):
                places.append((here, key))
                if isinstance(here[key], dict | list) and len(here[key]) < 1000:
                    waiting.append(here[key])
        if not places:
            return _leaf(rng)
        here, key = places[int(rng.integers(len(places)))]
        match int(rng.integers(0, 5)):
            case 0:
                del here[key]
            case 1 if isinstance(here, dict):
                here[str(_leaf(rng))[:50]] = _leaf(rng)
            case 1 | 2 if isinstance(here, list):
                here.insert(key, _leaf(rng))
            case 3:
                there, other = places[int(rng.integers(len(places)))]
                with contextlib.suppress(KeyError, IndexError):
                    here[key] = json.loads(json.dumps(there[other], default=str))
            case _:
                here[key] = _leaf(rng)
    return content


def as_json(content: Any, rng: np.random.Generator) -> bytes:
    """A changed content as a file; some of its bytes are changed as well."""
    try:
        text = json.dumps(altered(content, rng)).encode(errors="surrogatepass")
    except (ValueError, RecursionError):  # an integer that has no text
        text = b'{"k": ' + b"9" * 5000 + b"}"
    return damaged(text, rng) if rng.random() < 0.3 else text


# --- reading them --------------------------------------------------------------------------------


def recording(ending: str) -> Callable[[np.random.Generator, Path], None]:
    """Fuzz of one format of recordings."""
    sound = sound_recording(ending)

    def read(rng: np.random.Generator, folder: Path) -> None:
        from pikanid import Recording

        content = damaged(sound, rng)
        if rng.random() < 0.05:
            content = rng.bytes(int(rng.integers(0, 600)))
        if rng.random() < 0.02:
            content = gzip.compress(b"1,2\n" * 10**6, 1) + content
        path = folder / f"input{ending}"
        path.write_bytes(content)
        found = Recording.read(path, rate=10.0 if rng.random() < 0.2 else None)
        repr(found)
        for name in found.names:
            found.as_output(name)

    return read


def model(rng: np.random.Generator, folder: Path) -> None:
    """Model files."""
    import tomllib

    from pikanid import Model

    if rng.random() < 0.5:
        path = folder / "input.toml"
        path.write_bytes(damaged(MODEL.encode(), rng))
        found = Model.load(path)
    else:
        found = Model.from_dict(altered(tomllib.loads(MODEL), rng))
    found.to_dict()
    repr(found)


def estimate(rng: np.random.Generator, folder: Path) -> None:
    """Saved estimates, gzipped or not."""
    from pikanid.estimate import Estimate

    content = as_json(estimate_content(), rng)
    packed = rng.random() < 0.2
    path = folder / ("input.json.gz" if packed else "input.json")
    path.write_bytes(damaged(gzip.compress(content, 1), rng) if packed else content)
    found = Estimate.load(path)
    str(found), found._repr_html_(), found.to_dict(), found.fitted_model


def network(rng: np.random.Generator, folder: Path) -> None:
    """Saved networks: JSON, and NPZ of the same content."""
    from pikanid.approximators.kan.file import load

    packed = rng.random() < 0.3
    path = folder / ("input.npz" if packed else "input.json")
    if packed:
        content = network_content()
        header = as_json({k: v for k, v in content.items() if k != "arrays"}, rng)
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {n: np.array(a) for n, a in content["arrays"].items()}
        np.savez(buffer, header=np.array(header.decode(errors="replace")), **arrays)
        archive = buffer.getvalue()
        path.write_bytes(damaged(archive, rng) if rng.random() < 0.5 else archive)
    else:
        path.write_bytes(as_json(network_content(), rng))
    load(path)


def diagnosis(rng: np.random.Generator, folder: Path) -> None:
    """Diagnoses and cases of truth files, as they are compared."""
    from pikanid.validation.concealed.score import judge

    if rng.random() < 0.5:
        judge(altered(CASE, rng), ANSWER)
    else:
        judge(CASE, altered(ANSWER, rng))


def seals(rng: np.random.Generator, folder: Path) -> None:
    """Truth files and seals."""
    from pikanid.validation.concealed.seal import matches

    first = rng.random() < 0.5
    truth, seal = json.dumps(TRUTH).encode(), json.dumps(SEAL).encode()
    (folder / "truth.json").write_bytes(as_json(TRUTH, rng) if first else truth)
    (folder / "seal.json").write_bytes(seal if first else as_json(SEAL, rng))
    matches(folder, folder / "truth.json")


def arguments(rng: np.random.Generator, folder: Path) -> None:
    """Command lines that end before any fit is begun: each holds one wrong thing at least."""
    from pikanid.cli import main

    (folder / "run.csv").write_bytes(sound_recording(".csv"))
    (folder / "model.toml").write_text(MODEL)
    words = [WORDS[int(k)] for k in rng.integers(0, len(WORDS), int(rng.integers(0, 8)))]
    words = [*words, "--no-such-option"] if rng.random() < 0.9 else ["models", *words]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        code = main([str(folder / w) if w in ("run.csv", "model.toml") else w for w in words])
    if code not in (0, 2):
        raise AssertionError(f"exit code {code}")


@cache
def targets() -> dict[str, Callable[[np.random.Generator, Path], None]]:
    """Every target by its name."""
    return {**{f"recording {e}": recording(e) for e in RECORDINGS}, "model": model,
            "estimate": estimate, "network": network, "diagnosis": diagnosis,
            "truth and seal": seals, "command line": arguments}


# --- running -------------------------------------------------------------------------------------


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
    context = multiprocessing.get_context("fork")
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
