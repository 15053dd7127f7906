"""With what a report was computed."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version

LIBRARIES = ("pikanid", "numpy", "scipy", "torch", "pykan")


def provenance() -> str:
    """Versions and machine, as the clauses of a sentence."""
    found = []
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return f"Python {platform.python_version()}, {', '.join(found)}; {os.cpu_count()} CPU cores"
