"""Real recordings, fetched from their origin by commit and checked by SHA-256.

Excerpts of two of them come with the package: `single_pendulum_excerpt` and
`falling_balls_excerpt` need neither network nor folder.  Every other file is looked for in the
folder that the environment variable ``PIKANID_DATA`` names (which is never written to), then in the
user's cache folder, and then downloaded once.  Without any of these, `DatasetUnavailable` says what
is missing and how to get it.

The recordings belong to their authors: cite the papers named in the functions.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from pikanid.recording import alignment, fetched, kinematics, origins
from pikanid.recording.channel import Channel
from pikanid.recording.excerpts import falling_balls_excerpt, single_pendulum_excerpt
from pikanid.recording.fetched import FOLDER
from pikanid.recording.reading import csv, mat, spreadsheet
from pikanid.recording.reading.table import Options
from pikanid.recording.recording import Recording
from pikanid.recording.system_datasets import (
    boarding_school,
    building,
    cascaded_tanks,
    double_pendulum,
    lynx_hare,
    theophylline,
)

__all__ = [
    "BALLS", "FOLDER", "SLOSH_MOTIONS", "boarding_school", "building", "cascaded_tanks",
    "double_pendulum", "falling_balls", "falling_balls_excerpt", "lynx_hare", "silverbox",
    "single_pendulum", "single_pendulum_excerpt", "single_pendulum_free_swing", "slosh_lar",
    "slosh_lar_forced", "theophylline",
]

# Silverbox: 10^7/2^14 Hz, and the ranges (0-based, stop excluded) of the benchmark's official
# split; the held-out part is the last quarter of the first range.
_SILVERBOX_RATE = 1e7 / 2**14  # definition: [Hz], of the benchmark
_SILVERBOX_PARTS = {
    "train": (40650, 40650 + int(0.75 * (127400 - 40650))),
    "held_out": (40650 + int(0.75 * (127400 - 40650)), 127400),
    "arrow": (100, 40575),
    "arrow_no_extrapolation": (100, 32100),
    "all": (0, 131072),
}  # definition: official split of the benchmark

BALLS = origins.BALLS
SLOSH_MOTIONS = tuple(origins.SLOSH_CHECKSUMS)
_COMMANDED = 0.02  # numerical: [s] window of derivatives: a commanded pose has no noise


def single_pendulum(part: Literal["train", "held_out", "all"] = "train") -> tuple[Recording, ...]:
    """The free swing of one arm of a pendulum rig, in six pieces of 9.2 s that follow each other.

    Channels: ``theta`` [rad], measured from hanging, and ``theta_dot`` [rad/s], the authors'
    filtered derivative; every 1 ms.  K. Kaheman et al., The Experimental Multi-Arm Pendulum on a
    Cart: A Benchmark System for Chaos, Learning, and Control, arXiv 2205.06231.

    Args:
        part: The four training pieces, the two held-out ones, or all six.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    kinds = {"train": ("id",), "held_out": ("vad",), "all": ("id", "vad")}
    origins.check_known("part", part, tuple(kinds))
    origin = origins.SINGLE_PENDULUM
    arrays = mat.arrays(fetched.content(origin), origin.name)
    pieces = []
    for kind in kinds[part]:
        for k in range(1, (4 if kind == "id" else 2) + 1):
            theta, theta_dot = arrays[f"Y_{kind}.{k}"]
            pieces.append(
                Recording.from_arrays(
                    arrays[f"Time_{kind}.{k}"].ravel(),
                    {"theta": theta - np.pi, "theta_dot": theta_dot},
                    {"theta": "rad", "theta_dot": "rad/s"},
                    name=f"single pendulum, {'training' if kind == 'id' else 'held out'} {k}")
            )
    return tuple(pieces)


def single_pendulum_free_swing() -> Recording:
    """A small free swing (0.07 rad) of the same arm, to rest: dry friction shows at the end.

    Channel ``theta`` [rad] measured from hanging, every 0.1 ms from t = 60 s; the encoder's step
    is 0.00016 rad.  Source as for `single_pendulum`.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    origin = origins.FREE_SWING
    arrays = mat.arrays(fetched.content(origin), origin.name)
    return Recording.from_arrays(arrays["Theta1.time"].ravel(),
                                 {"theta": arrays["Theta1.signals.values"].ravel() - np.pi},
                                 {"theta": "rad"}, name="single pendulum, free swing")


def silverbox(
    part: Literal["train", "held_out", "arrow", "arrow_no_extrapolation", "all"] = "train",
) -> Recording:
    """An electronic oscillator with a cubic spring, at 610.35 Hz.

    Channels: ``u`` and ``y`` [V], both with an offset.  The input between samples runs closer to
    straight lines than to steps.  The first 50 samples of a test part may serve to find the
    initial state; results are RMS errors in mV.  T. Wigren and J. Schoukens, Three free data sets
    for development and benchmarking in nonlinear system identification, ECC 2013.

    Args:
        part: Of the benchmark's official split; time starts at 0 in each.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    origins.check_known("part", part, tuple(_SILVERBOX_PARTS))
    start, stop = _SILVERBOX_PARTS[part]
    origin = origins.SILVERBOX
    arrays = mat.arrays(fetched.content(origin), origin.name)
    return Recording.from_arrays(
        np.arange(stop - start) / _SILVERBOX_RATE,
        {"u": arrays["V1"].ravel()[start:stop], "y": arrays["V2"].ravel()[start:stop]},
        {"u": "V", "y": "V"}, name=f"Silverbox, {part.replace('_', ' ')}")


def falling_balls(ball: str = "Baseball", drop: Literal[1, 2] = 1) -> Recording:
    """A ball dropped from a bridge and filmed, 15 frames a second.

    Channels: ``h`` [m], height, and ``v`` [m/s], the authors' derivative.  The time of release is
    uncertain.  Drop 1 is for fitting, drop 2 for testing from its first 8 samples.  B. de Silva
    et al., Discovery of Physics From Data: Universal Laws and Discrepancies, Front. Artif.
    Intell. 3, 2020.

    Args:
        ball: One of `BALLS`; case and blanks do not matter.
        drop: 1 or 2.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    name = origins.ball_named(ball)
    origins.check_known("drop", str(drop), ("1", "2"))
    origin = origins.FALLING_BALLS
    # The workbook ends in .xls and is of the newer kind inside.
    rows, _ = spreadsheet.cells(fetched.content(origin), origin.name, name)
    table = np.array(rows[1:], dtype=float)
    t, h, v = table[table[:, 0] == drop, 1:4].T
    return Recording.from_arrays(t, {"h": h, "v": v}, {"h": "m", "v": "m/s"},
                                 name=f"{name}, drop {drop}")


def slosh_lar(name: str = "LE_2D_0m_5s_900deg") -> Recording:
    """Water in a cylinder (radius 49 mm, filling 78 mm) that a robot carries about.

    Channels: the commanded pose of the tool, ``x``, ``y``, ``z`` [m] and ``qx``, ``qy``, ``qz``,
    ``qw``, at 500 Hz with the first second idle; and ``h`` [mm], the height of the highest liquid
    point above rest, from two cameras at 59.94 Hz.  Video and motion are not synchronised: ``h``
    lags by an unknown 6 to 20 s that differs from run to run.  S. Di Leva et al.,
    Sloshing-Height Estimation for Liquid-Filled Containers Under Four-Dimensional Motions.

    Args:
        name: One of `SLOSH_MOTIONS`.

    Raises:
        DatasetUnavailable: If a file is neither at hand nor to be had.
    """
    origins.check_known("motion", name, SLOSH_MOTIONS)
    motion, heights = origins.slosh(name)
    table = csv.read(fetched.content(motion), motion.name, Options(delimiter=";", decimal="."))
    t, *pose = (column.values for column in table.columns)
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    arrays = mat.arrays(fetched.content(heights), heights.name)
    h = Channel("h", arrays["slosh_times"].ravel(), arrays["slosh_heights"].ravel(), "mm")
    carried = Recording.from_arrays(t, dict(zip(names, pose, strict=True)),
                                    {key: "m" for key in names[:3]},
                                    hold={key: "first" for key in names}, name=name)
    note = "The heights lag behind the motion by an unknown 6 to 20 s: estimate the delay."
    return replace(carried.with_channels(h), notes=(note,))


def slosh_lar_forced(name: str = "LE_2D_0m_5s_900deg") -> Recording:
    """A run of `slosh_lar` made ready for a model: accelerations, tilt, and heights on one clock.

    Channels: ``a_x``, ``a_y`` [m/s^2], the horizontal acceleration of the tool in fixed axes (the
    liquid hardly turns with a round vessel); ``tilt_x``, ``tilt_y`` [rad] about these axes;
    ``spin`` [rad/s] about the vertical; all at 500 Hz.  ``h`` [mm] while the tool moves: afterwards
    the cameras do not see the highest point any more.  The delay of the video comes from the
    energies of height, acceleration and tilt (`pikanid.recording.alignment.energy_delay`), with no
    model.

    Args:
        name: One of `SLOSH_MOTIONS`.

    Raises:
        DatasetUnavailable: If a file is neither at hand nor to be had.
    """
    raw = kinematics.attitude_angles(slosh_lar(name))
    raw = kinematics.with_acceleration(raw, {"a_x": "x", "a_y": "y"}, "savgol", _COMMANDED)
    turn = kinematics.derivative(raw["heading"], 1, "savgol", _COMMANDED)
    raw = raw.with_channels(replace(turn, name="spin"))
    late = alignment.energy_delay(raw, "h", (("a_x", "a_y"), ("tilt_x", "tilt_y")))
    begin, end = alignment.moving(raw, ("x", "y", "z", "tilt_x", "tilt_y", "heading"))
    kept = raw.without("x", "y", "z", *kinematics.QUATERNION, "heading").shift("h", -late)
    note = f"The heights lagged {late:.3f} s behind the motion, by the energies of both."
    return replace(kept.window(begin, end), notes=(note,))
