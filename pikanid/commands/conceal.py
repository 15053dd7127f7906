"""`pikanid conceal`: recordings whose hidden physics is known only to a sealed file."""

from __future__ import annotations

from typing import Annotated

import typer

from pikanid.commands.options import Quiet, quantity

EXAMPLES = """Examples:

  pikanid conceal --out recordings --truth truth.json

  pikanid conceal --out dev --truth dev.json --cases 40 --excitation two_pulse --seed 1

  pikanid conceal --out clean --truth clean.json --mix nothing=1 --sigma 1deg

  pikanid conceal --out rest --truth rest.json --mix remainder=1 --excitation mixed

Without --seed nobody knows what is hidden: the seed comes from the operating system and lies in
the truth file only; the folder holds the truth's SHA-256. An interrupted run goes on where it
stopped when it is repeated."""


def conceal(
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FOLDER", show_default=False,
        help="folder of the recordings: new, empty, or of an unfinished set")],
    truth: Annotated[str, typer.Option(
        metavar="FILE", show_default=False, help="file for the truth, outside that folder")],
    cases: Annotated[int, typer.Option(metavar="N", help="number of cases")] = 200,
    excitation: Annotated[str, typer.Option(
        "--excitation", "-e", metavar="NAME",
        help="rich (20 s), two_pulse (the paper's 5 s), mixed, or one of moves, chirp, multisine, "
             "free_decay")] = "rich",
    sigma: Annotated[str, typer.Option(
        metavar="ANGLE", help="standard deviation of the noise, as 0.1deg or 0.002")] = "0.1deg",
    mix: Annotated[str | None, typer.Option(
        metavar="CLASS=SHARE,...", show_default=False,
        help="shares of nothing, single, pair, near, outside, unforeseen (more laws of no "
             "catalogue) and remainder (strong effects, with such laws beside them)")] = None,
    seed: Annotated[int | None, typer.Option(
        metavar="N", min=0, show_default=False,
        help="makes an open set, for development: anybody can make it again")] = None,
    workers: Annotated[int | None, typer.Option(
        metavar="N", min=1, show_default=False, help="processes; by default one a core")] = None,
    quiet: Quiet = False,
) -> int:
    """Write recordings that hide an effect each, and a sealed file that says which."""
    from pikanid.reporting.console import console, working
    from pikanid.validation.concealed.deck import DEFAULT_MIX, parse_mix
    from pikanid.validation.concealed.generate import check, generate
    from pikanid.validation.concealed.seal import Settings

    shares = parse_mix(mix) if mix is not None else dict(DEFAULT_MIX)
    settings = Settings(cases, excitation, quantity(sigma, "rad", "--sigma"), shares)
    check(settings)
    with working("concealing", cases, quiet) as step:
        made = generate(out, truth, settings, seed, workers, step=step)
    if not quiet:
        kept = f" ({made.kept} were there already)" if made.kept else ""
        kind = "sealed" if seed is None else "open"
        console().print(
            f"{made.folder}: {made.made + made.kept} cases{kept}; {kind} truth: {made.truth}",
            markup=False, soft_wrap=True)
    return 0
