"""Entries of the cache: believed only if whole and the user's own, made again otherwise."""

from __future__ import annotations

import errno
import os
import stat
from collections import namedtuple
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import config

from pikanid.storage import cache
from pikanid.storage.jit import cached_jit

CONTENT = bytes(range(256)) * 4


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PIKANID_CACHE", str(tmp_path / "deep"))
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path / "temporary"))
    return tmp_path / "deep" / "compiled"


def flipped(path: Path, place: int) -> None:
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)


def as_a_link(path: Path) -> None:
    path.rename(path.with_name("elsewhere"))
    path.symlink_to("elsewhere")


DAMAGES: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "shorter than its digest": lambda path: path.write_bytes(path.read_bytes()[:20]),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "longer": lambda path: path.write_bytes(path.read_bytes() + b"\0"),
    "a bit of the digest": lambda path: flipped(path, 3),
    "a bit of the content": lambda path: flipped(path, 700),
    "another entry": lambda path: path.write_bytes(path.with_name("other").read_bytes()),
    "a link": as_a_link,
    "open to others": lambda path: path.chmod(0o666),
    "a pipe": lambda path: (path.unlink(), os.mkfifo(path)),
    "not readable": lambda path: path.chmod(0),
    "absent": Path.unlink,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_made_again(folder: Path, damage: str) -> None:
    cache.keep("other", b"of another one")
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert cache.kept("one", lambda: b"not asked for") == CONTENT
    DAMAGES[damage](folder / "one")
    if damage != "not readable" or os.geteuid() != 0:  # nothing is closed to root
        assert cache.find("one") is None
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert cache.find("one") == CONTENT
    assert cache.find("other") == b"of another one"


def test_what_is_in_the_way_of_an_entry_harms_nobody(folder: Path) -> None:
    cache.keep("other", b"")
    (folder / "one").mkdir()
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert sorted(os.listdir(folder)) == ["one", "other"]


def test_the_folder_is_closed_to_others(folder: Path) -> None:
    assert cache.cache_folder() == folder
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    folder.chmod(0o777)
    cache._folder.cache_clear()
    assert cache.cache_folder() == folder
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_a_linked_folder_is_not_followed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir()
    folder.parent.mkdir()
    folder.symlink_to(tmp_path / "theirs")
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert list((tmp_path / "theirs").iterdir()) == []
    assert cache.cache_folder() != folder


@pytest.mark.parametrize("planted", ["folder", "link"])
def test_a_folder_planted_in_the_temporary_one_is_not_used(
        folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, planted: str) -> None:
    folder.parent.write_text("in the way")
    theirs = tmp_path / "temporary" / "pikanid-4321"
    theirs.parent.mkdir(parents=True)
    if planted == "folder":
        theirs.mkdir(mode=0o700)
    else:
        (tmp_path / "mine").mkdir()
        theirs.symlink_to(tmp_path / "mine")
    monkeypatch.setattr(os, "getuid", lambda: 4321)  # not the owner of what lies there
    assert cache.cache_folder() is None
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert cache.find("one") is None


def test_an_entry_of_somebody_else_is_not_used(
        folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache.keep("one", CONTENT)
    monkeypatch.setattr(cache, "cache_folder", lambda: folder)
    monkeypatch.setattr(os, "getuid", lambda: 4321)
    assert cache.find("one") is None


def test_it_works_where_users_have_no_numbers(
        folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "getuid")
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert cache.find("one") == CONTENT
    folder.parent.rename(folder.parent.with_name("moved"))
    folder.parent.write_text("in the way")
    cache._folder.cache_clear()
    assert cache.kept("one", lambda: b"made") == b"made"
    assert cache.find("one") == b"made"  # below the temporary folder


def test_a_full_disk_is_nobodys_failure(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    cache.keep("other", b"")
    monkeypatch.setattr(os, "replace", full)
    assert cache.kept("one", lambda: CONTENT) == CONTENT
    assert os.listdir(folder) == ["other"]


def test_names_depend_on_versions_and_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {cache.named("x", 1), cache.named("x", "1"), cache.named("x", 1, 2)}
    for owner, name in ((numba, "__version__"), (np, "__version__"), (cache.sys, "version"),
                        (__import__("llvmlite"), "__version__"), (config, "CPU_NAME")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, "another")
            cache._versions.cache_clear()
            names.add(cache.named("x", 1))
    cache._versions.cache_clear()
    assert len(names) == 8
    assert cache.named("x", 1) in names


def adding(constant: object, **options: object) -> Callable[[float], float]:
    @numba.njit
    def called(x):  # type: ignore[no-untyped-def]
        return x + constant

    @cached_jit(**options)
    def caller(x):  # type: ignore[no-untyped-def]
        return 2.0 * called(x)

    return caller


def hits(function: object) -> tuple[int, int]:
    stats = function.stats  # type: ignore[attr-defined]
    return sum(stats.cache_hits.values()), sum(stats.cache_misses.values())


def test_machine_code_is_found_again_and_never_that_of_another_callee(folder: Path) -> None:
    first, again, other = adding(1.0), adding(1.0), adding(2.0)
    assert first(1.0) == again(1.0) == 4.0
    assert other(1.0) == 6.0  # its own text is the same: only what it calls differs
    assert (hits(first), hits(again), hits(other)) == ((0, 1), (1, 0), (0, 1))
    for path in folder.iterdir():
        flipped(path, path.stat().st_size // 2)
    healed = adding(1.0)
    assert healed(1.0) == 4.0
    assert hits(healed) == (0, 1)


def test_machine_code_depends_on_all_that_it_is_made_from() -> None:
    pair, turned = namedtuple("P", "a b"), namedtuple("P", "b a")
    made = [adding(1.0), adding(1), adding(np.array([1.0])), adding(np.array([2.0])),
            adding((1.0,)), adding(pair(1.0, 2.0)), adding(pair), adding(turned),
            adding(np.dtype("f4")), adding(1.0, error_model="numpy"),
            adding(adding(1.0)), adding(adding(2.0))]
    number = numba.float64(numba.float64)
    names = [m._cache._name(number) for m in made]  # type: ignore[attr-defined]
    assert len(set(names)) == len(names)
    assert names[0] == adding(1.0)._cache._name(number)  # type: ignore[attr-defined]
    kinds = [numba.types.NamedTuple((numba.float64,) * 2, cls) for cls in (pair, turned)]
    assert len({made[0]._cache._name((k,)) for k in kinds}) == 2  # type: ignore[attr-defined]
