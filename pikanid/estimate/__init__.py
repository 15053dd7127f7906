"""The one result type of all strategies, its file and its figures."""

from pikanid.estimate.data import Fit, Trajectory
from pikanid.estimate.estimate import Estimate

__all__ = ["Estimate", "Fit", "Trajectory"]
