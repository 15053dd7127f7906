"""Which hypotheses are fitted, and in which order."""
