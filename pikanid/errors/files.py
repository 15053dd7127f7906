"""What can be wrong with a file, and with what one holds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pikanid.errors.wording import listed, short


def detail_no_path(kind: str) -> str:
    return f"the path of a file is needed, not a {kind}"


def no_path(kind: str) -> str:
    return f"The path of a file is needed, not a {kind}."


def no_file(path: str) -> str:
    return f"There is no file '{short(path, 200)}'."


def is_folder(path: str) -> str:
    return f"'{path}' is a folder; give one of the files in it."


def cannot_open(where: str, reason: str) -> str:
    return f"'{where}' cannot be opened: {reason or 'the system refuses'}."


def cannot_write(path: str, reason: str) -> str:
    return f"'{path}' cannot be written: {reason or 'the system refuses'}."


def empty_file(where: str) -> str:
    return f"'{where}' is empty."


def unknown_ending(where: str, known: Iterable[str]) -> str:
    return f"'{where}': the ending of the name tells no known format (known: {listed(known)})."


def wrong_ending(where: str, actual: str, wanted: str) -> str:
    return f"'{where}' is {actual}, not {wanted} as its name says: rename it."


def damaged(where: str, kind: str) -> str:
    return f"'{where}' cannot be read as {kind}: it is damaged or cut off."


def cannot_unpack(where: str, reason: str) -> str:
    return f"'{where}' cannot be unpacked: {reason}."


def binary_junk(where: str) -> str:
    return f"'{where}' is not text: it holds binary data, so it is no CSV."



def no_rows(where: str) -> str:
    return f"'{where}' holds no rows of data."


def no_vectors(where: str) -> str:
    return f"'{where}' holds no numeric vector of two or more values."


def no_signals(where: str) -> str:
    return f"'{where}' holds no signals: no channel in it has samples."


def damaged_signal(where: str, path: str) -> str:
    return (f"'{where}': the samples of '{path}' cannot be read: they are damaged, or of a kind "
            "that is none of numbers.")


def no_number_signal(where: str, path: str) -> str:
    return f"'{where}': '{path}' holds text or bytes, not numbers."


def too_much_at_once(where: str, most: int, known: Sequence[str]) -> str:
    return (f"'{where}' holds more than {most / 2**20:.4g} MiB of samples: name those that you "
            "need (--column NAME=CHANNEL, in Python columns={'name in the model': 'its name'}); it "
            f"has: {listed(known)}.")


def several_columns(where: str, wanted: str, names: Sequence[str]) -> str:
    return (f"'{where}': '{wanted}' fits several channels: {listed(names)}; give one of these "
            "names, or a pattern that fits one.")


def note_cut_off(where: str) -> str:
    return f"'{where}' is cut off: its last samples are missing."


def note_other_stamps(seconds: float) -> str:
    return (f"Stamps of messages are of another clock than the recorder's: {seconds:.9g} s were "
            "added to them.")


def note_overtaken(topic: str, number: int) -> str:
    return (f"{number} messages of '{topic}' were not recorded in the order of their stamps: they "
            "are put in it.")


def note_two_clocks(topics: Sequence[str]) -> str:
    return ("Messages without a stamp are on the recorder's clock, which counts delays in: "
            f"{listed(topics)}.")


def too_slow(where: str, kind: str) -> str:
    return f"'{where}' takes too long to read as {kind}: it is damaged, or far too large."


def unit_to_be_told(unit: str) -> str:
    return f"its unit '{unit}' is unknown: say what is meant (--unit NAME=UNIT)"


def times_to_be_told() -> str:
    return "no times: name their column (--column t=COLUMN) or the rate (--rate HZ)"


def files_of_one_name(stem: str) -> str:
    return (f"Two of the files that are read together are called '{stem}': rename one, so that "
            "their channels can be told apart.")


def too_many_cells(where: str, most: int) -> str:
    return f"'{where}' holds more than {most} cells: save what you need as CSV or Parquet."


def no_sheet(where: str, sheet: str, known: Iterable[str]) -> str:
    return f"'{where}' has no sheet '{sheet}' (sheets: {listed(known)})."


def ragged_row(where: str, row: int, cells: int, wanted: int) -> str:
    return (f"'{where}', row {row}: {cells} cell(s) where the header has {wanted}; the file may be "
            "cut off, or its delimiter be another (in Python delimiter=).")


def not_a_number(where: str, row: int, header: str, cell: str) -> str:
    return f"'{where}', row {row}, column '{header}': '{short(cell, 40)}' is not a number."


def not_an_iso_date(where: str, row: int, header: str, cell: str) -> str:
    return (f"'{where}', row {row}, column '{header}': '{short(cell, 40)}' is not a number; of "
            "dates only those as 2024-03-31T13:50:00 are read, or give seconds.")


def header_twice(where: str, header: str) -> str:
    return f"'{where}' has two columns called '{header}': rename one of them."


def no_time(where: str, known: Iterable[str]) -> str:
    return (f"'{where}' has no time column among: {listed(known)}. Name it "
            "(--column t=COLUMN, in Python columns={'t': 'its header'}) or give the sampling rate "
            "in Hz (--rate, in Python rate=).")


def time_length(where: str, name: str, n: int, wanted: int) -> str:
    return f"'{where}': '{name}' has {n} values but its time column has {wanted}."


def bad_rate(rate: float) -> str:
    return f"A sampling rate of {rate:g} Hz cannot be: it must be positive and finite."


def rate_disagrees(where: str, rate: float, name: str, actual: float) -> str:
    return (f"'{where}' has the time column '{name}' sampled at {actual:.6g} Hz, not at {rate:g} "
            "Hz: leave out the rate, or map another column to 't'.")


def bad_delimiter(text: str) -> str:
    return f"{text!r} cannot delimit cells: give one character, such as ';'."


def bad_decimal(text: str) -> str:
    return f"{text!r} cannot be the decimal sign here: it must be '.' or ',', not the delimiter."


def dataset_missing(local: str, url: str, variable: str) -> str:
    return (f"The recording '{local}' is not on this machine and cannot be downloaded: connect to "
            f"the network, or fetch {url} yourself and set {variable} to the folder that holds "
            f"'{local}'.")


def dataset_altered(path: str, url: str) -> str:
    return f"'{path}' is not the original file (its checksum differs): fetch it again from {url}."


def no_such_data(what: str, given: str, known: Iterable[str]) -> str:
    return f"There is no {what} '{given}' (known: {listed(known)})."


def detail_too_large(given: int, most: int) -> str:
    return f"it holds {given / 2**20:.4g} MiB, more than the {most / 2**20:.4g} that are read"


def detail_unpacks(most: int) -> str:
    return (f"it would unpack to more than {most / 2**20:.4g} MiB of memory; unpack it yourself if "
            "you trust it")


def detail_memory(most: int) -> str:
    return f"what it holds would take more than {most / 2**20:.4g} MiB of memory"


def too_many_entries(where: str, given: int, most: int) -> str:
    return f"{where} has {given} entries; more than {most} are not read."


def entry_lacks(where: str, missing: Sequence[str]) -> str:
    return f"{where} lacks {listed(missing)}."


def entry_extra(where: str, extra: Sequence[str], known: Sequence[str]) -> str:
    return f"{where} holds {listed(extra)}, which is unknown (known: {listed(known)})."


def entry_negative(where: str) -> str:
    return f"{where[:1].upper()}{where[1:]} holds negative numbers."


def entry_too_deep(where: str) -> str:
    return f"{where} is nested too deeply: nothing of ours writes that."


def unreadable(what: str, path: str, detail: str) -> str:
    return f"The {what} '{short(path, 200)}' cannot be read: {detail.rstrip('.')}."


def not_installed(what: str, module: str, extra: str) -> str:
    return f"{what} needs '{module}', which is not installed: pip install 'pikanid[{extra}]'."


def region_outside(roi: Sequence[int] | None, shape: Sequence[int]) -> str:
    return (f"The region {roi} (left, top, width, height) does not lie within the picture of "
            f"{shape[1]} x {shape[0]} pixels.")


def bad_frame_rate(rate: float) -> str:
    return f"A video cannot have {rate:g} frames per second; give the camera's rate."


def no_surface(where: str, frames: int, reasons: Sequence[str]) -> str:
    why = f" ({'; '.join(reasons)})" if reasons else ""
    return (f"'{where}' shows a surface in fewer than two of {frames} readable frames{why}: check "
            "the file and the region.")


def counted_as_seconds(name: str) -> str:
    return (f"The whole numbers of '{name}' have no unit and are read as seconds: "
            "'--unit t=ms' says that they are something else.")
