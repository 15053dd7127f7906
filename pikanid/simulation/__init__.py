"""Simulation: SymPy models compiled by numba, integrated with exact forward sensitivities."""

from pikanid.simulation.simulator import Response, Simulator, Steps
from pikanid.simulation.synthetic import simulate
from pikanid.simulation.vectorfield import VectorField

__all__ = ["Response", "Simulator", "Steps", "VectorField", "simulate"]
