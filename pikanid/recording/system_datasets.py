"""Real recordings of systems that are no single oscillator, for the ready-made models of them."""

from __future__ import annotations

import io
from typing import Literal

import numpy as np

from pikanid.recording import fetched, origins
from pikanid.recording.origins import Origin
from pikanid.recording.recording import Recording

_TANKS_INTERVAL = 4.0  # definition: [s], of the benchmark
_TANKS_PARTS = {"train": (0, 2), "held_out": (1, 3)}  # definition: columns of input and output
_QUARTER, _HOUR, _DAY, _YEAR = 900.0, 3600.0, 86400.0, 31557600.0  # definition: seconds of each
_FIRST_DAYS = 4143  # definition: quarters of an hour of a building that are for fitting


def cascaded_tanks(part: Literal["train", "held_out"] = "train") -> Recording:
    """Two tanks above each other and a pump, which run over at times; 1024 samples, one in 4 s.

    Channels: ``u`` [V], the pump, held from sample to sample, and ``h`` [V], the sensor of the
    lower level, which is clipped at 10 V.  Both parts begin in the same unknown state.
    M. Schoukens and J. P. Noël, Three benchmarks addressing open challenges in nonlinear system
    identification, IFAC-PapersOnLine 50-1 (2017).

    Args:
        part: Of the benchmark's split.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    origins.check_known("part", part, tuple(_TANKS_PARTS))
    columns = np.loadtxt(io.BytesIO(fetched.content(origins.CASCADED_TANKS)), delimiter=",",
                         skiprows=1, usecols=_TANKS_PARTS[part])
    return Recording.from_arrays(
        _TANKS_INTERVAL * np.arange(len(columns)), {"u": columns[:, 0], "h": columns[:, 1]},
        {"u": "V", "h": "V"}, hold={"u": "zero"}, name=f"cascaded tanks, {part.replace('_', ' ')}")


def double_pendulum(part: Literal["train", "held_out", "held_out_2"] = "train") -> Recording:
    """An arm of two links with a motor in each joint, 10 s at 500 Hz.

    Channels: ``q1`` and ``q2`` [rad], the encoders, 0 where the arm hangs and q2 relative to the
    first link, and ``tau1`` and ``tau2`` [N m], the torques as measured, held from sample to
    sample.  F. Wiebe et al., Open source dual-purpose acrobot and pendubot platform, IEEE Robotics
    and Automation Magazine 31 (2024).

    Args:
        part: One of three runs with other torques.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    origins.check_known("part", part, tuple(origins.DOUBLE_PENDULUM))
    names = {"tau_meas1": "tau1", "tau_meas2": "tau2", "pos_meas1": "q1", "pos_meas2": "q2"}
    columns = _columns(origins.DOUBLE_PENDULUM[part])
    return Recording.from_arrays(
        columns["time"], {own: columns[name] for name, own in names.items()},
        {"tau1": "N*m", "tau2": "N*m", "q1": "rad", "q2": "rad"},
        hold={"tau1": "zero", "tau2": "zero"},
        name=f"double pendulum, {part.replace('_', ' ')}")


def building(part: Literal["train", "held_out"] = "train") -> Recording:
    """A heated building in winter, 72 days at 15 minutes; the first 43 days are for fitting.

    Channels: ``T`` and ``T_a`` [degC], of the room and outdoors, ``P``, heating, and ``I``, sun,
    both without a unit of their own.  J. Leprince et al., Fifty shades of grey: automated
    stochastic model identification of building heat dynamics, Energy and Buildings (2022).

    Args:
        part: Earlier or later days.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    origins.check_known("part", part, ("train", "held_out"))
    columns = np.loadtxt(io.BytesIO(fetched.content(origins.BUILDING)), delimiter=";", skiprows=1,
                         usecols=(2, 3, 4, 5))
    own = columns[:_FIRST_DAYS] if part == "train" else columns[_FIRST_DAYS:]
    return Recording.from_arrays(
        _QUARTER * np.arange(len(own)),
        {"I": own[:, 0], "T_a": own[:, 1], "P": own[:, 3], "T": own[:, 2]},
        {"T_a": "degC", "T": "degC"}, hold={"I": "zero", "T_a": "zero", "P": "zero"},
        name=f"building, {part.replace('_', ' ')}")


def theophylline() -> tuple[Recording, ...]:
    """Twelve subjects who swallowed theophylline, 11 samples of blood each over a day.

    Channels: ``c`` [mg/l], of which samples at 0 h are mostly of an earlier dose, and ``dose``
    [mg/kg], the same at all times.  R. Upton, in A. Boeckmann, L. Sheiner and S. Beal, NONMEM users
    guide, part V (1994).

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    columns = _columns(origins.THEOPHYLLINE)

    def subject(number: float) -> Recording:
        own = columns[columns["Subject"] == number]
        return Recording.from_arrays(
            _HOUR * own["Time"], {"dose": own["Dose"], "c": own["conc"]},
            {"dose": "mg/kg", "c": "mg/l"}, hold={"dose": "zero"},
            name=f"theophylline, subject {number:.0f}")

    return tuple(map(subject, np.unique(columns["Subject"])))


def lynx_hare() -> Recording:
    """Thousands of pelts of hares (``prey``) and lynxes (``predators``) a year, 1900 to 1920.

    P. Howard, Modeling basics, Texas A&M University (2009), of the Hudson's Bay Company's books.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    rows = np.loadtxt(io.BytesIO(fetched.content(origins.LYNX_HARE)), delimiter=",", skiprows=3)
    return Recording.from_arrays(_YEAR * (rows[:, 0] - rows[0, 0]),
                                 {"prey": rows[:, 2], "predators": rows[:, 1]}, name="hudson bay")


def boarding_school() -> Recording:
    """Boys in bed (``I``) in each of 14 days of influenza in a boarding school of 763 boys.

    Influenza in a boarding school, British Medical Journal 1 (1978) 587.

    Raises:
        DatasetUnavailable: If the file is neither at hand nor to be had.
    """
    rows = np.loadtxt(io.BytesIO(fetched.content(origins.BOARDING_SCHOOL)), skiprows=1)
    return Recording.from_arrays(_DAY * (rows[:, 0] - rows[0, 0]), {"I": rows[:, 1]},
                                 name="boarding school")


def _columns(origin: Origin) -> np.ndarray:
    """Of a table with a header, by name."""
    return np.genfromtxt(io.BytesIO(fetched.content(origin)), delimiter=",", names=True)
