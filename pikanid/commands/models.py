"""`pikanid models`: the ready-made models, and what one of them says."""

from __future__ import annotations

import inspect
from typing import Annotated

import typer

EXAMPLES = """Examples:

  pikanid models

  pikanid models sloshing

  pikanid models pendulum --toml > my.toml

  pikanid models my.toml"""


def models(
    name: Annotated[str | None, typer.Argument(
        metavar="[NAME|FILE.toml]", help="print this model in full", show_default=False)] = None,
    toml: Annotated[bool, typer.Option(
        "--toml", help="print nothing but the model file, to start your own from")] = False,
) -> int:
    """List the ready-made models, or print one: equations, parameters, model file."""
    from pikanid.model import systems
    from pikanid.reporting.console import console
    from pikanid.reporting.model_text import toml as as_toml
    from pikanid.reporting.tables import row, show_model, table

    screen = console()
    if name is not None:
        model = systems.find(name)
        if toml:
            print(as_toml(model), end="")
        else:
            show_model(screen, model, as_toml(model))
        return 0
    made = table("model", "inputs", "measured", "estimated", "what it is")
    for key, build in systems.SYSTEMS.items():
        model = build()
        summary = (inspect.getdoc(build) or "").split("\n")[0]
        row(made, key, ", ".join(model.input_names) or "none", ", ".join(model.output_names),
            ", ".join(model.free_names), summary)
    screen.print(made)
    return 0
