"""Results as JSON that every parser reads: no NaN, no infinity, no NumPy types.

One strategy gives one object, `Estimate.to_dict`, and the names of the recordings.  Several give

    {"schema_version": 1, "model": ..., "recordings": [...], "version": ..., "seconds": ...,
     "estimates": [one object a strategy that could be used],
     "failed": [{"strategy": ..., "reason": one sentence}]}
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pikanid.estimate import Estimate

SCHEMA = 1  # definition: of the format that files name


def plain(value: Any) -> Any:
    """The same content in JSON's own types; what is not a finite number becomes null.

    >>> plain({"a": np.float64("nan"), "b": (np.int64(1), np.array([1.0, np.inf]))})
    {'a': None, 'b': [1, [1.0, None]]}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def text(content: Any) -> str:
    """Strict JSON text, ending in a newline.

    >>> text({"std": float("inf")})
    '{\\n  "std": null\\n}\\n'
    """
    return json.dumps(plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def of_one(estimate: Estimate, recordings: Sequence[str]) -> dict[str, Any]:
    """What `pikanid identify --json` writes for one strategy."""
    return {**estimate.to_dict(), "recordings": list(recordings)}


def of_several(estimates: Sequence[Estimate], failed: Mapping[str, str], model: str,
               recordings: Sequence[str], version: str, seconds: float) -> dict[str, Any]:
    """What `pikanid identify --strategy all --json` writes."""
    return {
        "schema_version": SCHEMA,
        "model": model,
        "recordings": list(recordings),
        "estimates": [estimate.to_dict() for estimate in estimates],
        "failed": [{"strategy": name, "reason": why} for name, why in failed.items()],
        "version": version,
        "seconds": seconds,
    }
