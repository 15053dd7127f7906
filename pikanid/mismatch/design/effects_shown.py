"""What users' own effects would do in an experiment, and whether their derivatives are right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pikanid import errors
from pikanid.figures import COLOURS, DPI, new_figure
from pikanid.mismatch.catalogue.between import Motion
from pikanid.mismatch.catalogue.bound_effects import bound_to
from pikanid.mismatch.catalogue.candidate import Array
from pikanid.mismatch.catalogue.sites import sites
from pikanid.model import Effect, Model
from pikanid.model.domains import candidates_of
from pikanid.model.rates import in_rates
from pikanid.problem.arguments import a_model, one_recording
from pikanid.problem.problem import bind
from pikanid.recording import Recording
from pikanid.simulation import simulate
from pikanid.simulation.simulator import Simulator

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARE = 1e-3  # numerical: of the size, by which it is moved for a difference
PANEL = (6.0, 2.4)  # layout: width and height [inch] of one output with one effect
TIGHT = {"borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.2}  # layout: of a legend
LEGEND = 20.0  # layout: points that a legend takes between axes and their title
ROUNDING = 1e-10  # numerical: of an output, below which it has not moved


@dataclass(frozen=True, eq=False)
class ShownEffect:
    """What one effect does in an experiment.

    Attributes:
        effect: As described.
        size: At which it is shown: its guess, or a step from no effect.
        without, with_it: By output, values (N,) at the output's times.
        times: By output (N,) [s].
        failure: Why the model with the effect cannot be simulated at that size, if it cannot.
        derivative: Relative difference of the derivative by the size at no effect, as it is
            integrated with the model and as a simulation on the side of the effect shows it; NaN
            where nothing reaches an output.
    """

    effect: Effect
    size: float
    times: Mapping[str, Array]
    without: Mapping[str, Array]
    with_it: Mapping[str, Array]
    derivative: float
    failure: str = ""

    @property
    def largest(self) -> dict[str, float]:
        """By output, the largest difference that it makes."""
        return {o: float(np.abs(self.with_it[o] - y).max(initial=0.0))
                for o, y in self.without.items()}


def effects_shown(model: Model, excitation: Recording) -> tuple[ShownEffect, ...]:
    """Simulate each effect that a model lists, takes from a catalogue, or has between coordinates,
    at its guess and without.

    Args:
        model: With effects (`Model.with_candidates`, or ``[effects]`` in its file) or a domain.
        excitation: The experiment.

    Raises:
        BadModel: An effect does not suit the model.
        SimulationFailed: The model cannot be simulated.

    >>> import pikanid as pk
    >>> drag = pk.Effect("drag", "drag", (pk.Parameter("c2", 0.1, "1/rad"),), ("c2", 0.0),
    ...                  add={"theta_dot": "-c2*theta_dot*abs(theta_dot)"})
    >>> model = pk.systems.sloshing().with_candidates(drag)
    >>> shown = effects_shown(model, pk.excitation.two_pulse())
    >>> shown[0].derivative < 0.01
    True
    """
    model, _ = in_rates(a_model(model))
    effects, model = candidates_of(model), model.replace(effects=())
    drive = one_recording(excitation)
    nominal = simulate(model, drive)
    own = bound_to(effects, sites(model, (nominal,)), [nominal], lambda: _motion(model, nominal))
    return tuple(_shown(model, e, drive, nominal) for e in own)


def _motion(model: Model, recording: Recording) -> Motion:
    p = np.array([*model.values.values()])
    states = Simulator(model, bind(model, recording)).run(p, states=True).states
    return dict(zip(model.state_names, states.T, strict=True))


def _shown(model: Model, effect: Effect, drive: Recording, nominal: Recording) -> ShownEffect:
    size, start = effect.size, effect.start
    extended = model.with_effect(effect)
    try:
        there = simulate(extended.with_values({size.name: start}), drive)
        derivative = _derivative(extended, size.name, size.value, start, nominal)
    except errors.SimulationFailed as failure:
        return ShownEffect(effect, start, {}, {}, {}, float("nan"), str(failure))
    names = model.output_names
    return ShownEffect(effect, start, {o: nominal[o].time for o in names},
                       {o: nominal[o].values for o in names}, {o: there[o].values for o in names},
                       derivative)


def _derivative(extended: Model, name: str, null: float, guess: float, recording: Recording
                ) -> float:
    """Relative difference of two derivatives by a parameter at `null`."""
    simulator = Simulator(extended, bind(extended, recording))
    k = extended.parameter_names.index(name)
    p = np.array([extended.values[n] for n in extended.parameter_names])
    step = SHARE * (abs(guess - null) or 1.0)
    moved = [np.where(np.arange(len(p)) == k, null + s * step, p) for s in (0.0, 1.0, 2.0)]
    steps = simulator.choose_steps(moved[0])
    own = simulator.run(moved[0], np.array([k]), steps).sensitivity[:, 0]
    # one side only: beyond no effect some formulas mean nothing
    y = [simulator.run(at, steps=steps).y for at in moved]
    wanted = (4 * y[1] - 3 * y[0] - y[2]) / (2 * step)
    if np.abs(y[2] - y[0]).max(initial=0.0) <= ROUNDING * np.abs(y[0]).max(initial=0.0):
        return float("nan")
    return float(np.abs(own - wanted).max() / np.abs(wanted).max())


def effects_figure(effects: Sequence[ShownEffect], model: Model) -> Figure:
    """Each output without and with each effect that can be simulated: effects below each other,
    outputs beside.
    """
    shown = [one for one in effects if not one.failure]
    outputs = [model.output(o) for o in model.output_names]
    width, height = PANEL
    figure = new_figure(width * len(outputs), height * len(shown), dpi=DPI)
    axes = figure.subplots(len(shown), len(outputs), sharex=True, squeeze=False)
    for row, one in zip(axes, shown, strict=True):
        size = one.effect.size
        for axis, o in zip(row, outputs, strict=True):
            axis.plot(one.times[o.name], one.without[o.name], color="0.5", linewidth=1.0,
                      label="without")
            unit = f" {size.unit}" if size.unit else ""
            axis.plot(one.times[o.name], one.with_it[o.name], color=COLOURS[1], linewidth=1.0,
                      label=f"{size.name} = {one.size:.3g}{unit}")
            axis.set_ylabel(f"{o.name} [{o.unit}]" if o.unit else o.name)
            axis.set_title(one.effect.name, loc="left", fontsize="medium", pad=LEGEND)
            # above the axes, where no offset of the ticks stands: within, it would cover a curve
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize="small", ncols=2,
                        frameon=False, **TIGHT)
    for axis in axes[-1]:
        axis.set_xlabel("t [s]")
    return figure
