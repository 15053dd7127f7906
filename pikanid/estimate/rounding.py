"""Numbers as they are printed."""

from __future__ import annotations

import numpy as np


def rounded(value: float, std: float) -> str:
    """Value and standard error with two significant digits of the error.

    >>> rounded(0.0450123, 0.0000099)
    '0.0450123 ± 0.0000099'
    >>> rounded(5.1571e-7, 2.4e-8)
    '5.16e-07 ± 2.4e-08'
    """
    if not np.isfinite(std) or std <= 0:
        return f"{value:.6g}"
    digits = int(np.clip(1 - np.floor(np.log10(std)), 0, 12))
    if abs(value) >= 1e6 or 0 < abs(value) < 1e-5 or digits > 10:
        apart = np.floor(np.log10(abs(value))) - np.floor(np.log10(std)) if value else 0
        return f"{value:.{int(np.clip(apart + 1, 0, 6))}e} ± {std:.1e}"
    return f"{value:.{digits}f} ± {std:.{digits}f}"


def with_unit(text: str, unit: str) -> str:
    """A number and its unit, which is left away where there is none.

    >>> with_unit("0.3", "m"), with_unit("0.3", "1")
    ('0.3 m', '0.3')
    """
    return text if unit in ("", "1") else f"{text} {unit}"
