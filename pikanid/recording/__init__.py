"""Recordings: what was measured, from where it is read, and what can be done with it."""

from pikanid.recording.channel import Channel
from pikanid.recording.recording import Recording

__all__ = ["Channel", "Recording"]
