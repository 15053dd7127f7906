"""Files as test benches write them, each made by the writer of its own library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

FAST, SLOW = np.arange(0.0, 2.0, 0.01), np.arange(0.0, 2.0, 0.05)
THETA, U = np.sin(3 * FAST), np.where(SLOW > 0.5, 1.0, 0.0)
START = 1_700_000_000  # POSIX time [s] of t = 0


def mdf(path: Path, groups: Mapping[str, Sequence[Any]], compression: int = 0) -> None:
    """An MDF 4 file: group -> asammdf's signals on one clock."""
    from datetime import UTC, datetime

    from asammdf import MDF

    with MDF(version="4.10") as file:
        file.start_time = datetime.fromtimestamp(START, UTC)
        for name, signals in groups.items():
            file.append(list(signals), acq_name=name.rstrip("'"))
        file.save(path, overwrite=True, compression=compression)


def rig_mdf(path: Path, compression: int = 0) -> None:
    """The rig's two signals at their two rates."""
    from asammdf import Signal

    mdf(path, {"encoder": [Signal(THETA, FAST, name="theta", unit="deg")],
               "drive": [Signal(U, SLOW, name="u_x", unit="m/s^2")]}, compression)


def tdms(path: Path, channels: Sequence[Any]) -> None:
    """A TDMS file."""
    from nptdms import TdmsWriter

    with TdmsWriter(str(path)) as writer:
        writer.write_segment(list(channels))


def rig_tdms(path: Path) -> None:
    """The rig's two signals, as two waveforms."""
    from nptdms import ChannelObject

    began = np.datetime64(START, "s")
    tdms(path, [
        ChannelObject("Rig", "theta", THETA, {
            "unit_string": "deg", "wf_increment": 0.01, "wf_start_time": began}),
        ChannelObject("Rig", "u_x", U, {
            "unit_string": "m/s^2", "wf_increment": 0.05, "wf_start_time": began})])


def rig_hdf5(path: Path) -> None:
    """The rig's two signals in two groups, each with its times."""
    import h5py

    with h5py.File(path, "w") as file:
        for group, t, name, values, unit in (("encoder", FAST, "theta", THETA, "deg"),
                                             ("drive", SLOW, "u_x", U, "m/s^2")):
            file[f"{group}/time"], file[f"{group}/{name}"] = t, values
            file[f"{group}/{name}"].attrs["units"] = unit


Messages = Sequence[tuple[float, Any]]


def ros2(path: Path, topics: Mapping[str, tuple[str, Messages]], storage: str = "mcap",
         **options: Any) -> None:
    """The folder of a ROS 2 bag: topic -> type, and (time [s], message made of `types`)."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    store = types(2)
    with Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()], **options) as bag:
        for topic, (kind, messages) in topics.items():
            connection = bag.add_connection(topic, kind, typestore=store)
            for at, message in messages:
                bag.write(connection, nanoseconds(at), store.serialize_cdr(message, kind))


def ros1(path: Path, topics: Mapping[str, tuple[str, Messages]]) -> None:
    """A bag of ROS 1."""
    from rosbags.rosbag1 import Writer

    store = types(1)
    with Writer(path) as bag:
        for topic, (kind, messages) in topics.items():
            connection = bag.add_connection(topic, kind, typestore=store)
            for at, message in messages:
                bag.write(connection, nanoseconds(at), store.serialize_ros1(message, kind))


def types(version: int) -> Any:
    """The message types of a ROS."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY if version == 2 else Stores.ROS1_NOETIC)


def nanoseconds(at: float) -> int:
    """POSIX time [ns] of a time of the rig."""
    return START * 10**9 + round(at * 1e9)


def header(version: int, at: float, frame: str = "rig", seconds: int = START) -> Any:
    """The header of a message, stamped."""
    made = types(version).types
    whole = round(at * 1e9) + seconds * 10**9
    stamp = made["builtin_interfaces/msg/Time"](sec=whole // 10**9, nanosec=whole % 10**9)
    more = {"seq": 0} if version == 1 else {}
    return made["std_msgs/msg/Header"](stamp=stamp, frame_id=frame, **more)


def rig_topics(version: int) -> dict[str, tuple[str, Messages]]:
    """The rig's two signals: a joint with a stamp, recorded late, and a bare number."""
    made = types(version).types
    joint, number = made["sensor_msgs/msg/JointState"], made["std_msgs/msg/Float64"]
    nothing = np.array([])
    return {
        "/joints": ("sensor_msgs/msg/JointState", [
            (at + 2e-3, joint(header=header(version, at), name=["theta"],
                              position=np.array([value]), velocity=nothing, effort=nothing))
            for at, value in zip(FAST, np.deg2rad(THETA), strict=True)]),
        "/u_x": ("std_msgs/msg/Float64", [
            (at, number(data=float(value))) for at, value in zip(SLOW, U, strict=True)])}


def cut_and_changed(content: bytes, number: int, seed: int) -> list[bytes]:
    """The content cut off, or with bytes changed, at so many places."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(number):
        damaged = bytearray(content)
        at = int(rng.integers(len(content)))
        if k % 3 == 0:
            del damaged[at:]
        elif k % 3 == 1:
            damaged[at:at + 8] = rng.bytes(8)[:len(damaged) - at]
        else:  # a link to another place of the file
            at -= at % 8
            damaged[at:at + 8] = int(rng.integers(len(content))).to_bytes(8, "little")
        made.append(bytes(damaged))
    return made
