"""Torch parameters as NumPy arrays, and back."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from pikanid.approximators.kan.plan import Array


def read(parameter: Any) -> Array:
    """A torch parameter as a NumPy array of its own."""
    return np.array(parameter.detach().cpu().numpy(), dtype=float)


def write(parameter: Any, values: Array) -> None:
    """Put a NumPy array of the same shape into a torch parameter, in place."""
    parameter.data = tensor(values, parameter.device)


def tensor(values: Array, device: Any) -> Any:
    """A NumPy array as a torch tensor of its own, in float64."""
    torch = import_module("torch")
    return torch.from_numpy(np.array(values, dtype=float, order="C")).to(device)
