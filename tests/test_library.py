"""The table of named forms: families, searches that know no units, and where they begin."""

from __future__ import annotations

from collections import Counter
from math import comb
from typing import get_args

import numpy as np
import pytest

from pikanid.symbolic.library import LIBRARY, Kind, Knob, user_form
from pikanid.symbolic.naming import priors
from pikanid.symbolic.settings import USUAL

POWERS = {"rate": -1, "signed rate": -1, "frequency": -1, "exponent": 0}
RANGES = [(-1.0, 1.0), (0.5, 2.5), (-7.0, -1.0)]


@pytest.mark.parametrize("low, high", RANGES)
@pytest.mark.parametrize("kind", get_args(Kind))
def test_a_search_is_the_same_in_any_unit(kind: Kind, low: float, high: float) -> None:
    """x in another unit: lengths grow with it, rates fall, exponents stay."""
    knob, scale = Knob("p", kind), 40.0
    factor = scale ** POWERS.get(kind, 1)
    for there, here in ((knob.limits(scale * low, scale * high, 50), knob.limits(low, high, 50)),
                        (knob.grid(scale * low, scale * high, 50), knob.grid(low, high, 50))):
        np.testing.assert_allclose(there, factor * np.asarray(here), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("low, high", RANGES)
@pytest.mark.parametrize("kind", get_args(Kind))
def test_a_search_begins_within_its_limits(kind: Kind, low: float, high: float) -> None:
    knob, size = Knob("p", kind), high - low
    least, most = knob.limits(low, high, 200)
    grid = knob.grid(low, high, 200)
    assert np.all(grid > least - 1e-12 * size) and np.all(grid < most + 1e-12 * size)
    assert len(set(grid.tolist())) == len(grid) >= 16
    if kind == "location":  # what happens outside of the samples is not seen
        assert np.all((grid > low) & (grid < high))
    if kind == "below":
        assert np.all(grid < low)
    if kind == "above":
        assert np.all(grid > high)


def test_sums_of_powers_are_all_there() -> None:
    """Every choice of two or more powers up to the fifth, and the two single ones left."""
    sums = [f for f in LIBRARY if f.family == "polynomial"]
    sizes = Counter(len(f.columns) for f in sums)
    assert sizes == {1: 2, **{k: comb(5, k) for k in range(2, 6)}}
    x = np.linspace(0.5, 1.5, 7)
    for form in sums:
        for column, power in zip(form.values(x), form.powers, strict=True):
            np.testing.assert_allclose(column, x**power)


def test_a_form_moved_or_mirrored_is_of_its_family() -> None:
    forms = {f.name: f for f in LIBRARY}
    for name, form in forms.items():
        base = name.removeprefix("shifted ").removeprefix("mirrored ")
        assert form.family == forms[base].family, name
    share = priors(LIBRARY)
    # two forms of a family with as many constants share what one alone would have
    assert share["shifted reciprocal"] == share["mirrored reciprocal"]
    assert share["linear"] == pytest.approx(share["quadratic"])
    assert share["shifted cubic"] == pytest.approx(share["cubic"] / USUAL.simpler)
    assert sum(share.values()) == pytest.approx(1.0)


def test_constants_of_a_form_of_ones_own() -> None:
    form = user_form("A*exp(-(q - m)**2) + B", argument="q", name="bell")
    assert (form.name, form.count) == ("bell", 3)
    assert [(k.name, k.kind) for k in form.knobs] == [("m", "location")]
    x = np.linspace(-1.0, 1.0, 5)
    np.testing.assert_allclose(form.values(x, 0.3)[0], np.exp(-((x - 0.3) ** 2)))
    assert user_form("a*tanh(w*x)").knobs[0].kind == "signed rate"


@pytest.mark.parametrize("low, high", [(-2.0, 1.0), (1.0, 4.0), (-4.0, -1.0)])
def test_typical_widths_lie_between_the_sizes_of_x(low: float, high: float) -> None:
    form = next(f for f in LIBRARY if f.name == "saturation")
    size = np.abs(np.linspace(low, high, 400))
    (width,) = form.typical(low, high)
    assert size.min() < width < size.max()
