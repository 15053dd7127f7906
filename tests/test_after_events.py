"""A search goes on beside what happens once, whatever that has cost."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from pikanid.mismatch.search import leaders
from pikanid.mismatch.search.search import Search
from pikanid.mismatch.settings.settings import DEFAULTS

PUSH, DRAG = (SimpleNamespace(key=k, absent=a) for k, a in (("push", True), ("drag", False)))


def hypothesis(*effects: Any) -> Any:
    return SimpleNamespace(effects=effects, key=frozenset(e.key for e in effects))


def test_an_event_is_one_alone() -> None:
    assert leaders.an_event(hypothesis(PUSH))
    assert not leaders.an_event(hypothesis(DRAG))
    assert not leaders.an_event(hypothesis(PUSH, DRAG)) and not leaders.an_event(hypothesis())


@pytest.mark.parametrize(("best", "goes_on"), [((PUSH,), True), ((DRAG,), False)])
def test_no_budget_keeps_what_lasts_from_being_looked_for(
        best: tuple[Any, ...], goes_on: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = hypothesis(*best), []
    found.minimum, found.known, found.whitened = SimpleNamespace(chi2=900.0), True, SimpleNamespace(
        rows=100)
    monkeypatch.setattr(Search, "budget_exhausted", property(lambda self: True))
    monkeypatch.setattr(Search, "ranked", lambda self: [found])
    monkeypatch.setattr(Search, "_fit_all", lambda self, *args, **more: None)
    monkeypatch.setattr(Search, "_simplify", lambda self: None)
    monkeypatch.setattr(Search, "_contenders", lambda self: iter(()))
    monkeypatch.setattr(leaders, "to_extend", lambda ranked, fits: [found])
    monkeypatch.setattr(Search, "_extend",
                        lambda self, h, *args, **more: tried.append(more["anyway"]))

    class Stopped(Exception):
        pass

    def after(*args: Any) -> Any:
        raise Stopped

    monkeypatch.setattr("pikanid.mismatch.search.search.neighbours.afresh", lambda *args: ())
    monkeypatch.setattr("pikanid.mismatch.search.search.neighbours.with_events", after)
    nominal: Any = SimpleNamespace(name="any")
    records: Any = SimpleNamespace(settings=DEFAULTS, guess={})
    search = Search(nominal, records, ())
    with pytest.raises(Stopped):
        search.grow(lambda h: False)
    assert tried == ([True] if goes_on else [])
