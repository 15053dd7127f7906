"""What moved the tank, from a second file: accelerations, on the camera's clock."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

from pikanid.recording import Recording
from pikanid.recording.kinematics import with_acceleration


def with_motion(recording: Recording, motion: str | os.PathLike[str] | Recording,
                columns: Mapping[str, str] | None = None,
                positions: Mapping[str, str] | None = None, delay: float = 0.0) -> Recording:
    """A recording of the surface together with the inputs that moved the tank.

    Args:
        recording: Of the surface.
        motion: A file, or a recording, of accelerations or positions; it keeps its own times.
        columns: Input -> column that holds it; every column by its own name if None.
        positions: Input -> column of a position [m], of which it is the second derivative.
        delay: Time [s] of the motion's zero on the camera's clock.

    Raises:
        BadRecording: If the file or a column in it cannot be used.
        BadSetting: If the delay is no number.

    >>> seen = Recording.from_arrays([0.0, 1.0], {"theta": [0.0, 0.1]}, {"theta": "rad"})
    >>> moved = Recording.from_arrays([0.0, 1.0], {"u_x": [0.0, 1.0]}, {"u_x": "m/s^2"})
    >>> with_motion(seen, moved, delay=0.25)["u_x"].time.tolist()
    [0.25, 1.25]
    """
    wanted = {**(columns or {}), **(positions or {})}
    moved = motion if isinstance(motion, Recording) else Recording.read(motion, wanted or None)
    if isinstance(motion, Recording) and wanted:
        moved = motion.with_channels(*(replace(motion[old], name=new)
                                       for new, old in wanted.items()))
    for name in positions or {}:
        where = replace(moved[name], name=f"{name} position")
        moved = with_acceleration(moved.with_channels(where), {name: f"{name} position"})
        moved = moved.without(f"{name} position")
    names = [*wanted] or [*moved.names]
    for name in names:
        if delay:
            moved = moved.shift(name, delay)
    made = recording.with_channels(*(moved[name] for name in names))
    return Recording(made.channels, made.name, (*recording.notes, *moved.notes))
