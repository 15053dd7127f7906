"""Missing physics as a KAN inside the ODE: where, in which shape, and how sure.

`kan_discrepancy` adds spline edges to one equation of a model, fits them together with the
parameters and returns what the parameters alone cannot do, edge by edge, with bands and tests.
"""

from __future__ import annotations

from pikanid.discrepancy.api import kan_discrepancy
from pikanid.discrepancy.edge import Edge
from pikanid.discrepancy.result import Discrepancy
from pikanid.discrepancy.settings import DiscrepancySettings

__all__ = ["Discrepancy", "DiscrepancySettings", "Edge", "kan_discrepancy"]
