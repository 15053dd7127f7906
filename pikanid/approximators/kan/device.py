"""Where a pykan model lives: its own forward pass runs there; ours is NumPy, on the CPU."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pikanid import errors
from pikanid.approximators.kan.quiet import pykan_module


def check_device(device: str) -> None:
    """Refuse a device that torch does not know or that is not there.

    Raises:
        BadSetting: If it is neither the CPU nor a CUDA device that is present.

    >>> check_device("cpu")
    """
    pykan_module()
    torch = import_module("torch")
    try:
        wanted = torch.device(device)
    except (RuntimeError, TypeError) as fault:
        raise errors.BadSetting(errors.kan_device(device, "unknown")) from fault
    if wanted.type == "cpu":
        return
    if wanted.type != "cuda":
        raise errors.BadSetting(errors.kan_device(device, "only 'cpu' and 'cuda' can"))
    count = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if (wanted.index or 0) >= count:
        raise errors.BadSetting(errors.kan_device(device, f"{count} CUDA devices are present"))


def move(kan: Any, device: str) -> None:
    """Put a pykan model on a device, with the inputs that it saw last.

    Raises:
        BadSetting: If the device is not there.
    """
    check_device(device)
    kan.to(device)
    if kan.cache_data is not None:
        kan.cache_data = kan.cache_data.to(device)
