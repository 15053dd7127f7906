"""In which part of the state, and when, a law acts: where its force along the fitted motion is not
zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pikanid.mismatch.catalogue.candidate import Candidate
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.settings.settings import Settings
from pikanid.model import Model
from pikanid.problem.evaluated import paths
from pikanid.simulation.input_paths import combined
from pikanid.simulation.vectorfield import VectorField

ROUNDING = 1e-9  # numerical: of the largest force: less is a zero that was computed
NEIGHBOURS = 1.5  # numerical: intervals between samples, above which two are no neighbours
MOST = 2  # limit: intervals of one state


@dataclass(frozen=True)
class Interval:
    """Values of a state or an input in which something acts; its ends are those of the motion where
    no other are known.
    """

    state: str
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}".rstrip()
        return f"{self.state} from {self.low:.3g} to {self.high:.3g}{unit}"


@dataclass(frozen=True, eq=False)
class Course:
    """A law's force along the first recording's fitted motion.

    Attributes:
        t: (N,) times [s].
        acts: (N,) whether it is not zero.
        values: States and inputs (N,) by name.
    """

    t: np.ndarray
    acts: np.ndarray
    values: Mapping[str, np.ndarray]

    def intervals(self, site: Site, idle: float) -> tuple[Interval, ...]:
        """Values of one state or input outside of which the law is zero.

        Args:
            site: Coordinate.
            idle: Share of the visited range, and of the samples, in which it must be zero.

        Returns:
            The intervals; none where it acts always, or no single argument decides.
        """
        best: tuple[Interval, ...] = ()
        purest = 1 - idle
        for name, values in self.values.items():
            found = _active(values, self.acts, idle)
            held = np.any([(values >= a) & (values <= b) for a, b in found], axis=0) if (
                found) else np.zeros(len(values), bool)
            if not held.any() or len(found) > MOST or held.mean() > 1 - idle:
                continue
            if (pure := float(self.acts[held].mean())) > purest:
                purest, best = pure, _named(site, name, found)
        return best

    def windows(self, gap: float) -> tuple[tuple[float, float], ...]:
        """Seconds in which the law acts; what lies less than a gap [s] apart is one, and so are
        neighbouring samples.
        """
        at, between = self.t[self.acts], float(np.median(np.diff(self.t)))
        cuts = np.flatnonzero(np.diff(at) > max(gap, NEIGHBOURS * between)) + 1
        return tuple((round(float(part[0]), 3), round(float(part[-1]), 3))
                     for part in np.split(at, cuts) if len(part))


def course(best: Hypothesis, nominal: Model, effect: Candidate) -> Course | None:
    """What an effect does along the fitted motion.

    Args:
        best: Fit of the nominal model with this effect, and perhaps others.
        nominal: That model.
        effect: One of its effects.

    Returns:
        Its course; None of an effect that is no force of the instant: one with memory, a delay, or
        one of what is seen.
    """
    alone = effect.applied(nominal)
    if (alone.states, alone.inputs, alone.outputs) != (
            nominal.states, nominal.inputs, nominal.outputs):
        return None
    whitened, values = best.whitened, best.values
    simulator = whitened.simulators[0]
    p = whitened.problem.parameters(best.minimum.theta, 0)
    grid = simulator.grid(p)
    acting = combined(simulator.model, grid.U, paths(simulator.model, p))
    u = acting[:, [simulator.model.input_names.index(n) for n in nominal.input_names]]
    states = whitened.responses(best.minimum.theta, states=True)[0].states
    x = states[:, [best.model.state_names.index(n) for n in nominal.state_names]]
    with_it, without = (
        VectorField(m).rhs(grid.T, x, u, np.array(
            [values.get(name, m.values[name]) for name in m.parameter_names]))
        for m in (alone, nominal))
    force = np.abs(with_it - without)[:, nominal.state_names.index(effect.site.v)]
    seen = {*effect.site.moving, *effect.site.inputs}
    return Course(grid.T, force > ROUNDING * max(float(force.max(initial=0.0)), 1e-300), {
        name: column for name, column in zip(
            (*nominal.state_names, *nominal.input_names), (*x.T, *u.T), strict=True)
        if name in seen})


def regions_of_laws(courses: Sequence[Course | None], site: Site, settings: Settings
                    ) -> tuple[Interval, ...]:
    """Intervals of every law that acts in a part of what was visited only."""
    return tuple(interval for one in courses if one is not None and one.acts.any()
                 for interval in one.intervals(site, settings.beyond.idle))


def _named(site: Site, argument: str, ends: Sequence[tuple[float, float]]) -> tuple[Interval, ...]:
    units = {**{s.name: s.unit for s in site.model.states},
             **{i.name: i.unit for i in site.model.inputs}}
    return tuple(Interval(argument, a, b, units[argument]) for a, b in ends)


def _active(values: np.ndarray, acts: np.ndarray, idle: float) -> list[tuple[float, float]]:
    """Intervals of values (N,) in which samples act, without gaps below a share of the range.

    Ends lie half way to the next sample that does not act.
    """
    order = np.argsort(values, kind="stable")
    x, on = values[order], acts[order]
    turns = np.flatnonzero(np.diff(np.r_[False, on, False]))
    found: list[tuple[float, float]] = []
    for first, last in turns.reshape(-1, 2):
        a = 0.5 * (x[first] + x[first - 1]) if first else x[0]
        b = 0.5 * (x[last] + x[last - 1]) if last < len(x) else x[-1]
        if found and a - found[-1][1] < idle * (x[-1] - x[0]):
            found[-1] = (found[-1][0], float(b))
        else:
            found.append((float(a), float(b)))
    return found
