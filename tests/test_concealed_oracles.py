"""Every effect is held against a closed solution, a limiting case or an identity somewhere."""

from __future__ import annotations

import test_concealed_channels  # noqa: F401  # each names the effects that it covers
import test_concealed_forces  # noqa: F401
import test_concealed_friction  # noqa: F401
from concealing import COVERED

from pikanid.validation.concealed.effects import CATALOGUE, NEAR, OUTSIDE


def test_every_effect_has_an_oracle() -> None:
    assert {effect.id for effect in (*CATALOGUE, *NEAR, *OUTSIDE)} == COVERED
