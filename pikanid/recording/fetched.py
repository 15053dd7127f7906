"""Files of public repositories: from a folder, the user's cache or their origin, and checked."""

from __future__ import annotations

import gzip
import hashlib
import os
import zlib
from pathlib import Path

from pikanid import errors
from pikanid.recording.origins import Origin

FOLDER = "PIKANID_DATA"


def content(origin: Origin) -> bytes:
    """The checked bytes of a file, wherever it is found."""
    folder = os.environ.get(FOLDER)
    if folder:
        for local in (Path(folder) / origin.local, Path(folder) / f"{origin.local}.gz"):
            if local.is_file():
                return _checked(local, origin)
    return _checked(_downloaded(origin), origin)


def _downloaded(origin: Origin) -> Path:
    """The file in the cache folder, fetched if it is not there yet."""
    import pooch
    from requests.exceptions import RequestException

    cache = Path(pooch.os_cache("pikanid")) / Path(origin.local).parent
    try:
        return Path(
            pooch.retrieve(origin.url, known_hash=f"sha256:{origin.sha256}", fname=origin.name,
                           path=cache, downloader=pooch.HTTPDownloader(timeout=(5, 60)))
        )
    except (RequestException, OSError, ValueError):
        raise errors.DatasetUnavailable(
            errors.dataset_missing(origin.local, origin.url, FOLDER)) from None


def _checked(path: Path, origin: Origin) -> bytes:
    try:
        found = path.read_bytes()
        if path.suffix == ".gz":
            found = gzip.decompress(found)
    except (OSError, EOFError, zlib.error):
        found = b""
    if hashlib.sha256(found).hexdigest() != origin.sha256:
        raise errors.DatasetUnavailable(errors.dataset_altered(str(path), origin.url))
    return found
