"""How well models predict recordings: scores, a linear baseline, and what the residual tells."""

from pikanid.comparison.compare import resid, validate
from pikanid.comparison.residual_analysis import ResidualAnalysis
from pikanid.comparison.validation import Validation

__all__ = ["ResidualAnalysis", "Validation", "resid", "validate"]
