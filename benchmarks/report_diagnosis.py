"""How good are diagnoses?  Open sets of concealed recordings, scored: `reports/diagnosis.md`.

    python benchmarks/report_diagnosis.py [FOLDER] [--work build/diagnosis] [--cases 80]
        [--workers 2] [--only rich ...] [--rounds 3] [--alarms 400] [--thresholds 8]
        [--recordings silverbox ...]

Every set is made from its seed, every diagnosis is kept in the work folder: an interrupted run goes
on where it stopped.  Nothing of the truth reaches a diagnosis.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import diagnosis_alarms
import diagnosis_decoys
import diagnosis_real
import diagnosis_thresholds
import numpy as np
from provenance import provenance

from pikanid.errors import DatasetUnavailable
from pikanid.figures import new_figure, save_figure
from pikanid.model.systems import sloshing
from pikanid.storage.outputs import atomically
from pikanid.validation.concealed.generate import generate
from pikanid.validation.concealed.score import Score, Share, judge, reliability, tally
from pikanid.validation.concealed.seal import Settings
from pikanid.validation.own_model.trial import answered

DEGREE = math.pi / 180
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
    Set("rich", "rich", 0.1 * DEGREE, 20641),
    Set("two_pulse", "two_pulse", 0.1 * DEGREE, 20642),
    Set("rich_1deg", "rich", 1.0 * DEGREE, 20643),
    Set("remainder", "mixed", 0.1 * DEGREE, 20644, {"remainder": 1.0}, 1.5),
    Set("unforeseen", "mixed", 0.1 * DEGREE, 20645, {"unforeseen": 1.0}, 1.5),
    Set("outside", "mixed", 0.1 * DEGREE, 20646, {"outside": 1.0}, 1.5),
    Set("nothing", "mixed", 0.1 * DEGREE, 20647, {"nothing": 1.0}, 2.5),
)
LATER = 100  # from the seed of one round to that of the next


def rounds(chosen: Sequence[Set], count: int) -> list[Set]:
    """All sets; those of the default mix once for every round, with a seed of its own.

    >>> [(s.name, s.seed) for s in rounds(SETS[2:4], 2)]
    [('rich_1deg', 20643), ('rich_1deg_2', 20743), ('remainder', 20644)]
    """
    return [replace(one, name=one.name + (f"_{k + 1}" if k else ""), seed=one.seed + LATER * k)
            for one in chosen for k in range(1 if one.mix else count)]


def main() -> None:
    """Make the sets, diagnose, score, write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path("reports"))
    parser.add_argument("--work", type=Path, default=Path("build/diagnosis"))
    parser.add_argument("--cases", type=int, default=80)
    parser.add_argument("--rounds", type=int, default=3, help="of the sets of all kinds of cases")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--alarms", type=int, default=400,
                        help="clean recordings of each noise; 0 for none")
    parser.add_argument("--thresholds", type=int, default=8,
                        help="cases of each set that are diagnosed again with every threshold "
                             "changed; 0 for none")
    parser.add_argument("--thresholds-of", choices=[s.name for s in SETS], nargs="*",
                        default=[s.name for s in SETS], help="sets that those are taken from")
    parser.add_argument("--only", choices=[s.name for s in SETS], action="append")
    parser.add_argument("--recordings", choices=list(diagnosis_real.RECORDINGS), nargs="*",
                        default=list(diagnosis_real.RECORDINGS), help="real ones to diagnose")
    given = parser.parse_args()
    chosen = rounds([s for s in SETS if not given.only or s.name in given.only], given.rounds)
    parts = ["# Diagnoses of concealed recordings\n", provenance(), INTRODUCTION]
    every: dict[str, list[Score]] = {}
    for one in chosen:
        found = list(_diagnosed(one, given.work, given.cases, given.workers))
        parts.append(_section(one, found))
        longest = sorted(found, key=lambda each: -each[1]["cpu"])[:LONGEST]
        parts.append(_alone(given.work / one.name, [score.case for score, _ in longest]))
        every[one.name] = [score for score, _ in found]
    if len(chosen) > 1:
        parts.append(_together(every, given.rounds, given.folder))
    if any(s.name == "outside" for s in chosen):
        parts.append(diagnosis_decoys.section(given.work, given.workers, ["outside"]))
    if given.alarms:
        parts.append(diagnosis_alarms.section(given.alarms, given.work, given.workers))
    if given.thresholds:
        parts.append(diagnosis_thresholds.section(
            given.thresholds, given.work, given.workers,
            [s.name for s in chosen if s.name in given.thresholds_of]))
    if not given.only:
        parts.append(_real(given.work, given.recordings))
    atomically(given.folder / "diagnosis.md", "\n".join(parts).encode())


def _together(every: Mapping[str, list[Score]], count: int, folder: Path) -> str:
    """The sets taken together, round by round, and how true the stated probabilities are."""
    scores = list(itertools.chain(*every.values()))
    whole = [s.name for s in SETS if s.mix is None]
    lines = [f"\n## All {len(scores)} cases together\n", "| sets | right | wrong | missed |",
             "| --- | --- | --- | --- |"]
    for k in range(count):
        own = [f"{name}_{k + 1}" if k else name for name in whole]
        lines.append(_row(f"round {k + 1}: {', '.join(whole)}",
                          [s for name in own for s in every.get(name, ())]))
    lines += [_row(name, found) for name, found in every.items()
              if name.rstrip("_0123456789") not in whole]
    lines.append(_row("all", scores))
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    rows = reliability(scores)
    figure = new_figure(4.5, 4.0)
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], color="#9ca3af", lw=1, label="ideal")
    stated = [p for p, _ in rows]
    true = [share.count / share.n for _, share in rows]
    bars = np.array([share.interval for _, share in rows]).T
    reach = np.clip([np.array(true) - bars[0], bars[1] - np.array(true)], 0.0, None)
    axis.errorbar(stated, true, yerr=reach, fmt="o", color="#1d4ed8", capsize=3,
                  label="answers, 95 %")
    for k, (p, t, (_, share)) in enumerate(zip(stated, true, rows, strict=True)):
        # neighbours in turn above and below
        axis.annotate(f"{share.count}/{share.n}", (p, t), textcoords="offset points",
                      xytext=(5, 5 - 15 * (k % 2)), fontsize=8)
    axis.set(xlabel="probability stated of the first hypothesis", ylabel="share that was true",
             xlim=(0, 1.2), ylim=(-0.05, 1.12))
    axis.legend(loc="upper left", fontsize=8)
    save_figure(figure, folder / "figures" / "diagnosis_reliability.png")
    lines += ["", "| probability stated | true |", "| --- | --- |"]
    lines += [f"| {p:.2f} | {share} |" for p, share in rows]
    return "\n".join([*lines, "", "![stated probability against truth]"
                      "(figures/diagnosis_reliability.png)"]) + "\n"


def _row(name: str, scores: list[Score]) -> str:
    found = tally(scores)
    return f"| {name} | {found['right']} | {found['wrong']} | {found['missed']} |"


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
            rows += [diagnosis_real.Row(**row) for row in json.loads(kept.read_text())]
        except DatasetUnavailable as reason:
            missing.append(f"Left out: {reason}")
    return "\n".join(["\n## Real recordings, each with only its nominal model\n",
                      REAL, diagnosis_real.table(rows) if rows else "", *missing]) + "\n"


REAL = """Two drops of one ball repeat one experiment: what differs between them is noise, of any
colour, and what is missing has to repeat.  Silverbox: fitted to 24,000 samples; in the last column
both official tests.  Water carried by a robot: runs named by motion, time and turn; the delay of
the film comes from the energies of film and motion, before any model.
"""

INTRODUCTION = """
Each case is a pair of recordings of a rig that hides an effect, a pair of effects, or nothing; the
diagnosis gets the nominal model and the recordings. *Right*: the truth is among at most two
hypotheses, of the cases that the recordings could tell ("nameable": the nominal model is at least
5 sigma away, the best rival 4 sigma). *Wrong*: an answer without the truth, of all cases. Of two
hidden effects one may be too weak for anybody (the recording without it fits to less than 4 sigma);
to name the other one alone is neither right nor wrong, but *wrong strictly*. A *formula* is an
answer `symbolic:...` of the kind of law that is hidden, where that is in no catalogue; any other
formula is wrong. A *partial* answer gives names or families of effects that are surely there; it is
wrong if one of them does not hide. In the set "remainder" one or two effects hide beside laws of no
catalogue that leave 5 to 30 % of their misfit: *found* counts effects of at least 80 sigma, by name
or family. In the set "unforeseen" one law of no catalogue hides, of fifteen that the diagnosis was
not made for: any name but its own is wrong. Dry friction that rises at low speed (Stribeck) counts
as `coulomb_friction`, whose entry in the catalogue includes it. Noise of a case: white, coloured,
with outliers, dropouts or quantised. Held-out RMSEs are of plain predictions: they carry the
parameters' error. Intervals are Wilson's at 95 %.
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


def _section(one: Set, found: list[tuple[Score, Mapping[str, Any]]]) -> str:
    scores = [score for score, _ in found]
    seconds = np.array([answer["cpu"] for _, answer in found])
    lines = [f"\n## {one.name}: {one.excitation}, sigma = {one.sigma / DEGREE:g} deg, "
             f"seed {one.seed}, {len(scores)} cases\n", "| what | share |", "| --- | --- |"]
    lines += [f"| {name.replace('_', ' ')} | {share} |" for name, share in tally(scores).items()]
    lines += ["", "| class | right of nameable | wrong of all |", "| --- | --- | --- |"]
    for kind in dict.fromkeys(s.kind for s in scores):
        own = [s for s in scores if s.kind == kind]
        named = [s for s in own if s.nameable]
        lines.append(f"| {kind} | {Share(sum(s.outcome == 'right' for s in named), len(named))} | "
                     f"{Share(sum(s.outcome == 'wrong' for s in own), len(own))} |")
    rows = reliability(scores)
    if rows:
        lines += ["", "| probability stated | true |", "| --- | --- |"]
        lines += [f"| {stated:.2f} | {share} |" for stated, share in rows]
    wrong = [f"{s.case} ({s.reason}, nominal {s.nominal:.0f} sigma)" for s in scores
             if s.outcome == "wrong"]
    lines += ["", f"Wrong answers: {', '.join(wrong) or 'none'}.",
              f"Processor seconds a diagnosis: median {np.median(seconds):.1f}, "
              f"four of five below {np.quantile(seconds, 0.8):.1f}, largest {seconds.max():.1f}; "
              f"at most 10 s: {Share(int(np.sum(seconds <= 10)), len(seconds))}."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
