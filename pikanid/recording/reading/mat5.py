"""MATLAB level 5 files (saved with -v6 or -v7), read element by element.

Written here because the common reader crashes the whole process on damaged files: every length is
checked against the bytes that are there, and anything amiss is a ValueError.  Format: MAT-File
Format, The MathWorks, "Level 5 MAT-Files".
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pikanid.storage.limits import MOST_UNPACKED

_HEADER = 128  # definition: bytes, of the MAT 5 format
_MATRIX, _COMPRESSED = 14, 15  # definition: types of the MAT 5 format
_NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # definition: of the MAT 5 format  # fmt: skip
_CELL, _STRUCT, _OBJECT = 1, 2, 3  # definition: classes of the MAT 5 format
_NUMERIC = range(6, 16)  # definition: classes double to uint64; not char, sparse, function, opaque
_COMPLEX = 0x0800  # definition: flag of the MAT 5 format
_DEEPEST = 8  # limit: structures within structures
_MOST = 1000  # limit: cells or structures looked into

Leaf = tuple[str, np.ndarray]


def leaves(content: bytes) -> Iterator[Leaf]:
    """(path, array) of every real numeric array; fields and cells extend the path.

    Args:
        content: Bytes of the file.

    Raises:
        ValueError: If the file is damaged (also struct.error and zlib.error).
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise ValueError("no level 5 header")
    for kind, data in _elements(memoryview(content)[_HEADER:], order):
        if kind == _COMPRESSED:
            for inner, unpacked in _elements(memoryview(_unpacked(data)), order):
                if inner == _MATRIX:
                    yield from _Matrix.read(unpacked, order).leaves("", 0)
        elif kind == _MATRIX:
            yield from _Matrix.read(data, order).leaves("", 0)


def _unpacked(data: memoryview) -> bytes:
    unpacker = zlib.decompressobj()
    found = unpacker.decompress(data, MOST_UNPACKED)
    if not unpacker.eof:
        raise ValueError("cut off, or more than is read")
    return found


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """(type, content) of the tagged elements that follow each other."""
    position = 0
    while position + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, position)
        start, step = position + 8, size
        if kind >> 16:  # four bytes or fewer share the tag
            kind, size, start, step = kind & 0xFFFF, kind >> 16, position + 4, 0
            if size > 4:
                raise ValueError("small element too large")
        elif kind != _COMPRESSED:
            step = size + -size % 8
        if start + size > len(data):
            raise ValueError("element beyond the end")
        yield kind, data[start : start + size]
        position = position + 8 + step


@dataclass(frozen=True)
class _Matrix:
    """One array: its class, shape, name, and the elements that follow."""

    kind: int
    complex: bool
    shape: tuple[int, ...]
    name: str
    rest: list[tuple[int, memoryview]]
    order: str

    @classmethod
    def read(cls, data: memoryview, order: str) -> _Matrix:
        if len(data) == 0:
            return cls(0, False, (0,), "", [], order)
        parts = list(_elements(data, order))
        if len(parts) < 3:
            raise ValueError("matrix without head")
        (flags, shape, name), rest = parts[:3], parts[3:]
        (word,) = struct.unpack_from(order + "I", flags[1])
        dims = tuple(int(n) for n in _numbers(shape, order))
        if any(n < 0 for n in dims) or len(dims) > 32:
            raise ValueError("bad shape")
        label = bytes(name[1]).decode("latin-1")
        return cls(word & 0xFF, bool(word & _COMPLEX), dims, label, rest, order)

    def leaves(self, path: str, depth: int) -> Iterator[Leaf]:
        path = path or self.name
        if depth > _DEEPEST:
            return
        if self.kind == _CELL:
            for k, inner in enumerate(self._inner(self.rest)):
                yield from inner.leaves(f"{path}.{k + 1}", depth + 1)
        elif self.kind in (_STRUCT, _OBJECT):
            yield from self._fields(path, depth)
        elif self.kind in _NUMERIC and not self.complex and self.rest:
            values = _numbers(self.rest[0], self.order)
            if math.prod(self.shape) != values.size:
                raise ValueError("values do not fill the shape")
            yield path, values.reshape(self.shape, order="F")

    def _fields(self, path: str, depth: int) -> Iterator[Leaf]:
        rest = self.rest[self.kind == _OBJECT :]  # an object names its class first
        if len(rest) < 2:
            raise ValueError("structure without fields")
        widths = _numbers(rest[0], self.order)
        names = bytes(rest[1][1])
        width = int(widths[0]) if widths.size else 0
        if width <= 0:
            return
        fields = [
            names[k : k + width].split(b"\0")[0].decode("latin-1")
            for k in range(0, len(names), width)
        ]
        many = math.prod(self.shape) > 1
        for k, inner in enumerate(self._inner(rest[2:])):
            element, field = divmod(k, len(fields))
            middle = f"{element + 1}.{fields[field]}" if many else fields[field]
            yield from inner.leaves(f"{path}.{middle}", depth + 1)

    def _inner(self, parts: list[tuple[int, memoryview]]) -> Iterator[_Matrix]:
        for kind, data in parts[:_MOST]:
            if kind != _MATRIX:
                raise ValueError("a cell is no matrix")
            yield _Matrix.read(data, self.order)


def _numbers(part: tuple[int, memoryview], order: str) -> np.ndarray:
    kind, data = part
    if kind not in _NUMBERS:
        raise ValueError("not numbers")
    return np.frombuffer(data, dtype=np.dtype(order + _NUMBERS[kind]))
