"""What became of verdicts when settings were a quarter smaller and larger: a section of the report.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from diagnosis_thresholds import (
    BASE,
    FACTORS,
    LEFT_OUT,
    Answers,
    Threshold,
    all_settings,
    answers,
    changed,
    key_of,
    reason,
    scaled,
    thresholds,
)

from pikanid.validation.concealed.score import Share, judge

BAD = ("wrong", "failed")


def explained(answer: Mapping[str, Any]) -> tuple[str, frozenset[Any]]:
    """The verdict, and the ids of every hypothesis."""
    return answer["verdict"], frozenset(
        tuple(sorted(tuple(sorted(e["ids"])) for e in h["effects"]))
        for h in answer["hypotheses"])


@dataclass(frozen=True)
class Tried:
    """What became of one case.

    Attributes:
        name: Of its set, and its own.
        made: When, and by which versions.
        mismatch: Whether something is missing by the default settings.
        outcome: What the score makes of that answer.
        tried: Names of the settings that were changed.
        diagnosed: Changes that were diagnosed; the others decide nothing otherwise.
        changed: Outcome where the verdict, or the ids of a hypothesis, became others, by key.
    """

    name: str
    made: str
    mismatch: bool
    outcome: str
    tried: tuple[str, ...]
    diagnosed: int
    changed: Mapping[str, str]

    def was(self, threshold: Threshold, factor: float) -> str | None:
        """The outcome with a setting changed; None where that was not tried."""
        if threshold.name not in self.tried or changed(threshold, factor) is None:
            return None
        return self.changed.get(key_of(threshold, factor), self.outcome)


def compared(name: str, made: str, truth: Mapping[str, Any], found: Answers) -> Tried:
    """The answers of one case with that of the default settings."""
    def outcome(answer: Mapping[str, Any]) -> str:
        return ("failed" if answer["verdict"].startswith("failed")
                else judge(truth, answer).outcome)

    base = found[BASE]
    names = tuple(t.name for t in thresholds())
    return Tried(name, made, base["mismatch"], outcome(base), names, len(found) - 1, {
        key: outcome(answer) for key, answer in found.items()
        if explained(answer) != explained(base)})


def tried(cases: int, work: Path, workers: int, sets: Sequence[str] | None, made: str
          ) -> dict[str, dict[str, Any]]:
    """The first cases of each set that lies in the work folder, `Tried` as dicts by name."""
    jobs, truths = [], []
    for file in sorted(work.glob("*/truth.json")):
        name = file.parent.name
        if sets is None or name in sets:
            for case in json.loads(file.read_text())["cases"][:cases]:
                truths.append((f"{name} {case['id']}", case))
                jobs.append((file.parent / "recordings", case["id"],
                             work / "thresholds" / name / case["id"]))
    with ProcessPoolExecutor(workers) as pool:
        return {name: asdict(compared(name, made, truth, found)) for (name, truth), found in zip(
            truths, pool.map(answers, jobs), strict=True)}


def section(kept: Mapping[str, Mapping[str, Any]]) -> str:
    """The table: verdicts and outcomes that each threshold changes.

    Args:
        kept: What `tried` has found, in any number of runs.
    """
    found = [Tried(**{**one, "tried": tuple(one["tried"])}) for one in kept.values()]
    rows: list[str] = []
    harmless: dict[int, list[str]] = {}
    moved: dict[str, dict[str, None]] = {}
    for threshold in thresholds():
        lines, counts, touched = zip(*(_row(threshold, f, found) for f in FACTORS), strict=True)
        for name in itertools.chain(*touched):
            moved.setdefault(name, {})[f"`{threshold}`"] = None
        if any(touched):
            rows += lines
        else:
            harmless.setdefault(max(counts), []).append(f"`{threshold}` ({_told(threshold.value)})")
    each = [(c, c.was(t, f), key_of(t, f) in c.changed)
            for c in found for t in thresholds() for f in FACTORS if c.was(t, f) is not None]
    missing = sum(c.mismatch for c in found)
    parts = [
        f"\n## Settings a quarter smaller and larger, {len(found)} cases\n",
        f"The first cases of several sets ({missing} of them with something missing), diagnosed "
        "again with one setting changed; whole numbers move by one at least. A verdict survives if "
        "it and the ids of all its hypotheses stay the same; an outcome is what the score makes of "
        "it. Of the changes "
        f"{Share(len(each) - sum(c.diagnosed for c in found), len(each))} needed no diagnosis: "
        "every comparison with the setting, and with what is computed of it, has the same outcome "
        "for the other value. Numerical tolerances, bounds and starting values, which are no "
        "settings, are not varied.\n",
        f"Verdicts that survive: {Share(sum(not moves for *_, moves in each), len(each))}; "
        f"outcomes: {Share(sum(was == c.outcome for c, was, _ in each), len(each))}; became wrong: "
        f"{sum(was in BAD and c.outcome not in BAD for c, was, _ in each)}.\n",
        f"Cases whose verdict survives every change: {len(found) - len(moved)} of {len(found)}; "
        "whose outcome does: "
        f"{sum(set(c.changed.values()) <= {c.outcome} for c in found)} of {len(found)}.\n"]
    if rows:
        parts += ["| setting | value | changed verdicts | changed outcomes | became wrong |",
                  "| --- | --- | --- | --- | --- |", *rows, "", "Verdicts that do not survive: "
                  + "; ".join(f"{c} ({', '.join(by)})" for c, by in moved.items()) + ".\n"]
    parts += [f"No verdict of {own} depends on {', '.join(names)}.\n"
              for own, names in sorted(harmless.items(), reverse=True)]
    parts += ["Not varied:\n", *(f"- {why}: " + ", ".join(
        f"`{t}`" for t in all_settings() if reason(t) == why) + "." for why in LEFT_OUT)]
    parts += ["\nMade with:\n", *(f"- {made} ({', '.join(c.name for c in found if c.made == made)})"
                                  for made in sorted({c.made for c in found}))]
    return "\n".join(parts) + "\n"


def _row(threshold: Threshold, factor: float, found: Sequence[Tried]
         ) -> tuple[str, int, list[str]]:
    """A row of the table, how many cases were tried, and those whose verdict changes."""
    key = key_of(threshold, factor)
    own = [c for c in found if c.was(threshold, factor) is not None]
    touched = [c for c in own if key in c.changed]
    outcomes = [c for c in touched if c.changed[key] != c.outcome]
    wrong = [c.name for c in outcomes if c.changed[key] in BAD]
    return (f"| `{threshold}` | {_told(threshold.value)} → {_told(scaled(threshold.value, factor))}"
            f" | {len(touched)} of {len(own)} | {len(outcomes)} of {len(own)} | "
            f"{', '.join(wrong) or '-'} |", len(own), [c.name for c in touched])


def _told(value: Any) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(_told(v) for v in value) + ")"
    return f"{value:.4g}"
