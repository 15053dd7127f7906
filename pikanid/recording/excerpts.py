"""Excerpts of real recordings that come with the package: no network, no folder, no cache.

Both originals are under the MIT licence, whose texts lie beside the excerpts in ``data/``,
together with a README of their sources and of what was left out.  `pikanid.recording.datasets`
fetches the full recordings.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Literal

import numpy as np

from pikanid.recording import origins
from pikanid.recording.reading import csv as columns
from pikanid.recording.reading.table import Options
from pikanid.recording.recording import Recording

FOLDER = Path(__file__).parent / "data"
PLAIN = Options(delimiter=",", decimal=".")


def single_pendulum_excerpt(part: Literal["train", "held_out", "all"] = "train") -> Recording:
    """The angle of `single_pendulum` at 100 Hz, every tenth sample as recorded.

    Channel ``theta`` [rad], measured from hanging; 36.67 s of training, then 18.34 s held out.
    What lies above 50 Hz is noise smaller than that of the encoder's step, so that thinning needs
    no filter.  K. Kaheman et al., The Experimental Multi-Arm Pendulum on a Cart: A Benchmark System
    for Chaos, Learning, and Control, arXiv 2205.06231.

    Args:
        part: The training part, the held-out one, or both as one recording.

    Raises:
        BadSetting: If there is no such part.

    >>> single_pendulum_excerpt("held_out").start
    36.67
    """
    names = {"train": ("train",), "held_out": ("held_out",), "all": ("train", "held_out")}
    origins.check_known("part", part, tuple(names))
    tables = [columns.read((FOLDER / f"single_pendulum_{name}.csv").read_bytes(),
                           f"single_pendulum_{name}.csv", PLAIN) for name in names[part]]
    t, theta = (np.concatenate([table.columns[k].values for table in tables]) for k in (0, 1))
    return Recording.from_arrays(t, {"theta": theta}, {"theta": "rad"},
                                 name=f"single pendulum at 100 Hz, {part.replace('_', ' ')}")


def falling_balls_excerpt(ball: str = "Baseball", drop: Literal[1, 2] = 1) -> Recording:
    """The height of `falling_balls`, as filmed, without the authors' derivative.

    Channel ``h`` [m], 15 frames a second; the time of release is uncertain.  B. de Silva et al.,
    Discovery of Physics From Data: Universal Laws and Discrepancies, Front. Artif. Intell. 3, 2020.

    Args:
        ball: One of `pikanid.recording.datasets.BALLS`; case and blanks do not matter.
        drop: 1 or 2.

    Raises:
        BadSetting: If there is no such ball or drop.

    >>> falling_balls_excerpt("golf ball", drop=2).name
    'Golf Ball, drop 2'
    """
    name = origins.ball_named(ball)
    origins.check_known("drop", str(drop), ("1", "2"))
    with (FOLDER / "falling_balls.csv").open(encoding="utf-8", newline="") as file:
        rows = [row[2:] for row in csv.reader(file) if row[:2] == [name, str(drop)]]
    t, h = np.array(rows, dtype=float).T
    return Recording.from_arrays(t, {"h": h}, {"h": "m"}, name=f"{name}, drop {drop}")
