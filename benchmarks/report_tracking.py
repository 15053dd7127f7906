"""How well surfaces are tracked in videos whose truth is known.

Usage: python benchmarks/report_tracking.py FOLDER [CLIPS] [WORKERS]

Writes FOLDER/tracking.md and FOLDER/figures/tracking-*.png: a grid of conditions, parameters
identified from CLIPS rendered videos (20 by default), the motion known or by a marker, and physics
that is named from a video alone.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from provenance import provenance
from tracking_chain import CLIPS, HIDDEN, RATE, SECONDS, Errors, chained_clip, diagnosed
from tracking_grid import BAD, CONDITIONS, FRAMES, NORMAL, Score, score
from tracking_marker import SIDES, Followed, followed

from pikanid.figures import save_figure
from pikanid.pieces.sheet import Sheet
from pikanid.storage.outputs import atomically
from pikanid.tracking.drawing import detection
from pikanid.validation.study import clip

MARKERS = 6  # clips of either kind


def main(folder: Path, count: int, workers: int) -> None:
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(workers) as pool:
        named = {effect: pool.submit(diagnosed, effect) for effect in HIDDEN}
        scored = [pool.submit(score, c, k) for k, c in enumerate(CONDITIONS)]
        markers = {side: [pool.submit(followed, seed, side) for seed in range(MARKERS)]
                   for side in SIDES}
        chained = [pool.submit(chained_clip, seed) for seed in range(count)]
        scores, chain = ([task.result() for task in tasks] for tasks in (scored, chained))
        found = {effect: task.result() for effect, task in named.items()}
        moved = {side: [task.result() for task in tasks] for side, tasks in markers.items()}
    shown = clip.film(0)
    save_figure(detection(shown.track, shown.stills), folder / "figures/tracking-detection.png")
    atomically(folder / "tracking.md", text(scores, chain, moved, found).encode())


def text(scores: Sequence[Score], chain: Sequence[Errors],
         moved: Mapping[str, Sequence[Followed]], found: Mapping[str, str]) -> str:
    """The report in Markdown."""
    return "\n\n".join([
        "# From video to angle", _introduction(),
        "![As Fig. 2 of the paper: frame and region, the angle, points and line in two frames]"
        "(figures/tracking-detection.png)",
        "As Fig. 2 of the paper: a frame with the region, the angle over time, and two frames with "
        "points of the surface (yellow) and the line (magenta).",
        "## Conditions", grid_sheet(scores).to_markdown(), _grid_text(scores),
        "## Parameters from videos", _chain_text(chain), chain_sheet(chain).to_markdown(),
        "## Parameters where the motion is filmed, too", marker_text(moved),
        marker_sheet(moved).to_markdown(),
        "## Hidden physics, from the video alone", _diagnosis_text(found)]) + "\n"


def _introduction() -> str:
    return (
        "Written by `benchmarks/report_tracking.py`: clips of a dyed liquid's surface are drawn "
        "by `pikanid.tracking.render`, which knows nothing of the tracker, written as video files, "
        "and tracked with default settings; the region and the liquid's colour are found by "
        f"themselves unless a row says otherwise. {provenance()}.")


def grid_sheet(scores: Sequence[Score]) -> Sheet:
    """One row a condition."""
    rows = [(s.condition.name, "bad" if s.condition.bad else "normal", f"{s.rmse:.4f}",
             f"{s.worst:.3f}", f"{100 * s.inside:.1f}", f"{s.half_width:.4f}",
             f"{100 * s.failed:.1f}", f"{s.alike:+.2f}", f"{s.speed:.0f}") for s in scores]
    head = ("condition", "kind", "RMSE [deg]", "worst [deg]", "in own 95 % band [%]",
            "half width [deg]", "no angle [%]", "neighbours' correlation", "frames/s")
    return Sheet(head, tuple(rows), numbers=head[2:])


def _grid_text(scores: Sequence[Score]) -> str:
    normal, bad = ([s for s in scores if s.condition.bad is k] for k in (False, True))
    wrong = float(np.mean([s.wrong for s in scores]))
    return (
        f"{FRAMES} frames of 640 x 480 pixels (the small one 320 x 240), 100 a second, angles "
        "from -25° to 25° and at last near rest; Motion JPEG of quality 95 unless said. "
        f"Largest RMSE in normal conditions {max(s.rmse for s in normal):.3f}° (allowed {NORMAL}°),"
        f" in bad ones {max(s.rmse for s in bad):.3f}° (allowed {BAD}°); "
        f"{100 * wrong:.2f} % of all frames, and {100 * max(s.wrong for s in scores):.2f} % of "
        "those of the worst row, are off by more than 1° without being flagged; of frames that "
        f"nothing covers {100 * max(s.blind for s in scores):.2f} % at most are flagged. "
        "Where something is in the way, a frame has an angle if enough of the surface is seen. "
        "Frames per second count the CPU time of the whole "
        "of tracking, decoding included, on a machine that did other work besides; decoding alone "
        "is the larger part of lossless video.\n\n" + _band_text(scores))


def _band_text(scores: Sequence[Score]) -> str:
    """For which conditions stated bands hold 95 % of the frames."""
    inside = float(np.average([s.inside for s in scores], weights=[1 - s.failed for s in scores]))
    wide, narrow = ([f"{s.condition.name} ({100 * s.inside:.1f} %)" for s in scores if outside(s)]
                    for outside in (lambda s: s.inside > 0.98, lambda s: s.inside < 0.92))
    half = max(s.half_width for s in scores)
    return (
        f"Of all frames with an angle {100 * inside:.1f} % lie within their own 95 % band. Between "
        f"92 and 98 % do so in {len(scores) - len(wide) - len(narrow)} of {len(scores)} "
        f"conditions. Bands are wider than they need be, a safe mistake, with "
        f"{', '.join(wide) or 'none'}: what varies across a picture and stays the same from one to "
        "the next counts as error; of so few frames a share is also uncertain by about 1 %. They "
        "are too narrow with "
        f"{', '.join(narrow) or 'none'}. The largest median half width is {half:.3f}° (allowed "
        "0.15°). Where neighbours in time err alike, which few bits bring "
        "about, a frame's band is right, but many frames together say less than as many "
        "independent ones would: parameters of such a video err by more than they state.")


def _chain_text(chain: Sequence[Errors]) -> str:
    z = np.array([e.z for e in chain])
    return (
        f"Eq. (6) under the two pulses, {clip.SECONDS:g} s at {RATE:g} frames a second of "
        f"{clip.SCENE.size[1]} x {clip.SCENE.size[0]} pixels, rendered {len(chain)} times with "
        "place, level, light, dye, focus and noise anew, tracked, and fitted by "
        "NLS with the sigma of every frame. "
        f"Within 1.96 standard errors: l {int(np.sum(np.abs(z[:, 0]) < 1.96))}, d "
        f"{int(np.sum(np.abs(z[:, 1]) < 1.96))} of {len(chain)}; within 3: "
        f"{int(np.sum(np.abs(z[:, 0]) < 3))} and {int(np.sum(np.abs(z[:, 1]) < 3))}. Errors in "
        f"standard errors, root mean square: {np.sqrt(np.mean(z[:, 0] ** 2)):.2f} and "
        f"{np.sqrt(np.mean(z[:, 1] ** 2)):.2f}. {sum(e.explained for e in chain)} of {len(chain)} "
        "fits explain their recording by the χ² test.")


def chain_sheet(chain: Sequence[Errors]) -> Sheet:
    """One row a clip."""
    head = ("clip", "l: error / s.e.", "d: error / s.e.", "RMSE of the angle [deg]",
            "in own band [%]")
    return Sheet(head, tuple(
        (str(e.seed), f"{e.z[0]:+.2f}", f"{e.z[1]:+.2f}", f"{np.degrees(e.rmse):.4f}",
         f"{100 * e.inside:.1f}") for e in chain), numbers=head)


def marker_text(moved: Mapping[str, Sequence[Followed]]) -> str:
    """What the motion by a marker is worth."""
    every = [f for found in moved.values() for f in found]
    z = np.abs(np.array([f.z for f in every]))
    plain = np.array([f.plain for f in every])
    return (
        "The tank moves smoothly at two frequencies, and only the video says how: a marker of 38 "
        "x 22 pixels on the tank before a standing camera, or of 38 x 38 pixels on the background "
        f"of a camera that moves with the tank; noise of 8 grey levels, {len(every)} clips. "
        f"Errors of a position are {np.median([f.rmse for f in every]):.3f} px (median; largest "
        f"{max(f.rmse for f in every):.3f} px), and "
        f"{100 * np.mean([f.inside for f in every]):.0f} % of the positions lie within 1.96 of "
        "their standard errors. NLS as it is leaves errors of the motion out: l and d err by "
        f"{np.sqrt(np.mean(plain**2)):.1f} of its standard errors (root mean square). With those "
        "of `pk.bootstrap(fit, run, positions={'u_x': 'x'})` "
        f"{int(np.sum(z < 1.96))} of {z.size} lie within 1.96 and {int(np.sum(z < 3))} within 3; "
        f"root mean square {np.sqrt(np.mean(z**2)):.2f}.")


def marker_sheet(moved: Mapping[str, Sequence[Followed]]) -> Sheet:
    """One row a clip."""
    head = ("marker on", "clip", "x: RMSE [px]", "in own band [%]", "u_x: RMSE [%]",
            "l: error / s.e.", "d: error / s.e.", "s.e. of l [%]", "s.e. of d [%]", "frames/s")
    rows = [(side, str(k), f"{f.rmse:.4f}", f"{100 * f.inside:.1f}", f"{100 * f.acceleration:.1f}",
             f"{f.z[0]:+.2f}", f"{f.z[1]:+.2f}", f"{100 * f.share[0]:.3f}",
             f"{100 * f.share[1]:.2f}", f"{f.speed:.0f}")
            for side, found in moved.items() for k, f in enumerate(found)]
    return Sheet(head, tuple(rows), numbers=head[1:])


def _diagnosis_text(found: Mapping[str, str]) -> str:
    said = [f"Two videos of {SECONDS:g} s each, one to explain and one to prove it on; Eq. (6) is "
            "given, an effect is hidden in what was filmed."]
    said += [f"Hidden: `{effect}`.\n\n```text\n{dx}\n```" for effect, dx in found.items()]
    return "\n\n".join(said)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[2:]]
    main(Path(sys.argv[1]), *(given + [CLIPS, 2][len(given):]))
