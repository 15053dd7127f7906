"""`extract`: whatever holds a network, as a formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pikanid.symbolic.library import LIBRARY, Form
from pikanid.symbolic.network import read_network
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.reading import Reading


def extract(source: Any, x: Array | None = None, y: Array | None = None, *,
            inputs: Sequence[str] | None = None, library: Sequence[Form] = LIBRARY,
            alpha: float = 0.01) -> Reading:
    return read_network(source, x, y, inputs=inputs, library=library, alpha=alpha)
