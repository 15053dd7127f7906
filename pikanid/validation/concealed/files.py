"""Recordings and truths to files, so that nothing but the numbers tells one from another.

Every recording of a set has the same header, length and number of digits.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.experiment import Experiment

HEADER = "t [s],u_x [m/s^2],u_y [m/s^2],pitch [rad],theta [rad]"


def csv(experiment: Experiment, theta: Array) -> bytes:
    """A recording; samples that are missing in theta (N,) leave an empty cell.

    >>> from pikanid.validation.concealed.excitations import two_pulse
    >>> csv(two_pulse(), np.full(501, 0.25)).splitlines()[21]
    b'0.20,+1.000000,+0.000000,+0.000000,+0.25000000'
    """
    rows = [HEADER]
    for t, x, y, pitch, angle in zip(experiment.t, experiment.u_x, experiment.u_y,
                                     experiment.pitch, theta, strict=True):
        cell = "" if np.isnan(angle) else f"{angle:+.8f}"
        rows.append(f"{t:.2f},{x:+.6f},{y:+.6f},{pitch:+.6f},{cell}")
    return ("\n".join(rows) + "\n").encode().replace(b"-0.000000,", b"+0.000000,")


def canonical(content: Mapping[str, object]) -> bytes:
    """JSON with one form for one content."""
    return (json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def same_times(paths: Sequence[Path]) -> None:
    """Give files one time stamp: how long a case took to make would tell what it hides."""
    if paths:
        newest = max(path.stat().st_mtime_ns for path in paths)
        for path in paths:
            os.utime(path, ns=(newest, newest))
