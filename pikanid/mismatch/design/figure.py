"""The figure of a next experiment: what to run, and what each hypothesis foretells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pikanid.figures import COLOURS, DASHES, DPI, new_figure
from pikanid.recording import Recording
from pikanid.recording.channel import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def design_figure(profile: Recording,
                  responses: Mapping[str, Mapping[str, tuple[Array, Array]]],
                  units: Mapping[str, str]) -> Figure:
    """Inputs above, the foretold outputs of every hypothesis below.

    Args:
        profile: Inputs, ready to run.
        responses: Name of a hypothesis -> its outputs under the profile: name -> (times, values).
        units: Of the outputs.
    """
    inputs = list(profile.channels.values())
    outputs = list(next(iter(responses.values())))
    rows = len(inputs) + len(outputs)
    figure = new_figure(8.0, 1.2 + 1.7 * rows, dpi=DPI)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for axis, channel in zip(axes, inputs, strict=False):
        axis.step(channel.time, channel.values, where="post", color="0.2", linewidth=1.0)
        axis.set_ylabel(f"{channel.name} [{channel.unit}]" if channel.unit else channel.name)
    for axis, output in zip(axes[len(inputs):], outputs, strict=True):
        for k, (name, response) in enumerate(responses.items()):
            axis.plot(*response[output], color=COLOURS[k % len(COLOURS)],
                      linestyle=DASHES[k % len(DASHES)], linewidth=1.0, label=name)
        axis.set_ylabel(f"{output} [{units[output]}]" if units[output] else output)
    axes[-1].set_xlabel("t [s]")
    axes[0].set_title(profile.name, fontsize="large")
    if len(responses) > 1:  # beside the axes: within, it would cover a curve
        handles, labels = axes[-1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=2,
                      frameon=False, fontsize="small")
    return figure
