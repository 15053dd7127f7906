"""Names that are not in use."""

from __future__ import annotations

from collections.abc import Container


def free_name(name: str, *taken: Container[str]) -> str:
    """The name, with ``_x`` behind it until none of what is taken holds it.

    >>> free_name("k", {"k", "k_x"}), free_name("c", {"k"})
    ('k_x_x', 'c')
    """
    while any(name in names for names in taken):
        name += "_x"
    return name
