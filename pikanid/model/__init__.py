"""Models: an ordinary differential equation with its inputs, parameters and outputs, in SymPy."""

from pikanid.model.effect import Effect, NewState
from pikanid.model.effect_form import EffectForm
from pikanid.model.model import Formula, Model
from pikanid.model.parts import Input, Output, Parameter, Spline, State

__all__ = ["Effect", "EffectForm", "Formula", "Input", "Model", "NewState", "Output", "Parameter",
           "Spline", "State"]
