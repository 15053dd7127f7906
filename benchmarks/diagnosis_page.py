"""The page of the open sets, from what was kept of them: `reports/diagnosis.md`."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pikanid.figures import new_figure, save_figure
from pikanid.validation.concealed.score import Score, Share, reliability, tally

CLOSE = 0.15  # of stated probabilities, whose labels would lie on each other

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
or family, or as one of two families (*found of two*). In the set "unforeseen" one law of no
catalogue hides, of fifteen that the diagnosis was not made for: any name but its own is wrong. A
number behind a set is its round, with a seed of its own: the rules of partial answers were found on
the rounds 1 and 3 to 7 of "remainder" and 1 and 3 of "outside"; others had not been looked at.
Beside such laws a stated probability is true if all of the first hypothesis is there, and every
hidden effect in it.
Dry friction that rises at low speed (Stribeck) counts as `coulomb_friction`, whose entry in the
catalogue includes it. Noise of a case: white, coloured, with outliers, dropouts or quantised.
Held-out RMSEs are of plain predictions: they carry the parameters' error. Intervals are Wilson's at
95 %.
"""


def page(kept: Mapping[str, Any], whole: Sequence[str], others: Sequence[str],
         sections: Sequence[str]) -> str:
    """In Markdown.

    Args:
        kept: What was run: "sets" by name, each with when it was "made", its "title", "scores",
            "cpu" and the "alone" text, and "sections" by name, each "made" and a "text".
        whole: Names of the sets of all kinds of cases; later rounds have a number behind.
        others: Names of the other sets.
        sections: Of the page, behind the sets.
    """
    sets = {name: kept["sets"][name] for name in (*whole, *others) if name in kept["sets"]}
    missing = [n for n in (*whole, *others) if n not in sets] + [
        n for n in sections if n not in kept["sections"]]
    parts = ["# Diagnoses of concealed recordings\n", INTRODUCTION]
    if missing:
        parts.append(f"Not run so far: {', '.join(missing)}.\n")
    parts += [_section(one) for one in sets.values()]
    if len(sets) > 1:
        parts.append(_together({n: scores(one) for n, one in sets.items()}, whole))
    for name in sections:
        if name in kept["sections"]:
            one = kept["sections"][name]
            parts.append(f"{one['text'].rstrip()}\n\n{one['made']}.\n")
    return "\n".join(parts)


def scores(one: Mapping[str, Any]) -> list[Score]:
    """Of a set that was kept."""
    return [Score(**row) for row in one["scores"]]


def _section(one: Mapping[str, Any]) -> str:
    found, seconds = scores(one), np.array(one["cpu"])
    lines = [f"\n## {one['title']}, {len(found)} cases\n", f"{one['made']}.\n",
             "| what | share |", "| --- | --- |"]
    lines += [f"| {name.replace('_', ' ')} | {share} |" for name, share in tally(found).items()]
    lines += ["", "| class | right of nameable | wrong of all |", "| --- | --- | --- |"]
    for kind in dict.fromkeys(s.kind for s in found):
        own = [s for s in found if s.kind == kind]
        named = [s for s in own if s.nameable]
        lines.append(f"| {kind} | {Share(sum(s.outcome == 'right' for s in named), len(named))} | "
                     f"{Share(sum(s.outcome == 'wrong' for s in own), len(own))} |")
    rows = reliability(found)
    if rows:
        lines += ["", "| probability stated | true |", "| --- | --- |"]
        lines += [f"| {stated:.2f} | {share} |" for stated, share in rows]
    wrong = [f"{s.case} ({s.reason}, nominal {s.nominal:.0f} sigma)" for s in found
             if s.outcome == "wrong"]
    lines += ["", f"Wrong answers: {', '.join(wrong) or 'none'}.",
              f"Processor seconds a diagnosis: median {np.median(seconds):.1f}, "
              f"four of five below {np.quantile(seconds, 0.8):.1f}, largest {seconds.max():.1f}; "
              f"at most 10 s: {Share(int(np.sum(seconds <= 10)), len(seconds))}.", one["alone"]]
    return "\n".join(lines) + "\n"


def _together(every: Mapping[str, list[Score]], whole: Sequence[str]) -> str:
    """The sets taken together, and how true the stated probabilities are."""
    all_scores = list(itertools.chain(*every.values()))
    rounds: dict[str, list[Score]] = {}
    for name in whole:
        kind, _, number = name.rpartition("_")
        number = number if number.isdecimal() and kind in whole else "1"
        rounds.setdefault(number, []).extend(every.get(name, ()))
    lines = [f"\n## All {len(all_scores)} cases together\n", "| sets | right | wrong | missed |",
             "| --- | --- | --- | --- |"]
    lines += [_row(f"round {number} of those of all kinds", found)
              for number, found in rounds.items() if found]
    lines += [_row(name, found) for name, found in every.items()]
    lines += [_row("all", all_scores), "", "| probability stated | true |", "| --- | --- |"]
    lines += [f"| {p:.2f} | {share} |" for p, share in reliability(all_scores)]
    return "\n".join([*lines, "", "![stated probability against truth]"
                      "(figures/diagnosis_reliability.png)"]) + "\n"


def _row(name: str, found: list[Score]) -> str:
    shares = tally(found)
    return f"| {name} | {shares['right']} | {shares['wrong']} | {shares['missed']} |"


def draw_reliability(found: Sequence[Score], folder: Path) -> None:
    """figures/diagnosis_reliability.png: stated probabilities against the shares that were true."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    rows = reliability(found)
    figure = new_figure(4.5, 4.0)
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], color="#9ca3af", lw=1, label="ideal")
    stated = [p for p, _ in rows]
    true = [share.count / share.n for _, share in rows]
    if rows:
        bars = np.array([share.interval for _, share in rows]).T
        reach = np.clip([np.array(true) - bars[0], bars[1] - np.array(true)], 0.0, None)
        axis.errorbar(stated, true, yerr=reach, fmt="o", color="#1d4ed8", capsize=3,
                      label="answers, 95 %")
    for p, after, t, (_, share) in zip(stated, [*stated[1:], 2.0], true, rows, strict=True):
        # to the side where no neighbour's interval is
        left = after - p < CLOSE
        axis.annotate(f"{share.count}/{share.n}", (p, t), textcoords="offset points",
                      xytext=(-5 if left else 5, 4), ha="right" if left else "left", fontsize=8)
    axis.set(xlabel="probability stated of the first hypothesis", ylabel="share that was true",
             xlim=(0, 1.2), ylim=(-0.05, 1.12))
    axis.legend(loc="upper left", fontsize=8)
    save_figure(figure, folder / "figures" / "diagnosis_reliability.png")
