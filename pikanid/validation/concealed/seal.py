"""The truth about a set of recordings, and the seal that lets anybody check it afterwards.

The truth file holds the seed and a nonce; the folder that is given away holds only the SHA-256 of
the truth file.  The nonce keeps anyone from guessing the truth by trying hashes, and the hash keeps
anyone from changing the truth later.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pikanid import errors
from pikanid.storage.limits import json_content
from pikanid.validation.concealed import files

SCHEMA_VERSION = 1  # definition: of the format that files name
GENERATOR = "pikanid.validation.concealed 1"
SEAL = "seal.json"


@dataclass(frozen=True)
class Settings:
    """What a set is made from; two runs with equal settings and seed give equal bytes.

    Attributes:
        cases: How many.
        excitation: One of `excitations.CHOICES`.
        sigma: Noise [rad].
        mix: Share of each class.
    """

    cases: int
    excitation: str
    sigma: float
    mix: Mapping[str, float]


@dataclass(frozen=True)
class Secret:
    """Where the randomness comes from.

    Attributes:
        seed: Of everything random.
        nonce: Hexadecimal.
        sealed: Whether nobody knows them but the truth file.
    """

    seed: int
    nonce: str
    sealed: bool


def secret(seed: int | None) -> Secret:
    """From the operating system, or an open one for a known seed.

    >>> secret(7) == secret(7), secret(None).nonce == secret(None).nonce
    (True, False)
    """
    if seed is None:
        return Secret(secrets.randbits(128), secrets.token_hex(32), sealed=True)
    nonce = hashlib.sha256(f"pikanid open set {seed}".encode()).hexdigest()
    return Secret(seed, nonce, sealed=False)


def truth_content(settings: Mapping[str, object], key: Secret,
                  cases: Sequence[Mapping[str, object]]) -> bytes:
    """The truth file."""
    return files.canonical({
        "schema_version": SCHEMA_VERSION, "generator": GENERATOR, "sealed": key.sealed,
        "open": not key.sealed, "seed": str(key.seed), "nonce": key.nonce,
        "settings": dict(settings), "cases": list(cases)})


def seal_content(truth: bytes, sealed: bool) -> bytes:
    """The seal of a truth file."""
    return files.canonical({
        "schema_version": SCHEMA_VERSION, "generator": GENERATOR, "sealed": sealed,
        "sha256": hashlib.sha256(truth).hexdigest(),
        "of": "the truth file, byte for byte; it holds a nonce"})


def read_truth(path: str | Path) -> dict[str, object]:
    """The content of a truth file.

    Raises:
        BadSetting: If it cannot be read or is no truth file.
    """
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.unreadable("truth file", str(path), detail))

    content = json_content(path, wrong)
    if not isinstance(content, dict) or content.get("schema_version") != SCHEMA_VERSION:
        raise wrong("it is none of this version")
    return content


def cases_of(path: str | Path) -> list[Mapping[str, Any]]:
    """The entries of a truth file.

    Raises:
        BadSetting: If it cannot be read or has none.
    """
    found = read_truth(path).get("cases")
    if not isinstance(found, list) or not all(isinstance(case, dict) for case in found):
        raise errors.BadSetting(errors.unreadable("truth file", str(path), "it has no cases"))
    return found


def matches(folder: str | Path, truth: str | Path) -> bool:
    """Whether a truth file is the sealed one, and the recordings are those that it speaks of.

    Raises:
        BadSetting: If the truth or the seal cannot be read.
    """
    content = read_truth(truth)
    seal = read_truth(Path(folder) / SEAL)
    if hashlib.sha256(Path(truth).read_bytes()).hexdigest() != seal.get("sha256"):
        return False
    cases = content.get("cases")
    return isinstance(cases, list) and all(
        isinstance(case, dict) and intact(Path(folder), case) for case in cases)


def intact(folder: Path, case: Mapping[str, object]) -> bool:
    """Whether the recordings of a case are there, unaltered."""
    hashes = case.get("sha256")
    if not isinstance(hashes, dict):
        return False
    for name, wanted in hashes.items():
        # a name that leads out of the folder, or is none
        if Path(name).name != name or len(name) > 200:
            return False
        path = folder / name
        if not path.is_file() or hashlib.sha256(path.read_bytes()).hexdigest() != wanted:
            return False
    return True
