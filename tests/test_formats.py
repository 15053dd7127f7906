"""The list of file formats is what readers, writers, help and sentences go by."""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from pikanid.cli import main
from pikanid.errors import BadRecording
from pikanid.recording import Recording, formats


@pytest.mark.parametrize("ending", formats.written_endings())
def test_what_can_be_written_can_be_read(tmp_path: Path, ending: str) -> None:
    rec = Recording.from_arrays([0.0, 0.1, 0.2], {"y": [1.0, np.nan, 3.0]}, {"y": "mm"})
    rec.write(tmp_path / f"run{ending}")
    read = Recording.read(tmp_path / f"run{ending}")["y"]
    np.testing.assert_array_equal(read.values, [1.0, np.nan, 3.0])
    assert read.unit == "mm"


def test_every_format_has_endings_and_a_reader_of_its_own() -> None:
    endings = [e for f in formats.FORMATS for e in f.endings]
    assert len(endings) == len(set(endings)) and all(e.startswith(".") for e in endings)
    for f in formats.FORMATS:
        assert f.title in formats.readable()
        reader = import_module(f"pikanid.recording.reading.{f.file}")
        assert list(inspect.signature(reader.read).parameters) == ["content", "where", "options"]
        assert bool(f.written) == hasattr(reader, "content")
        assert all(formats.by_ending(f"run{e}".upper()) is f for e in f.endings)
        assert all(formats.by_ending(f"run{e}.gz") is (f if f.packed else None)
                   for e in f.endings)


def test_help_and_sentences_list_the_formats(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("identify", "diagnose", "extract", "channels"):
        assert main([command, "--help"]) == 0
        told = re.sub(r"[\s│]+", "", capsys.readouterr().out)
        assert formats.readable().replace(" ", "") in told, command
    for command in ("simulate", "design"):
        assert main([command, "--help"]) == 0
        told = re.sub(r"[\s│]+", "", capsys.readouterr().out)
        assert ",".join(formats.written_endings()) in told, command
    (tmp_path / "run.doc").write_text("t,y")
    with pytest.raises(BadRecording) as failure:
        Recording.read(tmp_path / "run.doc")
    assert all(e in str(failure.value) for e in formats.read_endings())


def test_no_list_of_formats_elsewhere() -> None:
    """Which endings a recording may have is asked of the list."""
    root = Path(formats.__file__).parents[1]
    ours = {e for f in formats.FORMATS for e in f.endings} - {".npz", ".txt"}  # others write these
    for path in root.rglob("*.py"):
        if path.name != "formats.py":
            texts = {n.value for n in ast.walk(ast.parse(path.read_text()))
                     if isinstance(n, ast.Constant) and isinstance(n.value, str)}
            assert len(texts & ours) < 3, path
