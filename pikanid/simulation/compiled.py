"""Compiled models: generated source on disk, compiled once and found again by every process.

Numba cannot cache functions made by `exec`, so the source is written to a cache folder (environment
variable PIKANID_CACHE, else the user's cache folder) under a name made from the model's formulas
and from the generator's own source.  Parameter values and which parameters are estimated do not
enter: one compiled model serves them all.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import platform
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Literal

from pikanid.expressions import to_text
from pikanid.model import Model
from pikanid.simulation.structure import Structure

Method = Literal["explicit", "implicit"]
_HERE = Path(__file__).parent
_DIGEST = hashlib.sha256().digest_size


def compiled(model: Model, method: Method = "explicit") -> ModuleType:
    """The module of compiled functions for `model`; generated at the first call ever.

    `method` chooses the classical Runge-Kutta step or the L-stable implicit one.
    """
    return _load(Structure(model), method)


@functools.lru_cache(maxsize=256)
def _load(structure: Structure, method: Method) -> ModuleType:
    key = _key(structure.model, method)
    path = cache_folder() / f"model_{key}.py"
    if not path.exists():
        _write(path, _source(structure.model, method).encode())
    name = f"pikanid_model_{key}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def cache_folder() -> Path:
    """The folder of generated sources; a temporary one where the usual one cannot be written."""
    import platformdirs

    wanted = os.environ.get("PIKANID_CACHE") or platformdirs.user_cache_dir("pikanid")
    folder = Path(wanted) / "compiled"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    fallback = Path(tempfile.gettempdir()) / f"pikanid-{os.getuid()}"
    fallback.mkdir(mode=0o700, exist_ok=True)
    return fallback


def _source(model: Model, method: Method) -> str:
    from pikanid.simulation.codegen import generate

    source, lowered = generate(model)
    kind = "hybrid" if lowered.n_dynamic else "smooth"
    step = "rk4" if method == "explicit" else "sdirk"
    pieces = [f"field_{kind}", step, f"drive_{kind}", "integrate"]
    return source + "\n\n".join(kernel_text(p) for p in pieces)


def kernel_text(name: str) -> str:
    """The source of a kernel, to be pasted behind the functions that it calls."""
    return (_HERE / "kernels" / f"{name}.py").read_text()


def written(title: str, source: str) -> Path:
    """The file in the cache folder that holds `source`, under a name made from its content."""
    digest = hashlib.sha256((source + _generator_version()).encode()).hexdigest()[:24]
    path = cache_folder() / f"{title}_{digest}.py"
    if not path.exists():
        _write(path, source.encode())
    return path


def kept(name: str, make: Callable[[], bytes]) -> bytes:
    """What a file in the cache folder holds, behind its digest; made where that is not so."""
    path = cache_folder() / name
    digest, content = b"", b""
    if path.exists():
        found = path.read_bytes()
        digest, content = found[:_DIGEST], found[_DIGEST:]
    if digest != hashlib.sha256(content).digest():
        content = make()
        _write(path, hashlib.sha256(content).digest() + content)
    return content


def _key(model: Model, method: Method) -> str:
    parts = [method, _generator_version(), *model.state_names, "|", *model.input_names, "|",
             *model.parameter_names, "|", *map(to_text, model.equations.values()), "|",
             *(to_text(o.expression) for o in model.outputs), "|", repr(model.splines),
             f"moving delays: {any(i.delay.free_symbols for i in model.inputs)}"]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:24]


@functools.cache
def _generator_version() -> str:
    import numba

    kernels = sorted(k for k in (_HERE / "kernels").glob("*.py")
                     if not k.name.startswith("tape"))
    files = [*kernels,
             *(_HERE / f"{n}.py" for n in ("codegen", "printing", "lowering", "support", "layout"))]
    digest = hashlib.sha256("".join(f.read_text() for f in files).encode()).hexdigest()
    return f"{digest} {numba.__version__} {platform.python_version()} {platform.machine()}"


def _write(path: Path, content: bytes) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(temporary, path)
