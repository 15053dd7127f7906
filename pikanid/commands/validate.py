"""`pikanid validate`: how well do models predict recordings, and which is best?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pikanid.commands.grouped import grouped
from pikanid.commands.options import Json, Quiet, Sigma
from pikanid.commands.outputs import STDOUT, check_outputs, written
from pikanid.commands.reading import Reading, every_source, files_read
from pikanid.figures import ENDINGS, image_for
from pikanid.recording.formats import readable

if TYPE_CHECKING:
    from pikanid.recording import Recording

SAVED = (".json", ".json.gz")
EXAMPLES = """Examples:

  pikanid identify run1.csv --model sloshing --save fit.json

  pikanid validate fit.json --data run2.csv --train run1.csv

  pikanid validate nominal.toml extended.toml --train run1.csv --data run2.csv --first 50

  pikanid validate fit.json --data run2.csv --horizon 10 --json - --quiet

Models and saved estimates are compared as they are; with --train, models are fitted first.
Exit codes: 0 compared, whatever was found; 2 bad input."""


@grouped
def validate(
    model: Annotated[list[str], typer.Argument(
        metavar="MODEL...", show_default=False,
        help="ready-made models, model files, or estimates that 'identify --save' kept")],
    data: Annotated[list[str], typer.Option(
        "--data", "-d", metavar="RUN", show_default=False,
        help=f"recording to predict: {readable()}; files joined by + are one; may be repeated")],
    train: Annotated[list[str], typer.Option(
        metavar="RUN", show_default=False, help="recording that models and the linear baseline "
        "are fitted to; may be repeated")] = [],  # noqa: B006
    first: Annotated[int, typer.Option(
        metavar="N", min=0, help="estimate the initial state from the first N samples, which are "
        "not scored")] = 0,
    free_start: Annotated[bool, typer.Option(
        "--free-start", help="fit the initial state to each recording")] = False,
    horizon: Annotated[int | None, typer.Option(
        metavar="K", min=1, show_default=False,
        help="predict K samples ahead instead of simulating freely")] = None,
    window: Annotated[int | None, typer.Option(
        metavar="W", min=1, show_default=False,
        help="samples up to each origin that its state is estimated of")] = None,
    lags: Annotated[int, typer.Option(
        metavar="L", min=1, help="of the residual analysis, in samples")] = 25,
    sigma: Sigma = [],  # noqa: B006
    *,
    files: Reading,
    seed: Annotated[int, typer.Option(
        metavar="N", min=0, help="of the bootstrap that compares models")] = 0,
    json_: Json = None,
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", help="draw measured, predicted and errors (.png, .svg, .pdf)")] = None,
    report: Annotated[str | None, typer.Option(
        metavar="FILE.html", help="write a page for people")] = None,
    quiet: Quiet = False,
) -> int:
    """Compare models on recordings: fit per cent, RMSE, AIC, a linear baseline, the noise."""
    check_outputs({"--json": (json_, [".json"]), "--plot": (plot, ENDINGS),
                   "--report": (report, [".html"])}, every_source(*model, *data, *train))
    from pikanid.comparison import validate as run
    from pikanid.comparison.contender import told_apart
    from pikanid.model import Model
    from pikanid.reporting.console import console, working

    given = [_model(name) for name in model]
    bare = [g if isinstance(g, Model) else g.model for g in given]
    records, training = ([files.recording(text, *bare, sigma=sigma) for text in texts]
                         for texts in (data, train))
    with working("validating", len(given) + 1, quiet) as step:
        compared: dict[str, Any] = {}
        for name, label, one in zip(model, told_apart([_label(n) for n in model]), given,
                                    strict=True):
            step(name)
            compared[label] = _fitted(one, training)
        step("comparing")
        found = run(compared, records, training=training, first=first,
                    initial="free" if free_start else "model", horizon=horizon, window=window,
                    lags=lags, seed=seed)
    made: dict[str, bytes] = {}
    if plot is not None:
        made[plot] = image_for(found.plot(), plot)
    if report is not None:
        from pikanid.reporting.validation_page import page

        made[report] = page(found, ", ".join(r.name for r in records),
                            compared, files_read(*model, *data, *train)).encode()
    written(made, json_, found.to_dict())
    if not quiet and json_ != STDOUT:
        from pikanid.reporting.validation_tables import show_validation

        show_validation(console(), found)
    return 0


def _model(name: str) -> Any:
    """The model, or the estimate, that an argument names."""
    from pikanid.estimate import Estimate
    from pikanid.model import systems

    return Estimate.load(name) if name.lower().endswith(SAVED) else systems.find(name)


def _label(name: str) -> str:
    return Path(name).name.split(".")[0] or name


def _fitted(given: Any, training: Sequence[Recording]) -> Any:
    """A model fitted to the training recordings, if there are any; an estimate as it is."""
    from pikanid.model import Model
    from pikanid.strategies import NLS

    is_to_fit = isinstance(given, Model) and training and given.free_names
    return NLS().fit(given, training) if is_to_fit else given
