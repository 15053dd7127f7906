"""Effects in a file: the table ``[effects]`` of a model file, or of a TOML file of its own.

    [effects.overflow]
    name = "overflow of the first tank"
    parameters.k_o = { unit = "1/s", guess = 0.1, bounds = [0, 10] }
    parameters.h = { unit = "cm", guess = 9.0, bounds = [5, 15] }
    add = { x1 = "-k_o*max(x1 - h, 0)", x2 = "k_o*max(x1 - h, 0)" }
    null = { k_o = 0.0 }

With ``for = { x = "state" }`` it is a form for any model (`pikanid.model.effect_form`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pikanid import errors
from pikanid.errors.wording import listed
from pikanid.model.effect import Effect
from pikanid.model.effect_form import EffectForm, form_of
from pikanid.model.effect_table import content_of, effect_of
from pikanid.storage.entries import Entry
from pikanid.storage.limits import toml_content

FOLDER = Path(__file__).with_name("catalogues")
MOST = 200  # limit: effects in one file


def catalogues() -> tuple[str, ...]:
    """Names of the catalogues that come with the package.

    >>> catalogues()
    ('electrical', 'hydraulics', 'kinetics', 'mechanics', 'populations', 'thermal')
    """
    return tuple(sorted(p.stem for p in FOLDER.glob("*.toml")))


def domain_of(value: Any) -> tuple[str, ...] | None:
    """Names of catalogues, from one name or several; None is none given.

    Raises:
        BadModel: They are not.
    """
    names = [value] if isinstance(value, str) else value
    if names is None:
        return None
    if not isinstance(names, list | tuple) or not all(
            isinstance(n, str) and n in catalogues() for n in names[:MOST]) or len(names) > MOST:
        raise errors.BadModel(errors.bad_value("The model's domain", value, listed(catalogues())))
    return tuple(dict.fromkeys(names))


def read_effects(path: str | os.PathLike[str]) -> tuple[Effect | EffectForm, ...]:
    """The effects in a TOML file, or in the catalogue of that name (`catalogues`).

    Raises:
        BadModel: Not such a file; the sentence says what is wrong, and where.

    >>> read_effects("hydraulics")[0].key
    'overflow'
    """
    def wrong(detail: str) -> errors.BadModel:
        return errors.BadModel(errors.unreadable("file of effects", str(path), detail))

    if not isinstance(path, str | os.PathLike):
        raise errors.BadModel(errors.no_path(type(path).__name__))
    shipped = str(path) in catalogues()
    if not shipped and not Path(path).suffix:
        raise errors.BadModel(errors.unknown_catalogue(str(path), catalogues()))
    content = toml_content(FOLDER / f"{path}.toml" if shipped else path, wrong)
    top = Entry(content, f"The file '{path}'", errors.BadModel).table(["effects"])
    return from_table(top["effects"].value, str(path))


def from_table(content: Any, source: str) -> tuple[Effect | EffectForm, ...]:
    """Effects from the table under ``[effects]``; `source` is named in error messages.

    Raises:
        BadModel: Anything in it is of another type, unknown or missing.
    """
    top = Entry(content, f"'{source}': [effects]", errors.BadModel).table(optional=None, most=MOST)
    made = []
    for key, entry in top.items():
        entry = entry.called(f"'{source}': effect '{key}'")
        plain = isinstance(entry.value, Mapping) and "for" not in entry.value
        made.append(effect_of(key, entry) if plain else form_of(key, entry, source))
    return tuple(made)


def to_table(effects: Sequence[Effect | EffectForm]) -> dict[str, Any]:
    """What stands under ``[effects]`` in a file."""
    return {e.key: content_of(e) if isinstance(e, Effect) else
            {"for": dict(e.places), **e.content} for e in effects}
