"""MATLAB files: level 5 (`mat5`) and 7.3 (HDF5, h5py), structures and cells flattened.

``Theta1.signals.values`` is a field of nested structures, ``Y_id.2`` the second cell of a cell
array; counting starts at 1, as in MATLAB.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from pikanid import errors
from pikanid.recording.formats import called
from pikanid.recording.reading import mat5
from pikanid.recording.reading.arrays import columns
from pikanid.recording.reading.table import Options, Table
from pikanid.storage.limits import DAMAGE, MOST_UNPACKED

_DEEPEST = 8  # limit: structures within structures
_MOST_CELLS = 1000  # limit: cells or structures looked into


def read(content: bytes, where: str, options: Options) -> Table:
    """The vectors in a MAT file, each a column named by its path.

    Raises:
        BadRecording: If the file is damaged or holds no vectors.
    """
    found = columns(arrays(content, where))
    if not found:
        raise errors.BadRecording(errors.no_vectors(where))
    return Table(found, shared_time=False)


def arrays(content: bytes, where: str) -> dict[str, np.ndarray]:
    """Every numeric array of the file by its path."""
    hdf5 = content.startswith((b"\x89HDF", b"MATLAB 7.3"))
    return dict((_v73 if hdf5 else _v5)(content, where))


def _v5(content: bytes, where: str) -> list[tuple[str, np.ndarray]]:
    try:
        return list(mat5.leaves(content))
    except DAMAGE:
        raise errors.BadRecording(errors.damaged(where, called(".mat"))) from None


def _v73(content: bytes, where: str) -> list[tuple[str, np.ndarray]]:
    try:
        import h5py
    except ImportError:
        raise errors.BadSetting(errors.not_installed("MAT 7.3", "h5py", "mat")) from None
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            room = [MOST_UNPACKED]
            return [
                leaf
                for name in file
                if not name.startswith("#") and _inside(file, name)
                for leaf in _flat_hdf5(name, file[name], file, 0, room)
            ]
    except DAMAGE:
        raise errors.BadRecording(errors.damaged(where, called(".mat"))) from None


def _inside(group: Any, name: str) -> bool:
    """Whether a member lies in this file: one may name another file, or a pipe that never ends."""
    import h5py

    return not isinstance(group.get(name, getlink=True), h5py.ExternalLink)


def _flat_hdf5(path: str, node: Any, file: Any, depth: int,
               room: list[int]) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    if depth > _DEEPEST:
        return
    if isinstance(node, h5py.Group):
        for field in node:
            if _inside(node, field):
                yield from _flat_hdf5(f"{path}.{field}", node[field], file, depth + 1, room)
        return
    if node.external is not None or node.is_virtual:  # its values lie in other files
        return
    room[0] -= node.size * max(node.dtype.itemsize, 8) if node.size else 0
    if room[0] < 0:  # a shape takes no bytes of the file: what is not written reads as zeros
        raise ValueError("more than is read")
    if "MATLAB_empty" in node.attrs or node.attrs.get("MATLAB_class", b"") == b"char":
        return
    if node.dtype.kind == "O":
        # A cell array, or one field of an array of structures, is a dataset of references.
        if h5py.check_ref_dtype(node.dtype) is h5py.Reference:
            for k, reference in enumerate(np.asarray(node[()]).ravel()[:_MOST_CELLS]):
                if reference:
                    yield from _flat_hdf5(f"{path}.{k + 1}", file[reference], file, depth + 1, room)
    elif node.dtype.kind in "fiub":
        yield path, np.asarray(node[()]).T  # HDF5 counts axes the other way round
