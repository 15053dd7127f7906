"""Excel workbooks, new (.xlsx, openpyxl) and old (.xls, xlrd)."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

from pikanid import errors
from pikanid.recording.formats import by_content, called
from pikanid.recording.reading.table import Options, Table, from_rows
from pikanid.storage.limits import DAMAGE

MOST_CELLS = 20_000_000  # limit: of a sheet, up to the last one of each row that holds something


def read(content: bytes, where: str, options: Options) -> Table:
    """The table on one sheet; row numbers are those that Excel shows.

    Args:
        content: Bytes of the file.
        where: Its name, for messages.
        options: The sheet.

    Raises:
        BadRecording: If the workbook is damaged, or the sheet is missing or empty.
    """
    rows, numbers = cells(content, where, options.sheet)
    if not rows:
        raise errors.BadRecording(errors.no_rows(where))
    return from_rows(where, rows, numbers)


def cells(content: bytes, where: str,
          sheet: str | int | None) -> tuple[list[list[object]], list[int]]:
    """The rows of a sheet that are not empty, cut to their common width, and their numbers."""
    found = by_content(content)
    new = found is not None and ".xlsx" in found.endings
    raw = (_xlsx if new else _xls)(content, where, sheet)
    kept = [k for k, row in enumerate(raw) if any(not _blank(cell) for cell in row)]
    width = max((k + 1 for row in raw for k, cell in enumerate(row) if not _blank(cell)), default=0)
    squared = [[*raw[k], *[None] * width][:width] for k in kept]
    return squared, [k + 1 for k in kept]


def _blank(cell: object) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _xlsx(content: bytes, where: str, sheet: str | int | None) -> list[list[object]]:
    try:
        import openpyxl
    except ImportError:
        raise errors.BadSetting(errors.not_installed(".xlsx", "openpyxl", "excel")) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on styles and extensions that hold no data
            book: Any = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
            try:
                page = book[_sheet(book.sheetnames, sheet, where)]
                # Some writers understate the size of the sheet.
                getattr(page, "reset_dimensions", lambda: None)()
                return _within(page.iter_rows(values_only=True), where)
            finally:
                book.close()
    except DAMAGE:
        raise errors.BadRecording(errors.damaged(where, called(".xlsx"))) from None


def _within(rows: Iterable[Sequence[object]], where: str) -> list[list[object]]:
    """Rows up to their last cell that holds something; a cell far off makes a row of thousands."""
    kept: list[list[object]] = []
    room = MOST_CELLS
    for row in rows:
        width = next((k for k in range(len(row), 0, -1) if row[k - 1] is not None), 0)
        kept.append(list(row[:width]))
        room -= width + 1
        if room < 0:
            raise errors.BadRecording(errors.too_many_cells(where, MOST_CELLS))
    return kept


def _xls(content: bytes, where: str, sheet: str | int | None) -> list[list[object]]:
    try:
        import xlrd
    except ImportError:
        raise errors.BadSetting(errors.not_installed(".xls", "xlrd", "excel")) from None
    try:
        book: Any = xlrd.open_workbook(file_contents=content, logfile=io.StringIO())
        page = book.sheet_by_name(_sheet(book.sheet_names(), sheet, where))
        return _within(([_xls_cell(cell, book.datemode) for cell in page.row(k)]
                        for k in range(page.nrows)), where)
    except (*DAMAGE, xlrd.XLRDError, xlrd.compdoc.CompDocError):
        raise errors.BadRecording(errors.damaged(where, called(".xls"))) from None


def _xls_cell(cell: Any, datemode: int) -> object:
    import xlrd

    if cell.ctype == xlrd.XL_CELL_DATE:
        return xlrd.xldate_as_datetime(cell.value, datemode)
    if cell.ctype == xlrd.XL_CELL_ERROR:
        return f"#{xlrd.error_text_from_code.get(cell.value, 'ERROR').lstrip('#')}"
    return None if cell.ctype in (xlrd.XL_CELL_EMPTY, xlrd.XL_CELL_BLANK) else cell.value


def _sheet(names: list[str], wanted: str | int | None, where: str) -> str:
    if wanted is None:
        return names[0]
    if isinstance(wanted, str) and wanted in names:
        return wanted
    if str(wanted).isdecimal() and int(wanted) < len(names):
        return names[int(wanted)]
    raise errors.BadRecording(errors.no_sheet(where, str(wanted), names))
