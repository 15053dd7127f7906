"""The page that every report is: one template, self-contained, for phone, desktop and print."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from types import MappingProxyType
from typing import TYPE_CHECKING

from pikanid.figures import image
from pikanid.storage.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pikanid.model import Model
    from pikanid.reporting.sheet import Sheet


def document(title: str, parts: Sequence[str], models: Mapping[str, Model] = MappingProxyType({}),
             files: Sequence[str] = ()) -> str:
    """A page of HTML of its parts, which are HTML already, with version and date.

    Args:
        title: Plain text.
        parts: In their order.
        models: By what they are called on the page, whose equations are listed.
        files: Names of the recordings, listed below them.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    room = Environment(loader=PackageLoader("pikanid.reporting"), autoescape=True,
                       undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    return room.get_template("page.html").render(
        title=title, parts=[Markup(part) for part in parts if part],
        models={name: equations(model) for name, model in models.items()},
        files=list(dict.fromkeys(files)), version=__version__,
        date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"))


def equations(model: Model) -> list[str]:
    """The model's equations and outputs as lines of text.

    >>> from pikanid.model.systems import pendulum
    >>> equations(pendulum())[0]
    'd(theta)/dt = theta_dot'
    """
    from pikanid.formula.expressions import to_text

    return [*(f"d({name})/dt = {to_text(e)}" for name, e in model.equations.items()),
            *(f"measured {o.name} = {to_text(o.expression)}" for o in model.outputs)]


def drawn(figure: Figure, shows: str) -> str:
    """A figure as a piece of the page, in vectors; a phone scrolls it sideways."""
    data = base64.b64encode(image(figure, ".svg")).decode()
    return (f'<div class="figure"><img alt="{escape(shows)}" '
            f'src="data:image/svg+xml;base64,{data}"></div>')


def tabled(sheet: Sheet) -> str:
    """A table as a piece of the page; wider than the page, it is scrolled alone."""
    head = "".join(f"<th>{escape(h)}</th>" for h in sheet.headers)
    body = "".join("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>"
                   for row in sheet.rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'
