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

from pikanid import strategies
from pikanid.storage.version import __version__

if TYPE_CHECKING:
    from pikanid import symbolic, uncertainty
    from pikanid.comparison import ResidualAnalysis, Validation, resid, validate
    from pikanid.discrepancy import kan_discrepancy
    from pikanid.estimate import Estimate
    from pikanid.mismatch.design.confusable import confusable
    from pikanid.mismatch.design.next_experiment import d_optimal, next_experiment
    from pikanid.mismatch.diagnose import diagnose
    from pikanid.mismatch.report.diagnosis import Diagnosis
    from pikanid.mismatch.settings.settings import Settings
    from pikanid.model import Effect, Input, Model, Output, Parameter, State, systems
    from pikanid.model.effects_file import read_effects
    from pikanid.recording import Channel, Recording, datasets, excitation
    from pikanid.simulation import simulate
    from pikanid.strategies import *  # noqa: F403 - all that are listed there
    from pikanid.strategies.bootstrap import bootstrap


# Name -> the module that defines it.
_HOMES = {
    "Model": "pikanid.model",
    "State": "pikanid.model",
    "Input": "pikanid.model",
    "Parameter": "pikanid.model",
    "Output": "pikanid.model",
    "Effect": "pikanid.model",
    "read_effects": "pikanid.model.effects_file",
    "Recording": "pikanid.recording",
    "Channel": "pikanid.recording",
    "Estimate": "pikanid.estimate",
    **dict.fromkeys(strategies.__all__, "pikanid.strategies"),
    "validate": "pikanid.comparison",
    "bootstrap": "pikanid.strategies.bootstrap",
    "Validation": "pikanid.comparison",
    "resid": "pikanid.comparison",
    "ResidualAnalysis": "pikanid.comparison",
    "kan_discrepancy": "pikanid.discrepancy",
    "diagnose": "pikanid.mismatch.diagnose",
    "Diagnosis": "pikanid.mismatch.report.diagnosis",
    "Settings": "pikanid.mismatch.settings.settings",
    "confusable": "pikanid.mismatch.design.confusable",
    "next_experiment": "pikanid.mismatch.design.next_experiment",
    "d_optimal": "pikanid.mismatch.design.next_experiment",
    "simulate": "pikanid.simulation",
}

# Name -> the module that it stands for.
_MODULES = {
    "symbolic": "pikanid.symbolic",
    "systems": "pikanid.model.systems",
    "excitation": "pikanid.recording.excitation",
    "uncertainty": "pikanid.uncertainty",
    "datasets": "pikanid.recording.datasets",
}

__all__ = [
    "Model",
    "State",
    "Input",
    "Parameter",
    "Output",
    "Effect",
    "read_effects",
    "Recording",
    "Channel",
    "Estimate",
    "validate",
    "bootstrap",
    "Validation",
    "resid",
    "ResidualAnalysis",
    "kan_discrepancy",
    "diagnose",
    "Diagnosis",
    "Settings",
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
__all__ += strategies.__all__


def __getattr__(name: str) -> object:
    """Import a public name on first use.

    Raises:
        AttributeError: If the package has no public name ``name``.
    """
    if name in _HOMES:
        found = getattr(import_module(_HOMES[name]), name)
    elif name in _MODULES:
        found = import_module(_MODULES[name])
    else:
        raise AttributeError(f"module 'pikanid' has no attribute {name!r}")
    globals()[name] = found  # the next access no longer comes through here
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
