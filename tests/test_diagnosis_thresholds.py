"""Scaled settings: every field is varied or left out; a repeated diagnosis is exact."""

import json
from dataclasses import asdict, replace

import diagnosis_thresholds as varied
import numpy as np
import pytest
import thresholds_page
from hypothesis import given
from hypothesis import strategies as st
from remembering import Memory
from watched import Watched

import pikanid as pk
from pikanid.mismatch.search import search
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.recording import excitation

SETTINGS = {t.name: t for t in varied.all_settings()}


def test_every_name_is_that_of_a_setting():
    assert {name for names in varied.LEFT_OUT.values() for name in names} <= set(SETTINGS)
    assert set(SETTINGS) >= varied.UNREAD


def test_what_counts_as_evidence_is_varied():
    found = {t.name for t in varied.thresholds()}
    assert found >= {name for name in SETTINGS if name.startswith(("verdict.", "search.", "fits."))
                     } - {"verdict.sensitive"}
    assert found >= {"alpha", "power", "refusal", "refusal_together", "choice_weight"}


def test_a_change_is_of_one_setting():
    for threshold in varied.thresholds():
        for factor in varied.FACTORS:
            found = varied.changed(threshold, factor)
            assert found is None or list(found.changed()) == [threshold.name]
    assert varied.changed(SETTINGS["power"], 1.25) is None
    assert varied.changed(SETTINGS["verdict.worth"], 1.25).verdict.worth == 1.25 * 0.05
    assert DEFAULTS.verdict.worth == 0.05


def test_what_acts_inside_fits_is_told_apart():
    memory = Memory(varied.UNREAD)
    changed = {name: memory.mark(varied.changed(SETTINGS[name], 0.75))
               for name in ("fits.far", "search.faint", "verdict.worth", "verdict.linear")}
    usual = memory.mark(DEFAULTS)
    assert {name for name, mark in changed.items() if mark != usual} == {
        "fits.far", "search.faint", "verdict.linear"}
    assert {name for name in changed if SETTINGS[name].inside_fits} == {
        "fits.far", "search.faint", "verdict.linear"}


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


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=4),
       st.floats(0.1, 3), st.floats(0.1, 3), st.floats(0.5, 2))
def test_what_is_not_noted_changes_nothing(data, limit, scale, factor):
    def program(limit, scale):
        rows = np.array(data)
        kept = rows[np.abs(rows) <= 2 * limit]
        if not len(kept) or max(limit, 1.0) * scale**2 < 1.5:
            return "few", len(kept)
        spread = np.sqrt(scale) * kept.std() + round(-limit, 1) / 4
        return ("wide" if spread > 0.1 else "narrow"), len(kept)

    noted = set()
    found = program(Watched(limit, {"limit": limit * factor}, noted),
                    Watched(scale, {"scale": scale * factor}, noted))
    assert found == program(limit, scale)
    if "limit" not in noted:
        assert program(limit * factor, scale) == found
    if "scale" not in noted:
        assert program(limit, scale * factor) == found


@pytest.mark.parametrize("look", [float, int, str, range, np.cumsum, lambda n: [1, 2, 3][:n],
                                  lambda n: f"{n:d}", lambda n: n.bit_length(), np.add.reduce])
def test_whatever_else_looks_at_a_number_is_noted(look):
    noted = set()
    number = Watched(3, {"more": 4}, noted)
    sum_of = 2 * number + 1
    assert not noted
    assert str(look(number)) == str(look(3))
    assert noted == {"more"}
    noted.clear()
    assert sum_of == 7 and noted == {"more"}


def test_a_section_says_what_does_not_survive():
    def answer(identifier):
        return {"verdict": "named", "mismatch": True, "hypotheses": [
            {"effects": [{"ids": [identifier]}], "probability": 1.0}]}

    truth = {"id": "001", "class": "single", "nameable": True, "base": {},
             "effects": [{"id": "input_delay", "twins": ["sensor_delay"], "near": ""}],
             "visibility": {"nominal": 40.0, "effects": [40.0], "best_rival": [],
                            "best_rival_distance": 9.0}}
    keys = {f"{t} x {f}": answer("input_delay") for t in varied.thresholds()
            for f in varied.FACTORS if varied.changed(t, f) is not None}
    case = thresholds_page.compared("rich 001", "today", truth, {
        varied.BASE: answer("input_delay"), **keys,
        "verdict.decoy_handicap x 0.75": answer("sensor_delay"),
        "verdict.behind x 1.25": answer("wall")})
    assert case.diagnosed == len(keys)
    few = replace(thresholds_page.compared("rich 002", "later", truth, {
        varied.BASE: answer("input_delay")}), tried=("verdict.behind",))
    text = thresholds_page.section(json.loads(json.dumps({"a": asdict(case), "b": asdict(few)})))
    assert "whose verdict survives every change: 1 of 2; whose outcome does: 1 of 2." in text
    assert "; became wrong: 1." in text
    assert f"Verdicts that survive: {len(keys)}/{len(keys) + 2} (" in text
    assert f" 2/{len(keys) + 2} (" in text
    assert "| `verdict.decoy_handicap` | 4 → 3 | 1 of 1 | 0 of 1 | - |" in text
    assert "| `verdict.behind` | 2 → 2.5 | 1 of 2 | 1 of 2 | rich 001 |" in text
    assert "rich 001 (`verdict.behind`, `verdict.decoy_handicap`)" in text
    assert "No verdict of 1 depends on `" in text and "`verdict.improvement`" in text
    assert "- later (rich 002)" in text


def test_a_diagnosis_repeated_fits_nothing_anew(monkeypatch):
    train, other = (pk.simulate(pk.systems.sloshing(), excitation.two_pulse(), sigma=0.002,
                                seed=seed) for seed in (1, 2))
    fits = []
    fitted = search.fitted
    monkeypatch.setattr(search, "fitted", lambda *given: fits.append(1) or fitted(*given))
    memory = Memory(varied.UNREAD)
    varied.diagnosed(train, other, DEFAULTS, memory)
    count = len(fits)
    varied.diagnosed(train, other, DEFAULTS.with_values({"verdict.worth": 0.06}), memory.fork())
    assert len(fits) == count > 0


@pytest.mark.slow
def test_a_remembered_diagnosis_is_the_same():
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 60.0)])
    train, other = (pk.simulate(truth, excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (1, 2))
    memory = Memory(varied.UNREAD)
    varied.diagnosed(train, other, DEFAULTS, memory)
    for name, factor in (("budget.singles", 0.75), ("verdict.unlikely", 1.25),
                         ("verdict.decoy_handicap", 0.75), ("noise.lone", 0.75),
                         ("refusal", 1.25)):
        settings = varied.changed(SETTINGS[name], factor)
        assert varied.diagnosed(train, other, settings, memory.fork()) == varied.diagnosed(
            train, other, settings, Memory())


@pytest.mark.slow
def test_what_decides_nothing_otherwise_changes_no_diagnosis():
    truth = pk.systems.sloshing().with_term(
        "theta_dot", "-k3*theta**3", [pk.Parameter("k3", 60.0)])
    train, other = (pk.simulate(truth, excitation.planar_moves(6, 10.0, seed=seed),
                                sigma=0.002, seed=seed) for seed in (3, 4))
    answer, noted = varied.decisive(train, other)
    assert answer == varied.diagnosed(train, other, DEFAULTS, Memory()) and answer["mismatch"]
    changes = [(t, f) for t in varied.thresholds() for f in varied.FACTORS
               if varied.changed(t, f) is not None]
    idle = [(t, f) for t, f in changes if varied.key_of(t, f) not in noted]
    assert len(changes) / 3 < len(idle) < len(changes)
    for threshold, factor in idle[::36]:
        assert varied.diagnosed(train, other, varied.changed(threshold, factor), Memory()
                                ) == answer, varied.key_of(threshold, factor)
