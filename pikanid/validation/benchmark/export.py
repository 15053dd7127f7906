"""Finished trials as a table: Parquet or CSV, one row for every trial and parameter."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pikanid import errors
from pikanid.validation.benchmark.store import read

if TYPE_CHECKING:
    import pandas as pd

ABOUT = b"pikanid.benchmark"  # definition: key of the store's own data in a Parquet file


def table(folder: Path) -> tuple[dict[str, str], pd.DataFrame]:
    """What a store says about itself, and its rows.

    Raises:
        BadRecording: There is no store, or it is damaged.
    """
    import pandas as pd

    about, rows = read(folder)
    return about, pd.DataFrame(rows)


def files(folder: Path, about: Mapping[str, str], frame: pd.DataFrame) -> dict[Path, bytes]:
    """`trials.csv` and, where pyarrow is installed, `trials.parquet`, to be written."""
    made = {folder / "trials.csv": frame.to_csv(index=False).encode()}
    with suppress(errors.BadSetting):
        made[folder / "trials.parquet"] = parquet(about, frame)
    return made


def parquet(about: Mapping[str, str], frame: pd.DataFrame) -> bytes:
    """The rows and what the store says about itself.

    Raises:
        BadSetting: pyarrow is not installed.
    """
    pa, pq = _pyarrow()
    made = pa.Table.from_pandas(frame, preserve_index=False)
    made = made.replace_schema_metadata(
        {**(made.schema.metadata or {}), ABOUT: json.dumps(dict(about)).encode()})
    buffer = BytesIO()
    pq.write_table(made, buffer, compression="zstd")
    return buffer.getvalue()


def from_parquet(path: Path) -> tuple[dict[str, str], pd.DataFrame]:
    """What `parquet` wrote.

    Raises:
        BadSetting: pyarrow is not installed.
        BadRecording: It is no such file.
    """
    pa, pq = _pyarrow()
    try:
        made = pq.read_table(path)
        about: dict[str, str] = json.loads(made.schema.metadata[ABOUT])
    except (OSError, ValueError, KeyError, TypeError, pa.ArrowException):
        raise errors.BadRecording(errors.damaged(str(path), "a table of trials")) from None
    return about, made.to_pandas()


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise errors.BadSetting(
            errors.not_installed("A Parquet file", "pyarrow", "parquet")) from None
    return pa, pq
