"""Where the catalogue ends: the shape of the missing force, formulas read from it, a patch."""
