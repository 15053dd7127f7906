"""Optimisers of Eq. (2): Gauss-Newton with banded-plus-border algebra, dense, and λ-schedules."""
