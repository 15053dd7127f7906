"""The installed version, for results and reports."""

from __future__ import annotations

from importlib.metadata import version

__version__ = version("pikanid")
