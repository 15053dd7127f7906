"""How far a designed experiment takes the outputs: nothing but its inputs is within bounds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from pikanid.pieces.sentences import enumerated
from pikanid.recording.channel import Array


def reached(responses: Iterable[Mapping[str, tuple[Array, Array]]]
            ) -> dict[str, tuple[float, float]]:
    """Least and largest value of each output, whichever hypothesis is true.

    Args:
        responses: Of each hypothesis: name of an output -> times (N,) [s] and values (N,).

    >>> t = np.arange(3.0)
    >>> reached([{"x": (t, t)}, {"x": (t, -5.0 * t)}])
    {'x': (-10.0, 2.0)}
    """
    found: dict[str, tuple[float, float]] = {}
    for outputs in responses:
        for name, (_, values) in outputs.items():
            low, high = found.get(name, (np.inf, -np.inf))
            found[name] = (float(min(low, values.min(initial=np.inf))),
                           float(max(high, values.max(initial=-np.inf))))
    return found


def reach_sentence(reach: Mapping[str, tuple[float, float]], units: Mapping[str, str]) -> str:
    """Where each output goes, in its unit.

    >>> reach_sentence({"x": (-10.0, 2.0), "n": (0.0, 1.0)}, {"x": "mm", "n": ""})
    'It takes x from -10 to 2 mm and n from 0 to 1.'
    """
    parts = [f"{name} from {low:.3g} to {high:.3g} {units.get(name, '')}".rstrip()
             for name, (low, high) in reach.items()]
    return f"It takes {enumerated(parts)}."
