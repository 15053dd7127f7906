"""Makes the excerpts of real recordings that the package ships, from the originals.

    python benchmarks/thin_recordings.py [FOLDER, by default pikanid/recording/data]

The same originals give the same bytes.  The pendulum's angle is thinned from 1 kHz to 100 Hz
without an anti-alias filter, because none is needed: the arm swings below 5 Hz, and all that lies
above the new Nyquist frequency is noise smaller than that of the encoder's step.  `above` measures
it, and the script stops where this should not be so.  A filter would do harm: the ripple in its
pass band changes the swing by more than that.  Of the falling balls the measured heights are kept,
unthinned; the authors' derivative, which can be had from them, is left out.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import signal

from pikanid.recording import datasets
from pikanid.storage.outputs import atomically

STRIDE = 10  # of the pendulum: 1 kHz recorded, 100 Hz kept
DIGITS = 6  # of the angle [rad] after the point: 1/160 of the encoder's step
STEP = 0.00016  # [rad] of the encoder
TRAINING = 36.667  # [s] the authors' training pieces end here


def pendulum() -> dict[str, str]:
    """File name -> CSV of the angle in the training pieces and in the held-out ones."""
    pieces = datasets.single_pendulum("all")
    t, theta = (np.concatenate([getattr(piece["theta"], what) for piece in pieces])
                for what in ("time", "values"))
    aliased = above(theta, 1.0 / (t[1] - t[0]), STRIDE)
    if aliased > STEP / np.sqrt(12.0):
        raise SystemExit(f"Thinning would fold {aliased:.1e} rad into the swing: filter first.")
    t, theta = t[::STRIDE], theta[::STRIDE]
    parts = {"train": t < TRAINING, "held_out": t > TRAINING}
    return {f"single_pendulum_{name}.csv": "t [s],theta [rad]\n" + "".join(
        f"{x:.2f},{y:.{DIGITS}f}\n" for x, y in zip(t[part], theta[part], strict=True))
        for name, part in parts.items()}


def above(values: np.ndarray, rate: float, stride: int) -> float:
    """RMS of what lies above the Nyquist frequency that is left after thinning."""
    frequency, density = signal.welch(values, rate, nperseg=8192)
    high = frequency > rate / (2 * stride)
    return float(np.sqrt(np.trapezoid(density[high], frequency[high])))


def falling(balls: Sequence[str]) -> dict[str, str]:
    """File name -> CSV of the heights of some balls in both drops."""
    rows = []
    for ball in balls:
        for drop in (1, 2):
            h = datasets.falling_balls(ball, drop)["h"]
            rows += [f"{ball},{drop},{float(x)!r},{float(y)!r}\n"
                     for x, y in zip(h.time, h.values, strict=True)]
    return {"falling_balls.csv": "ball,drop,t [s],h [m]\n" + "".join(rows)}


def excerpts(balls: Sequence[str] = datasets.BALLS) -> dict[str, str]:
    """File name -> content of every excerpt."""
    return pendulum() | falling(balls)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "pikanid/recording/data")
    for file, text in excerpts().items():
        atomically(target / file, text.encode())
        print(f"{target / file}: {len(text.encode())} bytes")
