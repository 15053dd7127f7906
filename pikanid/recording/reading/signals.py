"""What a file with channels of its own holds: signals with names, units and clocks, read on demand.

A file of a test bench holds thousands of channels, of which a few are wanted: a reader lists them
all and fetches the samples of those that are asked for.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from pikanid.recording.channel import Array

_BETWEEN = re.compile(r"[/.]")
WIDEST = 64  # limit: signals in one matrix; wider ones are images or tables of something else


@dataclass(frozen=True, eq=False)
class Clock:
    """Sample times that signals share.

    Attributes:
        path: Where the file has them.
        load: Makes the (N,) times [s].
        count: N.
    """

    path: str
    load: Callable[[], Array]
    count: int


@dataclass(frozen=True, eq=False)
class Signal:
    """One signal.

    Attributes:
        path: Its whole name, such as ``"Rig/theta"``; two signals of one file may share it.
        name: Its short name, used where no other signal of the file has it.
        count: Number of samples.
        load: Makes the (count,) samples; any failure is one of this signal alone.
        unit: As the file says it; None if it says none.
        clock: Its times; None if the file has none.
        defect: Why it is no signal of numbers, "" if it is one.
    """

    path: str
    name: str
    count: int
    load: Callable[[], Array]
    unit: str | None = None
    clock: Clock | None = None
    defect: str = ""


@dataclass(frozen=True, eq=False)
class Contents:
    """The signals of a file, and when its time 0 was.

    Attributes:
        signals: In the order of the file.
        began: POSIX time [s] of t = 0; None if the file does not tell.
        notes: What the reader had to decide, one sentence each.
    """

    signals: Sequence[Signal]
    began: float | None = None
    notes: tuple[str, ...] = ()


def asked(text: str, *names: str) -> bool:
    """Whether a text is one of the names of a signal, a pattern that fits one of them, or a part.

    >>> asked("Rig/*", "Rig/theta", "theta"), asked("x[0]", "x[0]"), asked("phi", "theta")
    (True, True, False)
    """
    return text in names or fits(text, *names) or is_part(text, *names)


def fits(pattern: str, *names: str) -> bool:
    """Whether a pattern of a shell fits a name.

    >>> fits("*.z", "/imu.angular_velocity.z")
    True
    """
    return any(fnmatchcase(name, pattern) for name in names)


def is_part(text: str, *paths: str) -> bool:
    """Whether a text is a whole part of a path: a group, a topic, a field, or several in a row.

    >>> is_part("/joints", "/joints.position.theta"), is_part("position.theta", "/joints.position")
    (True, False)
    >>> is_part("joint", "/joints.position.theta"), is_part("", "/joints")
    (False, False)
    """
    def whole(parts: str) -> str:
        return "/" + "/".join(filter(None, _BETWEEN.split(parts))) + "/"

    return whole(text) != "//" and any(whole(text) in whole(path) for path in paths)


def distinct(signals: Sequence[Signal]) -> list[tuple[str, str]]:
    """(path, name) of every signal, no two of them alike.

    >>> one, two = (Signal(f"{g}/y", "y", 0, lambda: None) for g in "ab")
    >>> distinct([one, two]), distinct([one])
    ([('a/y', 'a/y'), ('b/y', 'b/y')], [('a/y', 'y')])
    """
    seen: Counter[str] = Counter()
    paths = []
    for signal in signals:
        seen[signal.path] += 1
        paths.append(signal.path if seen[signal.path] == 1
                     else f"{signal.path} ({seen[signal.path]})")
    short = Counter(signal.name for signal in signals)
    return [(path, signal.name if short[signal.name] == 1 else path)
            for path, signal in zip(paths, signals, strict=True)]
