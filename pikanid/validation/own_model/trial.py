"""Diagnoses of a concealed set, kept one by one, and scored."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pikanid.model import Model
from pikanid.recording import Recording
from pikanid.storage.outputs import atomically
from pikanid.storage.workers import unordered
from pikanid.validation.concealed.score import Score, Share, judge
from pikanid.validation.concealed.seal import cases_of


@dataclass(frozen=True)
class Trial:
    """One case: the score, whether the place was right, and what it cost.

    Attributes:
        score: Of the names.
        place: Whether channel and, of laws in an equation, the equation are right; None where
            nothing hides or two effects hide in different places, or no answer is right.
        cpu: Processor time of the diagnosis [s].
        said: Ids that were given.
        hidden: Ids and places.
    """

    score: Score
    place: bool | None
    cpu: float
    said: str
    hidden: str


def trials(folder: str | Path, truth: str | Path, model: Model, answers: str | Path,
           workers: int = 1, step: Callable[[str], None] = lambda text: None) -> list[Trial]:
    """Diagnose every case of a set that has no answer yet, and score all.

    Args:
        folder: Of the recordings.
        truth: File; it is read for the names of the cases first, and nothing of it reaches a
            diagnosis.
        model: Nominal, with the effects that it may lack.
        answers: Folder of the answers, one file a case.
        workers: Processes.
        step: Called with the number of a case that is done.

    Raises:
        BadSetting: If the truth cannot be read.
    """
    return [_trial(case, answer)
            for case, answer in answered(folder, truth, model, answers, workers, step)]


def answered(folder: str | Path, truth: str | Path, model: Model, answers: str | Path,
             workers: int = 1, step: Callable[[str], None] = lambda text: None,
             ) -> list[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Every case of a set with its answer, and the processor seconds that took as ``"cpu"``; the
    arguments are those of `trials`.
    """
    cases = cases_of(truth)
    kept = Path(answers)
    kept.mkdir(parents=True, exist_ok=True)
    waiting = [c["id"] for c in cases if not (kept / f"{c['id']}.json").exists()]
    for done in unordered(_answer, [(str(folder), case, model, str(kept)) for case in waiting],
                          min(workers, max(len(waiting), 1))):
        step(done)
    return [(case, json.loads((kept / f"{case['id']}.json").read_bytes())) for case in cases]


def places(found: Iterable[Trial]) -> Share:
    """How many right answers have the right place."""
    told = [one.place for one in found if one.place is not None]
    return Share(sum(told), len(told))


def _answer(folder: str, case: str, model: Model, answers: str) -> str:
    from pikanid.mismatch.diagnose import diagnose

    train, held_out = (Recording.read(Path(folder) / f"{case}_{part}.csv")
                       for part in ("train", "held_out"))
    begun = time.process_time()
    answer = diagnose(model, train, held_out, workers=1).to_dict()
    answer["cpu"] = time.process_time() - begun
    atomically(Path(answers) / f"{case}.json", json.dumps(answer).encode())
    return case


def _trial(case: Mapping[str, Any], answer: Mapping[str, Any]) -> Trial:
    score = judge(case, answer)
    if answer["verdict"] == "partial":
        said = " + ".join("/".join(p["ids"]) if p["ids"] else f"({p['family']})"
                          for p in answer["present"])
    else:
        said = " | ".join(" + ".join("/".join(e["ids"]) for e in h["effects"])
                          for h in answer["hypotheses"])
    hidden = " + ".join(f"{e['id']}[{e['variant'] or e['where']['place']}]"
                        for e in case["effects"])
    return Trial(score, placed(case, answer) if score.outcome == "right" else None,
                 float(answer["cpu"]), said, hidden or "-")


def placed(case: Mapping[str, Any], answer: Mapping[str, Any]) -> bool | None:
    """Whether what is right in an answer acts in the channel, and of laws in the equation, of what
    hides; None where several effects hide in different places.
    """
    places = {(e["where"]["channel"], tuple(e["where"]["places"])) for e in case["effects"]}
    if len(places) != 1:
        return None
    (channel, equations), hidden = places.pop(), [{e["id"], *e["twins"]} for e in case["effects"]]
    return any(
        # one of twins in several channels: which of them cannot be known
        len(e["ids"]) > 1 if e["channel"] != channel
        else channel != "dynamics" or e["equation"] in equations
        for h in answer["hypotheses"] for e in h["effects"]
        if any(ids & {*e["ids"]} for ids in hidden))
