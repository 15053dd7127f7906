"""The report of the study: `study.md`, the same as a page, and its figures."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pikanid.figures import image
from pikanid.pieces.sheet import Sheet
from pikanid.reporting import study_sheets as sheets
from pikanid.reporting.study_figures import figures
from pikanid.reporting.study_page import Heading, Part, Picture, Printed, page
from pikanid.reporting.tables import shown
from pikanid.storage.outputs import together
from pikanid.validation.study import clip, pendulum, slosh
from pikanid.validation.study.run import SEED, Study

if TYPE_CHECKING:
    from rich.console import Console

CAPTIONS = {
    "slosh-trajectories": "As Fig. 5 of the paper: the truth, one noisy recording, and the model "
                          "simulated at every estimate.",
    "slosh-errors": "1 is the Cramér-Rao bound, below which no unbiased estimator can stay.",
    "pendulum": "The residual swings with the pendulum and grows where the model runs on without "
                "data: physics is missing.",
    "video": "As Fig. 2 of the paper: a frame with the region, the angle over time, and two frames "
             "with points of the surface (yellow) and the line (magenta).",
    "pendulum-diagnosis": "The diagnosis: when the mismatch acts, and the held-out recording "
                          "before and after.",
}
DIAGNOSIS_TEXT = (
    "`pikanid diagnose` on the same two parts, given the viscous pendulum and nothing else: what "
    "was found, how it is modelled, and the RMSE on the held-out part before and after, where each "
    "model's initial state is estimated from that part.")
VERSIONS = ("pikanid", "numpy", "scipy", "sympy", "numba", "torch", "pykan")


def show(out: Console, study: Study) -> None:
    """All tables on a screen."""
    _head(out, "Slosh pendulum, two pulses, N = 501, seed 0 (as Table III)")
    out.print(shown(sheets.slosh(study, "dense")))
    _head(out, "The same with every tenth sample, N = 51 (as Table IV)")
    out.print(shown(sheets.slosh(study, "sparse")))
    if study.spreads:
        _head(out, f"Errors over {study.seeds} seeds, in units of the Cramér-Rao bound")
        out.print(shown(sheets.spread(study)))
    _head(out, "Real recording: free swing of a pendulum arm, viscous pendulum; RMSE [rad]")
    out.print(shown(sheets.pendulum(study)))
    if study.filmed is not None:
        _head(out, "From a rendered video")
        out.print(_video_text(study.filmed), markup=False, highlight=False, soft_wrap=True)
    reasons = sheets.reasons(study)
    if reasons:
        out.print()
    for text in reasons:
        out.print(f"Not usable: {text}", markup=False, soft_wrap=True)
    _head(out, "What does the viscous pendulum leave out? A diagnosis of the real recording")
    out.print(str(study.diagnosis), markup=False, highlight=False, soft_wrap=True)


def _head(out: Console, text: str) -> None:
    out.print()
    out.print(text, style="bold", markup=False)
    out.print()


def write(study: Study, folder: Path) -> list[Path]:
    """Write `study.md`, `study.html` and `figures/study-*.png`; returns what was written.

    Raises:
        BadRecording: If the folder cannot be written to.
    """
    drawn = figures(study)
    pictures = {name: f"figures/study-{name}.png" for name in drawn}
    files = {folder / "study.md": text(study, pictures).encode(),
             folder / "study.html": page(parts(study), drawn, figures(study, narrow=True)).encode(),
             **{folder / pictures[name]: image(figure) for name, figure in drawn.items()}}
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    together(files)
    return list(files)


def text(study: Study, pictures: Mapping[str, str]) -> str:
    """The report in Markdown; `pictures` maps the names of the figures to their files."""
    written = []
    for part in parts(study):
        if isinstance(part, Sheet):
            written.append(part.to_markdown())
        elif isinstance(part, Picture):
            if part.name in pictures:
                written.append(f"![{part.caption}]({pictures[part.name]})\n\n{part.caption}")
        elif isinstance(part, Printed):
            written.append(f"```text\n{part.text}\n```")
        elif isinstance(part, Heading):
            written.append(f"{'#' * part.level} {part.text}")
        else:
            written.append(part)
    return "\n\n".join(written) + "\n"


def parts(study: Study) -> list[Part]:
    """All that the report says, in its order."""
    found: list[Part] = [
        Heading(1, "Study of the strategies"), _introduction(), Heading(2, "Slosh pendulum"),
        _slosh_text(), Heading(3, "Dense: N = 501"), sheets.slosh(study, "dense", paper=True),
        Heading(3, "Sparse: N = 51"), sheets.slosh(study, "sparse", paper=True),
        _picture("slosh-trajectories")]
    if study.spreads:
        found += [Heading(3, "Repeated seeds"), _spread_text(study), sheets.spread(study),
                  _picture("slosh-errors")]
    found += [Heading(2, "Real recording: free swing of a pendulum arm"), _pendulum_text(study),
              sheets.pendulum(study), _picture("pendulum"),
              Heading(3, "What the viscous pendulum leaves out"), DIAGNOSIS_TEXT,
              Printed(str(study.diagnosis)), _picture("pendulum-diagnosis")]
    if study.filmed is not None:
        found += [Heading(2, "From a video"), _video_text(study.filmed), _picture("video")]
    unusable = [f"- {reason}" for reason in sheets.reasons(study)]
    if unusable:
        found += [Heading(2, "Not usable"), "\n".join(unusable)]
    return [*found, Heading(2, "Settings"), _settings(study)]


def _picture(name: str) -> Picture:
    return Picture(name, CAPTIONS[name])


def _introduction() -> str:
    return ("Written by `pikanid study`. Every strategy with its default settings, on the "
            "simulated slosh profile of Table II and on a real recording. \"Verdict\" is the χ² "
            "test of the model simulated at the estimate: a strategy whose parameters do not "
            "reproduce the recording is a misfit, whatever its own curve looks like.")


def _slosh_text() -> str:
    true = ", ".join(f"{name} = {value:g}" for name, value in slosh.TRUE.items())
    start = ", ".join(f"{name} = {value:g}" for name, value in slosh.START.items())
    return (f"Eq. (6) under two pulses of ±1 m/s² ([0.2, 0.6) s and [1.2, 1.6) s), 5 s at 100 Hz. "
            f"True values: {true}; every fit starts at {start}. Noise is white and Gaussian from "
            f"`numpy.random.default_rng({SEED})`. s.e. is the standard error that the strategy "
            "itself states. Times are those of one fit with the model already compiled.")


def _spread_text(study: Study) -> str:
    return (f"Seeds 0 to {study.seeds - 1}. With {study.seeds} seeds an efficient estimator's "
            "RMSE/CRB scatters about 1 by "
            f"±{100 / (2 * study.seeds) ** 0.5:.0f} % (one standard deviation).")


def _pendulum_text(study: Study) -> str:
    train, held = study.swing.train, study.swing.held_out
    return (f"K. Kaheman et al., arXiv 2205.06231; the excerpt at 100 Hz that the package ships. "
            f"Length, damping and the state at t = 0 are estimated on {train.start:.1f} s to "
            f"{train.stop:.1f} s. RMSE [rad], held-out: the fitted model runs on from t = 0 "
            f"through {held.start:.1f} s to {held.stop:.1f} s, data that it has not seen and "
            f"whose start it is not told. Restarted: the state at {held.start:.1f} s is estimated "
            f"from the {pendulum.FIRST:g} s that follow, with the parameters held, and the model "
            "runs from there. That both are far above the encoder's step of 0.00016 rad is the "
            "point: a viscous pendulum does not explain this arm.")


def _video_text(filmed: clip.Filmed) -> str:
    said = (f"Eq. (6) under the two pulses, simulated for {clip.SECONDS:g} s, rendered as a video "
            f"of {len(filmed.track.seen)} frames, and tracked: the angle's RMSE is "
            f"{np.degrees(filmed.rmse):.4f}°, its median standard error "
            f"{np.degrees(np.nanmedian(filmed.track.sigma[:, 0])):.4f}°, and "
            f"{100 * filmed.inside:.0f} % of the frames lie within their own 95 % band. ")
    if filmed.estimate is None:
        return f"{said}NLS failed: {filmed.reason}"
    found = ", ".join(
        f"{name} = {filmed.estimate.value(name):.5g} ± {filmed.estimate.std(name):.1g} "
        f"({(filmed.estimate.value(name) - value) / filmed.estimate.std(name):+.1f} standard "
        "errors from the truth)" for name, value in slosh.TRUE.items())
    return f"{said}NLS on that recording: {found}."


def _settings(study: Study) -> str:
    found = []
    for name in VERSIONS:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    lines = [f"- Python {platform.python_version()}, {', '.join(found)}",
             f"- seed of the single fits: {SEED}; repeated seeds: {study.seeds}",
             f"- the whole study took {study.seconds:.0f} s"]
    settings = {r.strategy: r.estimate.settings for r in study.slosh_fits
                if r.estimate is not None and r.scenario.label == "dense, 0.1°"}
    for name, options in settings.items():
        kept = {k: v for k, v in options.items() if isinstance(v, str | int | float | bool)}
        shown = ", ".join(f"{k} = {v:.6g}" if isinstance(v, float) else f"{k} = {v}"
                          for k, v in kept.items())
        lines.append(f"- {name} (dense, 0.1°): {shown}")
    return "\n".join(lines)
