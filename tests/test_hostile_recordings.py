"""Recordings of a few kilobytes that would fill the memory, and files that lead to other files."""

from __future__ import annotations

import gzip
import io
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.recording import Recording
from pikanid.recording.reading import mat, parquet, spreadsheet
from pikanid.storage import limits as stored

T = np.arange(5) * 0.1


def test_gzipped_text_that_unpacks_to_more_than_is_read(tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored, "MOST_UNPACKED", 2**20)
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(b"t,y\n" + b"0,1\n" * 2**19))
    with pytest.raises(errors.BadRecording, match=r"more than 1 MiB.*unpack it yourself"):
        Recording.read(path)


def test_archives_that_unpack_to_more_than_is_read(tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored, "MOST_UNPACKED", 2**20)
    np.savez_compressed(tmp_path / "run.npz", t=T, y=np.zeros(2**18))
    with zipfile.ZipFile(tmp_path / "run.xlsx", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", b" " * 2**21)
    for name in ("run.npz", "run.xlsx"):
        assert (tmp_path / name).stat().st_size < 10_000
        with pytest.raises(errors.BadRecording, match="more than 1 MiB"):
            Recording.read(tmp_path / name)


def test_an_array_whose_header_states_more_than_there_is(tmp_path: Path) -> None:
    member = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        member, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    with zipfile.ZipFile(tmp_path / "run.npz", "w") as archive:
        archive.writestr("t.npy", member.getvalue())
    with pytest.raises(errors.BadRecording, match="damaged or cut off"):
        Recording.read(tmp_path / "run.npz")


def test_cells_far_off_make_no_rows_of_thousands(tmp_path: Path,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    page = book.active
    for k in range(1, 200):
        page.cell(k, 400, 1.0)
    book.save(tmp_path / "run.xlsx")
    monkeypatch.setattr(spreadsheet, "MOST_CELLS", 10_000)
    with pytest.raises(errors.BadRecording, match="more than 10000 cells"):
        Recording.read(tmp_path / "run.xlsx")


def test_runs_of_one_value_in_parquet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    path = tmp_path / "run.parquet"
    pq.write_table(pa.table({"t": np.zeros(10**6, int), "y": np.zeros(10**6, int)}), path)
    assert path.stat().st_size < 20_000
    monkeypatch.setattr(parquet, "MOST_UNPACKED", 2**20)
    with pytest.raises(errors.BadRecording, match="more than 1 MiB"):
        Recording.read(path)


def test_shapes_that_take_no_bytes_of_a_mat_file(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.mat", "w") as file:
        file["t"] = T
        file.create_dataset("y", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(errors.BadRecording, match="damaged"):
        Recording.read(tmp_path / "run.mat")


def test_compressed_elements_of_an_older_mat_file(tmp_path: Path,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy.io import savemat

    from pikanid.recording.reading import mat5

    savemat(tmp_path / "run.mat", {"t": T, "y": np.zeros(2**18)}, do_compression=True)
    monkeypatch.setattr(mat5, "MOST_UNPACKED", 2**20)
    with pytest.raises(errors.BadRecording, match="damaged"):
        Recording.read(tmp_path / "run.mat")


def test_a_mat_file_opens_no_other_file(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["secret"] = T
    (tmp_path / "raw").write_bytes(T.tobytes())
    with h5py.File(tmp_path / "run.mat", "w") as file:
        file["t"], file["y"] = T, T
        file["linked"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "secret")
        file.create_group("s")["linked"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "secret")
        file.create_dataset("raw", (5,), "f8", external=[(str(tmp_path / "raw"), 0, 40)])
        layout = h5py.VirtualLayout((5,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "secret", (5,))
        file.create_virtual_dataset("virtual", layout)
    found = mat.arrays((tmp_path / "run.mat").read_bytes(), "run.mat")
    assert sorted(found) == ["t", "y"]


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "run.csv")
    with pytest.raises(errors.BadRecording, match="no regular file"):
        Recording.read(tmp_path / "run.csv")
