"""Physics-informed parameter identification: a recording in, parameters out.

Everything a user needs is reachable from here; names are imported when they are first used
(PEP 562), so that ``import pikanid`` costs milliseconds and pulls in no heavy library.

>>> import pikanid as pk
>>> "Model" in dir(pk)
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from pikanid.version import __version__

if TYPE_CHECKING:
    from pikanid import datasets, excitation, symbolic, systems, uncertainty
    from pikanid.discrepancy import kan_discrepancy
    from pikanid.estimate import Estimate
    from pikanid.mismatch import Diagnosis, diagnose
    from pikanid.mismatch.confusable import confusable
    from pikanid.mismatch.experiments import d_optimal, next_experiment
    from pikanid.model import Input, Model, Output, Parameter, State
    from pikanid.recording import Channel, Recording
    from pikanid.simulation import simulate
    from pikanid.strategies import IPDA, NLS, PDA, PIKAN, PINN


# Name -> the module that defines it; None where the name is itself a module of the package.
_HOMES: dict[str, str | None] = {
    "Model": "pikanid.model",
    "State": "pikanid.model",
    "Input": "pikanid.model",
    "Parameter": "pikanid.model",
    "Output": "pikanid.model",
    "Recording": "pikanid.recording",
    "Channel": "pikanid.recording",
    "Estimate": "pikanid.estimate",
    "NLS": "pikanid.strategies",
    "PDA": "pikanid.strategies",
    "IPDA": "pikanid.strategies",
    "PINN": "pikanid.strategies",
    "PIKAN": "pikanid.strategies",
    "kan_discrepancy": "pikanid.discrepancy",
    "diagnose": "pikanid.mismatch",
    "Diagnosis": "pikanid.mismatch",
    "confusable": "pikanid.mismatch.confusable",
    "next_experiment": "pikanid.mismatch.experiments",
    "d_optimal": "pikanid.mismatch.experiments",
    "simulate": "pikanid.simulation",
    "symbolic": None,
    "systems": None,
    "excitation": None,
    "uncertainty": None,
    "datasets": None,
}

__all__ = [
    "Model",
    "State",
    "Input",
    "Parameter",
    "Output",
    "Recording",
    "Channel",
    "Estimate",
    "NLS",
    "PDA",
    "IPDA",
    "PINN",
    "PIKAN",
    "kan_discrepancy",
    "diagnose",
    "Diagnosis",
    "confusable",
    "next_experiment",
    "d_optimal",
    "simulate",
    "symbolic",
    "systems",
    "excitation",
    "uncertainty",
    "datasets",
    "__version__",
]


def __getattr__(name: str) -> object:
    """Import a public name on first use.

    Raises:
        AttributeError: If the package has no public name ``name``.
    """
    if name not in _HOMES:
        raise AttributeError(f"module 'pikanid' has no attribute {name!r}")
    home = _HOMES[name]
    found = getattr(import_module(home), name) if home else import_module(f"pikanid.{name}")
    globals()[name] = found  # the next access no longer comes through here
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
