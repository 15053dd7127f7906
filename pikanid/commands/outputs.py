"""Places that commands write to: checked before any work is done, written all or none."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pikanid import errors

STDOUT = "-"  # where JSON may go instead of to a file


def check_outputs(outputs: Mapping[str, tuple[str | None, Sequence[str]]],
                  inputs: Sequence[str]) -> None:
    """Refuse what could not be written in the end, before any work is done.

    Args:
        outputs: Option -> (path or None, endings that the name may have); JSON may go to standard
            output.
        inputs: Paths that are read and must survive.

    Raises:
        BadSetting: Wrong ending, missing or unwritable folder, no regular file, an input, or two
            options with one path.
    """
    taken: dict[str, str] = {}
    for option, (path, endings) in outputs.items():
        if path is None or (path == STDOUT and option == "--json"):
            continue
        _check_place(option, path, endings)
        real = os.path.realpath(path)
        if any(os.path.realpath(source) == real or _same(source, path) for source in inputs):
            raise errors.BadSetting(errors.output_is_input(option, path))
        if real in taken:
            raise errors.BadSetting(errors.output_twice(taken[real], option, path))
        taken[real] = option


def _check_place(option: str, path: str, endings: Sequence[str]) -> None:
    file = Path(path)
    if not path.lower().endswith(tuple(endings)) or "\0" in path:
        raise errors.BadSetting(errors.output_ending(option, path, endings))
    folder = file.parent
    try:
        if not folder.is_dir():
            raise errors.BadSetting(errors.output_folder(option, path, str(folder)))
        if file.is_dir():
            raise errors.BadSetting(errors.output_refused(option, path, "it is a folder"))
        if file.exists() and not file.is_file():
            raise errors.BadSetting(errors.output_refused(option, path, "it is no regular file"))
        if len(os.fsencode(file.name)) > 200:
            raise errors.BadSetting(errors.output_refused(option, path, "its name is too long"))
    except OSError as failure:
        why = failure.strerror or "the system refuses"
        raise errors.BadSetting(errors.output_refused(option, path, why)) from None
    try:  # what access rights promise the file system may refuse
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        why = f"the folder '{folder}' is not open for writing"
        raise errors.BadSetting(errors.output_refused(option, path, why)) from None


def _same(source: str, path: str) -> bool:
    try:
        return os.path.samefile(source, path)
    except (OSError, ValueError):
        return False


def report_folder(option: str, text: str) -> Path:
    """A report's folder, made if need be, before any work is done.

    Raises:
        BadSetting: If it cannot be made.
    """
    folder = Path(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as failure:
        why = getattr(failure, "strerror", "") or "the system refuses"
        raise errors.BadSetting(errors.output_refused(option, text, why)) from None
    return folder


def written(files: Mapping[str, bytes], json_: str | None, content: Any) -> None:
    """Write files and, if it is asked for, content as JSON: all or none; JSON may be printed.

    Raises:
        BadRecording: If a place cannot be written to.
    """
    from pikanid.reporting import strict_json
    from pikanid.storage.outputs import together

    text = "" if json_ is None else strict_json.text(content)
    together({**files, **({json_: text.encode()} if json_ not in (None, STDOUT) else {})})
    if json_ == STDOUT:
        print(text, end="")


def tell_notes(notes: Iterable[str], quiet: bool) -> None:
    """Sentences about what was given, on standard error."""
    from pikanid.reporting.console import console

    if not quiet:
        for note in notes:
            console(sys.stderr).print(f"Note: {note}", markup=False, soft_wrap=True)
