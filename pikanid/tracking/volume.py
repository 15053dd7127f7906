"""The liquid keeps its volume: a surface whose mean height jumps is something else's edge.

What covers a part of the tank, or drops above the surface, may have edges as sharp as the liquid's
own.  Through them the mean height changes; that of an incompressible liquid between two walls does
not, however it moves.  Seen by a camera that is not quite straight, it depends a little on the
slope, smoothly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pikanid.tracking.settings import TrackingSettings
from pikanid.tracking.surface import MAD, failed
from pikanid.tracking.tracked import Seen

Array = NDArray[np.float64]
CHANGED = "covered or a splash: the liquid below it has not the volume of the other pictures"
FEWEST = 20  # numerical: pictures below which none is unlike the others
ROUNDS = 20  # numerical: of reweighting


def without_changes(seen: Sequence[Seen], width: float, settings: TrackingSettings
                    ) -> tuple[Seen, ...]:
    """Pictures whose surface lies higher or lower than its slope lets expect have none.

    Args:
        seen: The pictures.
        width: Between the walls, in the unit of the surface's level.
        settings: How large a change counts.
    """
    theta, level = (np.array([getattr(s.surface, name) for s in seen])
                    for name in ("theta", "level"))
    there = np.flatnonzero(np.isfinite(theta))
    if len(there) < FEWEST:
        return tuple(seen)
    away = departures(np.tan(theta[there]), level[there])
    scatter = MAD * float(np.median(np.abs(away)))
    most = max(settings.volume * width, settings.jump * scatter)
    changed = set(there[np.abs(away) > most].tolist())
    return tuple(replace(s, surface=failed(CHANGED)) if k in changed else s
                 for k, s in enumerate(seen))


def departures(slope: Array, level: Array) -> Array:
    """Levels (n,) less what a parabola over the slope explains, by least absolute deviations.

    >>> slope = np.linspace(-0.5, 0.5, 41)
    >>> level = 100 + 2 * slope + slope**2
    >>> level[30:36] += 5
    >>> departures(slope, level)[[30, 40]].round().tolist()
    [5.0, 0.0]
    """
    # among departures whose slope is wrong, too, steep ones must not have the say
    bounded = np.clip(slope, *np.quantile(slope, [0.05, 0.95]))
    design = np.column_stack([np.ones_like(bounded), bounded, bounded**2])
    away = level - np.median(level)
    least = max(1e-9 * float(np.ptp(level)), 1e-12)
    for _ in range(ROUNDS):
        root = 1 / np.sqrt(np.maximum(np.abs(away), least))
        away = level - design @ np.linalg.lstsq(design * root[:, None], level * root)[0]
    return np.asarray(away)
