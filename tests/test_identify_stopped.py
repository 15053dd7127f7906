"""`identify --strategy all`, stopped half-way: what is finished is written; and its page."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import pikanid as pk
from pikanid.cli import main
from pikanid.commands import identify
from pikanid.strategies import STRATEGIES


class Stopped:
    """A strategy during which a signal arrives."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def fit(self, *given: Any) -> None:
        signal.raise_signal(self.number)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """A shell that starts its jobs in the background has them ignore SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def recorded(tmp_path: Path) -> str:
    run = pk.simulate(pk.systems.sloshing(), pk.excitation.multisine(duration=3),
                      sigma=2e-3, seed=1)
    run.write(tmp_path / "run.csv")
    return str(tmp_path / "run.csv")


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("at", [0, 1])
def test_what_is_finished_is_written(recorded: str, tmp_path: Path, number: signal.Signals, at: int,
                                     monkeypatch: pytest.MonkeyPatch) -> None:
    usual, names = identify._make, list(STRATEGIES)

    def make(name: str, protocol: str, seed: int, step: Any) -> Any:
        return Stopped(number) if name == names[at] else usual(name, protocol, seed, step)

    monkeypatch.setattr(identify, "_make", make)
    before = signal.getsignal(signal.SIGTERM)
    out, page = tmp_path / "out.json", tmp_path / "page.html"
    assert main(["identify", recorded, "--model", "sloshing", "--strategy", "all", "--json",
                 str(out), "--report", str(page), "--quiet"]) == 130
    assert signal.getsignal(signal.SIGTERM) is before
    assert out.exists() == page.exists() == (at > 0)
    if at:
        told = json.loads(out.read_text(encoding="utf-8"))
        assert [e["strategy"] for e in told["estimates"]] == names[:at]
        assert {f["strategy"]: f["reason"] for f in told["failed"]} == dict.fromkeys(
            names[at:], identify.INTERRUPTED)


def test_a_page_of_estimates_has_print_precision(recorded: str, tmp_path: Path) -> None:
    page, saved = tmp_path / "page.html", tmp_path / "fit.json"
    assert main(["identify", recorded, "--model", "sloshing", "--report", str(page), "--save",
                 str(saved), "--quiet"]) == 0
    text, found = page.read_text(encoding="utf-8"), pk.Estimate.load(saved)
    std = found.std("l_theta")
    digits = f"{std:.1e}"[0] + f"{std:.1e}"[2]
    assert f"{digits}</td>" in text and "d(theta)/dt" in text and "theta" in text


@pytest.mark.kan
@pytest.mark.parametrize("name", ["pinn", "pikan"])
def test_long_fits_say_how_far_they_are(name: str, noisy: pk.Recording) -> None:
    pytest.importorskip("torch")
    told: list[tuple[str, bool]] = []

    def step(text: str, within: bool = False) -> None:
        told.append((text, within))

    strategy: Any = identify._make(name, "default", 0, step)
    if name == "pinn":
        strategy = replace(strategy, steps=3)
    strategy.fit(pk.systems.sloshing(), noisy)
    assert told and all(within and text.startswith(f"{name}, ") for text, within in told)
    assert all("lam " in text for text, _ in told)
