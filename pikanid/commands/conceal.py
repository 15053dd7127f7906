"""`pikanid conceal`: recordings whose hidden physics is known only to a sealed file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from pikanid import errors
from pikanid.commands.options import Catalogues, Quiet, Values, adjusted, quantity

if TYPE_CHECKING:
    from pikanid.validation.own_model.rig import Rig

EXCITATION, SIGMA, NOISE = "rich", "0.1deg", 0.005  # definition: unless it is said
EXAMPLES = """Examples:

  pikanid conceal --out recordings --truth truth.json

  pikanid conceal --out dev --truth dev.json --cases 40 --excitation two_pulse --seed 1

  pikanid conceal --out clean --truth clean.json --mix nothing=1 --sigma 1deg

  pikanid conceal --out rest --truth rest.json --mix remainder=1 --excitation mixed

  pikanid conceal --model tanks.toml --catalogue hydraulics --inputs a.csv --held-out-inputs b.csv
  --out mine --truth mine.json --cases 20 --seed 1

Without --seed nobody knows what is hidden: the seed comes from the operating system and lies in
the truth file only; the folder holds the truth's SHA-256. An interrupted run goes on where it
stopped when it is repeated.

With --model the recordings are of your own rig: parameters near the model's, driven by the inputs
in two files, simulated by SciPy. It hides what your catalogue and the kit's know, and laws of
neither; `pikanid score` then tells how far a diagnosis can be trusted there."""


def conceal(
    out: Annotated[str, typer.Option(
        "--out", "-o", metavar="FOLDER", show_default=False,
        help="folder of the recordings: new, empty, or of an unfinished set")],
    truth: Annotated[str, typer.Option(
        metavar="FILE", show_default=False, help="file for the truth, outside that folder")],
    cases: Annotated[int, typer.Option(metavar="N", help="number of cases")] = 200,
    excitation: Annotated[str | None, typer.Option(
        "--excitation", "-e", metavar="NAME", show_default=EXCITATION,
        help="rich (20 s), two_pulse (the paper's 5 s), mixed, or one of moves, chirp, multisine, "
             "free_decay")] = None,
    sigma: Annotated[str | None, typer.Option(
        metavar="ANGLE", show_default=SIGMA,
        help="standard deviation of the noise, as 0.1deg or 0.002")] = None,
    mix: Annotated[str | None, typer.Option(
        metavar="CLASS=SHARE,...", show_default=False,
        help="shares of nothing, single, pair, near, outside, unforeseen (more laws of no "
             "catalogue) and remainder (strong effects, with such laws beside them)")] = None,
    model: Annotated[str | None, typer.Option(
        "--model", "-m", metavar="NAME|FILE.toml", show_default=False,
        help="conceal in this model instead of the sloshing rig")] = None,
    inputs: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False,
        help="of the model, for the recording to explain")] = None,
    held_out_inputs: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False, help="the same for the one to prove it on")] = None,
    noise: Annotated[float | None, typer.Option(
        metavar="SHARE", show_default=str(NOISE),
        help="of an output's range, with --model")] = None,
    set_: Values = [],  # noqa: B006
    catalogue: Catalogues = [],  # noqa: B006
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

    _check_rig(model is not None, {"--excitation": excitation, "--sigma": sigma}, {
        "--inputs": inputs, "--held-out-inputs": held_out_inputs, "--noise": noise,
        "--set": set_ or None, "--catalogue": catalogue or None})
    if model is not None:
        from pikanid.validation.own_model import generate as own
        from pikanid.validation.own_model.case import CLASSES

        rig = _rig(model, inputs, held_out_inputs, NOISE if noise is None else noise, set_,
                   catalogue)
        shares = None if mix is None else parse_mix(mix, CLASSES)
        make = partial(own.generate, out, truth, own.OwnSet(rig, cases, shares))
    else:
        settings = Settings(cases, excitation or EXCITATION,
                            quantity(SIGMA if sigma is None else sigma, "rad", "--sigma"),
                            dict(DEFAULT_MIX) if mix is None else parse_mix(mix))
        check(settings)
        make = partial(generate, out, truth, settings)
    with working("concealing", cases, quiet) as step:
        made = make(seed, workers, step)
    if not quiet:
        kept = f" ({made.kept} were there already)" if made.kept else ""
        kind = "sealed" if seed is None else "open"
        console().print(
            f"{made.folder}: {made.made + made.kept} cases{kept}; {kind} truth: {made.truth}",
            markup=False, soft_wrap=True)
    return 0


def _check_rig(own: bool, sloshing: Mapping[str, object], rig: Mapping[str, object]) -> None:
    """Refuse what the other kind of set is made of: it would be passed over in silence."""
    for option, value in (sloshing if own else rig).items():
        if value is not None:
            raise errors.BadSetting(errors.conceal_other_rig(option, own))


def _rig(model: str, inputs: str | None, held_out: str | None, noise: float,
         set_: list[str], catalogue: list[str]) -> Rig:
    from pikanid.model import systems
    from pikanid.model.effects_file import read_effects
    from pikanid.recording import Recording
    from pikanid.validation.own_model.rig import Rig

    if inputs is None or held_out is None:
        raise errors.BadSetting(errors.conceal_two_inputs())
    chosen = adjusted(systems.find(model), set_)
    drives = [Recording.read(path) for path in (inputs, held_out)]
    kept = [d.without(*(n for n in chosen.output_names if n in d)) for d in drives]
    own = [effect for name in catalogue for effect in read_effects(name)]
    return Rig(chosen, kept[0], kept[1], noise, tuple(own))
