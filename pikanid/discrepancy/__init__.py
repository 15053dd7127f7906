"""Missing physics as a KAN inside the ODE: where, in which shape, and how sure.

`kan_discrepancy` adds spline edges to one equation of a model, fits them together with the
parameters and returns what the parameters alone cannot do, edge by edge, with bands and tests.
"""

from __future__ import annotations

from pikanid.discrepancy.api import kan_discrepancy
from pikanid.discrepancy.edge import Edge
from pikanid.discrepancy.result import Discrepancy

__all__ = ["Discrepancy", "Edge", "kan_discrepancy"]
