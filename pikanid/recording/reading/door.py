"""Which kind of file this is, by its ending and by its content, and the plain failures."""

from __future__ import annotations

import os
from pathlib import Path

from pikanid import errors
from pikanid.storage.limits import DAMAGE, file_bytes, gunzipped, unpacked_size

ENDINGS = {
    ".csv": "csv",
    ".tsv": "csv",
    ".txt": "csv",
    ".dat": "csv",
    ".asc": "csv",
    ".xlsx": "xlsx",
    ".xlsm": "xlsx",
    ".xls": "xls",
    ".parquet": "parquet",
    ".pq": "parquet",
    ".mat": "mat",
    ".npz": "npz",
}
NAMES = {
    "csv": "text (CSV)",
    "xlsx": "an Excel workbook (.xlsx)",
    "xls": "an old Excel workbook (.xls)",
    "parquet": "a Parquet file",
    "mat": "a MAT file",
    "hdf5": "an HDF5 file",
    "npz": "an NPZ archive",
    "zip": "a ZIP archive",
    "gzip": "gzip-compressed",
}
FOREIGN_FAILURES = DAMAGE


def kind_and_content(path: str | os.PathLike[str]) -> tuple[str, bytes, str]:
    """The kind of a file, its bytes (unpacked if gzipped text) and its stem.

    Raises:
        BadRecording: If it is missing, a directory, empty, unreadable, of unknown ending, or
            something else than its ending says.
    """
    if not isinstance(path, str | os.PathLike):
        raise errors.BadRecording(errors.no_path(type(path).__name__))
    file = Path(path)
    where = file.name or str(path)
    try:
        missing, folder = not file.exists(), file.is_dir()
    except (ValueError, OSError):  # a NUL in the name, a name that is too long
        missing, folder = True, False
    if missing:
        raise errors.BadRecording(errors.no_file(str(path)))
    if folder:
        raise errors.BadRecording(errors.is_folder(str(path)))
    packed = file.suffix.lower() == ".gz"
    ending = Path(file.stem).suffix.lower() if packed else file.suffix.lower()
    kind = ENDINGS.get(ending)
    if kind is None or (packed and kind != "csv"):
        known = [*ENDINGS, ".csv.gz"]
        raise errors.BadRecording(errors.unknown_ending(where, known))
    content = file_bytes(file, lambda why: errors.BadRecording(errors.cannot_open(where, why)))
    if not content:
        raise errors.BadRecording(errors.empty_file(where))
    actual = _sniff(content)
    if actual == "gzip" and kind == "csv":
        content = gunzipped(content, lambda why: errors.BadRecording(
            errors.cannot_unpack(where, why)))
        if not content:
            raise errors.BadRecording(errors.empty_file(where))
        actual = _sniff(content)
    if actual == "hdf5" and kind == "mat":
        actual = "mat"
    if {actual, kind} == {"xls", "xlsx"}:
        kind = actual  # Excel itself opens either under both endings
    if actual and actual != kind:
        raise errors.BadRecording(errors.wrong_ending(where, NAMES[actual], NAMES[kind]))
    if not actual and kind != "csv":
        raise errors.BadRecording(errors.damaged(where, NAMES[kind]))
    if kind in ("xlsx", "npz"):
        unpacked_size(content, lambda why: errors.BadRecording(errors.cannot_unpack(where, why)))
    stem = Path(file.stem).stem if packed else file.stem
    return kind, content, stem or where


def _sniff(content: bytes) -> str:
    """The kind that the first bytes give away, "" for text or rubbish."""
    marks = {
        b"\x1f\x8b": "gzip",
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": "xls",
        b"PAR1": "parquet",
        b"\x89HDF\r\n\x1a\n": "hdf5",
        b"MATLAB 5.0 MAT-file": "mat",
        b"MATLAB 7.3 MAT-file": "mat",
    }
    for mark, kind in marks.items():
        if content.startswith(mark):
            return kind
    if content[124:128] in (b"\x00\x01IM", b"\x01\x00MI"):
        return "mat"  # other programs introduce themselves in the first 116 bytes
    if not content.startswith(b"PK\x03\x04"):
        return ""
    # The names of the members stand in plain text before each of them.
    if b"xl/" in content or b"[Content_Types].xml" in content:
        return "xlsx"
    return "npz" if b".npy" in content else "zip"
