"""How well models predict recordings: scores, a linear baseline, and what the residual tells."""

from pikanid.comparison.compare import validate
from pikanid.comparison.validation import Validation

__all__ = ["Validation", "validate"]
