"""Eq. (5) checked term by term: pykan's loss against the objective of iPDA.

Usage: python benchmarks/report_equivalence.py FOLDER

Writes FOLDER/equivalence.md and FOLDER/equivalence.png; the same as `pikanid equivalence --report`
and the settings at the end.
"""

from __future__ import annotations

import sys
import time

from provenance import provenance

from pikanid.storage.outputs import atomically
from pikanid.validation.equivalence import run_checks

SEED = 0


def main(folder: str) -> None:
    """Run every check and write the page, atomically."""
    begun = time.perf_counter()
    page = run_checks(seed=SEED, progress=lambda part: print(part, flush=True)).write(folder)
    settings = (
        "\n## Settings\n\n"
        "Written by `benchmarks/report_equivalence.py`. Two derivations that share no formula: the "
        "loss of a pykan KAN with w_b = 0 by its own forward pass and torch's autograd, and "
        "Eq. (5) from SciPy's design matrices with derivatives by hand, both in float64. T is the "
        "horizon [s], N data, M collocation points (both ends included; \"random\" grids are "
        "uniformly drawn), k the degree, G the grid. Every setting has random coefficients, "
        f"parameters and noise of its own, from seed {SEED}. {provenance()}. The checks took "
        f"{time.perf_counter() - begun:.0f} s.\n")
    atomically(page, (page.read_text() + settings).encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
