"""Whether answers agree under other CPU settings: what counts as a difference, what is tried."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import platform_cases
import platforms
import pytest

ANSWER: dict[str, Any] = {
    "verdict": "set",
    "hypotheses": [
        {"effects": [{"ids": ["a", "b"], "parameters": {"k": {"value": 2.0, "std": 0.1}}},
                     {"ids": ["c"], "parameters": {}}], "probability": 0.7},
        {"effects": [{"ids": ["d"], "parameters": {"q": {"value": 1.0, "std": None}}}],
         "probability": 0.3}],
    "parameters": {"before": {"l": {"value": 0.045, "std": 1e-5}},
                   "after": {"l": {"value": 0.046, "std": 1e-5}}},
    "held_out": {"rmse_before": 0.03, "rmse_after": 0.01}}


def changed(**places: Any) -> dict[str, Any]:
    """The answer with values at "path/to/place" replaced or, if callable, changed."""
    other = copy.deepcopy(ANSWER)
    for path, value in places.items():
        *way, last = (int(key) if key.isdigit() else key for key in path.split("/"))
        table: Any = other
        for key in way:
            table = table[key]
        table[last] = value(table[last]) if callable(value) else value
    return other


@pytest.mark.parametrize(("path", "within", "beyond"), [
    ("hypotheses/0/effects/0/parameters/k/value", 2.0049, 2.0051),
    ("hypotheses/1/effects/0/parameters/q/value", 1.0 + 9e-7, 1.0 + 2e-6),
    ("hypotheses/0/probability", 0.719, 0.721),
    ("parameters/before/l/value", 0.045 + 4e-7, 0.045 + 6e-7),
    ("parameters/after/l/value", 0.046 - 4e-7, 0.046 - 6e-7),
    ("held_out/rmse_before", 0.03 * 1.0009, 0.03 * 1.0011),
    ("held_out/rmse_after", 0.01 * 0.9991, 0.01 * 0.9989),
])
def test_numbers_may_differ_within_their_tolerance(
        path: str, within: float, beyond: float) -> None:
    assert platforms.differences(ANSWER, changed(**{path: within})) == []
    assert len(platforms.differences(ANSWER, changed(**{path: beyond}))) == 1


def test_verdict_and_names_may_not_differ() -> None:
    assert platforms.differences(ANSWER, changed(verdict="named")) == ["verdict set -> named"]
    for ids in (["a"], ["a", "x"]):
        (told,) = platforms.differences(ANSWER, changed(**{"hypotheses/0/effects/0/ids": ids}))
        assert told.startswith("names ")
    fewer = changed(hypotheses=lambda every: every[:1])
    assert platforms.differences(ANSWER, fewer) and platforms.differences(fewer, ANSWER)


def test_the_order_of_what_is_the_same_does_not_matter() -> None:
    def turned(effects: list[Any]) -> list[Any]:
        return [{**e, "ids": e["ids"][::-1]} for e in effects[::-1]]

    other = changed(**{"hypotheses/0/effects": turned, "hypotheses": lambda every: every[::-1]})
    assert platforms.differences(ANSWER, other) == []


AVX512 = {"SSE2": True, "AVX": True, "AVX2": True, "FMA3": True, "AVX512_SKX": True,
          "X86_V3": True, "X86_V4": True, "AVX512_SPR": False}
NEWER = ("X86_V3", "X86_V4", "AVX512_SPR")  # what NumPy 2.4 calls its kernels
OLDER = ("FMA3", "AVX2", "AVX512_SKX")  # and what NumPy 2.1 does


@pytest.mark.parametrize(("dispatched", "no_512", "no_2"), [
    (NEWER, "X86_V4", "X86_V3 X86_V4"), (OLDER, "AVX512_SKX", "FMA3 AVX2 AVX512_SKX")])
def test_every_setting_is_tried(dispatched: tuple[str, ...], no_512: str, no_2: str) -> None:
    found = {s.name: s for s in platforms.settings(AVX512, dispatched)}
    variables = {name: dict(s.variables) for name, s in found.items()}
    assert {v.get("OPENBLAS_CORETYPE") for v in variables.values()} == {
        None, "Sandybridge", "Haswell", "SkylakeX"}
    assert variables["no AVX512"]["NPY_DISABLE_CPU_FEATURES"] == no_512
    assert variables["no AVX2"]["NPY_DISABLE_CPU_FEATURES"] == no_2
    assert variables["generic numba"] == {"NUMBA_CPU_NAME": "generic"}
    assert variables["plainest"] == {
        "OPENBLAS_CORETYPE": "Sandybridge", "NPY_DISABLE_CPU_FEATURES": no_2,
        "ATEN_CPU_CAPABILITY": "default", "NUMBA_CPU_NAME": "generic"}
    assert {s.hash_seed for s in found.values()} == {0, 1, 2, 3}
    assert {s.threads for s in found.values()} == {1, 2}
    assert set(platforms.SHORT_SETTINGS) <= set(found)


def test_what_a_cpu_does_not_have_is_left_out() -> None:
    plain = platforms.settings({"SSE2": True, "AVX": True}, NEWER)
    assert [s.name for s in plain] == [
        "reference", "Sandybridge", "generic numba", "two threads", "plainest"]
    other = platforms.settings({}, NEWER)  # another architecture
    assert [s.name for s in other] == ["reference", "generic numba", "two threads"]


def test_settings_inherit_none_of_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.setenv("KEPT", "yes")
    reference = platforms.settings(AVX512, NEWER)[0].environment()
    assert "OPENBLAS_CORETYPE" not in reference
    assert reference["OMP_NUM_THREADS"] == "1" and reference["KEPT"] == "yes"
    assert reference["PYTHONHASHSEED"] == "0"


def test_outcomes_of_a_session() -> None:
    report = """<testsuites><testsuite>
        <testcase classname="tests.a" name="one"/>
        <testcase classname="tests.a" name="two"><failure message="no"/></testcase>
        <testcase classname="tests.a" name="three"><error message="no"/></testcase>
        <testcase classname="tests.a" name="four"><skipped/></testcase>
        </testsuite></testsuites>"""
    assert platforms.outcomes(report) == (1, ("tests.a::two", "tests.a::three"))


@pytest.mark.parametrize(("failed", "other", "code"), [
    ((), ANSWER, 0), (("tests.a::two",), ANSWER, 1), ((), changed(verdict="none"), 1)])
def test_the_exit_code_says_whether_anything_differs(
        failed: tuple[str, ...], other: dict[str, Any], code: int, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def tried(setting: platforms.Setting, folder: Path, cases: tuple[str, ...], *_: object
              ) -> platforms.Run:
        first = setting.name == "reference"
        return platforms.Run(5, () if first else failed,
                             dict.fromkeys(cases, ANSWER if first else other))

    monkeypatch.setattr(platforms, "tried", tried)
    monkeypatch.setattr(platforms, "here", lambda: platforms.settings(AVX512, NEWER))
    monkeypatch.setattr(platform_cases, "make", lambda folder, cases: None)
    report = tmp_path / "platforms.md"
    assert platforms.main(["--short", "--work", str(tmp_path), "--report", str(report)]) == code
    table = report.read_text()
    assert table.count("\n| ") == 2 + len(platforms.SHORT_SETTINGS)
    shown = capsys.readouterr().out.splitlines()
    assert all(line in shown for line in table.splitlines() if line[:2] in ("| ", "- "))
    assert ("verdict set -> none" in table) == (other is not ANSWER)
    assert ("tests.a::two fails" in table) == bool(failed)


def test_twenty_recordings_of_many_kinds() -> None:
    assert len(platform_cases.CASES) == 20
    assert set(platform_cases.SHORT) < set(platform_cases.CASES)
    first, again, other = (platform_cases.simulated(seed, ("dry",))[0] for seed in (1, 1, 2))
    assert first == again != other
