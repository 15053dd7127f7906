"""Files are written whole or not at all, those of one run together, with ordinary permissions."""

from __future__ import annotations

import ast
import errno
import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pikanid
from pikanid import errors
from pikanid.cli import main
from pikanid.estimate import Estimate
from pikanid.recording import Recording
from pikanid.storage.outputs import atomically, together

PACKAGE = Path(pikanid.__file__).parent


@pytest.fixture
def mask() -> Iterator[int]:
    """A mask of the user's that no library call may change."""
    before = os.umask(0o027)
    yield 0o027
    assert os.umask(before) == 0o027


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_permissions_are_ordinary_ones(tmp_path: Path, mask: int) -> None:
    atomically(tmp_path / "a", b"1")
    assert mode(tmp_path / "a") == 0o666 & ~mask
    atomically(tmp_path / "secret", b"1", private=True)
    assert mode(tmp_path / "secret") == 0o600


def full(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("broken", ["fsync", "replace"])
def test_a_full_disk_changes_none_of_the_files(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str) -> None:
    atomically(tmp_path / "a", b"old")
    monkeypatch.setattr(os, broken, full)
    with pytest.raises(errors.BadRecording, match="No space left"):
        together({tmp_path / "a": b"new", tmp_path / "b": b"new"})
    assert os.listdir(tmp_path) == ["a"]
    assert (tmp_path / "a").read_bytes() == b"old"


@pytest.mark.parametrize("spoil", [lambda p: p.mkdir(), lambda p: p.parent.rmdir()],
                         ids=["is a folder", "no such folder"])
def test_a_place_that_cannot_be_written_spares_the_other(
        tmp_path: Path, spoil: Callable[[Path], None]) -> None:
    (tmp_path / "sub").mkdir()
    spoil(tmp_path / "sub" / "b")
    atomically(tmp_path / "a", b"old")
    with pytest.raises(errors.BadRecording, match=r"sub.b.*cannot be written"):
        together({tmp_path / "a": b"new", tmp_path / "sub" / "b": b"new"})
    assert (tmp_path / "a").read_bytes() == b"old"
    assert not list(tmp_path.rglob("*.part"))


def test_an_interrupt_leaves_nothing_behind(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        together({tmp_path / "a": b"new", tmp_path / "b": b"new"})
    assert list(tmp_path.iterdir()) == []


def test_all_is_there_before_the_first_is_renamed(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes, rename = [], os.replace

    def noted(source: Path, target: Path) -> None:
        sizes.append(sorted(p.stat().st_size for p in tmp_path.iterdir()))
        rename(source, target)

    monkeypatch.setattr(os, "replace", noted)
    together({tmp_path / "a": b"1", tmp_path / "b": b"22"})
    assert sizes == [[1, 2], [1, 2]]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    t = np.linspace(0.0, 2.0, 81)
    path = tmp_path_factory.mktemp("outputs") / "run.csv"
    drive = Recording.from_arrays(t, {"u_x": np.sin(9 * t)}, {"u_x": "m/s^2"})
    from pikanid.model import systems
    from pikanid.simulation import simulate

    simulate(systems.sloshing(), drive, sigma=1e-3).write(path)
    return path


def test_outputs_of_identify_come_together(
        recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mask: int) -> None:
    names = ["fit.json", "fit.png", "estimate.json"]
    command = ["identify", str(recording), "-m", "sloshing", "-q"]
    for option, name in zip(("--json", "--plot", "--save"), names, strict=True):
        command += [option, str(tmp_path / name)]
    writes = []
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: writes.append(1) or (full() if writes[2:] else None))
        assert main(command) == 2
    assert list(tmp_path.iterdir()) == []  # two were written, the third found the disk full
    assert main(command) == 0
    assert sorted(os.listdir(tmp_path)) == sorted(names)
    assert {mode(tmp_path / name) for name in names} == {0o640}


def test_a_saved_estimate_has_ordinary_permissions(
        recording: Path, tmp_path: Path, mask: int) -> None:
    found = pikanid.NLS().fit(
        pikanid.model.systems.sloshing(), Recording.read(recording))
    replace(found, seconds=0.0).save(tmp_path / "a.json.gz")
    assert mode(tmp_path / "a.json.gz") == 0o640
    assert Estimate.load(tmp_path / "a.json.gz").free == found.free
    with pytest.raises(errors.BadRecording, match="cannot be written"):
        found.save(tmp_path / "missing" / "a.json")


def writes(node: ast.Call) -> str | None:
    """The name of a call that makes a file, or None."""
    called = ast.unparse(node.func)
    name = called.split(".")[-1]
    if called in ("os.replace", "os.rename", "np.save", "np.savetxt", "shutil.move"):
        return called
    if name in ("write_text", "write_bytes", "mkstemp", "NamedTemporaryFile"):
        return called
    if name == "to_csv" and node.args:
        return called  # without a path it goes into memory
    if name == "savefig" and "format" not in {k.arg for k in node.keywords}:
        return called  # with a format it goes into memory
    if called in ("open", "gzip.open"):
        modes = [a for a in [*node.args[1:2], *(k.value for k in node.keywords if k.arg == "mode")]]
        return called if any(set("wax+") & set(ast.unparse(m)) for m in modes) else None
    return None


def test_one_module_writes_files() -> None:
    found = {
        f"{path.relative_to(PACKAGE)}: {writes(node)}"
        for path in PACKAGE.rglob("*.py")
        if path.relative_to(PACKAGE).as_posix() not in ("storage/outputs.py", "storage/cache.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and writes(node)
    }
    assert found == set(), "write files by pikanid.storage.outputs"
