"""Tests of a residual against distributions that are known: normal, χ², and many repetitions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import binom, chi2, norm

from pikanid.mismatch.detect.residual_tests import (
    AT_ONCE,
    BATCH,
    CLEAR,
    Detection,
    _chance,
    _standard,
    detect,
    frequency_bands,
    past_inputs,
    unit_columns,
)
from pikanid.mismatch.settings.detection import DetectionSettings
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.noise.projection import project
from pikanid.problem.held import HeldInput

N = 200
# orthonormal: a Jacobian, two signs, a narrow and a wide band, inputs
Q = np.linalg.qr(np.random.default_rng(0).normal(size=(N, 40)))[0]
J, SIGNS, NARROW, WIDE, INPUTS = Q[:, :3], Q[:, 3:5], Q[:, 5:7], Q[:, 7:27], Q[:, 27:32]
NOTHING = np.empty((N, 0))


def judged(r: np.ndarray, one_sided: tuple[bool, ...] = (True, True), signs: np.ndarray = SIGNS,
           bands: list[np.ndarray] | None = None, spread: float = 0.0, seed: int = 0) -> Detection:
    lines = [NARROW, WIDE] if bands is None else bands
    return detect(r, J, signs, np.array(one_sided, bool), lines, INPUTS, spread, DEFAULTS, seed)


def near(p: float, share: float) -> object:
    """A p-value within four standard errors; where it is clearly no alarm one batch of draws is
    enough.
    """
    draws = DEFAULTS.budget.draws if p / share < 0.8 * CLEAR[1] else BATCH
    return pytest.approx(p, abs=4 * np.sqrt(p * (1 - p) / draws) + 1 / draws)


@pytest.mark.parametrize("size", [-2.5, 2.0, 2.5])
@pytest.mark.parametrize("one_sided", [True, False])
def test_a_sign_counts_on_its_side_only(size: float, one_sided: bool) -> None:
    r, strongest = size * SIGNS[:, 0], abs(size)
    found = judged(r, (one_sided,) * 2)
    assert found.z == pytest.approx([size, 0.0], abs=1e-12)
    inside = norm.cdf(strongest) if one_sided else 1 - 2 * norm.sf(strongest)
    if one_sided and size < 0:
        assert found.catalogue > 0.7  # nothing on their side: as weak as can be
    else:
        assert found.catalogue == near(1 - inside**2, 0.6)  # the larger one of two


def test_signs_of_both_kinds_are_told_apart() -> None:
    r = -6.0 * SIGNS[:, 0]
    assert judged(r, (False, True)).catalogue < 1e-5
    assert judged(r, (True, False)).catalogue > 0.3


@pytest.mark.parametrize("power", [10.0, 40.0])
def test_one_band_is_a_chi_square_of_its_lines(power: float) -> None:
    r = np.sqrt(power / 20) * WIDE.sum(axis=1)
    assert judged(r, bands=[WIDE]).bands == near(chi2.sf(power, 20), 0.2)
    # another one that could have been louder makes it less of a surprise
    assert judged(r).bands == near(
        1 - chi2.cdf(power, 20) * chi2.cdf(2 * cube(power, 20), 2), 0.2)


def cube(power: float, freedom: int) -> float:
    """The power per line of two lines that is as loud as this of others (Wilson and Hilferty)."""
    loud = ((power / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / np.sqrt(2 / (9 * freedom))
    return float((1 - 2 / 18 + loud * np.sqrt(2 / 18)) ** 3)


def test_the_inputs_past_is_a_chi_square_of_its_columns() -> None:
    r = np.sqrt(17.0) * INPUTS[:, 2]
    assert judged(r).inputs == near(chi2.sf(17.0, 5), 0.2)


def test_what_the_parameters_take_up_tells_nothing() -> None:
    rng = np.random.default_rng(1)
    r = rng.normal(size=N)
    lines = [NARROW + J @ rng.normal(size=(3, 2)), WIDE]
    found, moved = judged(r, bands=lines), judged(r + 50.0 * J.sum(axis=1), bands=lines)
    assert moved.bands == pytest.approx(found.bands) and moved.catalogue == found.catalogue
    assert moved.power == pytest.approx(float(np.sum((r + 50 * J.sum(axis=1)) ** 2)))


def test_each_kind_of_test_has_its_share() -> None:
    found = judged(np.sqrt(18.0) * INPUTS[:, 0])
    each = zip((found.catalogue, found.bands, found.inputs), DEFAULTS.kinds, strict=True)
    assert sum(DEFAULTS.kinds) == pytest.approx(1.0)
    assert found.p_value == min(1.0, *(p / share for p, share in each)) == found.inputs / 0.2


@pytest.mark.parametrize("spread", [0.3, 0.6])
def test_doubt_of_the_noise_level_is_drawn_with_the_residual(spread: float) -> None:
    """Of a χ² of 5 times a log-normal power: by another million draws."""
    rng = np.random.default_rng(5)
    drawn = chi2.rvs(5, size=10**6, random_state=rng) * np.exp(spread * rng.normal(size=10**6))
    found = judged(np.sqrt(18.0) * INPUTS[:, 0], spread=spread)
    assert found.inputs == near(float(np.mean(drawn > 18.0)), 0.2)


@pytest.mark.parametrize("spread", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_beyond_the_draws_p_values_are_those_of_the_tail(seed: int, spread: float) -> None:
    """Of the signs one is as large as seen; the noise's power may be wrong.  By quadrature."""
    sizes, width = (4.5, 5.5, 7.0, 40.0), max(spread, 1e-9)
    p = [judged(size * SIGNS[:, 0], spread=spread, seed=seed).catalogue for size in sizes]
    truth = [quad(lambda e, s=size: 2 * norm.sf(s * np.exp(-e / 2)) * norm.pdf(e, 0, width),
                  -8 * width, 8 * width, points=[0.0])[0] for size in sizes[:3]]
    # the draws' own error at the edge of the tail, and what two signs that overlap have in common
    assert all(0.4 < ours / true < 4 for ours, true in zip(p, truth, strict=False))
    assert p == sorted(p, reverse=True) and p[3] < 1e-20


@pytest.mark.parametrize("freedom", [1, 5, 20])
def test_the_tail_of_a_score_is_that_of_its_chi_square(freedom: int) -> None:
    for power in (1.5 * freedom, 3.0 * freedom, 9.0 * freedom):
        spread = 2 / (9 * freedom)
        score = ((power / freedom) ** (1 / 3) - (1 - spread)) / np.sqrt(spread)
        assert float(_standard(np.array(power), freedom)) == pytest.approx(score)
        assert _chance(score, freedom, 0.0) == pytest.approx(chi2.sf(power, freedom))
    assert _chance(9.0, 0, 0.0) == pytest.approx(chi2.sf(9.0, 1))


def test_white_noise_is_blamed_as_often_as_stated() -> None:
    rng, runs, alpha = np.random.default_rng(2), 150, 0.05
    p = np.array([judged(r, (True, False)).p_value for r in rng.normal(size=(runs, N))])
    assert np.sum(p < alpha) <= binom.ppf(0.999, runs, alpha)
    assert np.sum(p < 0.5) >= binom.ppf(0.001, runs, 0.35)  # nor does it sleep


def test_projection_and_unit_columns_by_hand() -> None:
    rng = np.random.default_rng(3)
    A, D = rng.normal(size=(30, 4)) * [1e-8, 1.0, 1.0, 1e6], rng.normal(size=(30, 5))
    A[:, 2] = A[:, 1]  # a direction twice, and one without influence
    A = np.column_stack([A, np.zeros(30)])
    basis = np.linalg.qr(A[:, [0, 1, 3]] / [1e-8, 1.0, 1e6])[0]
    rest = D - basis @ (basis.T @ D)
    np.testing.assert_allclose(project(A, D), rest, atol=1e-9)
    np.testing.assert_array_equal(project(A[:, :0], D), D)
    D[:, 1], D[:, 2] = A[:, 1], np.inf
    units, lengths = unit_columns(D, A)
    np.testing.assert_array_equal(lengths == 0, [False, True, True, False, False])
    assert not units[:, [1, 2]].any()
    for k in (0, 3, 4):
        assert lengths[k] == pytest.approx(np.linalg.norm(rest[:, k]))
        np.testing.assert_allclose(units[:, k], rest[:, k] / lengths[k], atol=1e-9)


def test_bands_hold_every_line_once() -> None:
    """Up to six natural rates: 2 s at 10 rad/s are 19 lines of 0.5 Hz."""
    t = 3.0 + np.arange(200) * 0.01
    bands = frequency_bands(t, 10.0, DEFAULTS.detection)
    every = np.hstack([np.hstack(np.split(b, 2, axis=1)) for b in bands])
    assert len(bands) == 8 and every.shape == (200, 2 * 19)
    span = t[-1] - t[0]
    for band in bands:
        np.testing.assert_allclose(np.linalg.norm(band, axis=0), 1.0, atol=0.08)
    lines = np.concatenate([b[:, :b.shape[1] // 2].T for b in bands])
    expected = [np.cos(2 * np.pi * k * (t - 3.0) / span) * np.sqrt(2 / 200) for k in range(1, 20)]
    np.testing.assert_allclose(lines, expected, atol=1e-12)
    widths = [b.shape[1] for b in bands]
    assert widths == sorted(widths) and widths[-1] > 2 * widths[0]
    # never beyond what the samples, or 150 lines, can hold
    assert sum(b.shape[1] for b in frequency_bands(
        t, 1e4, DEFAULTS.detection)) == 2 * int(0.9 * 50 * span)

    own = DetectionSettings(bands=3, reach=4.0, lines=5)
    assert len(frequency_bands(t, 10.0, own)) == 3
    assert sum(b.shape[1] for b in frequency_bands(t, 1e4, own)) == 2 * 5
    low = frequency_bands(t, 10.0, DetectionSettings(reach=4.0))
    assert sum(b.shape[1] for b in low) == 2 * int(4.0 * 10.0 * span / (2 * np.pi))


def test_past_inputs_span_the_input_at_every_lag_of_a_period() -> None:
    t = np.linspace(0.0, 6.0, 301)
    u = np.sin(3 * t) + np.sin(7.3 * t) + (t > 2)
    held = [HeldInput("u", t, u, "zero")]
    columns = past_inputs(t, held, 5.0, DEFAULTS.detection)
    np.testing.assert_allclose(columns.T @ columns, np.eye(columns.shape[1]), atol=1e-10)
    for lag in np.linspace(0.0, 2 * np.pi / 5.0, 12)[1:]:  # a controller would know the first
        late = np.interp(t - lag, t, u, left=u[0])
        late -= late.mean()
        rest = late - columns @ (columns.T @ late)
        assert np.linalg.norm(rest) < 2e-2 * np.linalg.norm(late)
    later = np.interp(t - 2.5, t, u, left=u[0])
    later -= later.mean()
    assert np.linalg.norm(later - columns @ (columns.T @ later)) > 0.2 * np.linalg.norm(later)
    assert past_inputs(t, held, 5.0, DetectionSettings(lags=4)).shape[1] <= 3 + AT_ONCE
    assert past_inputs(t, [], 5.0, DEFAULTS.detection).shape == (301, 0)


def test_what_a_fast_rig_answers_within_a_few_samples_is_spanned() -> None:
    """Levels, each held for long, and an answer one sample late, or two, and nothing besides."""
    rng, t = np.random.default_rng(0), 0.005 * np.arange(1000)
    u = np.repeat(rng.uniform(-6.0, 6.0, 40), 25)
    columns = past_inputs(t, [HeldInput("u", t, u, "zero")], 0.0, DEFAULTS.detection)
    steps = np.concatenate([[0.0], np.diff(u)])
    for late in (1, 2, 3):
        answer = np.concatenate([np.zeros(late), steps[:-late]])
        rest = answer - columns @ (columns.T @ answer)
        assert np.linalg.norm(rest) < 0.2 * np.linalg.norm(answer)


def test_without_a_natural_rate_inputs_act_over_a_twentieth_of_the_record() -> None:
    t = np.linspace(3.0, 13.0, 1001)
    pulse = (np.abs(t - 5.0) < 0.05).astype(float)
    held = [HeldInput("u", t, pulse, "zero")]
    columns = past_inputs(t, held, 0.0, DEFAULTS.detection)
    moved = np.abs(np.diff(columns, axis=0)).max(axis=1) > 1e-6
    where = t[1:][moved]
    assert where.min() == pytest.approx(4.95, abs=0.02)
    assert where.max() == pytest.approx(5.05 + 0.5, abs=0.02)
    longer = past_inputs(t, held, 0.0, DetectionSettings(spans=10))
    moved = np.abs(np.diff(longer, axis=0)).max(axis=1) > 1e-6
    assert t[1:][moved].max() == pytest.approx(5.05 + 1.0, abs=0.02)
