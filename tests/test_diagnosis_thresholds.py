"""Scaled thresholds: every named number is varied or left out; a repeated diagnosis is exact."""


import diagnosis_thresholds as varied
import numpy as np
import pytest
from remembering import Memory

import pikanid as pk
from pikanid.mismatch.data import whitened
from pikanid.mismatch.fitting import hypothesis
from pikanid.mismatch.judge import verdict
from pikanid.mismatch.search import search
from pikanid.recording import excitation

NUMBERS = {str(t): t for t in varied.named_numbers()}


def test_what_is_left_out_exists():
    for modules in varied.LEFT_OUT.values():
        for module, names in modules.items():
            for name in names.split():
                assert name == "*" or f"{module}.{name}" in NUMBERS
            assert any(t.module == module for t in NUMBERS.values())


def test_the_constants_of_a_verdict_are_thresholds():
    found = {t.name for t in varied.thresholds() if t.module == "verdict"}
    assert found >= {"WITHIN", "GUARD", "BEHIND", "PART", "ADEQUATE", "WORTH"}


def test_a_change_reaches_every_user_and_ends():
    before = whitened.GROSS
    with varied.changed(NUMBERS["whitened.GROSS"], 1.25):
        assert whitened.GROSS == hypothesis.GROSS == verdict.GROSS == 1.25 * before
    assert whitened.GROSS == hypothesis.GROSS == verdict.GROSS == before


def test_only_what_acts_outside_fits_keeps_the_memory():
    assert NUMBERS["hypothesis.FAR"].inside_fits  # in a search too, but in fits as well
    assert not NUMBERS["verdict.WORTH"].inside_fits
    assert NUMBERS["verdict.WORTH"].users == {"case", "verdict"}


def test_whole_numbers_move_by_one_at_least():
    assert [varied.scaled(n, f) for n in (1, 2, 8) for f in varied.FACTORS] == [0, 2, 1, 3, 6, 10]


def test_a_memory_tells_arguments_apart_by_content():
    calls = []

    def double(rows, names=()):
        calls.append(len(rows))
        return 2 * rows

    memory = Memory()
    remembered = memory.of(double)
    for rows in (np.ones(2), np.ones(2), np.zeros(2)):
        remembered(rows)
    assert len(calls) == 2
    remembered(np.ones(2), names={"a": 1.0})
    memory.fork().of(double)(np.zeros(2))
    assert len(calls) == 3
    for _ in range(2):
        remembered(np.ones(2), names=[object()])  # nothing tells it apart
    assert len(calls) == 5


def test_a_section_says_what_does_not_survive(monkeypatch, tmp_path):
    def answer(identifier):
        return {"verdict": "named", "mismatch": True, "hypotheses": [
            {"effects": [{"ids": [identifier]}], "probability": 1.0}]}

    truth = {"id": "001", "class": "single", "nameable": True, "base": {},
             "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""}],
             "visibility": {"nominal": 40.0, "effects": [40.0], "best_rival": [],
                            "best_rival_distance": 9.0}}
    keys = {f"{t} x {f}": answer("input_delay") for t in varied.thresholds()
            for f in varied.FACTORS}
    case = varied.Tried("rich 001", truth, {
        varied.BASE: answer("input_delay"), **keys,
        "verdict.GUARD x 0.75": answer("sensor_delay"), "verdict.BEHIND x 1.25": answer("wall")})
    monkeypatch.setattr(varied, "tried", lambda *given: [case])
    text = varied.section(1, tmp_path, 1)
    assert "Verdicts that survive every change: 0 of 1. Outcomes that do: 0 of 1." in text
    assert "| `verdict.GUARD` | 4 → 3 | 1 of 1 | 0 of 1 | - |" in text
    assert "| `verdict.BEHIND` | 3 → 3.75 | 1 of 1 | 1 of 1 | rich 001 |" in text
    assert "rich 001 (`verdict.BEHIND`, `verdict.GUARD`)" in text
    assert "No verdict of 1 depends on `" in text and "`case.BETTER`" in text


def test_a_diagnosis_repeated_fits_nothing_anew(monkeypatch):
    train, other = (pk.simulate(pk.systems.sloshing(), excitation.two_pulse(), sigma=0.002,
                                seed=seed) for seed in (1, 2))
    fits = []
    fitted = search.fitted
    monkeypatch.setattr(search, "fitted", lambda *given: fits.append(1) or fitted(*given))
    memory = Memory()
    varied.diagnosed(train, other, memory)
    count = len(fits)
    varied.diagnosed(train, other, memory.fork())
    assert len(fits) == count > 0


@pytest.mark.slow
def test_a_remembered_diagnosis_is_the_same():
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 60.0)])
    train, other = (pk.simulate(truth, excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    memory = Memory()
    varied.diagnosed(train, other, memory)
    for name, factor in (("search.SINGLES", 0.75), ("search.CLOSE", 1.25), ("verdict.WITHIN", 1.25),
                         ("outliers.LONE", 0.75)):
        with varied.changed(NUMBERS[name], factor):
            assert varied.diagnosed(train, other, memory.fork()) == varied.diagnosed(
                train, other, Memory())
