"""Recordings: what was measured, from where it is read, and what can be done with it.

Classes are imported when they are first used: which excitations and file formats there are is known
without them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pikanid.recording.channel import Channel
    from pikanid.recording.recording import Recording

__all__ = ["Channel", "Recording"]


def __getattr__(name: str) -> type[Channel] | type[Recording]:
    if name not in __all__:
        raise AttributeError(f"module 'pikanid.recording' has no attribute {name!r}")
    found: type[Channel] | type[Recording] = getattr(
        import_module(f"pikanid.recording.{name.lower()}"), name)
    globals()[name] = found  # the next access no longer comes through here
    return found
