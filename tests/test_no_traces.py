"""Nothing that fits, draws or reads a network disturbs its surroundings (see `traces`)."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from relaxing import guessed, slosh
from traces import no_traces

import pikanid as pk

torch = pytest.importorskip("torch", reason="needs the `kan` extra")
pytest.importorskip("kan.MultKAN", reason="needs the `kan` extra")

from pikanid.approximators.kan import build_kan  # noqa: E402
from pikanid.approximators.kan import plot as plot_kan  # noqa: E402
from pikanid.strategies.pikan import PIKAN  # noqa: E402
from pikanid.strategies.pinn import PINN  # noqa: E402
from pikanid.symbolic.library import LIBRARY  # noqa: E402
from pikanid.validation.equivalence import EquivalenceReport, Setting, compare  # noqa: E402

pytestmark = pytest.mark.kan

STRATEGIES = {
    "NLS": pk.NLS(starts=1),
    "PDA": pk.PDA(),
    "iPDA": pk.IPDA(),
    "PINN": PINN(hidden=(6,), steps=3),
    "PINN by gradients": PINN(protocol="paper", hidden=(6,), steps=(3, 3)),
    "PIKAN": PIKAN(grid=40, lam=100.0),
    "PIKAN in state form": PIKAN(grid=40, lam=100.0, form="state"),
    "deep PIKAN": PIKAN(width=(1, 2, 1), grid=20, lam=100.0),
}


@pytest.mark.parametrize("name", STRATEGIES)
def test_fit(name: str, tmp_path: Path) -> None:
    rec = slosh(1.0, stride=10)
    with no_traces(tmp_path):
        STRATEGIES[name].fit(guessed(), rec)


def drawn(kan: Any) -> None:
    kan.plot()
    plot_kan(kan, np.linspace(-1, 1, 20).repeat(2).reshape(-1, 2), scale=0.3, title="net")


def trained(kan: Any) -> None:
    x = torch.rand(40, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    data = {"train_input": x, "train_label": x[:, :1], "test_input": x, "test_label": x[:, :1]}
    kan.fit(data, steps=2, log=100)


def read(kan: Any) -> None:
    x = np.random.default_rng(0).uniform(-1, 1, (100, 2))
    few = [form for form in LIBRARY if form.name in ("linear", "sine", "cubic")]
    pk.symbolic.extract(kan, x, np.sin(3 * x[:, 0]) + x[:, 1], inputs=["a", "b"], library=few)


def made(kan: Any) -> None:
    build_kan([1, [2, 1], 1], grid=[4, 6], base="silu", start="waves")


METHODS: dict[str, Callable[[Any], Any]] = {
    "build": made,
    "prune": lambda kan: kan.prune(),
    "prune of nodes, as pykan does": lambda kan: kan.prune_node(),
    "refine": lambda kan: kan.refine(8),
    "plot": drawn,
    "copy": lambda kan: kan.copy(),
    "training": trained,
    "extract": read,
}


@pytest.mark.parametrize("name", METHODS)
def test_network(name: str, tmp_path: Path) -> None:
    width = [2, 1] if name == "extract" else [2, 2, 1]
    kan = build_kan(width, grid=4, noise=2.0, start="waves")
    with no_traces(tmp_path):
        METHODS[name](kan)


def test_equivalence(tmp_path: Path) -> None:
    with no_traces(tmp_path):
        report = EquivalenceReport(compare(Setting("duffing", "state", grid=5)))
        report.plot()
    assert report.passed


def test_what_is_drawn_of_an_estimate(tmp_path: Path) -> None:
    estimate = pk.NLS(starts=1).fit(guessed(), slosh(1.0))
    with no_traces(tmp_path):
        estimate.plot()


TRACES: dict[str, Callable[[], Any]] = {
    "file": lambda: Path("left.txt").write_text(""),
    "seed of torch": lambda: torch.manual_seed(0),
    "draw of torch": lambda: torch.rand(1),
    "draw of NumPy": lambda: np.random.rand(),
    "draw of random": random.random,
    "line": lambda: print("checkpoint"),
}


@pytest.mark.parametrize("name", TRACES)
def test_a_trace_is_found(name: str, tmp_path: Path) -> None:
    with pytest.raises(AssertionError), no_traces(tmp_path):
        TRACES[name]()


def test_pykan_itself_leaves_traces(tmp_path: Path) -> None:
    from kan.MultKAN import KAN

    with pytest.raises(AssertionError), no_traces(tmp_path):
        KAN([1, 1], grid=3)
