"""Settings of a reading decide where they act, are taken along, and are said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid import errors
from pikanid.approximators.kan import build_kan
from pikanid.symbolic.library import LIBRARY, NOTHING
from pikanid.symbolic.naming import name_curve, name_edge, priors
from pikanid.symbolic.search import shortlist
from pikanid.symbolic.settings import USUAL, SymbolicSettings

FEW = [f for f in LIBRARY
       if f.name in ("linear", "quadratic", "cubic", "sine", "tanh", "absolute value")]
X = np.linspace(-1.0, 1.0, 120)
NOISE = np.random.default_rng(0).normal(size=X.size)


def test_priors_weigh_forms() -> None:
    """A faint line: something for who expects something, nothing for who does not."""
    y = 0.25 * X + 0.5 * NOISE
    names = [name_edge(X, y, library=FEW, settings=SymbolicSettings(nothing=p)).name
             for p in (0.01, 0.999)]
    assert names[0] != NOTHING.name and names[1] == NOTHING.name
    strict = priors(FEW, SymbolicSettings(simpler=100.0))
    assert strict["linear"] / strict["sine"] > priors(FEW)["linear"] / priors(FEW)["sine"]


def test_a_rate_decides_which_trace_refuses_a_form() -> None:
    y = X + 0.12 * X**3 + 0.05 * NOISE
    line = [f for f in LIBRARY if f.name == "linear"]
    (fit,) = [c for c in name_edge(X, y, sigma=0.05, library=line).candidates
              if c.form.name == "linear"]
    p = fit.adequacy
    assert 1e-12 < p < 0.3
    for rate, kept in ((0.5 * p, True), (min(2 * p, 0.9), False)):
        edge = name_edge(X, y, sigma=0.05, library=line, settings=SymbolicSettings(trace=rate))
        (other,) = [c for c in edge.candidates if c.form.name == "linear"]
        assert (other.probability > 0) is kept


def test_an_edge_brings_as_many_forms_as_its_settings_say() -> None:
    edge = name_edge(X, np.sin(3 * X) + 0.05 * NOISE, library=FEW)
    assert edge.settings is USUAL
    narrow = name_curve(edge.curve, FEW, SymbolicSettings(forms=1))
    assert len(shortlist(narrow)) < len(shortlist(edge))


@pytest.mark.kan
def test_a_reading_says_by_which_settings_it_came() -> None:
    x = np.random.default_rng(0).uniform(-1, 1, (150, 1))
    y = 2 * x[:, 0] + np.random.default_rng(1).normal(0, 0.02, 150)
    own = SymbolicSettings(compete=1, adequate=0.9999)
    reading = pk.symbolic.extract(build_kan([1, 1], grid=4), x, y, library=FEW, settings=own)
    assert reading.settings is own and not reading.ok
    assert "Settings: adequate = 0.9999, compete = 1; all others defaults." in str(reading)
    assert all(edge.settings is own for edge in reading.edges.values())
    usual = replace(reading, settings=USUAL)
    assert usual.ok and "Settings" not in str(usual)


def test_what_is_no_setting_is_refused() -> None:
    with pytest.raises(errors.BadSetting, match="polished is 0; it must be a whole number"):
        SymbolicSettings(polished=0)
