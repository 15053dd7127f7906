"""Is anything left in a residual, and of which kind, to first order?"""
