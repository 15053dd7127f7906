"""What a truth file says of a case and a diagnosis answers, checked before they are compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pikanid import errors
from pikanid.storage.entries import Entry

VERDICTS = ("none", "named", "set", "partial", "unconfirmed", "unnamed")
LONGEST_ID = 1000  # limit: of an effect: the formula of a symbolic law stands in it
MOST = 100  # limit: hypotheses, effects of one, ids of one effect


@dataclass(frozen=True)
class Answer:
    """A diagnosis.

    Attributes:
        verdict: One of `VERDICTS`.
        mismatch: Whether something is missing.
        hypotheses: Ids of the effects of each, the most probable first.
        probabilities: Of each.
        after: Value and standard error of each parameter that has one, after the diagnosis.
        held_out: RMSE after it over the noise; None where it is not given.
        present: Of what is said to be surely there: families, one of which it is, and ids where the
            name is sure.
    """

    verdict: str
    mismatch: bool
    hypotheses: tuple[list[set[str]], ...]
    probabilities: tuple[float, ...]
    after: Mapping[str, tuple[float, float]]
    held_out: float | None
    present: tuple[tuple[frozenset[str], frozenset[str]], ...] = ()


def read_answer(diagnosis: Any, case: str) -> Answer:
    """The content of diagnosis.json.

    Raises:
        BadSetting: If anything in it that is compared is missing or of another type.
    """
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.diagnosis_unreadable(case, detail.rstrip(".")))

    get = Entry(diagnosis, "it", wrong).table(("verdict", "mismatch", "hypotheses"), None)
    get = {key: entry.called(f"its {key}") for key, entry in get.items()}
    given = [_hypothesis(entry) for entry in get["hypotheses"].items(most=MOST)]
    given.sort(key=lambda hypothesis: -hypothesis[1])
    return Answer(
        get["verdict"].text(VERDICTS), get["mismatch"].flag(),
        tuple(effects for effects, _ in given), tuple(p for _, p in given),
        _after(get.get("parameters")), _held_out(get.get("held_out")),
        tuple(_present(e) for e in get["present"].items(most=MOST)) if "present" in get else ())


def check_case(case: Any) -> None:
    """Refuse an entry of a truth file that a diagnosis cannot be compared with.

    Raises:
        BadSetting: If anything in it that is compared is missing or of another type.
    """
    def wrong(detail: str) -> errors.BadSetting:
        return errors.BadSetting(errors.truth_case(detail.rstrip(".")))

    get = Entry(case, "it", wrong).table(
        ("id", "class", "nameable", "effects", "base", "visibility"), None)
    get["id"].text(longest=50)
    get["class"].text(longest=50)
    get["nameable"].flag()
    effects = get["effects"].items(most=MOST)
    for entry in effects:
        _check_effect(entry)
    if "remainder" in get:
        for entry in get["remainder"].items(most=MOST):
            _check_effect(entry)
    if "remainder_share" in get:
        get["remainder_share"].number(low=0.0)
    for entry in get["base"].table(optional=None, most=MOST).values():
        entry.table(("value",), None)["value"].number()
    seen = get["visibility"].table(
        ("nominal", "effects", "best_rival", "best_rival_distance"), None)
    seen["nominal"].number(low=0.0, finite=False)
    seen["best_rival_distance"].number(low=0.0, finite=False)
    seen["effects"].array(len(effects))
    for rival in seen["best_rival"].items(most=MOST):
        rival.text(longest=LONGEST_ID)


def _check_effect(entry: Entry) -> None:
    effect = entry.table(("id", "twins", "near"), None)
    for key in ("id", "near", "variant"):
        if key in effect:
            effect[key].text(longest=LONGEST_ID)
    for twin in effect["twins"].items(most=MOST):
        twin.text(longest=LONGEST_ID)
    if "parameters" in effect:
        for parameter in effect["parameters"].table(optional=None, most=MOST).values():
            parameter.table(("value",), None)["value"].number()


def _hypothesis(entry: Entry) -> tuple[list[set[str]], float]:
    get = entry.table(("effects", "probability"), None)
    effects = [effect.table(("ids",), None)["ids"].items(most=MOST)
               for effect in get["effects"].items(most=MOST)]
    return ([{identifier.text(longest=LONGEST_ID) for identifier in ids} for ids in effects],
            get["probability"].number(0.0, 1.0))


def _present(entry: Entry) -> tuple[frozenset[str], frozenset[str]]:
    get = entry.table(("family", "ids"), None)
    families = [get[key] for key in ("family", "or_family")
                if key in get and get[key].value is not None]
    ids = [] if get["ids"].value is None else get["ids"].items(most=MOST)
    return (frozenset(family.text(longest=LONGEST_ID) for family in families),
            frozenset(identifier.text(longest=LONGEST_ID) for identifier in ids))


def _after(parameters: Entry | None) -> dict[str, tuple[float, float]]:
    if parameters is None or parameters.value is None:
        return {}
    after = parameters.table(optional=None).get("after")
    if after is None or after.value is None:
        return {}
    found = {}
    for name, entry in after.table(optional=None, most=10 * MOST).items():
        get = entry.table(("value",), None)
        std = get.get("std")
        if std is not None and std.value is not None:
            found[name] = (get["value"].number(), std.number(low=0.0))
    return found


def _held_out(entry: Entry | None) -> float | None:
    if entry is None or entry.value is None:
        return None
    get = entry.table(optional=None)
    after, noise = get.get("rmse_after"), get.get("noise")
    if after is None or noise is None or after.value is None or noise.value is None:
        return None
    return after.number(low=0.0) / noise.number(low=1e-300)
