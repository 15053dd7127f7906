"""Formulas: the whitelist parser and printer, non-smooth functions, units."""
