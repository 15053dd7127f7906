"""Benchmarks whose every round times the reference just before: machines change their speed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np


def in_turn(benchmark: Any, function: Callable[..., Any], arguments: tuple[Any, ...],
            reference: Callable[[], Any], rounds: int) -> Any:
    """What `function` returns; the median of its time over the reference's in the same round goes
    to the column "in turn".
    """
    taken: list[float] = []

    def before() -> tuple[tuple[Any, ...], dict[str, Any]]:
        begun = time.perf_counter()
        reference()
        taken.append(time.perf_counter() - begun)
        return arguments, {}

    found = benchmark.pedantic(function, setup=before, warmup_rounds=3, rounds=rounds)
    own = np.array(benchmark.stats.stats.data)
    benchmark.extra_info["in turn"] = f"{np.median(own / taken[-len(own):]):.3g}"
    return found
