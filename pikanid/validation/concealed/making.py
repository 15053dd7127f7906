"""A whole set of concealed recordings: resumable, in parallel, the same for any number of workers.

While a set is being made, a folder beside the truth file (its name and ``.unfinished``) keeps the
secret, the finished recordings and the truth about each; from that a run that was interrupted or
killed goes on.  To go on is to know the secret, so it has to lie somewhere: where the user has
chosen to keep the truth, in a folder that nobody else can enter (mode 0700, not a link, files
0600), never among the recordings.  It is removed as soon as the truth file is there, by the next
run if this one is killed in between; whoever gives a set up removes it.

The recordings move to their place all at once, in the order of their numbers: when a file was born
would tell how long its case took, and with that what it hides.  The truth file of a sealed set is
the user's alone as well; who hands it out opens it.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from pikanid import errors
from pikanid.storage.cache import own_folder
from pikanid.storage.outputs import STAGED, atomically
from pikanid.storage.workers import unordered
from pikanid.validation.concealed import files, seal
from pikanid.validation.concealed.case import Case
from pikanid.validation.concealed.seal import Secret

MOST_CASES = 100_000  # limit: of one set
Maker = Callable[[], Case]


@dataclass(frozen=True)
class MadeSet:
    """What a run left behind.

    Attributes:
        folder: Of the recordings.
        truth: File.
        made: Cases made by this run.
        kept: Cases found finished.
    """

    folder: Path
    truth: Path
    made: int
    kept: int


def make_set(out: str | Path, truth: str | Path, settings: Mapping[str, Any],
             cases_of: Callable[[Secret], Mapping[str, Maker]], seed: int | None = None,
             workers: int | None = None,
             step: Callable[[str], None] = lambda text: None) -> MadeSet:
    """Write the recordings of a set to a folder and the truth about it to a file elsewhere.

    Args:
        out: Folder of the recordings and the seal.
        truth: File outside of it.
        settings: Of the set, as they stand in the truth file; `cases` is their number.
        cases_of: From the secret: number of each case, as in its files' names, and what makes it;
            a process can be sent it.
        seed: Known seed of an open set; None for a sealed one.
        workers: Processes; as many as there are cores by default.
        step: Called with the number of a case before the next one is begun.

    Raises:
        BadSetting: If a place is taken, or an unfinished set there has other settings.
    """
    folder, file = Path(out), Path(truth)
    _check_places(folder, file)
    progress = file.with_name(file.name + ".unfinished")
    if file.exists():
        made = _already_made(folder, file, settings, seed)
        _remove(progress, folder, file)  # of a run that was killed after its last step but one
        return made
    key = _begin(progress, folder, settings, seed)
    makers = cases_of(key)
    waiting = {name: make for name, make in makers.items() if not _finished(progress, name)}
    step("the first cases")
    for name in _made_in_parallel(waiting, progress, workers):
        step(name)
    cases = [json.loads(_entry(progress, name).read_bytes()) for name in makers]
    content = seal.truth_content(settings, key, cases)
    _hand_over(cases, progress, folder, seal.seal_content(content, key.sealed))
    atomically(file, content, private=key.sealed)
    _remove(progress, folder, file)
    return MadeSet(folder, file, len(waiting), len(makers) - len(waiting))


def _check_places(folder: Path, file: Path) -> None:
    inside, outer = file.resolve(), folder.resolve()
    if outer == inside or outer in inside.parents:
        raise errors.BadSetting(errors.conceal_truth_inside(str(file), str(folder)))
    if file.is_dir() or (folder.exists() and not folder.is_dir()):
        raise errors.BadSetting(errors.conceal_taken(str(file if file.is_dir() else folder)))
    for place in (folder, file.parent):
        try:
            place.mkdir(parents=True, exist_ok=True)
        except (OSError, ValueError) as failure:
            why = getattr(failure, "strerror", "") or "the system refuses"
            raise errors.BadSetting(errors.cannot_write(str(place), why)) from None


def _already_made(folder: Path, file: Path, settings: Mapping[str, Any],
                  seed: int | None) -> MadeSet:
    """A finished set is left as it is, provided that it is the one asked for."""
    content = seal.read_truth(file)
    same = content.get("settings") == settings and (
        content.get("sealed") if seed is None else content.get("seed") == str(seed))
    if not same or not seal.matches(folder, file):
        raise errors.BadSetting(errors.conceal_taken(str(file)))
    return MadeSet(folder, file, 0, settings["cases"])


def _begin(progress: Path, folder: Path, settings: Mapping[str, Any], seed: int | None) -> Secret:
    """The secret of the unfinished set there, or that of a new one."""
    note = progress / "set.json"
    if note.exists():
        kept = json.loads(note.read_bytes())
        key = Secret(int(kept["seed"]), kept["nonce"], kept["sealed"])
        wanted = key.sealed if seed is None else key.seed == seed
        if kept["settings"] != settings or not wanted:
            raise errors.BadSetting(errors.conceal_other_settings(str(progress)))
        return key
    if any(folder.iterdir()):
        raise errors.BadSetting(errors.conceal_taken(str(folder)))
    key = seal.secret(seed)
    if not own_folder(progress):
        raise errors.BadSetting(errors.conceal_taken(str(progress)))
    atomically(note, files.canonical({
        "seed": str(key.seed), "nonce": key.nonce, "sealed": key.sealed,
        "settings": settings}), private=True)
    return key


def _entry(progress: Path, name: str) -> Path:
    return progress / f"{name}.json"


def _finished(progress: Path, name: str) -> bool:
    entry = _entry(progress, name)
    return entry.exists() and seal.intact(progress, json.loads(entry.read_bytes()))


def _made_in_parallel(makers: Mapping[str, Maker], progress: Path,
                      workers: int | None) -> Iterable[str]:
    number = min(workers or os.cpu_count() or 1, max(len(makers), 1))
    return unordered(_make_one, [(*one, progress) for one in makers.items()], number)


def _make_one(name: str, make: Maker, progress: Path) -> str:
    case = make()
    for file, content in case.recordings.items():
        atomically(progress / file, content, private=True)
    atomically(_entry(progress, name), files.canonical(case.truth), private=True)
    return name


def _hand_over(cases: Sequence[Mapping[str, object]], progress: Path, folder: Path,
               seal_text: bytes) -> None:
    """Recordings and seal into the folder that is given away."""
    names = sorted(name for case in cases for name in cast(dict[str, str], case["sha256"]))
    for name in names:
        atomically(folder / name, (progress / name).read_bytes())
    atomically(folder / seal.SEAL, seal_text)
    files.same_times([folder / name for name in (*names, seal.SEAL)])


def _remove(progress: Path, folder: Path, file: Path) -> None:
    """The unfinished set, and what a kill left of files on their way to their places."""
    if progress.exists():
        shutil.rmtree(progress)
    for leftover in (*folder.glob(STAGED), *file.parent.glob(f".{file.name}{STAGED}")):
        leftover.unlink()
