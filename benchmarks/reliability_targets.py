"""What is fuzzed: everything that reads what others wrote, by the name of its target."""

from __future__ import annotations

import contextlib
import gzip
import io
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from reliability_damage import altered, as_json, damaged
from reliability_inputs import (
    ANSWER,
    CASE,
    MODEL,
    RECORDINGS,
    SEAL,
    TRUTH,
    WORDS,
    estimate_content,
    network_content,
    sound_recording,
)


def recording(ending: str) -> Callable[[np.random.Generator, Path], None]:
    """Fuzz of one format of recordings."""
    sound = sound_recording(ending)

    def read(rng: np.random.Generator, folder: Path) -> None:
        from pikanid import Recording

        content = damaged(sound, rng)
        if rng.random() < 0.05:
            content = rng.bytes(int(rng.integers(0, 600)))
        if rng.random() < 0.02:
            content = gzip.compress(b"1,2\n" * 10**6, 1) + content
        path = folder / f"input{ending}"
        path.write_bytes(content)
        found = Recording.read(path, rate=10.0 if rng.random() < 0.2 else None)
        repr(found)
        for name in found.names:
            found.as_output(name)

    return read


def model(rng: np.random.Generator, folder: Path) -> None:
    """Model files."""
    import tomllib

    from pikanid import Model

    if rng.random() < 0.5:
        path = folder / "input.toml"
        path.write_bytes(damaged(MODEL.encode(), rng))
        found = Model.load(path)
    else:
        found = Model.from_dict(altered(tomllib.loads(MODEL), rng))
    found.to_dict()
    repr(found)


def estimate(rng: np.random.Generator, folder: Path) -> None:
    """Saved estimates, gzipped or not."""
    from pikanid.estimate import Estimate

    content = as_json(estimate_content(), rng)
    packed = rng.random() < 0.2
    path = folder / ("input.json.gz" if packed else "input.json")
    path.write_bytes(damaged(gzip.compress(content, 1), rng) if packed else content)
    found = Estimate.load(path)
    str(found), found._repr_html_(), found.to_dict(), found.fitted_model


def network(rng: np.random.Generator, folder: Path) -> None:
    """Saved networks: JSON, and NPZ of the same content."""
    from pikanid.approximators.kan.file import load

    packed = rng.random() < 0.3
    path = folder / ("input.npz" if packed else "input.json")
    if packed:
        content = network_content()
        header = as_json({k: v for k, v in content.items() if k != "arrays"}, rng)
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {n: np.array(a) for n, a in content["arrays"].items()}
        np.savez(buffer, header=np.array(header.decode(errors="replace")), **arrays)
        archive = buffer.getvalue()
        path.write_bytes(damaged(archive, rng) if rng.random() < 0.5 else archive)
    else:
        path.write_bytes(as_json(network_content(), rng))
    load(path)


def diagnosis(rng: np.random.Generator, folder: Path) -> None:
    """Diagnoses and cases of truth files, as they are compared."""
    from pikanid.validation.concealed.score import judge

    if rng.random() < 0.5:
        judge(altered(CASE, rng), ANSWER)
    else:
        judge(CASE, altered(ANSWER, rng))


def seals(rng: np.random.Generator, folder: Path) -> None:
    """Truth files and seals."""
    from pikanid.validation.concealed.seal import matches

    first = rng.random() < 0.5
    truth, seal = json.dumps(TRUTH).encode(), json.dumps(SEAL).encode()
    (folder / "truth.json").write_bytes(as_json(TRUTH, rng) if first else truth)
    (folder / "seal.json").write_bytes(seal if first else as_json(SEAL, rng))
    matches(folder, folder / "truth.json")


def arguments(rng: np.random.Generator, folder: Path) -> None:
    """Command lines that end before any fit is begun: each holds one wrong thing at least."""
    from pikanid.cli import main

    (folder / "run.csv").write_bytes(sound_recording(".csv"))
    (folder / "model.toml").write_text(MODEL)
    words = [WORDS[int(k)] for k in rng.integers(0, len(WORDS), int(rng.integers(0, 8)))]
    words = [*words, "--no-such-option"] if rng.random() < 0.9 else ["models", *words]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        code = main([str(folder / w) if w in ("run.csv", "model.toml") else w for w in words])
    if code not in (0, 2):
        raise AssertionError(f"exit code {code}")


@cache
def targets() -> dict[str, Callable[[np.random.Generator, Path], None]]:
    """Every target by its name."""
    return {**{f"recording {e}": recording(e) for e in RECORDINGS}, "model": model,
            "estimate": estimate, "network": network, "diagnosis": diagnosis,
            "truth and seal": seals, "command line": arguments}
