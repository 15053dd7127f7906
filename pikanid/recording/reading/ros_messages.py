"""Numbers in serialized ROS messages, many messages at once.

Messages are laid out as CDR (ROS 2; Object Management Group, "Common Object Request Broker
Architecture", chapter on GIOP transfer syntax) or without gaps (ROS 1).  Where the numbers of one
message lie depends on lengths of texts and sequences alone, so messages that agree in these are
cut at the same places.  Types come from the bag as data; no code is made of them.  Covariances are
left out: they are settings of a sensor, hardly ever signals.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4  # definition: kinds of fields, as rosbags numbers them
_CODES = {"bool": "u1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2",
          "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
          "float32": "f4", "float64": "f8"}
_WIDEST = 64  # limit: elements of a sequence that are signals; longer ones are images or clouds
_MOST = 4096  # limit: numbers of one message that are signals
_DEEPEST = 16  # limit: messages within messages
FILLER = "structure_needs_at_least_one_member"  # of empty messages
# Units that the definitions of messages state (REP 103 of ROS): by type and field.
UNITS = {
    ("sensor_msgs/msg/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/msg/Imu", "linear_acceleration"): "m/s^2",
    ("sensor_msgs/msg/Temperature", "temperature"): "degC",
    ("sensor_msgs/msg/FluidPressure", "fluid_pressure"): "Pa",
    ("sensor_msgs/msg/MagneticField", "magnetic_field"): "T",
    ("sensor_msgs/msg/Range", "range"): "m",
    ("sensor_msgs/msg/BatteryState", "voltage"): "V",
    ("sensor_msgs/msg/BatteryState", "current"): "A",
    ("geometry_msgs/msg/Twist", "linear"): "m/s",
    ("geometry_msgs/msg/Twist", "angular"): "rad/s",
    ("geometry_msgs/msg/Accel", "linear"): "m/s^2",
    ("geometry_msgs/msg/Accel", "angular"): "rad/s^2",
    ("geometry_msgs/msg/Wrench", "force"): "N",
    ("geometry_msgs/msg/Wrench", "torque"): "N*m",
    ("geometry_msgs/msg/Pose", "position"): "m",
    ("geometry_msgs/msg/Transform", "translation"): "m",
    ("geometry_msgs/msg/PointStamped", "point"): "m",
}

Types = Mapping[str, Sequence[tuple[str, Any]]]


@dataclass(frozen=True)
class Leaf:
    """One number of a message: its path, where it lies, of what code, and its unit if known."""

    path: str
    offset: int
    code: str
    unit: str | None


@dataclass
class Layout:
    """Where the numbers of a message lie.

    Attributes:
        leaves: The numbers.
        guards: (offset, length) of the bytes that messages of the same layout share.
    """

    leaves: list[Leaf] = field(default_factory=list)
    guards: list[tuple[int, int]] = field(default_factory=list)


class Walk:
    """The layout of one message.

    Args:
        types: Fields of every message type.
        data: Bytes of the message.
        cdr: Whether it is of ROS 2.

    Raises:
        ValueError: If the bytes end early (also IndexError, KeyError), or a type is not known.
    """

    def __init__(self, types: Types, data: bytes, cdr: bool) -> None:
        self.types, self.data, self.cdr = types, data, cdr
        self.at = 4 if cdr else 0
        self.order = ">" if cdr and data[1] == 0 else "<"
        self.layout = Layout()
        if cdr:
            self.layout.guards.append((0, 4))

    def message(self, kind: str, path: str = "", unit: str | None = None, depth: int = 0) -> Layout:
        """Walk through a message of this type."""
        if depth > _DEEPEST:
            raise ValueError("nested too deeply")
        fields = self.types[kind]
        labels: list[str] = []
        for name, description in fields:
            if name == FILLER:
                continue
            below = f"{path}.{name}" if path else name
            own = UNITS.get((kind, name), unit)
            texts = self._field(description, below, own, depth, labels)
            # JointState and its like name the elements of their arrays
            labels = texts if name in ("name", "names", "joint_names") else labels
        if self.cdr and all(name == FILLER for name, _ in fields):
            self.at += 1  # an empty structure takes a byte
        return self.layout

    def _field(self, description: Any, path: str, unit: str | None, depth: int,
               labels: Sequence[str]) -> list[str]:
        kind, about = int(description[0]), description[1]
        if kind == NAME:
            self.message(about, path, unit, depth + 1)
            return []
        if kind == BASE:
            self._base(about[0], path, unit)
            return []
        inner, count = about
        if kind == SEQUENCE:
            count = self._length()
        if int(inner[0]) == BASE and inner[1][0] in _CODES:
            self._numbers(_CODES[inner[1][0]], count, path, unit, labels)
            return []
        texts = []
        for k in range(count):
            if int(inner[0]) == BASE:
                texts.append(self._text(exactly=True))
            else:
                self.message(inner[1], f"{path}[{k}]", unit, depth + 1)
        return texts

    def _base(self, name: str, path: str, unit: str | None) -> None:
        if name == "string":
            self._text()
            return
        self._numbers(_CODES[name], 1, path, unit, (), single=True)

    def _numbers(self, code: str, count: int, path: str, unit: str | None,
                 labels: Sequence[str], single: bool = False) -> None:
        size = int(code[1])
        if count:
            self._align(size)
        if self.at + size * count > len(self.data):
            raise ValueError("cut off")
        if count <= _WIDEST and not path.endswith("covariance"):
            for k in range(count):
                place = path if single else (
                    f"{path}.{labels[k]}" if len(labels) == count else f"{path}[{k}]")
                self.layout.leaves.append(
                    Leaf(place, self.at + size * k, self.order + code, unit))
            if len(self.layout.leaves) > _MOST:
                raise ValueError("more numbers than are signals")
        self.at += size * count

    def _length(self) -> int:
        self._align(4)
        self.layout.guards.append((self.at, 4))
        count = int(np.frombuffer(self.data, self.order + "u4", 1, self.at)[0])
        self.at += 4
        if count > len(self.data):
            raise ValueError("longer than the message")
        return count

    def _text(self, exactly: bool = False) -> str:
        length = self._length()
        if self.at + length > len(self.data):
            raise ValueError("cut off")
        text = self.data[self.at:self.at + length]
        if exactly:
            self.layout.guards.append((self.at, length))
        self.at += length
        return text.rstrip(b"\0").decode("utf-8", "replace")

    def _align(self, size: int) -> None:
        if self.cdr:
            self.at += -(self.at - 4) % size


def columns(types: Types, kind: str, messages: Sequence[bytes], cdr: bool,
            paths: Collection[str], whole: Collection[str] = ()) -> dict[str, np.ndarray]:
    """The numbers at these paths in every message: (N,) each.

    Where a message is damaged or has no such number, it is NaN.  Paths in `whole` are integers of
    all their digits (0 where there is none), others floats.
    """
    found: dict[str, np.ndarray] = {}
    left = np.arange(len(messages))
    lengths = np.array([len(data) for data in messages])
    while left.size:
        first = int(left[0])
        same = left[lengths[left] == lengths[first]]
        try:
            layout = Walk(types, messages[first], cdr).message(kind)
        except (ValueError, KeyError, IndexError, TypeError):
            left = left[1:]
            continue
        table = np.frombuffer(b"".join(messages[k] for k in same), np.uint8)
        table = table.reshape(len(same), lengths[first])
        fits = np.ones(len(same), bool)
        for at, length in layout.guards:
            fits &= np.all(table[:, at:at + length] == table[0, at:at + length], axis=1)
        for leaf in layout.leaves:
            if leaf.path in paths:
                size = int(leaf.code[2])
                values = np.ascontiguousarray(
                    table[fits, leaf.offset:leaf.offset + size]).view(leaf.code)[:, 0]
                nothing = (np.zeros(len(messages), np.int64) if leaf.path in whole
                           else np.full(len(messages), np.nan))
                found.setdefault(leaf.path, nothing)[same[fits]] = values
        left = np.setdiff1d(left, same[fits], assume_unique=True)
    return found
