"""Benchmarks compute nothing in parallel: one thread, so that ratios mean something."""

from __future__ import annotations

import os

import pytest

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


@pytest.fixture(scope="session", autouse=True)
def models_from_tapes() -> None:
    """In place of the fixture that spares tests the compiling: models run as users run them."""
