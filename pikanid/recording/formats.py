"""File formats of recordings: how each is called and recognised, and what reads and writes it.

This list is what help, sentences and readers go by.  No numerical library is needed to know it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

HDF5 = b"\x89HDF\r\n\x1a\n"
ZIP = b"PK\x03\x04"


@dataclass(frozen=True)
class Format:
    """One format.

    Attributes:
        title: In lists, as "CSV".
        name: In sentences, as "a MAT file".
        endings: Of file names, in small letters.
        file: In `pikanid.recording.reading`, that has `read(content, where, options)`, which makes
            a `Table` of the bytes of a file of that name, and `content(channels, ending)`, which
            makes bytes of channels, where something is `written`.
        recognised: Whether bytes are of this format; None for text, which nothing tells.
        written: Endings under which recordings can be written.
        packed: Whether a file may be gzipped, with another ending ``.gz``.
        members: Endings of the files in a folder that stands for one file of this format.
    """

    title: str
    name: str
    endings: tuple[str, ...]
    file: str
    recognised: Callable[[bytes], bool] | None = None
    written: tuple[str, ...] = ()
    packed: bool = False
    members: tuple[str, ...] = ()


def _starts(*marks: bytes) -> Callable[[bytes], bool]:
    return lambda content: content.startswith(marks)


def _workbook(content: bytes) -> bool:
    # the names of the members stand in plain text before each of them
    return content.startswith(ZIP) and (b"xl/" in content or b"[Content_Types].xml" in content)


def _arrays(content: bytes) -> bool:
    return content.startswith(ZIP) and b".npy" in content and not _workbook(content)


def _matlab(content: bytes) -> bool:
    # other programs than MATLAB introduce themselves in the first 116 bytes
    return content.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file", HDF5)) or (
        content[124:128] in (b"\x00\x01IM", b"\x01\x00MI"))


FORMATS = (
    Format("CSV", "text (CSV)", (".csv", ".tsv", ".txt", ".dat", ".asc"), "csv",
           written=(".csv", ".csv.gz", ".tsv", ".tsv.gz"), packed=True),
    Format("Excel", "an Excel workbook (.xlsx)", (".xlsx", ".xlsm"), "spreadsheet", _workbook),
    Format("Excel", "an old Excel workbook (.xls)", (".xls",), "spreadsheet",
           _starts(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")),
    Format("Parquet", "a Parquet file", (".parquet", ".pq"), "parquet", _starts(b"PAR1"),
           written=(".parquet", ".pq")),
    Format("MDF", "an MDF file", (".mf4", ".mdf", ".mf3"), "mdf",
           _starts(b"MDF     ", b"UnFinMF ")),
    Format("ROS bag", "a bag of ROS 1", (".bag",), "ros", _starts(b"#ROSBAG V")),
    Format("ROS bag", "a bag of ROS 2 (MCAP)", (".mcap",), "ros", _starts(b"\x89MCAP0\r\n"),
           members=(".mcap", ".mcap.zstd")),
    Format("ROS bag", "a bag of ROS 2 (SQLite)", (".db3",), "ros", _starts(b"SQLite format 3\0"),
           members=(".db3", ".db3.zstd")),
    Format("TDMS", "a TDMS file", (".tdms",), "tdms", _starts(b"TDSm")),
    Format("HDF5", "an HDF5 file", (".h5", ".hdf5", ".hdf", ".nc"), "hdf5", _starts(HDF5)),
    Format("MAT", "a MAT file", (".mat",), "mat", _matlab),
    Format("NPZ", "an NPZ archive", (".npz",), "npz", _arrays),
)
GZIPPED = Format("gzip", "gzip-compressed", (), "", _starts(b"\x1f\x8b"))
# What else is told apart, to say what a file is.
_KNOWN = (GZIPPED, *FORMATS, Format("ZIP", "a ZIP archive", (), "", _starts(ZIP)))


def by_ending(name: str) -> Format | None:
    """The format that the ending of a file name tells.

    >>> by_ending("run.MAT").title, by_ending("run.csv.gz").title, by_ending("run.mat.gz")
    ('MAT', 'CSV', None)
    """
    lower = name.lower()
    return next((f for f in FORMATS if lower.endswith(f.endings) or (
        f.packed and lower.endswith(tuple(f"{ending}.gz" for ending in f.endings)))), None)


def called(ending: str) -> str:
    """What a file of that ending is, in sentences.

    >>> called(".mat")
    'a MAT file'
    """
    return next(f.name for f in FORMATS if ending in f.endings)


def by_content(content: bytes) -> Format | None:
    """The format that the bytes of a file give away; None for text or rubbish."""
    return next((f for f in _KNOWN if f.recognised and f.recognised(content)), None)


def readable() -> str:
    """The formats that can be read, for people.

    >>> readable()
    'CSV, Excel, Parquet, MDF, ROS bag, TDMS, HDF5, MAT or NPZ'
    """
    *most, last = dict.fromkeys(f.title for f in FORMATS)
    return f"{', '.join(most)} or {last}"


def read_endings() -> tuple[str, ...]:
    """Endings of files that can be read."""
    return tuple(e for f in FORMATS for e in f.endings) + tuple(
        f"{f.endings[0]}.gz" for f in FORMATS if f.packed)


def written_endings() -> tuple[str, ...]:
    """Endings of files that can be written."""
    return tuple(e for f in FORMATS for e in f.written)
