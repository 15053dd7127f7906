"""The angle of a drawn surface: unbiased, inside its own band as often as that says, or refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from pikanid import errors
from pikanid.tracking.render import picture
from pikanid.tracking.surface import find


@pytest.mark.parametrize("blur", [0.5, 1.5])
def test_errors_are_as_large_as_stated(blur: float) -> None:
    truths = np.random.default_rng(1).uniform(-25, 25, 200) * np.pi / 180
    found = [find(picture(theta, blur=blur, seed=k)) for k, theta in enumerate(truths)]
    angle, sigma = (np.array([getattr(f, name) for f in found]) for name in ("theta", "sigma"))
    inside = int(np.sum(np.abs(angle - truths) < 1.96 * sigma))
    assert binom.ppf(0.001, 200, 0.92) <= inside  # not less than 92 %, but for one run in 1000
    assert np.sqrt(np.mean((angle - truths) ** 2)) < np.radians(0.1)
    assert 1.96 * np.median(sigma) < np.radians(0.15)


def test_what_shows_no_surface_is_refused() -> None:
    empty = picture(0.0, level=500.0)
    noise = np.random.default_rng(0).integers(0, 256, empty.shape).astype(np.uint8)
    for shown in (empty, noise):
        found = find(shown)
        assert np.isnan(found.theta) and np.isnan(found.sigma) and found.reason


def test_level_is_the_height_above_the_lower_edge() -> None:
    assert find(picture(0.1, level=70.0)).level == pytest.approx(90.0, abs=0.05)


def test_a_grey_picture_is_refused_in_a_sentence() -> None:
    with pytest.raises(errors.BadRecording, match="picture"):
        find(np.zeros((40, 40), np.uint8))
