"""From curves to formulas."""

from __future__ import annotations

from pikanid.symbolic.naming import name_edge

__all__ = ["name_edge"]
