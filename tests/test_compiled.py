"""The name of a compiled model: another one when what its source is made by changes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pikanid.model import systems
from pikanid.simulation import compiled

GENERATORS = ("compiled", "codegen", "printing", "constants", "lowering", "support",
              "layout")
HERE = Path(compiled.__file__).parent


def test_another_generator_or_kernel_makes_another_name(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def name_with(changed: str) -> str:
        copy = tmp_path / f"with_{changed.replace('/', '_')}"
        shutil.copytree(HERE, copy, ignore=shutil.ignore_patterns("__pycache__"),
                        dirs_exist_ok=True)
        if changed:
            with (copy / changed).open("a", encoding="utf-8") as file:
                file.write("# changed")
        monkeypatch.setattr(compiled, "_HERE", copy)
        return compiled._name(systems.sloshing(), "explicit")

    kernels = [f"kernels/{k.name}" for k in (HERE / "kernels").glob("*.py")
               if not k.name.startswith("tape")]
    changed = [*(f"{n}.py" for n in GENERATORS), *kernels]
    assert name_with("") == compiled._name(systems.sloshing(), "explicit")
    assert len({name_with(c) for c in ("", *changed)}) == 1 + len(changed)
