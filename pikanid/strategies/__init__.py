"""The identification strategies: one method a file, one result type.

NLS shoots (Eq. 1); PDA, iPDA, PINN and PIKAN relax the ODE (Eq. 2, Table I).  The package, the
command line and the study read the list below.  Classes are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pikanid.strategies.ipda import IPDA
    from pikanid.strategies.nls import NLS
    from pikanid.strategies.pda import PDA
    from pikanid.strategies.pikan import PIKAN
    from pikanid.strategies.pinn import PINN
    from pikanid.strategies.strategy import Strategy

# in the order of the paper's tables
__all__ = [
    "NLS",
    "PDA",
    "IPDA",
    "PINN",
    "PIKAN",
]

# name on the command line, which is that of the file -> class
STRATEGIES = {name.lower(): name for name in __all__}


def strategy_class(name: str) -> type[Strategy]:
    """The class of a strategy by its short name.

    >>> strategy_class("nls").__name__
    'NLS'
    """
    return __getattr__(STRATEGIES[name])


def __getattr__(name: str) -> type[Strategy]:
    if name not in __all__:
        raise AttributeError(f"module 'pikanid.strategies' has no attribute {name!r}")
    found: type[Strategy] = getattr(import_module(f"pikanid.strategies.{name.lower()}"), name)
    return found
