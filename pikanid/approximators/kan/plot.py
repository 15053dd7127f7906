"""pykan's diagram of a model, drawn without traces."""

from __future__ import annotations

import tempfile
from typing import TYPE_CHECKING, Any

import numpy as np

from pikanid.approximators.kan.plan import Array
from pikanid.approximators.kan.quiet import pykan_module, undisturbed

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(kan: Any, x: Array | None = None, **options: Any) -> Figure:
    """The diagram of a pykan model: every edge with its function.

    pykan writes one picture an edge into ./figures and leaves its figure open in pyplot; here the
    pictures go to a folder that is gone afterwards, and the figure belongs to the caller alone.

    Args:
        kan: A pykan model.
        x: Inputs (M, inputs) over which edges are drawn; those seen last unless given.
        options: Passed to pykan's `plot`: beta, scale, tick, in_vars, out_vars, title, ...
    """
    import matplotlib.pyplot as plt
    import torch

    options.pop("folder", None)
    # pykan's own method, whether the model is pykan's or the one that calls this function.
    draw = pykan_module().MultKAN.plot
    current = plt.gcf() if plt.get_fignums() else None
    with (
        undisturbed(double=True),
        plt.rc_context(),
        tempfile.TemporaryDirectory() as folder,
        torch.no_grad(),
    ):
        batch = kan.cache_data if x is None else torch.from_numpy(np.array(x, float))
        kan(batch.reshape(len(batch), -1))
        draw(kan, folder=folder, **options)
        figure = plt.gcf()
        plt.close(figure)
    if current is not None:
        plt.figure(current.number)
    return figure
