"""Does the kit say the same on every machine?  Tests and diagnoses under other CPU settings.

    python benchmarks/platforms.py [--short] [--jobs 2] [--only NAME ...] [--no-tests]
        [--report FILE.md]

Each setting is a set of environment variables for child processes: the kernels of OpenBLAS, what
NumPy and torch may use of the CPU, the CPU that numba compiles for, Python's hash seed, threads.
Every value is tried, not every combination: rounding differs by kernel, and kernels of different
libraries do not meet; the last setting takes the plainest of everything together.  What this CPU
does not have is left out, and said.

The twenty recordings are made once and read by all: 16 simulated ones (seeds 0 to 15) and 4 real
ones.  A diagnosis is the same where verdict and names are equal and every number is within
its tolerance: constants and parameters within 0.05 of their standard error, RMS errors within
0.1 %, probabilities within 0.02.  Exit code 1 where a test fails or a diagnosis differs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import platform_cases
from provenance import provenance

ROOT = Path(__file__).resolve().parents[1]
# Where decisions are made close to an edge, and where sums are long.
SHORT_TESTS = ("tests/test_verdict.py", "tests/test_prediction.py", "tests/test_gauss_newton.py",
               "tests/test_uncertainty.py", "tests/test_noise.py")
SHORT_SETTINGS = ("reference", "SkylakeX", "plainest")
STANDARD_ERRORS, RELATIVE, PROBABILITY = 0.05, 1e-3, 0.02  # tolerances
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Setting:
    """Environment variables of a run; `threads` are those of the libraries and of a diagnosis."""

    name: str
    variables: tuple[tuple[str, str], ...]
    hash_seed: int = 0
    threads: int = 1

    def environment(self) -> dict[str, str]:
        """That of a child process: nothing of what settings set is inherited."""
        own = {**dict(self.variables), "PYTHONHASHSEED": str(self.hash_seed),
               **dict.fromkeys(THREADS, str(self.threads)),
               "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "benchmarks")))}
        sets = {"OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "NUMBA_CPU_NAME",
                "ATEN_CPU_CAPABILITY"}
        return {k: v for k, v in os.environ.items() if k not in sets} | own

    def described(self) -> str:
        """The variables in words."""
        told = [f"{k}={v}" for k, v in self.variables]
        return ", ".join([*told, f"hash seed {self.hash_seed}", f"threads: {self.threads}"])


def settings(features: dict[str, bool], dispatched: Sequence[str]) -> tuple[Setting, ...]:
    """Those that a CPU can run.

    Args:
        features: What it has, by NumPy's names.
        dispatched: What NumPy has code of its own for, by the same names.
    """
    def without(*marks: str) -> str:
        return " ".join(name for name in dispatched
                        if features.get(name) and any(mark in name for mark in marks))

    x86 = features.get("SSE2", False)
    avx2, avx512 = features.get("AVX2", False), features.get("AVX512_SKX", False)
    no_512, no_2 = without("AVX512", "X86_V4"), without("AVX", "FMA", "X86_V")
    blas = [("Sandybridge", features.get("AVX", False)), ("Haswell", avx2), ("SkylakeX", avx512)]
    kernels = [Setting(name, (("OPENBLAS_CORETYPE", name),), seed)
               for seed, (name, there) in enumerate(blas, 1) if there]
    fewer = [Setting(name, (("NPY_DISABLE_CPU_FEATURES", off), ("ATEN_CPU_CAPABILITY", torch)),
                     seed)
             for seed, (name, off, torch) in enumerate((
                 ("no AVX512", no_512, "avx2"), ("no AVX2", no_2, "default"))) if off]
    generic = (("NUMBA_CPU_NAME", "generic"),)
    plainest = tuple(pair for s in (*kernels[:1], *fewer[-1:]) for pair in s.variables) + generic
    return (Setting("reference", ()), *kernels, *fewer, Setting("generic numba", generic, 2),
            Setting("two threads", (), 3, 2),
            *((Setting("plainest", plainest, 1, 2),) if x86 else ()))


def here() -> tuple[Setting, ...]:
    """The settings for this machine."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return settings(__cpu_features__, __cpu_dispatch__)


# --- one setting ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """What came out under a setting: tests passed and their failures, diagnoses by case."""

    passed: int
    failed: tuple[str, ...]
    diagnoses: dict[str, Any]


def tried(setting: Setting, folder: Path, cases: Sequence[str], tests: Sequence[str] | None
          ) -> Run:
    """Diagnoses and tests (None for no tests) in processes of their own."""
    own = folder / setting.name.replace(" ", "_")
    own.mkdir(parents=True, exist_ok=True)
    answers, report = own / "answers.json", own / "tests.xml"
    for old in (answers, report):
        old.unlink(missing_ok=True)
    call = [sys.executable, str(ROOT / "benchmarks/platform_cases.py"), str(folder),
            str(answers), str(setting.threads), *cases]
    subprocess.run(call, cwd=ROOT, env=setting.environment(), check=True)
    passed, failed = 0, ()
    if tests is not None:
        call = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider",
                f"--junitxml={report}", *tests]
        done = subprocess.run(call, cwd=ROOT, env=setting.environment(), text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if done.returncode not in (0, 1):  # 1: tests have failed
            raise SystemExit(f"pytest ended with {done.returncode}:\n{done.stdout[-2000:]}")
        passed, failed = outcomes(report.read_text())
    return Run(passed, failed, json.loads(answers.read_text()))


def outcomes(report: str) -> tuple[int, tuple[str, ...]]:
    """How many tests of a JUnit report have passed, and which have failed."""
    passed, failed = 0, []
    for case in ElementTree.fromstring(report).iter("testcase"):
        if any(case.find(kind) is not None for kind in ("failure", "error")):
            failed.append(f"{case.get('classname')}::{case.get('name')}")
        elif case.find("skipped") is None:
            passed += 1
    return passed, tuple(failed)


# --- two settings --------------------------------------------------------------------------------


def differences(reference: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """What two answers (`Diagnosis.to_dict`) to one recording do not agree on, in words."""
    found = []
    if reference["verdict"] != other["verdict"]:
        found.append(f"verdict {reference['verdict']} -> {other['verdict']}")
    names, others = (sorted(_names(a)) for a in (reference, other))
    if names != others:
        found.append(f"names {names} -> {others}")
    if found:  # numbers of other hypotheses cannot be compared
        return found
    numbers = dict(_numbers(other))
    for place, value, tolerance in ((p, v, t) for p, (v, t) in _numbers(reference)):
        if place not in numbers or abs(numbers[place][0] - value) > tolerance:
            found.append(f"{place} {value:.6g} -> {numbers.get(place, ('none',))[0]}")
    return found


def _names(answer: dict[str, Any]) -> list[str]:
    return [" + ".join(sorted("/".join(sorted(e["ids"])) for e in h["effects"]))
            for h in answer["hypotheses"]]


def _numbers(answer: dict[str, Any]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Place -> number and its tolerance."""
    for name, h in zip(_names(answer), answer["hypotheses"], strict=True):
        yield f"probability of {name}", (h["probability"], PROBABILITY)
        for effect in h["effects"]:
            for constant, v in effect["parameters"].items():
                yield f"{constant} of {name}", _estimate(v)
    for when, table in answer["parameters"].items():
        for label, v in table.items():
            yield f"{label} {when}", _estimate(v)
    for key in ("rmse_before", "rmse_after") if answer["held_out"] else ():
        rmse = answer["held_out"][key]
        yield key, (rmse, RELATIVE * rmse)


def _estimate(v: dict[str, Any]) -> tuple[float, float]:
    return v["value"], STANDARD_ERRORS * v["std"] if v["std"] else 1e-6 * abs(v["value"])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run every setting, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="few settings, tests and diagnoses")
    parser.add_argument("--jobs", type=int, default=2, help="settings tried at a time")
    parser.add_argument("--only", nargs="*", help="settings beside the reference")
    parser.add_argument("--no-tests", action="store_true", help="diagnoses only")
    parser.add_argument("--work", type=Path, default=ROOT / "build/platforms")
    parser.add_argument("--report", type=Path, help="write the table to a file as well")
    given = parser.parse_args(arguments)
    chosen = [s for s in here() if s.name == "reference" or s.name in (
        given.only or (SHORT_SETTINGS if given.short else [x.name for x in here()]))]
    cases = platform_cases.SHORT if given.short else tuple(platform_cases.CASES)
    tests = None if given.no_tests else SHORT_TESTS if given.short else ()
    platform_cases.make(given.work.resolve(), cases)
    lines = [f"{len(cases)} diagnoses and {'no' if tests is None else 'some' if tests else 'all'} "
             f"quick tests under {len(chosen)} settings. {provenance()}.", "",
             "| setting | variables | tests passed | failed | diagnoses as in the reference |",
             "| --- | --- | --- | --- | --- |"]
    print("\n".join(lines), flush=True)
    told, reference, sound = [], None, True
    with ThreadPoolExecutor(given.jobs) as pool:
        runs = pool.map(lambda s: tried(s, given.work.resolve(), cases, tests), chosen)
        for setting, run in zip(chosen, runs, strict=True):
            reference = reference or run
            other = {c: differences(reference.diagnoses[c], run.diagnoses[c]) for c in cases}
            same = sum(not d for d in other.values())
            sound = sound and not run.failed and same == len(cases)
            lines.append(f"| {setting.name} | {setting.described()} | {run.passed} | "
                         f"{len(run.failed)} | {same} of {len(cases)} |")
            print(lines[-1], flush=True)
            told += [f"- {setting.name}: {name} fails" for name in run.failed]
            told += [f"- {setting.name}: {c}: {', '.join(d)}" for c, d in other.items() if d]
    left_out = sorted({"Sandybridge", "Haswell", "SkylakeX", "no AVX512", "no AVX2"}
                      - {s.name for s in here()})
    lines += ["", f"Left out, as this CPU has no such thing: {', '.join(left_out) or 'nothing'}.",
              *told]
    print("\n".join(lines[-1 - len(told):]))
    if given.report:
        head = ["# The same on every machine", "", __doc__.split("\n\n", 2)[2].strip(), ""]
        given.report.write_text("\n".join([*head, *lines]) + "\n")
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
