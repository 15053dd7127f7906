"""The page that every report is: one template, self-contained, for phone, desktop and print."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from types import MappingProxyType
from typing import TYPE_CHECKING

from pikanid.storage.version import __version__

if TYPE_CHECKING:
    from pikanid.model import Model


def document(title: str, parts: Sequence[str], models: Mapping[str, Model] = MappingProxyType({}),
             recordings: Sequence[str] = (), files: Sequence[str] = ()) -> str:
    """A page of HTML of its parts, which are HTML already, with version and date.

    Args:
        title: Plain text.
        parts: In their order.
        models: By what they are called on the page, whose equations are listed.
        recordings: Their names, listed below them.
        files: What was read, as it was named.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    room = Environment(loader=PackageLoader("pikanid.reporting"), autoescape=True,
                       undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    return room.get_template("page.html").render(
        title=title, parts=[Markup(part) for part in parts if part],
        models={name: equations(model) for name, model in models.items()},
        recordings=list(dict.fromkeys(recordings)), files=list(dict.fromkeys(files)),
        version=__version__, beside=_beside(),
        date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"))


def _beside() -> str:
    """Versions of what computes."""
    from importlib.metadata import version
    from platform import python_version

    return ", ".join([f"Python {python_version()}", *(
        f"{label} {version(label.lower())}" for label in ("NumPy", "SciPy", "SymPy", "numba"))])


def equations(model: Model) -> list[str]:
    """The model's equations and outputs as lines of text.

    >>> from pikanid.model.systems import pendulum
    >>> equations(pendulum())[0]
    'd(theta)/dt = theta_dot'
    """
    from pikanid.formula.expressions import to_text

    return [*(f"d({name})/dt = {to_text(e)}" for name, e in model.equations.items()),
            *(f"measured {o.name} = {to_text(o.expression)}" for o in model.outputs)]
