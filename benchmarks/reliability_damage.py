"""Damage that the fuzz does: to bytes, and to what a file of JSON holds."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import numpy as np
from reliability_inputs import CODE


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Bits flipped, bytes cut, spliced, doubled, or replaced by telling ones, at 1 to 4 places."""
    data = bytearray(content)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 4]))):
        at = int(rng.integers(0, max(len(data), 1)))
        length = int(rng.choice([1, 2, 4, 8, 64]))
        match int(rng.integers(0, 7)):
            case 0:
                data[at : at + 1] = bytes([data[at] ^ (1 << int(rng.integers(8)))]) if data else b""
            case 1:
                del data[at:]
            case 2:
                data[at : at + length] = rng.bytes(length)
            case 3:
                del data[at : at + length]
            case 4:
                other = int(rng.integers(0, max(len(data), 1)))
                data[at:at] = data[other : other + 8 * length]
            case 5:
                telling = [b"\xff" * length, b"\0" * length, b"\x7f\xff\xff\xff", b"1e999", b"nan"]
                data[at : at + length] = telling[int(rng.integers(len(telling)))]
            case _:
                data[at : at + 1] = [b"\n", b",", b'"', b"[", b"-", b"9" * 400][rng.integers(6)]
    return bytes(data)


def _leaf(rng: np.random.Generator) -> Any:
    values: list[Any] = [
        None, True, False, 0, 1, -1, 2, 10**9, 10**18, 10**400, -(10**400), 0.5, 1e308, 5e-324,
        float("nan"), float("inf"), "", "x", "theta", "free", "sin(theta)", CODE, "a" * 30_000,
        "1+" * 300_000 + "1", "max(theta," * 50 + "1" + ")" * 50, "theta**1000**1000", "\x1b[2J",
        "\ud800", [], {}, [CODE], {"a": CODE}, [[1, 2], [3]], [0.0] * 10_000, {"a": {"b": []}}]
    value = values[int(rng.integers(len(values)))]
    if rng.random() < 0.02:
        for _ in range(300):
            value = [value]
    return value


def altered(content: Any, rng: np.random.Generator) -> Any:
    """The content with one to three of its places replaced, removed, added or exchanged."""
    content = json.loads(json.dumps(content))
    for _ in range(int(rng.integers(1, 4))):
        places: list[tuple[Any, Any]] = []
        waiting = [content]
        while waiting:
            here = waiting.pop()
            for key in list(here) if isinstance(here, dict) else range(len(here)):
                places.append((here, key))
                if isinstance(here[key], dict | list) and len(here[key]) < 1000:
                    waiting.append(here[key])
        if not places:
            return _leaf(rng)
        here, key = places[int(rng.integers(len(places)))]
        match int(rng.integers(0, 5)):
            case 0:
                del here[key]
            case 1 if isinstance(here, dict):
                here[str(_leaf(rng))[:50]] = _leaf(rng)
            case 1 | 2 if isinstance(here, list):
                here.insert(key, _leaf(rng))
            case 3:
                there, other = places[int(rng.integers(len(places)))]
                with contextlib.suppress(KeyError, IndexError):
                    here[key] = json.loads(json.dumps(there[other], default=str))
            case _:
                here[key] = _leaf(rng)
    return content


def as_json(content: Any, rng: np.random.Generator) -> bytes:
    """A changed content as a file; some of its bytes are changed as well."""
    try:
        text = json.dumps(altered(content, rng)).encode(errors="surrogatepass")
    except (ValueError, RecursionError):  # an integer that has no text
        text = b'{"k": ' + b"9" * 5000 + b"}"
    return damaged(text, rng) if rng.random() < 0.3 else text
