"""iPDA from N = 10³ to 10⁶ samples: seconds and peak memory a sample.

Usage: python benchmarks/ipda_scaling.py [SAMPLES ...]

Every size runs in a process of its own, so that its peak memory is its own.  Two inputs: pulses
every two seconds, and a zero-order hold that jumps at every sample.  A machine does not run at one
speed all the time: three rounds over all sizes and inputs, of which the median and the extremes are
shown.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from typing import Any

SIZES = (1_000, 10_000, 100_000, 1_000_000)
KINDS = ("pulses", "every sample")
ROUNDS = 3


def main(sizes: tuple[int, ...]) -> None:
    """Print one table row a size and kind of input, then how evenly the cost grows."""
    rows: dict[tuple[str, int], list[dict[str, Any]]] = {
        (kind, size): [] for kind in KINDS for size in sizes}
    for _ in range(ROUNDS):  # the rounds outermost: a slow minute meets all sizes, not one
        for (kind, size), found in rows.items():
            done = subprocess.run(
                [sys.executable, __file__, "--one", kind, str(size)], capture_output=True,
                text=True, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
            found.append(json.loads(done.stdout.splitlines()[-1]))
    print("## iPDA, time and memory against the number of samples\n")
    print(f"Median of {ROUNDS} rounds, each over all sizes; in brackets the fastest and the "
          "slowest round.\n")
    print("| input | N | intervals | seconds | µs a sample | bytes a sample |")
    print("| --- | --- | --- | --- | --- | --- |")
    for (kind, size), found in rows.items():
        costs = sorted(1e6 * row["seconds"] / size for row in found)
        middle = statistics.median(costs)
        print(f"| {kind} | {size} | {found[0]['intervals']} | {1e-6 * size * middle:.3g} "
              f"| {middle:.3g} ({costs[0]:.3g} to {costs[-1]:.3g}) "
              f"| {statistics.median(row['bytes'] for row in found) / size:.4g} |")
    print()
    for kind in KINDS:
        each = [[1e6 * row["seconds"] / size for row in rows[kind, size]] for size in sizes]
        medians, fastest = list(map(statistics.median, each)), list(map(min, each))
        print(f"Cost a sample, dearest size over cheapest, {kind}: "
              f"{max(medians) / min(medians):.2f} by the medians, "
              f"{max(fastest) / min(fastest):.2f} by the fastest rounds.\n")


def one(kind: str, size: int) -> None:
    """Fit one recording; print seconds and the memory that the fit added, as JSON."""
    import numpy as np

    import pikanid as pk
    from pikanid.problem.problem import Problem
    from pikanid.strategies.ipda import IPDA, fit_relaxed

    def problem(count: int) -> Problem:
        t = 0.01 * np.arange(count)
        pulses = np.where(t % 2.0 < 0.4, 1.0, 0.0)
        jumps = np.random.default_rng(1).normal(size=count)
        drive = pk.Recording.from_arrays(
            t, {"u_x": pulses if kind == "pulses" else jumps}, units={"u_x": "m/s^2"},
            hold={"u_x": "zero"})
        rec = pk.simulate(pk.systems.sloshing(), drive, sigma=0.002, seed=0, tolerance=1e-6)
        return Problem(pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05), rec)

    fit_relaxed(problem(300), IPDA())  # imports and generated functions are not what is measured
    bound = problem(size)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times = []
    for _ in range(max(1, min(31, 200_000 // size))):  # short fits need a median
        begun = time.perf_counter()
        fit = fit_relaxed(bound, IPDA())
        times.append(time.perf_counter() - begun)
    seconds = float(np.median(times))
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps({"seconds": seconds, "bytes": 1024 * (after - before),
                      "intervals": fit.grid.n_intervals, "theta": fit.theta.tolist()}))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], int(sys.argv[3]))
    else:
        main(tuple(map(int, sys.argv[1:])) or SIZES)
