"""When, and in which part of the state, hidden laws act: from the truth and the recorded inputs.

A law *acts in a regime* if it is exactly zero elsewhere: a wall is nothing before it is touched, a
disturbance nothing before it begins.  Laws without such an edge (viscous damping, a cubic spring, a
magnet whose force fades) act always, and a hard stop acts at instants only, which are no share of a
recording: neither has a window or a region.  What a law does at each instant is known from the
truth's parameters along the true motion, which is simulated once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pikanid.validation.concealed.arrays import Array
from pikanid.validation.concealed.effect import Effect
from pikanid.validation.concealed.effects import CATALOGUE, NEAR, OUTSIDE, UNFORESEEN
from pikanid.validation.concealed.experiment import Experiment
from pikanid.validation.concealed.rig import Rig
from pikanid.validation.concealed.simulate import motion

Mask = NDArray[np.bool_]
Spans = tuple[tuple[float, float], ...]
ANGLE, RATE, DRIVE = "theta", "theta_dot", "u_x"


@dataclass(frozen=True)
class Regime:
    """Where a law acts: an argument beyond `low`, below `high`, or outside of both if it does so
    `both_ways`.
    """

    argument: str
    low: float
    high: float
    both_ways: bool = False

    def holds(self, values: Array) -> Mask:
        """(N,) whether the law acts at values (N,) of the argument."""
        inside = (values > self.low) & (values < self.high)
        return ~inside if self.both_ways else inside


@dataclass(frozen=True, eq=False)
class Acting:
    """A law that acts in a regime, along the true motion of the train recording.

    Attributes:
        id: Of the law.
        channel: Where it acts.
        regime: Part of the state or input; None where time alone decides.
        mask: (N,) whether it acts at each sample.
        windows: Seconds in which it does.
    """

    id: str
    channel: str
    regime: Regime | None
    mask: Mask
    windows: Spans


@dataclass(frozen=True, eq=False)
class Truth:
    """The true motion and every hidden effect and law on it.

    Attributes:
        t: (N,) [s].
        motion: By name, angle [rad], rate [rad/s] and recorded input [m/s²] (N,).
        acting: Effects and laws that act in a regime.
        always: Ids of the others.
    """

    t: Array
    motion: Mapping[str, Array]
    acting: tuple[Acting, ...]
    always: tuple[str, ...]

    @property
    def windows(self) -> Spans | None:
        """Seconds in which anything acts; None where something acts always, or nothing hides."""
        if self.always or not self.acting:
            return None
        return spans(self.t, np.any([a.mask for a in self.acting], axis=0))


def truth_of(case: Mapping[str, Any], experiment: Experiment) -> Truth | None:
    """What acts when, in the train recording of a case.

    Args:
        case: Entry of a truth file that `answers.check_case` has passed.
        experiment: Inputs of its train recording.

    Returns:
        The truth; None of a tank, all of whose laws act always.

    Raises:
        SimulationFailed: If the motion does not stay finite.
    """
    entries = [*case["effects"], *case.get("remainder", ())]
    rig = Rig(length=case["base"]["l_theta"]["value"], damping=case["base"]["d_theta"]["value"])
    for entry in entries:
        effect = effect_of(entry)
        if effect is None:
            return None
        rig = effect.applied(rig, _values(entry))
    states = motion(rig, experiment, experiment.t)
    seen = {ANGLE: states[:, 0], RATE: states[:, 1], DRIVE: experiment.u_x}
    acting, always = [], []
    for entry in entries:
        found = _acting(entry, experiment.t, seen)
        if found is None:
            always.append(entry["id"])
        else:
            acting.append(found)
    return Truth(experiment.t, seen, tuple(acting), tuple(always))


def effect_of(entry: Mapping[str, Any]) -> Effect | None:
    """The effect that an entry of a truth file is one of; None of a liquid in a tank."""
    variant = entry.get("variant", "")
    return next((e for e in (*CATALOGUE, *NEAR, *OUTSIDE, *UNFORESEEN)
                 if e.id == entry["id"] and e.variant == variant), None)


def spans(t: Array, mask: Mask) -> Spans:
    """Seconds in which samples (N,) at rising times (N,) are true, half a sample to either side.

    >>> spans(np.arange(6.0), np.array([False, True, True, False, False, True]))
    ((0.5, 2.5), (4.5, 5.0))
    """
    edges = np.r_[t[0], 0.5 * (t[1:] + t[:-1]), t[-1]]
    turns = np.flatnonzero(np.diff(np.r_[False, mask, False]))
    return tuple((float(edges[a]), float(edges[b])) for a, b in turns.reshape(-1, 2))


def closed(windows: Spans, gap: float) -> Spans:
    """Windows with those that lie closer than a gap [s] joined.

    >>> closed(((0.0, 1.0), (1.2, 2.0), (5.0, 6.0)), 0.5)
    ((0.0, 2.0), (5.0, 6.0))
    """
    ordered = sorted(windows)
    found: list[tuple[float, float]] = ordered[:1]
    for (_, _), (start, stop) in pairwise(ordered):
        if start - found[-1][1] < gap:
            found[-1] = (found[-1][0], max(found[-1][1], stop))
        else:
            found.append((start, stop))
    return tuple(found)


def natural_period(case: Mapping[str, Any]) -> float:
    """Of the base rig [s]: 2π √(l/g)."""
    base = case["base"]
    return 2 * math.pi * math.sqrt(base["l_theta"]["value"] / base["g"]["value"])


REGIMES: Mapping[str, Callable[[Mapping[str, float]], Regime]] = {
    "wall_impact": lambda v: Regime(ANGLE, v["theta_wall"], math.inf),
    "cable_drag": lambda v: Regime(ANGLE, v["theta_c"], math.inf),
    "one_way_friction": lambda v: Regime(RATE, 0.0, math.inf),
    "input_saturation": lambda v: Regime(DRIVE, -v["limit"], v["limit"], both_ways=True),
    "sensor_saturation": lambda v: Regime(ANGLE, -v["limit"], v["limit"], both_ways=True),
}  # definition: of each law; friction one way acts beyond a rate of zero


def _acting(entry: Mapping[str, Any], t: Array, seen: Mapping[str, Array]) -> Acting | None:
    values = _values(entry)
    if entry["id"] == "disturbance":
        half = values["width"] / 2
        # the samples about a force that is shorter than the time between two hold it
        mask = np.abs(t - values["time"]) <= max(half, 0.5 * float(t[1] - t[0]))
        window = (max(values["time"] - half, float(t[0])), min(values["time"] + half, float(t[-1])))
        return Acting(entry["id"], entry["channel"], None, mask, (window,))
    make: Callable[[Mapping[str, float]], Regime] | None = REGIMES.get(entry["id"])
    if make is None:
        return None
    regime = make(values)
    mask = regime.holds(seen[regime.argument])
    return Acting(entry["id"], entry["channel"], regime, mask, spans(t, mask))


def _values(entry: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(number["value"]) for name, number in entry["parameters"].items()}


def experiment_of(rows: Sequence[Sequence[float]] | Array, kind: str = "") -> Experiment:
    """The inputs of a recording: columns (N, 4 or more) time, u_x, u_y and pitch, as in its file.

    >>> experiment_of([[0.0, 1.0, 0.0, 0.0, 0.1], [0.01, 0.5, 0.0, 0.0, 0.1]]).u_x
    array([1. , 0.5])
    """
    table = np.array(rows, dtype=float)
    return Experiment(kind, table[:, 0], table[:, 1], table[:, 2], table[:, 3], 0.0)
