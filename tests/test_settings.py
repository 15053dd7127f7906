"""Settings of a diagnosis: documented, checked, from files, printed, and taken by every step."""

from __future__ import annotations

import inspect
import json
import pkgutil
import re
from dataclasses import fields, is_dataclass, replace
from importlib import import_module
from math import inf, log, nan
from pathlib import Path
from statistics import NormalDist
from typing import Any, get_type_hints

import numpy as np
import pytest
from typer.testing import CliRunner

import pikanid as pk
from pikanid import errors
from pikanid.cli import app
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.data.whitened import Whitened
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.report.locate import smallest
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings import thresholds
from pikanid.mismatch.settings.settings import DEFAULTS, Settings
from pikanid.mismatch.steps.opening import open_case
from pikanid.objective.adequacy import decides
from pikanid.settings import Range, check, ranges_of


def groups() -> list[Any]:
    """The defaults of every dataclass in a module `settings` of the package."""
    found = {}
    for place in pkgutil.walk_packages(pk.__path__, "pikanid."):
        if ".settings" in place.name:
            module = import_module(place.name)
            found |= {kind.__name__: kind() for kind in vars(module).values()
                      if is_dataclass(kind) and kind is not Range and isinstance(kind, type)}
    return [found[name] for name in sorted(found)]


GROUPS = groups()


@pytest.mark.parametrize("group", GROUPS, ids=lambda g: type(g).__name__)
def test_every_field_is_described(group: Any) -> None:
    assert set(described(group)) >= {f.name for f in fields(group)}


def test_thresholds_follow_from_their_rates() -> None:
    z = NormalDist().inv_cdf
    usual = Settings()
    assert usual.adequate == 0.005 and usual.separated == 4.0 and usual.visible == 5.0
    assert usual.louder == 1.64 and usual.contradiction == 4.6
    careful = Settings(alpha=1e-4, refusal=0.002, confusion=1e-3, noise_excess=0.001,
                       noise_conflict=1e-6)
    assert careful.adequate == 0.001
    assert careful.visible == pytest.approx(z(0.9) - z(1e-6), abs=0.05)
    assert careful.separated == pytest.approx(-2 * z(1e-3), abs=0.05)
    assert careful.louder == pytest.approx(-z(1e-3), abs=0.005)
    assert careful.contradiction == pytest.approx(-log(1e-6), abs=0.05)
    assert careful.least_proof == pytest.approx((z(0.9) - z(1e-4)) ** 2)
    assert thresholds.price(3, 2, 1000, 50, 0.5) == pytest.approx(3 * log(1000) + 2 * log(50))
    assert thresholds.bic(1000) == pytest.approx(log(1000) / 2)


def test_the_separation_of_two_hypotheses_errs_at_its_rate() -> None:
    """The likelihood ratio of two predictions D apart, drawn under either of them."""
    drawn = np.random.default_rng(0).standard_normal(200_000)
    distance = Settings(confusion=0.01).separated
    assert np.mean(drawn > distance / 2) == pytest.approx(0.01, abs=0.001)


def test_a_table_describes_settings_and_back() -> None:
    own = Settings(alpha=0.05).with_values({"search.faint": 4.0, "budget.force_knots": (9, 90)})
    assert own.changed() == {"alpha": 0.05, "search.faint": 4.0, "budget.force_knots": (9, 90)}
    assert Settings.from_dict(json.loads(json.dumps(own.to_dict()))) == own
    assert str(own) == ("Settings: alpha = 0.05, search.faint = 4, budget.force_knots = (9, 90); "
                        "all others defaults.")


@pytest.mark.parametrize(("values", "told"), [
    ({"alpha": 0.0}, "alpha.*between 0 and 1"),
    ({"power": 1.0}, "power.*between 0 and 1"),
    ({"alpha": "0.05"}, "alpha"),
    ({"kinds": (0.9, 0.2, 0.2)}, "kinds.*shares of 1"),
    ({"budget.singles": 2.5}, "budget.singles.*whole number"),
    ({"budget.singles": 0}, "budget.singles.*whole number"),
    ({"budget.pairs": True}, "budget.pairs.*whole number"),
    ({"search.faint": -1.0}, "search.faint.*0 or more"),
    ({"search.faint": float("nan")}, "search.faint.*0 or more"),
    ({"verdict.strong": (1.0, 2.0)}, "verdict.strong.*4 of these"),
    ({"adequacy.alpha": 2.0}, r"The setting adequacy\.alpha is 2"),
    ({"search.fainter": 1.0}, "no setting 'search.fainter'.*search.faint"),
    ({"verdict": 1.0}, "no setting 'verdict'"),
    ({"budget.singles.x": 1}, "no setting 'budget.singles.x'"),
])
def test_what_is_no_setting_is_refused(values: dict[str, Any], told: str) -> None:
    with pytest.raises(errors.BadSetting, match=told):
        DEFAULTS.with_values(values)


def test_a_group_of_another_kind_is_refused() -> None:
    with pytest.raises(errors.BadSetting, match="search"):
        replace(DEFAULTS, search={"faint": 3.0})  # type: ignore[arg-type]  # what a user may do
    with pytest.raises(errors.BadSetting, match="settings"):
        pk.diagnose(pk.systems.sloshing(), run(1),
                    settings={"alpha": 0.1})  # type: ignore[arg-type]  # what a user may do


def test_alpha_alone_may_be_given() -> None:
    with pytest.raises(errors.BadSetting, match=r"alpha.*between 0 and 1"):
        pk.diagnose(pk.systems.sloshing(), run(1), alpha=1.5)
    found = pk.diagnose(pk.systems.sloshing(), run(1), alpha=1e-6)
    assert found.settings.changed() == {"alpha": 1e-6} and found.alpha == 1e-6


@pytest.mark.parametrize("content", [
    b"alpha = ", b"\xff\xfe", b"alpha = 2", b"[search]\nfainter = 1", b"search = 3",
    b"[a.b]\nc = 1", b"alpha = nan", b"x = " + b"[" * 2000])
def test_a_file_of_wrong_settings_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "own.toml"
    file.write_bytes(content)
    with pytest.raises(errors.BadSetting):
        Settings.read(file)


def run(seed: int) -> pk.Recording:
    return pk.simulate(pk.systems.sloshing(), pk.excitation.planar_moves(3, 6.0, seed=seed),
                       sigma=0.002, seed=seed)


def test_a_result_says_by_which_settings_it_came(tmp_path: Path) -> None:
    """The page, the file and the text; --alpha and --settings meet in one."""
    run(1).write(tmp_path / "run.csv")
    (tmp_path / "own.toml").write_text("[budget]\nsingles = 3\n")
    said = CliRunner().invoke(app, [
        "diagnose", str(tmp_path / "run.csv"), "--model", "sloshing", "--alpha", "0.02",
        "--settings", str(tmp_path / "own.toml"), "--json", str(tmp_path / "why.json"),
        "--report", str(tmp_path / "why.html")])
    assert said.exit_code == 0, said.output
    words = "Settings: alpha = 0.02, budget.singles = 3; all others defaults."
    assert said.output.rstrip().endswith(words)
    assert words in (tmp_path / "why.html").read_text("utf-8")
    found = json.loads((tmp_path / "why.json").read_text("utf-8"))
    assert found["alpha"] == 0.02
    assert Settings.from_dict(found["settings"]).changed() == {"alpha": 0.02, "budget.singles": 3}


def test_no_step_falls_back_to_the_defaults(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is whitened, in opening, search, prediction, force and advice, has the settings; of
    no group are the usual ones asked for anything.
    """
    own = Settings().with_values({"budget.singles": 2, "budget.pairs": 1, "budget.effort": 0.0})
    for dof in range(550, 650):
        decides(dof, DEFAULTS.adequacy)  # what is remembered of others is not compared with
    asked = watch(monkeypatch)
    seen: list[Settings] = []
    made = Whitened.__init__

    def watched(self: Whitened, model: pk.Model, records: Records) -> None:
        seen.append(records.settings)
        made(self, model, records)

    monkeypatch.setattr(Whitened, "__init__", watched)
    truth = pk.systems.sloshing().with_term("theta_dot", "-k*theta**3", [pk.Parameter("k", 200.0)])
    train, other = (pk.simulate(truth, pk.excitation.planar_moves(3, 6.0, seed=seed), sigma=0.002,
                                seed=seed) for seed in (1, 2))
    train = train.with_channels(replace(train["theta"], sigma=None))  # noise is read as well
    dx = pk.diagnose(pk.systems.sloshing(), train, other, settings=own, workers=1)
    assert dx.settings is own and dx.mismatch
    assert len(seen) > 5 and all(settings is own for settings in seen)
    usual = {id(one) for one in USUAL}
    assert [name for group, name in asked if group in usual] == []
    reached = {id(getattr(own, f.name)): f.name for f in fields(own) if f.name not in LATER
               and is_dataclass(getattr(own, f.name))}
    assert set(reached) <= {group for group, _ in asked}, reached


# Asked where something without a name, or sure beside a remainder, is found.
LATER = ("beyond", "part", "formulas")
USUAL = [one for name in ("noise", "objective", "uncertainty", "symbolic", "discrepancy",
                          "mismatch.settings")
         for one in vars(import_module(f"pikanid.{name}.settings")).values() if one in GROUPS]
USUAL += [getattr(DEFAULTS, f.name) for f in fields(DEFAULTS)
          if is_dataclass(getattr(DEFAULTS, f.name))]


def watch(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, str]]:
    """From now on: which field of which object is asked for, of all kinds of settings."""
    asked: list[tuple[int, str]] = []

    def look(self: Any, name: str) -> Any:
        if not name.startswith("__"):
            asked.append((id(self), name))
        return object.__getattribute__(self, name)

    for group in GROUPS:
        monkeypatch.setattr(type(group), "__getattribute__", look, raising=False)
    return asked


def test_the_rate_of_false_alarms_decides_what_is_missing() -> None:
    """A faint effect: missing for who accepts false alarms, nothing for who does not."""
    truth = pk.systems.sloshing().with_term("theta_dot", "-k*theta**3", [pk.Parameter("k", 17.0)])
    rec = pk.simulate(truth, pk.excitation.planar_moves(3, 6.0, seed=4), sigma=0.002, seed=4)
    case = open_case(pk.systems.sloshing(), (rec,), None, None, lambda text: None, DEFAULTS)
    p = case.detected().p_value
    assert 1e-6 < p < 0.3
    for alpha, missing in ((0.5 * p, False), (min(2 * p, 0.9), True)):
        dx = pk.diagnose(pk.systems.sloshing(), rec, settings=Settings(alpha=alpha), workers=1)
        assert dx.mismatch is missing and dx.alpha == alpha


def test_settings_act_where_they_are_looked_up() -> None:
    """One of each kind: price of an effect, budget of a search, size that can be seen, iterations.
    """
    rec = run(1)
    usual = open_case(pk.systems.sloshing(), (rec,), None, None, lambda text: None, DEFAULTS)
    effect = next(c for c in usual.candidates if c.key == "cubic_stiffness")

    def cost(weight: float) -> float:
        records = replace(usual.records, settings=Settings(choice_weight=weight))
        found = fitted(usual.model, [effect], records, [{}], 40)
        assert found is not None
        return found.penalty

    assert cost(2.0) - cost(1.0) == pytest.approx(2 * log(40))

    sizes = [_sizes(usual.base, own, effect) for own in (DEFAULTS, Settings(alpha=1e-6))]
    ratio = sizes[1]["cubic_stiffness"].value / sizes[0]["cubic_stiffness"].value
    assert ratio == pytest.approx(Settings(alpha=1e-6).visible / 5.0)

    stopped = Search(usual.model, replace(usual.records, settings=DEFAULTS.with_values(
        {"budget.effort": 0.0})), usual.candidates, spent=1.0)
    assert stopped.budget_exhausted and not replace(stopped, records=usual.records).budget_exhausted


def _sizes(base: Any, own: Settings, effect: Any) -> dict[str, Any]:
    whitened = Whitened(base.model, replace(base.whitened.records, settings=own))
    assert whitened.choose_steps(base.minimum.theta)
    return smallest(replace(base, whitened=whitened), [effect])


def described(group: Any) -> dict[str, str]:
    """What the documentation says of each field, of a base class where it has it from there."""
    text = "\n".join(inspect.cleandoc(kind.__doc__ or "") for kind in type(group).__mro__)
    return dict(re.findall(r"^    (\w+): (\S.*)", text, re.MULTILINE))


NUMBERS = [(group, f.name, ranges_of(hints[f.name])) for group in GROUPS
           for hints in [get_type_hints(type(group), include_extras=True)]
           for f in fields(group) if not is_dataclass(hints[f.name])]


@pytest.mark.parametrize(("group", "name", "ranges"), NUMBERS,
                         ids=[f"{type(g).__name__}.{name}" for g, name, _ in NUMBERS])
def test_every_field_has_a_range_and_keeps_to_it(group: Any, name: str, ranges: Any) -> None:
    """Beyond a bound, of another kind or not finite: one sentence.  What is inside is taken."""
    assert ranges is not None, "annotate it with one of pikanid.settings"
    each = ranges if isinstance(ranges, tuple) else (ranges,)

    def with_all(*values: Any) -> Any:
        given = values if isinstance(ranges, tuple) else values[0]
        made = replace(group, **{name: given})
        check(made)
        return made

    for k, r in enumerate(each):
        usual = [0.1 if name == "kinds" else _inside(r) for r in each]
        assert getattr(with_all(*usual), name) in (usual[0], tuple(usual))
        outside = [r.low - 1e-9, r.high + 1e-9, inf, -inf, nan, "1", None, True, 10**400]
        outside += [r.low, r.high] if r.inside else []
        outside += [float(r.low), r.low + 0.5] if r.whole else []
        for wrong in outside:
            with pytest.raises(errors.BadSetting, match=rf"{name} is .*; it must be .+\."):
                with_all(*usual[:k], wrong, *usual[k + 1:])
        if not r.inside and r.low > -inf and name != "kinds" and not isinstance(ranges, tuple):
            with_all(r.low)
    if isinstance(ranges, tuple):
        with pytest.raises(errors.BadSetting, match=f"{len(each)} of these"):
            with_all(*usual[1:])


def _inside(r: Range) -> float:
    if r.high < inf:
        return (r.low + r.high) / 2
    return r.low + (1 if r.whole else 0.25) if r.low > -inf else 0.25


def test_ranges_are_those_that_the_documentation_speaks_of() -> None:
    """A rate or a probability is none of the sure ones, a share is from 0 to 1."""
    wrong = []
    for group, name, ranges in NUMBERS:
        first = described(group)[name].split()[0]
        each = ranges if isinstance(ranges, tuple) else (ranges,)
        if first in ("Rate", "Probability") and any(r != Range(0, 1, inside=True) for r in each):
            wrong.append(name)
        if first in ("Share", "Shares") and any((r.low, r.high) != (0, 1) for r in each):
            wrong.append(name)
    assert wrong == []


@pytest.mark.parametrize("values", [
    {"quiet.steepest": 1.225}, {"noise.begins": (0.6, 0.25)}, {"budget.force_knots": (800, 8)},
    {"noise.covered": 1.1}, {"search.kept": 2.0}, {"verdict.alike": 0.9}])
def test_a_value_beyond_its_meaning_is_refused(values: dict[str, Any]) -> None:
    with pytest.raises(errors.BadSetting):
        DEFAULTS.with_values(values)
