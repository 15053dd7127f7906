"""Saved networks from strangers: a network or one sentence, without code, hangs or memory."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile import JSON_VALUES, cut, nothing_evaluated, walk

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import ShallowKAN, build_kan, load, save  # noqa: E402
from pikanid.approximators.kan.build import from_state  # noqa: E402
from pikanid.approximators.kan.file import from_content  # noqa: E402

pytestmark = pytest.mark.kan
__all__ = ["nothing_evaluated"]


@pytest.fixture(scope="module")
def networks(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("networks")
    save(build_kan([2, [1, 1], 1], grid=3, k=2, base="silu"), folder / "deep.json")
    save(ShallowKAN(build_kan([1, 1], grid=4, k=3, grid_range=(0, 5)), [0.7]), folder / "kink.json")
    made = {p.stem: json.loads(p.read_text()) for p in folder.iterdir()}
    # what is compiled comes from a cache of its own, a pickle, once in a process: before the guard
    assert all(used(content) for content in made.values())
    return made


def used(content: Any, built: bool = True) -> bool:
    header = content
    arrays = None
    if isinstance(content, dict):
        arrays = content.get("arrays")
        header = {key: value for key, value in content.items() if key != "arrays"}
    try:
        state, kinks = from_content(header, arrays, errors.BadSetting)
        if not built:
            return True
        kan = from_state(state)
        if kinks is not None:
            ShallowKAN(kan, kinks).forward(np.linspace(0.1, 4.9, 5))
    except errors.BadSetting as problem:
        text = str(problem)
        assert 10 < len(text) < 4000, text[:300]
        assert text.isprintable(), text[:300]
        return False
    assert kan(torch.zeros(3, state.plan.nodes(0), dtype=torch.float64)).shape[0] == 3
    return True


@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("name", ["deep", "kink"])
@pytest.mark.parametrize("value", JSON_VALUES)
def test_every_place_of_a_network(name: str, value: str, networks: dict[str, Any]) -> None:
    for _, content in walk(networks[name], JSON_VALUES[value]):
        used(content, built=False)


@pytest.mark.slow  # building a network in pykan takes 20 ms
@pytest.mark.usefixtures("nothing_evaluated")
@pytest.mark.parametrize("name", ["deep", "kink"])
@pytest.mark.parametrize("value", JSON_VALUES)
def test_every_network_that_is_accepted_can_be_built(name: str, value: str,
                                                     networks: dict[str, Any]) -> None:
    for _, content in walk(networks[name], JSON_VALUES[value]):
        used(content)


@pytest.mark.parametrize("name", ["deep", "kink"])
def test_every_entry_of_a_network_is_missed(name: str, networks: dict[str, Any]) -> None:
    assert used(networks[name])
    accepted = [path for path, content in cut(networks[name]) if used(content)]
    # points seen, of which there may be fewer; and kinks, each of which stands alone
    assert all(path[:2] == ("arrays", "batch") or path == ("kinks", 0) or path == ("kinks", 1)
               for path in accepted), accepted


@pytest.mark.parametrize(("key", "value"), [
    ("arrays", 0), ("k", 0), ("k", 1e308), ("k", True), ("width", [[10**9, 0], [1, 0]]),
    ("width", [[1, 0]] * 100_000), ("arity", 10**400), ("version", 1e400), ("symbols", "x")])
@pytest.mark.parametrize("suffix", [".json", ".npz"])
def test_what_crashed_or_filled_the_memory(key: str, value: Any, suffix: str, tmp_path: Path,
                                           networks: dict[str, Any]) -> None:
    content = {**networks["deep"], key: value}
    path = tmp_path / f"net{suffix}"
    if suffix == ".json":
        path.write_text(json.dumps(content))
    else:
        arrays = content.pop("arrays") or {}
        np.savez(path, header=np.array(json.dumps(content)),
                 **{n: np.array(a) for n, a in arrays.items()})
    with pytest.raises(errors.BadSetting):
        load(path)


def test_an_archive_that_states_more_than_it_holds(tmp_path: Path) -> None:
    """NumPy asks for the memory of the stated shape before it reads."""
    import io
    import zipfile

    member = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        member, {"descr": "<f8", "fortran_order": False, "shape": (10**13,)})
    path = tmp_path / "net.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", member.getvalue())
    with pytest.raises(errors.BadSetting, match="damaged"):
        load(path)
