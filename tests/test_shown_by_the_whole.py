"""A partial answer is shown by an explanation that leaves nothing, where one holds what is sure."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from weighing import effect

from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.kinds import Kind
from pikanid.mismatch.judge.partial import Part
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.mismatch.steps import surely

DOUBT = "the push is too weak to be sure of"


def hypothesis(*names: str) -> Any:
    return SimpleNamespace(effects=tuple(effect(n, n) for n in names), key=frozenset(names),
                           blurred=())


@pytest.mark.parametrize(("whole", "adequate", "verdict", "shown"), [
    (("wall", "push"), True, "unconfirmed", {"wall", "push"}),
    (("wall", "push"), False, "unconfirmed", {"wall", "drag"}),  # it leaves something as well
    (("stop", "push"), True, "unconfirmed", {"wall", "drag"}),   # what is sure is not in it
    (("wall", "push", "drag"), True, "named", {"wall", "drag"})])  # not all of it is sure
def test_which_explanation_is_shown(monkeypatch: pytest.MonkeyPatch, whole: tuple[str, ...],
                                    adequate: bool, verdict: Any, shown: set[str]) -> None:
    explained, part_of = hypothesis(*whole), hypothesis("wall", "drag")
    [wall] = hypothesis("wall").effects
    present: Any = SimpleNamespace(effect=wall, kind=Kind("wall"), names=("wall",))  # type: ignore[arg-type]
    part = Part((present,), (), part_of, 9.0, 0.8)
    misfits = {frozenset(): 10.0, explained.key: 1.5}
    case: Any = SimpleNamespace(
        base=SimpleNamespace(key=frozenset()), settings=DEFAULTS, proves=True, candidates=(),
        adequate=lambda h: adequate,
        predicted=lambda h: SimpleNamespace(misfit=misfits[h.key]),
        search=SimpleNamespace(ranked=list, scale=lambda: 1.0))
    monkeypatch.setattr(surely, "_sure", lambda case: (None, part))
    monkeypatch.setattr(surely, "sure_channels", lambda *_: ("dynamics",))
    found = surely.with_sure_part(case, Answer(verdict, (explained,), (), doubt=DOUBT), case)
    assert found.verdict == "partial" and found.given[0].key == shown
    assert found.part is not None and found.part.present == (present,)
    if shown == explained.key:
        assert found.part.overdispersion == 1.0
        assert found.part.share == pytest.approx(1 - 1.25 / 99)
        assert [d.kind.family for d in found.part.doubtful] == ["push"]
    else:
        assert found.part is part and found.others[0] is explained
        assert found.reasons[explained.key] == DOUBT
