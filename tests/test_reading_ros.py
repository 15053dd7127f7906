"""Bags of ROS: numbers in messages as rosbags itself finds them, clocks, hostile files."""

from __future__ import annotations

import dataclasses
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import benches
import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording
from pikanid.recording.reading import ros_messages

pytest.importorskip("rosbags", reason="needs the `ros` extra")

KINDS = [
    "std_msgs/msg/Float64", "std_msgs/msg/UInt8", "std_msgs/msg/Int64", "std_msgs/msg/Bool",
    "std_msgs/msg/Float64MultiArray", "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/BatteryState", "sensor_msgs/msg/Joy", "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/WrenchStamped", "nav_msgs/msg/Odometry", "diagnostic_msgs/msg/KeyValue",
    "trajectory_msgs/msg/JointTrajectory", "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/NavSatFix",
    "std_msgs/msg/Empty", "geometry_msgs/msg/PolygonStamped"]


class Random:
    """Messages of any type with random numbers and lengths, and what they hold."""

    def __init__(self, version: int) -> None:
        self.store, self.rng = benches.types(version), np.random.default_rng(version)
        self.fields = {name: list(fields) for name, (_, fields) in self.store.fielddefs.items()}

    def message(self, kind: str) -> Any:
        return self.store.types[kind](**{
            name: self.value(about) for name, about in self.fields[kind]})

    def value(self, about: Any) -> Any:
        kind, inner = int(about[0]), about[1]
        if kind == ros_messages.NAME:
            return self.message(inner)
        if kind == ros_messages.BASE:
            return self.base(inner[0])
        count = inner[1] if kind == ros_messages.ARRAY else int(self.rng.integers(4))
        made = [self.value(inner[0]) for _ in range(count)]
        if int(inner[0][0]) == ros_messages.BASE and inner[0][1][0] != "string":
            name = {"byte": "uint8", "char": "uint8"}.get(inner[0][1][0], inner[0][1][0])
            return np.array(made, name)
        return made

    def base(self, name: str) -> Any:
        if name == "string":
            return "".join(map(chr, self.rng.integers(97, 107, self.rng.integers(6)))) + "é"
        if name == "bool":
            return bool(self.rng.integers(2))
        if name.startswith("float"):
            return float(np.dtype(name).type(self.rng.normal()))
        return int(self.rng.integers(100))


def numbers(message: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """The numbers in a message object, by their paths."""
    for name in (f.name for f in dataclasses.fields(message)):
        value, below = getattr(message, name), f"{path}.{name}" if path else name
        if name.endswith("covariance") or isinstance(value, str) or name in (
                ros_messages.FILLER, name.upper()):  # constants of a type
            continue
        if isinstance(value, bool | int | float):
            yield below, float(value)
        elif isinstance(value, list | np.ndarray):
            labels = [str(n) for n in getattr(message, "name", getattr(
                message, "joint_names", ()))]
            for k, element in enumerate(value):
                place = f"{below}.{labels[k]}" if len(labels) == len(value) else f"{below}[{k}]"
                if dataclasses.is_dataclass(element):
                    yield from numbers(element, f"{below}[{k}]")
                elif not isinstance(element, str):
                    yield place, float(element)
        else:
            yield from numbers(value, below)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_numbers_are_where_rosbags_finds_them(version: int, kind: str) -> None:
    source = Random(version)
    kind = kind if kind in source.fields else kind.replace("tf2_msgs", "tf")
    if kind not in source.fields:
        pytest.skip("this ROS has no such type")
    made = [source.message(kind) for _ in range(40)]
    cdr = version == 2
    write = source.store.serialize_cdr if cdr else source.store.serialize_ros1
    raw = [bytes(write(message, kind)) for message in made]
    expected = [dict(numbers(message)) for message in made]
    paths = {path for one in expected for path in one}
    found = ros_messages.columns(source.fields, kind, raw, cdr, paths)
    assert set(found) == paths
    for path in paths:
        np.testing.assert_array_equal(
            found[path], [one.get(path, np.nan) for one in expected], err_msg=path)


def test_a_big_endian_message() -> None:
    raw = b"\x00\x00\x00\x00" + np.array([1.5], ">f8").tobytes()
    fields = {"a": [("data", (1, ("float64", 0)))]}
    assert ros_messages.columns(fields, "a", [raw], True, {"data"})["data"].tolist() == [1.5]


@pytest.mark.parametrize(("storage", "mode"), [
    ("mcap", "storage"), ("mcap", "message"), ("sqlite3", "file"), ("sqlite3", "message")])
def test_packed_bags(tmp_path: Path, storage: str, mode: str) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer

    store, kind = benches.types(2), "std_msgs/msg/Float64"
    from rosbags.rosbag2 import StoragePlugin

    bag = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin[storage.upper()])
    bag.set_compression(CompressionMode[mode.upper()], CompressionFormat.ZSTD)
    with bag:
        connection = bag.add_connection("/y", kind, typestore=store)
        for k in range(50):
            message = store.types[kind](data=float(k))
            bag.write(connection, benches.nanoseconds(0.1 * k), store.serialize_cdr(message, kind))
    rec = Recording.read(tmp_path / "bag")
    assert rec["y"].values.tolist() == list(range(50))
    np.testing.assert_allclose(rec["y"].time, 0.1 * np.arange(50), atol=1e-9)


def test_stamps_of_a_simulated_clock_are_put_on_the_recorders(tmp_path: Path) -> None:
    made = benches.types(2).types
    twist, stamped = made["geometry_msgs/msg/Twist"], made["geometry_msgs/msg/TwistStamped"]
    vector = made["geometry_msgs/msg/Vector3"]
    benches.ros2(tmp_path / "bag", {"/φ": ("geometry_msgs/msg/TwistStamped", [
        (0.1 * k + 0.004 * (k % 3), stamped(
            header=benches.header(2, 0.1 * k + 5.0, "x" * k, seconds=0),
            twist=twist(linear=vector(x=float("nan"), y=0.0, z=0.0),
                        angular=vector(x=0.0, y=0.0, z=float(k)))))
        for k in range(30)])})
    rec = Recording.read(tmp_path / "bag", {"omega": "/φ*angular.z", "v": "*linear.x"})
    np.testing.assert_allclose(rec["omega"].time, 0.1 * np.arange(30), atol=1e-6)
    assert rec["omega"].unit == "rad/s" and np.isnan(rec["v"].values).all()
    assert any("of another clock than the recorder's" in note for note in rec.notes)


def test_times_that_go_back_are_told(tmp_path: Path) -> None:
    made = benches.types(2).types["sensor_msgs/msg/Range"]
    benches.ros2(tmp_path / "bag", {"/range": ("sensor_msgs/msg/Range", [
        (0.1 * k, made(header=benches.header(2, 0.1 * k - (1.55 if k > 20 else 0)),
                       radiation_type=0, field_of_view=0.0, min_range=0.0, max_range=9.0,
                       range=float(k), variance=0.0))
        for k in range(40)])})
    with pytest.raises(errors.BadRecording, match=r"sample 22: the time .* goes back"):
        Recording.read(tmp_path / "bag", {"y": "/range.range"})


def test_messages_that_overtake_each_other_are_put_in_order(tmp_path: Path) -> None:
    kind, messages = benches.rig_topics(2)["/joints"]
    late = [(at + 0.03 * (k % 3 == 1), message) for k, (at, message) in enumerate(messages)]
    benches.ros2(tmp_path / "bag", {"/joints": (kind, sorted(late, key=lambda one: one[0]))})
    rec = Recording.read(tmp_path / "bag", {"theta": "/joints"})
    np.testing.assert_allclose(rec["theta"].time, benches.FAST, atol=1e-9)
    np.testing.assert_array_equal(rec["theta"].values, np.deg2rad(benches.THETA))
    assert "were not recorded in the order of their stamps" in rec.notes[0]


def test_a_bag_without_messages(tmp_path: Path) -> None:
    benches.ros2(tmp_path / "bag", {"/y": ("std_msgs/msg/Float64", [])})
    with pytest.raises(errors.BadRecording, match="holds no signals"):
        Recording.read(tmp_path / "bag")


@pytest.mark.parametrize("statement", [
    "ALTER TABLE topics RENAME TO t2; CREATE VIEW topics AS WITH RECURSIVE c(x) AS (SELECT 1 "
    "UNION ALL SELECT x+1 FROM c) SELECT count(*) AS id, 'a' AS name FROM c",
    "ALTER TABLE messages ADD COLUMN more BLOB GENERATED ALWAYS AS (zeroblob(1e9))"])
def test_a_database_that_computes_is_refused(tmp_path: Path, statement: str) -> None:
    benches.ros2(tmp_path / "bag", benches.rig_topics(2), "sqlite3")
    path = next((tmp_path / "bag").glob("*.db3"))
    with sqlite3.connect(path) as database:
        database.executescript(statement)
    with pytest.raises(errors.BadRecording, match="damaged or cut off"):
        Recording.read(path)
