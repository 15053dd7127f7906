"""Reading MAT files: level 5 and 7.3, structures, cells, plain vectors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid.errors import BadRecording
from pikanid.recording import Recording
from pikanid.recording.reading import mat5

T = np.arange(5) * 0.1
Y = np.array([1.0, 2.0, 0.5, -1.0, 3.0])


def nested() -> dict[str, Any]:
    signals = {"values": Y[:, None], "label": "theta"}
    other = {"time": T[:3, None], "signals": {"values": Y[:3, None]}}
    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.vstack([Y, -Y]), np.arange(4.0)[:, None]
    return {
        "Theta": {"time": T[:, None], "signals": signals},
        "Other": other,
        "Cells": cells,
        "dt": 0.1,
        "word": "abc",
    }


def write_v73(path: Path, content: dict[str, Any]) -> None:
    """A MAT 7.3 file as MATLAB writes it: transposed datasets, references for cells."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:

        def put(group: Any, name: str, value: Any) -> Any:
            if isinstance(value, dict):
                made = group.create_group(name)
                made.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    put(made, key, inner)
            elif isinstance(value, str):
                made = group.create_dataset(name, data=np.array([[ord(c)] for c in value], "u2"))
                made.attrs["MATLAB_class"] = np.bytes_("char")
            elif np.asarray(value).dtype == object:
                array = np.asarray(value)
                references = np.empty(array.T.shape, dtype=h5py.ref_dtype)
                for k, cell in enumerate(array.ravel()):
                    references.ravel()[k] = put(file.require_group("#refs#"), f"c{k}", cell).ref
                made = group.create_dataset(name, data=references)
                made.attrs["MATLAB_class"] = np.bytes_("cell")
            else:
                made = group.create_dataset(name, data=np.atleast_2d(np.asarray(value)).T)
                made.attrs["MATLAB_class"] = np.bytes_("double")
            return made

        for key, value in content.items():
            put(file, key, value)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" ")
    with path.open("r+b") as raw:
        raw.write(head)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_mat_structures_and_cells(tmp_path: Path, version: str) -> None:
    path = tmp_path / "run.mat"
    if version == "5":
        from scipy.io import savemat

        savemat(path, nested())
    else:
        write_v73(path, nested())
    rec = Recording.read(path)
    assert set(rec.names) == {"Theta.signals.values", "Other.signals.values"}
    assert rec["Theta.signals.values"].time.tolist() == T.tolist()
    assert rec["Other.signals.values"].time.tolist() == T[:3].tolist()
    assert set(rec.unreadable) == {"Cells.1.1", "Cells.1.2", "Cells.2"}
    cell = Recording.read(path, columns={"t": "Theta.time", "y": "Cells.1.2"})
    assert cell["y"].values.tolist() == (-Y).tolist()
    assert Recording.read(path, columns={"z": "Cells.2"}, rate=10)["z"].time[-1] == pytest.approx(
        0.3
    )


def test_mat_of_plain_vectors(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "run.mat"
    savemat(path, {"V1": Y, "V2": -Y, "flag": np.uint8([[1]])})
    rec = Recording.read(path, columns={"u": "V1", "y": "V2"}, rate=10)
    assert rec.names == ("u", "y")
    np.testing.assert_allclose(rec.t, T)
    with pytest.raises(BadRecording, match="no time column among: V1, V2"):
        Recording.read(path)
    savemat(path, {"note": "nothing here"})
    with pytest.raises(BadRecording, match="no numeric vector"):
        Recording.read(path)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"])
def test_level_5_arrays_as_scipy_writes_them(kind: str, packed: bool) -> None:
    from io import BytesIO

    from scipy.io import savemat

    array = (np.random.default_rng(0).standard_normal((3, 4, 2)) * 100).astype(kind)
    many = np.array([(1.0, array[0]), (2.0, array[1])], dtype=[("p", "O"), ("q", "O")])
    content = {"a_name_beyond_four_bytes": array, "s": {"in": {"y": array[:, 0]}}, "m": many,
               "none": np.zeros((0, 0)), "z": 1j * np.ones(3), "word": "abc"}  # fmt: skip
    buffer = BytesIO()
    savemat(buffer, content, do_compression=packed)
    found = dict(mat5.leaves(buffer.getvalue()))
    assert set(found) == {"a_name_beyond_four_bytes", "s.in.y", "m.1.p", "m.1.q", "m.2.p", "m.2.q",
                          "none"}  # fmt: skip
    np.testing.assert_array_equal(found["a_name_beyond_four_bytes"], array)
    np.testing.assert_array_equal(found["s.in.y"], array[:, 0])
    np.testing.assert_array_equal(found["m.2.q"], array[1])


def test_level_5_files_of_the_other_byte_order() -> None:
    """Written by hand: one double matrix [1, 2] called y, most significant byte first."""
    import struct

    parts = [
        struct.pack(">IIII", 6, 8, 6, 0),
        struct.pack(">IIii", 5, 8, 1, 2),
        struct.pack(">HHI", 1, 1, ord("y") << 24),
        struct.pack(">IIdd", 9, 16, 1.0, 2.0),
    ]
    body = b"".join(parts)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    found = dict(mat5.leaves(head + struct.pack(">II", 14, len(body)) + body))
    assert found["y"].tolist() == [[1.0, 2.0]]
