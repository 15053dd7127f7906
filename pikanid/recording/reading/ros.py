"""Bags of ROS 1 and ROS 2 (.bag, .db3, .mcap, or the folder of a bag; rosbags), topic by topic.

A number in the messages of a topic is a signal, ``/imu.angular_velocity.z``; a topic that carries
one number is called as the topic is.  Messages with a header are on the clock of its stamp, others
on the recorder's; time 0 is the earliest of all.
"""

from __future__ import annotations

import io
import re
import sqlite3
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.channel import Array
from pikanid.recording.formats import ZIP, by_content, by_ending
from pikanid.recording.reading import foreign
from pikanid.recording.reading.ros_messages import Types, Walk, columns
from pikanid.recording.reading.signals import Clock, Contents, Signal
from pikanid.storage.outputs import atomically

_ROS_1 = ".bag"
_PACKED = b"\x28\xb5\x2f\xfd"  # how zstd begins
_STAMP = ("header.stamp.sec", "header.stamp.nanosec")
_OVERTAKES = 8  # limit: places by which a message may be early among those recorded
_APART = 3600 * 10**9  # definition: nanoseconds that no delay takes: stamps of another clock

read = partial(foreign.table, "ros", "rosbags", "a ROS bag")


@dataclass(eq=False)
class _Topic:
    """The messages of one topic, as they were recorded."""

    name: str
    kind: str
    types: Types
    cdr: bool
    messages: list[bytes] = field(default_factory=list)
    logged: list[int] = field(default_factory=list)

    @cached_property
    def values(self) -> dict[str, np.ndarray]:
        """Every number of every message, by its path."""
        return columns(self.types, self.kind, self.messages, self.cdr,
                       {leaf.path for leaf in self.leaves}, _STAMP)

    @cached_property
    def leaves(self) -> list[Any]:
        """The numbers that the first sound message has."""
        for data in self.messages:
            try:
                return Walk(self.types, data, self.cdr).message(self.kind).leaves
            except (ValueError, KeyError, IndexError, TypeError):
                continue
        return []

    @cached_property
    def stamps(self) -> np.ndarray | None:
        """(N,) stamps [ns] of the headers; None where there is none in some message."""
        if not {leaf.path for leaf in self.leaves}.issuperset(_STAMP):
            return None
        seconds, rest = (self.values[path] for path in _STAMP)
        stamps = 10**9 * seconds + rest
        return stamps if np.all(stamps > 0) else None

    @cached_property
    def order(self) -> np.ndarray:
        """(N,) places of the messages in the order of their stamps; as recorded where that differs
        by more than messages overtake each other: then the clock was set back.
        """
        recorded = np.arange(len(self.messages))
        if self.stamps is None:
            return recorded
        sorted_ = np.argsort(self.stamps, kind="stable")
        return sorted_ if np.max(np.abs(sorted_ - recorded)) <= _OVERTAKES else recorded

    def overtaken(self) -> int:
        """How many messages are not where they were recorded."""
        return int(np.count_nonzero(self.order != np.arange(len(self.messages))))

    def in_order(self) -> _Topic:
        """The topic with its messages in that order."""
        if not self.overtaken():
            return self
        return _Topic(self.name, self.kind, self.types, self.cdr,
                      [self.messages[k] for k in self.order], [self.logged[k] for k in self.order])


def contents(content: bytes, where: str) -> Contents:
    """Every number of every topic."""
    topics = _topics(content)
    if not topics:
        raise errors.BadRecording(errors.no_signals(where))
    moved = {t.name: t.overtaken() for t in topics}
    topics = [t.in_order() for t in topics]
    stamped = [topic for topic in topics if topic.stamps is not None]
    late = min((int(np.min(np.array(t.logged) - t.stamps)) for t in stamped), default=0)
    late = late if abs(late) > _APART else 0
    zero = min(int(np.min(t.logged if t.stamps is None else t.stamps + late)) for t in topics)
    notes = [errors.note_other_stamps(late / 1e9)] if late else []
    notes += [errors.note_overtaken(name, number) for name, number in moved.items() if number]
    if 0 < len(stamped) < len(topics):
        notes.append(errors.note_two_clocks([t.name for t in topics if t.stamps is None]))
    return Contents([s for t in topics for s in _signals(t, zero, late)], zero / 1e9, tuple(notes))


def _signals(topic: _Topic, zero: int, late: int) -> Iterator[Signal]:
    count = len(topic.messages)

    def seconds() -> Array:
        stamps = topic.stamps
        at = np.array(topic.logged) if stamps is None else stamps + late
        return (at - zero) / 1e9

    clock = Clock(f"{topic.name} (times)", seconds, count)
    leaves = [leaf for leaf in topic.leaves if not leaf.path.startswith("header.")]
    for leaf in leaves:
        path = f"{topic.name}.{leaf.path}"
        name = path
        if [other.path for other in leaves] == ["data"]:
            path, name = topic.name, topic.name.lstrip("/")
        yield Signal(path, name, count, _values(topic, leaf.path), leaf.unit, clock)


def _values(topic: _Topic, path: str) -> Callable[[], Array]:
    return lambda: topic.values[path].astype(float)


def _topics(content: bytes) -> list[_Topic]:
    """Topics with messages, in the order of their names."""
    found: dict[tuple[str, str], _Topic] = {}
    for path, cdr in _files(content):
        with _reader(path, cdr) as bag:
            types = _types(bag.connections, cdr)
            for connection, logged, data in bag.messages():
                topic = found.setdefault(
                    (connection.topic, connection.msgtype),
                    _Topic(connection.topic, connection.msgtype, types, cdr))
                topic.messages.append(_plain(bytes(data)))
                topic.logged.append(int(logged))
    for topic in found.values():
        order = np.argsort(topic.logged, kind="stable")  # of a bag in several files
        topic.messages = [topic.messages[k] for k in order]
        topic.logged = [topic.logged[k] for k in order]
    return [found[key] for key in sorted(found)]


def _files(content: bytes) -> Iterator[tuple[Path, bool]]:
    """The bag's files in this process's own folder, and whether they are of ROS 2."""
    parts = [content]
    if content.startswith(ZIP):  # the files of a folder
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            parts = [archive.read(name) for name in archive.namelist()]
    for k, part in enumerate(map(_plain, parts)):
        found = by_content(part)
        if found is None or found.file != "ros":
            raise ValueError("no part of a bag")
        path = Path(f"part{k}{found.endings[0]}")
        atomically(path, part)
        yield path, found is not by_ending(_ROS_1)


def _reader(path: Path, cdr: bool) -> Any:
    from rosbags import rosbag1, rosbag2

    with path.open("rb") as file:
        if file.read(6) == b"SQLite":
            _check_tables(path)
    return rosbag2.Reader(path) if cdr else rosbag1.Reader(path)


def _check_tables(path: Path) -> None:
    """Raise ValueError unless a database holds plain tables: others compute, maybe for ever."""
    with sqlite3.connect(f"file:{path.name}?mode=ro&immutable=1", uri=True) as database:
        for kind, text in database.execute("SELECT type, sql FROM sqlite_master"):
            if kind not in ("table", "index") or re.search(
                    r"\bVIRTUAL\b|\bGENERATED\b|\bAS\s*\(", str(text), re.IGNORECASE):
                raise ValueError("more than plain tables")


def _types(connections: Any, cdr: bool) -> Types:
    """Fields of every type: those of the distribution, and those that the bag defines itself."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY if cdr else Stores.ROS1_NOETIC)
    known = {name: fields for name, (_, fields) in store.fielddefs.items()}
    for one in connections:
        if one.msgdef.format == MessageDefinitionFormat.MSG:
            own = get_types_from_msg(one.msgdef.data, one.msgtype)
        elif one.msgdef.format == MessageDefinitionFormat.IDL:
            # several definitions stand below each other, each behind a line of "="
            texts = [re.sub(r"^IDL: .*\n", "", text)
                     for text in one.msgdef.data.split("=" * 80 + "\n") if text.strip()]
            own = {name: made for text in texts for name, made in get_types_from_idl(text).items()}
        else:
            continue
        known.update({name: fields for name, (_, fields) in own.items()})
    return known


def _plain(data: bytes) -> bytes:
    """Bytes unpacked, where they are packed."""
    if not data.startswith(_PACKED):
        return data
    # as rosbags does; Python has it since 3.14
    zstd = import_module("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd")
    unpacked: bytes = zstd.decompress(data)
    return unpacked
