"""How good are diagnoses?  Open sets of concealed recordings, scored: `reports/diagnosis.md`.

    python benchmarks/report_diagnosis.py [FOLDER] [--work build/diagnosis] [--cases 80]
        [--workers 2] [--only rich alarms ...] [--rounds 3] [--alarms 400] [--thresholds 3]
        [--recordings silverbox ...]

Every set is made from its seed, every diagnosis is kept in the work folder: an interrupted run goes
on where it stopped.  Scores are kept in FOLDER/diagnosis.json: sets and sections that are not asked
for stay as they are, and so do cases with changed thresholds.  Nothing of the truth reaches a
diagnosis.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import diagnosis_alarms
import diagnosis_decoys
import diagnosis_real
import thresholds_page
from diagnosis_page import draw_reliability, page, scores
from diagnosis_rows import Row, table
from provenance import provenance

from pikanid.errors import DatasetUnavailable
from pikanid.model.systems import sloshing
from pikanid.storage.outputs import atomically, together
from pikanid.validation.concealed.generate import generate
from pikanid.validation.concealed.score import Score, judge
from pikanid.validation.concealed.seal import Settings
from pikanid.validation.own_model.trial import answered

DEGREE = math.pi / 180
SECTIONS = ("decoys", "alarms", "thresholds", "real")
MOST_ROUNDS = 14  # limit: that can be asked for by name
LONGEST = 5  # diagnoses of a set that are timed again by themselves


@dataclass(frozen=True)
class Set:
    """An open set: its name, excitation, noise [rad], seed, mix (default where None), and how many
    times as many cases as are asked for it has.  Those of the default mix are made in several
    rounds.
    """

    name: str
    excitation: str
    sigma: float
    seed: int
    mix: Mapping[str, float] | None = None
    times: float = 1.0


SETS = (
    Set("rich", "rich", 0.1 * DEGREE, 20841),
    Set("two_pulse", "two_pulse", 0.1 * DEGREE, 20842),
    Set("rich_1deg", "rich", 1.0 * DEGREE, 20843),
    Set("remainder", "mixed", 0.1 * DEGREE, 20844, {"remainder": 1.0}, 1.5),
    Set("unforeseen", "mixed", 0.1 * DEGREE, 20845, {"unforeseen": 1.0}, 1.5),
    Set("outside", "mixed", 0.1 * DEGREE, 20846, {"outside": 1.0}, 1.5),
    Set("nothing", "mixed", 0.1 * DEGREE, 20847, {"nothing": 1.0}, 2.5),
)
LATER = 100  # from the seed of one round to that of the next


def rounds(chosen: Sequence[Set], count: int) -> list[Set]:
    """All sets, once for every round, with a seed of its own.

    >>> [(s.name, s.seed) for s in rounds(SETS[2:4], 2)][1:3]
    [('rich_1deg_2', 20943), ('remainder', 20844)]
    """
    return [replace(one, name=one.name + (f"_{k + 1}" if k else ""), seed=one.seed + LATER * k)
            for one in chosen for k in range(count)]


def main() -> None:
    """Run what is asked for, and write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path("reports"))
    parser.add_argument("--work", type=Path, default=Path("build/diagnosis"))
    parser.add_argument("--cases", type=int, default=80)
    parser.add_argument("--rounds", type=int, default=3, help="of the sets of all kinds of cases")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--alarms", type=int, default=400, help="clean recordings of each noise")
    parser.add_argument("--thresholds", type=int, default=3,
                        help="cases of each set that are diagnosed again with every threshold "
                             "changed")
    every = rounds(SETS, MOST_ROUNDS)
    parser.add_argument("--thresholds-of", choices=[s.name for s in every], nargs="*",
                        help="sets that those are taken from; by default all in the work folder")
    parser.add_argument("--recordings", choices=list(diagnosis_real.RECORDINGS), nargs="*",
                        default=list(diagnosis_real.RECORDINGS), help="real ones to diagnose")
    parser.add_argument("--only", choices=[*(s.name for s in every), *SECTIONS], nargs="*",
                        help="sets and sections to run; by default all")
    given = parser.parse_args()
    chosen = [one for one in rounds(SETS, given.rounds)
              if one.mix is None or one in SETS]
    asked = given.only if given.only is not None else [*(s.name for s in chosen), *SECTIONS]
    path = given.folder / "diagnosis.json"
    kept = json.loads(path.read_bytes()) if path.exists() else {"sets": {}, "sections": {}}
    kinds = [s.name for s in every
             if s.mix is None and (s.name in kept["sets"] or s.name in asked)]
    others = [s.name for s in every
              if s.mix and (s in SETS or s.name in kept["sets"] or s.name in asked)]

    def keep() -> None:
        found = [s for one in kept["sets"].values() for s in scores(one)]
        draw_reliability(found, given.folder)
        together({path: json.dumps(kept, indent=1).encode(), path.with_suffix(".md"): page(
            kept, kinds, others, SECTIONS).encode()})

    for one in every:
        if one.name in asked:
            kept["sets"][one.name] = _kept_set(one, given.work, given.cases, given.workers)
            keep()
    sections: dict[str, Callable[[], str]] = {
        "decoys": lambda: diagnosis_decoys.section(given.work, given.workers, ["outside"]),
        "alarms": lambda: diagnosis_alarms.section(given.alarms, given.work, given.workers),
        "thresholds": lambda: _thresholds(kept, given),
        "real": lambda: _real(given.work, given.recordings)}
    for name in SECTIONS:
        if name in asked:
            kept["sections"][name] = {"made": _made(), "text": sections[name]()}
            keep()


def _made() -> str:
    return f"{datetime.now(UTC):%Y-%m-%d}, {provenance()}"


def _kept_set(one: Set, work: Path, cases: int, workers: int) -> dict[str, Any]:
    found = list(_diagnosed(one, work, cases, workers))
    longest = sorted(found, key=lambda each: -each[1]["cpu"])[:LONGEST]
    return {"made": _made(), "title": f"{one.name}: {one.excitation}, sigma = "
            f"{one.sigma / DEGREE:g} deg, seed {one.seed}",
            "scores": [asdict(score) for score, _ in found],
            "cpu": [answer["cpu"] for _, answer in found],
            "alone": _alone(work / one.name, [score.case for score, _ in longest])}


def _thresholds(kept: dict[str, Any], given: argparse.Namespace) -> str:
    """The section; cases of earlier runs stay in it."""
    every = kept.setdefault("thresholds", {})
    every.update(thresholds_page.tried(
        given.thresholds, given.work, given.workers, given.thresholds_of, _made()))
    return thresholds_page.section(every)


def _real(work: Path, names: Sequence[str]) -> str:
    """Rows of the recordings that are there."""
    rows, missing = [], []
    for name in names:
        make = diagnosis_real.RECORDINGS[name]
        kept = work / "real" / f"{name}.json"
        try:
            if not kept.exists():
                kept.parent.mkdir(parents=True, exist_ok=True)
                atomically(kept, json.dumps([asdict(row) for row in make()]).encode())
            rows += [Row(**row) for row in json.loads(kept.read_text())]
        except DatasetUnavailable as reason:
            missing.append(f"Left out: {reason}")
    return "\n".join(["\n## Real recordings, each with only its nominal model\n",
                      REAL, table(rows) if rows else "", *missing]) + "\n"


REAL = """Two drops of one ball repeat one experiment: what differs between them is noise, of any
colour, and what is missing has to repeat.  Silverbox: fitted to 24,000 samples; in the last column
both official tests.  Water carried by a robot: runs named by motion, time and turn; the delay of
the film comes from the energies of film and motion, before any model.  Held-out RMSE is that of
the output that is missed most.  To be sure of a family beside a remainder, the best explanation has
to explain 80 % of the square of the held-out misfit, and without the family four times as much has
to be left (of a scale error 16 times).
"""

def _diagnosed(one: Set, work: Path, cases: int, workers: int
               ) -> Iterator[tuple[Score, Mapping[str, Any]]]:
    from pikanid.validation.concealed.deck import DEFAULT_MIX

    folder = work / one.name
    settings = Settings(round(one.times * cases), one.excitation, one.sigma,
                        dict(one.mix or DEFAULT_MIX))
    made = generate(folder / "recordings", folder / "truth.json", settings, seed=one.seed,
                    workers=workers)
    for case, answer in answered(made.folder, made.truth, sloshing(), folder / "answers", workers):
        yield judge(case, answer), answer


def _alone(folder: Path, cases: Sequence[str]) -> str:
    """How long the diagnoses take that took longest, made again one after the other, with as many
    threads as a diagnosis takes by itself.
    """
    kept = folder / "alone.json"
    seconds: dict[str, float] = json.loads(kept.read_text()) if kept.exists() else {}
    for case in cases:
        if case not in seconds:
            # once to have everything compiled and read, then for the time
            seconds[case] = [_timed(folder / "recordings", case) for _ in range(2)][1]
            kept.write_text(json.dumps(seconds))
    found = ", ".join(f"{seconds[case]:.1f}" for case in cases)
    return (f"The {len(cases)} that took longest, again by themselves on {os.cpu_count()} cores: "
            f"{found} s by the clock.\n")


def _timed(folder: Path, case: str) -> float:
    import pikanid as pk

    train, other = (pk.Recording.read(folder / f"{case}_{part}.csv")
                    for part in ("train", "held_out"))
    begun = time.perf_counter()
    pk.diagnose(pk.systems.sloshing(), train, other)
    return time.perf_counter() - begun


if __name__ == "__main__":
    main()
