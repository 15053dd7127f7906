"""Saving, loading and drawing KANs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pikanid import errors

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import ShallowKAN, build_kan, load, plot, save  # noqa: E402

pytestmark = pytest.mark.kan


@pytest.mark.parametrize("suffix", [".npz", ".json"])
def test_round_trip_is_exact(tmp_path: Path, suffix: str) -> None:
    kan = build_kan([2, [2, 2], 2], grid=[4, 7], k=4, base="silu", mult_arity=[[], [2, 3], []])
    kan.act_fun[0].mask.data[0, 1] = 0.0
    kan.node_bias[0].data += 0.1
    kan.fix_symbolic(1, 0, 0, "sin", fit_params_bool=False, verbose=False)
    x = torch.rand(50, 2, dtype=torch.float64)
    wanted = kan(x)
    save(kan, tmp_path / f"net{suffix}")
    loaded = load(tmp_path / f"net{suffix}")
    assert torch.equal(loaded(x), wanted)
    assert loaded.width == kan.width and loaded.grid == kan.grid
    assert loaded.symbolic_fun[1].funs_name == kan.symbolic_fun[1].funs_name
    assert torch.equal(loaded.cache_data[:50], x)
    assert [p.name for p in tmp_path.iterdir()] == [f"net{suffix}"]


@pytest.mark.parametrize("suffix", [".npz", ".json"])
def test_kinks_are_saved_beside_the_model(tmp_path: Path, suffix: str) -> None:
    shallow = ShallowKAN(build_kan([1, 2], grid=20, k=5, grid_range=(0, 5)), [0.2, 1.6])
    c = np.random.default_rng(0).normal(size=(shallow.n_basis, 2))
    shallow.set_coefficients(c)
    save(shallow, tmp_path / f"curve{suffix}")
    loaded = load(tmp_path / f"curve{suffix}")
    t = np.linspace(0, 5, 101)
    assert isinstance(loaded, ShallowKAN)
    assert np.array_equal(loaded.forward(t), shallow.forward(t))
    assert np.array_equal(loaded.coefficients, shallow.coefficients)


def test_broken_files_are_explained(tmp_path: Path) -> None:
    good = tmp_path / "good.json"
    save(build_kan([1, 1]), good)
    header = json.loads(good.read_text())
    bad = {
        "missing.npz": None,
        "junk.npz": b"\x00\x01junk",
        "empty.npz": b"",
        "junk.json": b"{",
        "list.json": b"[]",
        "foreign.json": json.dumps(header | {"format": "other"}).encode(),
        "newer.json": json.dumps(header | {"version": 99}).encode(),
        "base.json": json.dumps(header | {"base": "relu"}).encode(),
        "width.json": json.dumps(header | {"width": [[1, 0], [2, 0]]}).encode(),
        "layers.json": json.dumps(header | {"width": [[1, 0], [1, 0], [1, 0]]}).encode(),
        "symbol.json": json.dumps(header | {"symbols": [[["__import__"]]]}).encode(),
        "knots.json": json.dumps(
            header | {"arrays": header["arrays"] | {"layer0_grid": [[0.0] * 12]}}
        ).encode(),
        "nan.json": json.dumps(
            header | {"arrays": header["arrays"] | {"layer0_coef": [[[float("nan")] * 8]]}}
        ).encode(),
    }
    for name, content in bad.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(errors.BadSetting):
            load(tmp_path / name)
    with pytest.raises(errors.BadSetting, match=r"\.npz or \.json"):
        save(build_kan([1, 1]), tmp_path / "net.pickle")


def test_no_pickle_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "evil.npz", header=np.array([{"a": 1}], dtype=object))
    with pytest.raises(errors.BadSetting):
        load(tmp_path / "evil.npz")


def test_plot_belongs_to_the_caller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure

    monkeypatch.chdir(tmp_path)
    assert plt.get_fignums() == []
    figure = plot(build_kan([1, [2, 1], 1]), scale=0.3, in_vars=["t"], title="net")
    assert isinstance(figure, Figure) and len(figure.axes) > 6
    figure.savefig(tmp_path / "net.png")
    assert [p.name for p in tmp_path.iterdir()] == ["net.png"]
    assert plt.get_fignums() == []
