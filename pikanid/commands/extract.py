"""`pikanid extract`: what a KAN has learned, as a formula."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from pikanid import errors
from pikanid.commands.options import Json
from pikanid.commands.outputs import STDOUT, check_outputs, written
from pikanid.figures import ENDINGS, image_for
from pikanid.recording.formats import readable

if TYPE_CHECKING:
    import numpy as np

    from pikanid.symbolic import Reading

EXAMPLES = """Examples:

  pikanid extract network.npz --data points.csv --input theta --input omega --output y

  pikanid extract network.npz --plot network.svg

  pikanid extract discrepancy.json --json formula.json

MODEL is a KAN saved by pikanid (.npz, .json), ESTIMATE an estimate with KAN edges (.json,
.json.gz). Without --data a KAN's own values are read and nothing can be tested. Exit code 3: no
simple form says what the network says."""


def extract(
    source: Annotated[str, typer.Argument(
        metavar="MODEL_OR_ESTIMATE", show_default=False, help="a saved KAN, or a saved estimate")],
    data: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False,
        help=f"the points that the KAN was trained on: {readable()}")] = None,
    input_: Annotated[list[str] | None, typer.Option(
        "--input", "-i", metavar="NAME", show_default=False,
        help="a column of the data that enters the KAN, in the KAN's order")] = None,
    output: Annotated[str | None, typer.Option(
        metavar="NAME", show_default=False, help="the column that the KAN learned")] = None,
    alpha: Annotated[float, typer.Option(
        metavar="P", help="level at which an edge counts as significant")] = 0.01,
    json_: Json = None,
    plot: Annotated[str | None, typer.Option(
        metavar="FILE", show_default=False, help="the network drawn: .png, .svg, .pdf")] = None,
) -> int:
    """Read a KAN: a formula with standard errors, and how far to trust it."""
    from pikanid.reporting.console import console
    from pikanid.symbolic import extract as read

    check_outputs({"--plot": (plot, ENDINGS),
                   "--json": (json_, (".json",))},
                  [p for p in (source, data) if p])
    network = _load(source)
    names = list(input_ or [])
    x, y = _points(data, names, output) if data else (None, None)
    reading = read(network, x, y, inputs=names or None, alpha=alpha)
    files = {}
    if plot is not None:
        files[plot] = image_for(reading.plot(), plot)
    written(files, json_, _content(reading))
    if json_ != STDOUT:
        console().print(str(reading), markup=False, soft_wrap=True)
    return 0 if reading.ok else errors.EXIT_MISFIT


def _load(path: str) -> Any:
    """A KAN or an estimate, by what the file holds."""
    from pikanid.estimate import Estimate
    from pikanid.storage.limits import file_bytes

    start = file_bytes(path, lambda why: errors.BadSetting(errors.cannot_open(path, why)),
                       first=4096)
    if path.endswith(".npz") or b"pikanid-kan" in start:
        from pikanid.approximators.kan import load

        return load(path)
    if not path.endswith((".json", ".json.gz")):
        raise errors.BadSetting(errors.not_a_network(path))
    return Estimate.load(path)


def _points(path: str, names: list[str], output: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Inputs (M, n) and output (M,) from the columns of a table."""
    import numpy as np

    from pikanid.recording import Recording

    wanted = [*names, output or ""]
    channels = Recording.read(path, also=filter(None, wanted)).channels
    missing = [n or "(no --output)" for n in wanted if n not in channels]
    if missing or not names:
        raise errors.BadSetting(errors.extract_columns(
            missing or ["(no --input)"], list(channels)))
    columns = [channels[n].values for n in wanted]
    return np.column_stack(columns[:-1]), np.asarray(columns[-1], float)


def _content(reading: Reading) -> dict[str, Any]:
    from pikanid.formula.expressions import to_text

    return {
        "schema_version": 1, "formula": to_text(reading.expression),
        "latex": reading.latex(), "ok": reading.ok, "probability": reading.probability,
        "constants": {n: {"value": float(v), "std": float(s)} for n, v, s in zip(
            reading.names, reading.values, reading.std, strict=True)},
        "inputs": {n: list(r) for n, r in zip(reading.inputs, reading.ranges, strict=True)},
        "forms": {"-".join(map(str, place)): name for place, name in reading.forms.items()},
        "error_network": reading.error_network, "error_data": reading.error_data,
        "spread": reading.spread, "p_value": reading.p_value}
