"""Building a pykan model: it is pykan's, and nothing around it changes."""

from __future__ import annotations

import copy
import pickle
import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators import kan as room  # noqa: E402
from pikanid.approximators.kan.quiet import pykan_module  # noqa: E402

pytestmark = pytest.mark.kan


@contextmanager
def nothing_changes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fails if files, generators, the default dtype or matplotlib's state are not as before."""
    import matplotlib
    import matplotlib.pyplot as plt

    monkeypatch.chdir(folder)
    own = plt.figure()
    settings = {
        name: matplotlib.rcParams[name] for name in matplotlib.rcParams if name != "backend"
    }
    torch_state, numpy_state = torch.get_rng_state(), np.random.get_state()
    random_state, dtype = random.getstate(), torch.get_default_dtype()
    queued = len(torch.cuda._queued_calls)
    try:
        yield
        assert torch.equal(torch.get_rng_state(), torch_state)
        after = np.random.get_state()
        assert np.array_equal(after[1], numpy_state[1]) and after[2:] == numpy_state[2:]
        assert random.getstate() == random_state
        assert torch.get_default_dtype() == dtype
        assert len(torch.cuda._queued_calls) == queued
        assert list(folder.iterdir()) == []
        assert plt.get_fignums() == [own.number] and plt.gcf() is own
        for name, value in settings.items():
            assert matplotlib.rcParams[name] == value, name
    finally:
        plt.close(own)


def use_everything() -> None:
    width: list[Any] = [1, [3, 1], 1]
    kan = room.build_kan(width, grid=6, grid_range=[(0.0, 5.0), (-1.0, 1.0)], base="silu")
    assert width == [1, [3, 1], 1]
    kan.refine(12).prune().plot()
    kan.copy()
    kan.prune_node()
    kan.attribute()
    kan.suggest_symbolic(0, 0, 0, lib=["x", "sin"], verbose=False)
    kan.fix_symbolic(0, 0, 0, "x", verbose=False)
    copy.deepcopy(kan)
    shallow = room.ShallowKAN(room.build_kan([1, 2], grid=8, k=5, grid_range=(0, 5)), [1.2])
    shallow.set_coefficients(np.ones((shallow.n_basis, 2)))
    shallow.forward(np.linspace(0, 5, 11))
    shallow.refined(16)


def test_no_side_effects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with nothing_changes(tmp_path, monkeypatch):
        use_everything()
    assert capsys.readouterr().out == ""


def test_pykan_itself_has_these_side_effects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The trap that the room exists for: the plain constructor fails the same check."""
    state, numpy_state, python_state = (
        torch.get_rng_state(),
        np.random.get_state(),
        random.getstate(),
    )
    width = [1, 1]
    with pytest.raises(AssertionError), nothing_changes(tmp_path, monkeypatch):
        pykan_module().MultKAN(width=width, grid=3)
    assert (tmp_path / "model").is_dir() and width == [[1, 0], [1, 0]]
    torch.set_rng_state(state)
    np.random.set_state(numpy_state)
    random.setstate(python_state)


def test_pykan_still_seeds_for_its_own_users() -> None:
    """The stand-ins leave pykan's module as it was."""
    room.build_kan([1, 1])
    module = pykan_module()
    assert module.torch is torch and module.np is np and module.random is random


def test_is_pykan_with_pykans_knots() -> None:
    ours = room.build_kan([1, 1], grid=40, grid_range=(0.0, 5.0))
    assert isinstance(ours, pykan_module().MultKAN)
    dtype = torch.get_default_dtype()
    torch.set_default_dtype(torch.float64)
    try:
        with torch.random.fork_rng(devices=[]):
            state, python_state = np.random.get_state(), random.getstate()
            theirs = pykan_module().MultKAN(
                width=[1, 1],
                grid=40,
                grid_range=[0.0, 5.0],
                base_fun="zero",
                sb_trainable=False,
                sp_trainable=False,
                auto_save=False,
            )
            np.random.set_state(state)
            random.setstate(python_state)
    finally:
        torch.set_default_dtype(dtype)
    assert torch.allclose(ours.act_fun[0].grid, theirs.act_fun[0].grid, rtol=0.0, atol=1e-14)
    theirs.load_state_dict(ours.state_dict())
    x = torch.linspace(0, 5, 101, dtype=torch.float64)[:, None]
    assert torch.equal(ours(x), theirs(x))


def test_only_coefficients_are_trainable() -> None:
    names = [n for n, p in room.build_kan([1, 2, 1]).named_parameters() if p.requires_grad]
    assert names == ["act_fun.0.coef", "act_fun.1.coef"]
    kan = room.build_kan([1, 1], base="silu")
    names = [n for n, p in kan.named_parameters() if p.requires_grad]
    assert names == ["act_fun.0.coef", "act_fun.0.scale_base"]
    assert all(p.dtype == torch.float64 for p in kan.parameters())


def test_seed_decides() -> None:
    a, b, c = (room.build_kan([1, 5, 1], seed=s, start="waves") for s in (1, 1, 2))
    assert torch.equal(a.act_fun[0].coef, b.act_fun[0].coef)
    assert not torch.equal(a.act_fun[0].coef, c.act_fun[0].coef)


def test_waves_fill_the_hidden_grid_and_stay_inside() -> None:
    kan = room.build_kan([1, 5, 1], grid=20, grid_range=[(0, 5), (2, 8)], start="waves")
    deep = room.DeepKAN(kan)
    hidden = deep.coverage(np.linspace(0, 5, 201), deep.coefficients)[1]
    assert hidden.min() > 0.0 and hidden.max() < 1.0
    assert np.all(np.diff(hidden, axis=1) > 0.1)


@pytest.mark.parametrize(
    "change",
    [
        {"width": [1]},
        {"width": [[1, 1], 1]},
        {"width": [1, 0]},
        {"grid": 0},
        {"grid": [3, 4]},
        {"k": 0},
        {"base": "relu"},
        {"grid_range": (1.0, 1.0)},
        {"grid_range": (0.0, float("nan"))},
        {"mult_arity": 1},
        {"mult_arity": [[2], []]},
    ],
)
def test_bad_arguments_are_explained(change: dict[str, Any]) -> None:
    with pytest.raises(errors.BadSetting):
        room.build_kan(**({"width": [1, 1]} | change))


def test_fit_by_pykan_works_and_keeps_the_grid(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    kan = room.build_kan([1, 1], grid=8)
    knots = kan.act_fun[0].grid.clone()
    x = torch.linspace(-1, 1, 60, dtype=torch.float64)[:, None]
    data = {"train_input": x, "train_label": x**2, "test_input": x, "test_label": x**2}
    kan.fit(data, steps=5)
    assert torch.equal(kan.act_fun[0].grid, knots)
    assert float(((kan(x).detach() - x**2) ** 2).mean()) < 1e-6
    assert list(tmp_path.iterdir()) == []


def test_pickle_and_deepcopy_keep_every_bit() -> None:
    kan = room.build_kan([2, [2, 1], 1], base="silu")
    x = torch.rand(20, 2, dtype=torch.float64)
    for twin in (pickle.loads(pickle.dumps(kan)), copy.deepcopy(kan), kan.copy()):
        assert torch.equal(twin(x), kan(x)) and twin.act_fun[0].coef.dtype == torch.float64
