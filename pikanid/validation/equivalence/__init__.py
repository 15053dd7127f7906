"""Eq. (5): the loss of a shallow KAN with w_b = 0 is the objective of iPDA, checked term by term.

Two derivations that share no formula are compared: pykan's forward pass with torch autograd
(`network`), and SciPy design matrices with derivatives by hand (`ipda`).  Negative controls show
that the comparison can fail.

>>> from pikanid.validation.equivalence import Setting, compare
>>> checks = compare(Setting("duffing", "second-order", degree=3, grid=5))
>>> all(check.passed for check in checks)
True
"""

from __future__ import annotations

from pikanid.validation.equivalence.checks import compare, run_checks
from pikanid.validation.equivalence.report import Check, EquivalenceReport
from pikanid.validation.equivalence.setting import Setting

__all__ = ["Check", "EquivalenceReport", "Setting", "compare", "run_checks"]
