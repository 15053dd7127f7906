"""The identification strategies: one method a file, one result type.

NLS shoots (Eq. 1); PDA, iPDA, PINN and PIKAN relax the ODE (Eq. 2, Table I).  Classes are imported
when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pikanid.strategies.ipda import IPDA
    from pikanid.strategies.nls import NLS
    from pikanid.strategies.pda import PDA
    from pikanid.strategies.pikan import PIKAN
    from pikanid.strategies.pinn import PINN

__all__ = ["IPDA", "NLS", "PDA", "PIKAN", "PINN", "STRATEGIES", "strategy"]

# name on the command line -> class; in the order of the paper's tables
STRATEGIES = {"nls": "NLS", "pda": "PDA", "ipda": "IPDA", "pinn": "PINN", "pikan": "PIKAN"}


def strategy(name: str) -> Any:
    """The class of a strategy by its short name.

    >>> strategy("nls").__name__
    'NLS'
    """
    return __getattr__(STRATEGIES[name])


def __getattr__(name: str) -> Any:
    for short, found in STRATEGIES.items():
        if found == name:
            return getattr(import_module(f"pikanid.strategies.{short}"), name)
    raise AttributeError(f"module 'pikanid.strategies' has no attribute {name!r}")
