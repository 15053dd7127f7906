"""The proof in a diagnosis: errors of a held-out prediction, beside the noise that they have."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pikanid.mismatch.steps.reporting import _proof

MET, NOT_MET = (SimpleNamespace(name=n, parameters=[SimpleNamespace(name=f"p_{n}")])
                for n in ("a drag", "a limit"))
BASE, BEST = SimpleNamespace(noise=9.0), SimpleNamespace(noise=1.5, effects=(MET, NOT_MET))
T = np.arange(3.0)


def held(rmse: float) -> Any:
    return SimpleNamespace(
        rmse={"y": rmse}, rmse_moved={"y": 0.9 * rmse}, t=T, measured=T + 1, predicted=rmse * T,
        moved=T - 1, acts={"p_a limit": 0.0}, detection=SimpleNamespace(p_value=0.25),
        residuals=())


def case(later: bool = True, lost: object = None) -> Any:
    known = {id(BASE): held(4.0), id(BEST): held(2.0)}
    return SimpleNamespace(
        base=BASE, predicted=lambda h: None if h is lost else known[id(h)],
        later=SimpleNamespace(sigma=lambda output: 0.5, recordings=()) if later else None,
        model=SimpleNamespace(outputs=(SimpleNamespace(name="y", unit="m"),)))


@pytest.mark.parametrize(("verdict", "noise"), [
    ("named", 0.75), ("set", 0.75), ("unconfirmed", 0.5), ("unnamed", 0.5)])
def test_all_that_a_name_leaves_is_noise(verdict: str, noise: float) -> None:
    answer: Any = SimpleNamespace(verdict=verdict, given=(BEST,))
    proof = _proof(case(), answer, BEST)  # type: ignore[arg-type]  # a stand-in
    assert proof is not None and proof.not_met == ("a limit",)
    found = proof.outputs["y"]
    assert (found.before, found.after, found.noise, found.unit) == (4.0, 2.0, noise, "m")
    assert found.moved == pytest.approx(1.8) and proof.p_value == 0.25


def test_without_a_prediction_there_is_no_proof() -> None:
    answer: Any = SimpleNamespace(verdict="named")
    for made in (case(later=False), case(lost=BASE), case(lost=BEST)):
        assert _proof(made, answer, BEST) is None  # type: ignore[arg-type]  # a stand-in
