"""Edges are named by likelihood: rightly under noise, "nothing" and "no simple form" included."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.stats import binom

from pikanid import errors
from pikanid.approximators.bspline import BSpline
from pikanid.formula.expressions import symbol
from pikanid.symbolic import name_edge
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import _covariance, fit_form
from pikanid.symbolic.library import LIBRARY, NOTHING, Form, user_form

X = np.linspace(-1.0, 1.0, 400)
FORMS = {form.name: form for form in LIBRARY}
FEW = [FORMS[n] for n in ("linear", "quadratic", "cubic", "signed square", "sine", "tanh",
                          "signed power", "sign")]


def noisy(y: np.ndarray, share: float, seed: int = 0) -> np.ndarray:
    return y + share * y.std() * np.random.default_rng(seed).normal(size=y.shape)


LAWS = {
    "cubic": X**3,
    "signed square": X * np.abs(X),
    "tanh": np.tanh(20 * X),
    "sine": np.sin(3 * X),
    "sign": np.sign(X),
    "dead zone": X - np.clip(X, -0.3, 0.3),
    "signed power": np.sign(X) * np.abs(X) ** 1.5,
    "exponential": np.exp(-2.0 * X),
    "shifted Gaussian": np.exp(-((4.0 * (X - 0.3)) ** 2)),
}


@pytest.mark.parametrize("name", LAWS)
def test_law_is_named_under_noise(name: str) -> None:
    edge = name_edge(X, noisy(3.0 * LAWS[name] + 0.7, 0.05))
    assert edge.name == name
    assert edge.probability > 0.5


def test_noisy_cubic_is_not_zero() -> None:
    """A score of complexity against r² calls this edge "0"."""
    edge = name_edge(X, noisy(X**3, 0.05), library=FEW)
    assert edge.name == "cubic"
    assert abs(edge.best.values["a"] - 1.0) < 4.0 * edge.best.std["a"]


def test_stated_noise_is_believed() -> None:
    """Standard errors grow with it, whatever the points leave."""
    y = noisy(X**3, 0.05)
    narrow, wide = (name_edge(X, y, sigma=s, library=FEW) for s in (0.02, 0.06))
    assert narrow.name == wide.name == "cubic"
    assert wide.best.std["a"] == pytest.approx(3.0 * narrow.best.std["a"])


@pytest.mark.parametrize("share", [0.0, 1e-7])
def test_exact_points_are_named_too(share: float) -> None:
    edge = name_edge(X, noisy(np.sin(3 * X), share), library=FEW)
    assert edge.name == "sine"
    assert edge.best.values["b"] == pytest.approx(3.0, abs=1e-6)


def test_noise_alone_is_nothing() -> None:
    names = [name_edge(X, np.random.default_rng(k).normal(size=X.size), library=FEW).name
             for k in range(30)]
    assert names.count("nothing") >= 29


def test_no_simple_form_is_an_answer() -> None:
    law = np.sin(9.0 * X**2) * np.exp(X)
    edge = name_edge(X, noisy(law, 0.02))
    assert edge.name == "no simple form"
    assert edge.expression is None
    assert sum(c.probability for c in edge.candidates) + edge.unnamed == pytest.approx(1.0)


def test_what_leaves_a_trace_is_not_named() -> None:
    """The best of a poor library ranks first and is wrong: it must not be the answer."""
    edge = name_edge(X, noisy(np.tanh(20 * X), 0.05), library=[FORMS["linear"], FORMS["cubic"]])
    assert edge.name == "no simple form"


def test_stated_noise_and_unknown_noise_agree() -> None:
    y = X**3 + 0.05 * np.random.default_rng(3).normal(size=X.size)
    known, unknown = name_edge(X, y, sigma=0.05, library=FEW), name_edge(X, y, library=FEW)
    assert known.name == unknown.name == "cubic"
    assert known.best.std["a"] == pytest.approx(unknown.best.std["a"], rel=0.15)


@pytest.mark.parametrize("form, truth", [
    ("cubic", {"a": 2.0}), ("tanh", {"a": 1.5, "b": 8.0}), ("dead zone", {"a": 1.0, "w": 0.4})])
def test_intervals_cover_the_constants(form: str, truth: dict[str, float]) -> None:
    """95 % intervals over 200 seeds, against the binomial's 0.1 % tails."""
    law = 0.3 + truth["a"] * FORMS[form].values(X, *(v for n, v in truth.items() if n != "a"))[0]
    inside = dict.fromkeys(truth, 0)
    for seed in range(200):
        y = law + 0.1 * np.random.default_rng(seed).normal(size=X.size)
        fit = fit_form(FORMS[form], Curve.of_points(X, y))
        assert fit is not None
        found = dict(zip((*FORMS[form].amplitudes, *(k.name for k in FORMS[form].knobs)),
                         zip([*fit.amplitudes, *fit.inside], np.sqrt(np.diag(fit.covariance)),
                             strict=False), strict=True))
        for name, value in truth.items():
            estimate, std = found[name]
            inside[name] += abs(estimate - value) <= 1.96 * std
    low, high = binom.interval(0.998, 200, 0.95)
    assert all(low <= n <= high for n in inside.values()), inside


@pytest.mark.parametrize("name", ["cubic", "sine", "tanh"])
def test_answer_does_not_depend_on_units(name: str) -> None:
    y = noisy(LAWS[name], 0.05)
    plain, scaled = name_edge(X, y, library=FEW), name_edge(1e3 * X, 1e-4 * y, library=FEW)
    assert plain.name == scaled.name == name
    assert scaled.probability == pytest.approx(plain.probability, abs=1e-3)


def test_constants_carry_units() -> None:
    edge = name_edge(X, noisy(np.tanh(20 * X), 0.01), unit="N", x_unit="m/s", library=FEW)
    assert edge.best.units("N", "m/s") == {"a": "N", "b": "s/m", "d": "N"}
    assert name_edge(X, X**3, library=FEW).best.units("N", "m") == {"a": "N/m^3", "d": "N"}


def spline_edge(law: np.ndarray, sigma: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Values and covariance of a least-squares spline of 14 coefficients."""
    knots = np.concatenate([[-1.0] * 3, np.linspace(-1, 1, 12), [1.0] * 3])
    B = BSpline(3, knots).basis(X).toarray()
    y = law + sigma * np.random.default_rng(seed).normal(size=X.size)
    inverse = np.linalg.inv(B.T @ B)
    return B @ inverse @ B.T @ y, sigma**2 * B @ inverse @ B.T


@pytest.mark.parametrize("name", ["cubic", "signed square", "sine", "nothing"])
def test_spline_is_named_with_its_own_uncertainty(name: str) -> None:
    law = LAWS.get(name, np.zeros(X.size))
    for seed in range(3):
        values, covariance = spline_edge(law, 0.05, seed)
        assert name_edge(X, values, covariance=covariance, library=FEW).name == name


def test_free_columns_are_not_held_against_a_form() -> None:
    """Where a linear part is another term's to say, x³ less its linear part is still x³."""
    values, covariance = spline_edge(X**3, 0.02, 0)
    y = values - 0.6 * X
    curve = Curve.of_covariance(X, y, covariance, free=X[:, None])
    fits = {n: fit_form(FORMS[n], curve) for n in ("cubic", "quadratic", "linear")}
    assert fits["cubic"] is not None and fits["quadratic"] is not None
    assert fits["cubic"].amplitudes[0] == pytest.approx(1.0, abs=0.1)
    assert fits["cubic"].rss < 40.0 < fits["quadratic"].rss
    assert fits["linear"] is None  # the curve cannot show it at all


def test_user_form_competes() -> None:
    form = user_form("q*x*exp(-x**2*w)", name="bump")
    y = noisy(X * np.exp(-5.0 * X**2), 0.05)
    edge = name_edge(X, y, library=[*LIBRARY, form])
    assert edge.name == "bump"
    assert edge.best.values["w"] == pytest.approx(5.0, rel=0.1)


def test_every_form_recovers_itself_without_noise() -> None:
    """Each form, drawn at a place off its search grid, fits its own values to rounding."""
    x = np.linspace(0.4, 2.6, 300)
    for form in LIBRARY:
        if form is NOTHING or not form.fits_range(0.4, 2.6) or form.name in ("sign", "sign and "
                "linear", "absolute value", "Stribeck"):  # straight or constant where x > 0
            continue
        assert_recovers(form, x)


def assert_recovers(form: Form, x: np.ndarray) -> None:
    inside = {"location": 1.337, "below": 0.11, "above": 3.21, "width": 0.773, "rate": 1.93,
              "signed rate": 1.93, "frequency": 4.19, "exponent": 2.37}
    p = np.array([0.333 if form.name.startswith("shifted") and k.kind == "width"
                  else inside[k.kind] for k in form.knobs])
    y = 0.4 + np.sum([(k + 1.3) * c for k, c in enumerate(form.values(x, *p))], axis=0)
    fit = fit_form(form, Curve.of_points(x, y))
    assert fit is not None, form.name
    assert np.sqrt(fit.rss / x.size) < 1e-6 * max(y.std(), 1e-3), form.name


@pytest.mark.parametrize("x, y", [
    (np.arange(5.0), np.arange(5.0)), (np.ones(20), np.arange(20.0)),
    (np.arange(20.0), np.full(20, np.nan)), (np.arange(20.0), np.arange(19.0))])
def test_bad_points_are_refused(x: np.ndarray, y: np.ndarray) -> None:
    with pytest.raises(errors.BadSetting, match="cannot be named"):
        name_edge(x, y)


def test_candidate_needs_its_argument() -> None:
    with pytest.raises(errors.BadModel, match="argument 'x'"):
        user_form("q + 2")
    with pytest.raises(errors.BadModel):
        user_form("__import__('os')")


def test_curve_that_knows_little_is_offered_little() -> None:
    """A covariance of rank three carries no polynomial of five powers."""
    basis = np.column_stack([np.ones(X.size), X, X**2, X**3])
    curve = Curve.of_spline(X, basis, np.array([0.0, 0.0, 0.0, 1.0]), 1e-6 * np.eye(4))
    assert curve.rows == 3
    full = FORMS["polynomial x + x^2 + x^3 + x^4 + x^5"]
    assert fit_form(full, curve) is None
    fit = fit_form(FORMS["cubic"], curve)
    assert fit is not None and fit.amplitudes[0] == pytest.approx(1.0)


POWERS = {"abs_power": lambda x, n: np.abs(x) ** n,
          "signed_power": lambda x, n: np.sign(x) * np.abs(x) ** n,
          "log_abs": lambda x: np.log(np.abs(x))}


@pytest.mark.parametrize("scale", [0.2, 1.0, 3.0])
def test_forms_agree_where_the_data_cannot_tell_them_apart(scale: float) -> None:
    """Within three standard deviations of the whole curve: Σ ((f - g)/σ)² ≤ 9."""
    x = np.linspace(-1.0, 1.0, 60)
    y = np.sin(1.2 * x)
    edge = name_edge(x, y, sigma=0.05 / scale)
    first, agreeing = None, []
    for c in edge.candidates:
        curve = sp.lambdify(symbol("x"), c.numeric(), [POWERS, "numpy"])(x) * np.ones(60)
        curve = (curve - curve.mean()) / (0.05 / scale)  # the constant is nobody's
        first = curve if first is None else first
        distance = float(np.sum((curve - first) ** 2))
        assert c.agrees == (distance <= 9.0), (c.form.name, distance)
        agreeing.append(c.agrees)
    assert agreeing[0] and any(agreeing) and not all(agreeing)
    assert edge.probability == pytest.approx(
        sum(c.probability for c in edge.candidates if c.agrees))


def test_a_sigma_that_is_stated_is_the_noise() -> None:
    """Stated ten times too small, a straight line is no answer to a slight bend in it."""
    x = np.linspace(-1.0, 1.0, 100)
    y = x + 0.05 * np.random.default_rng(1).normal(size=100)
    right, wrong = (name_edge(x, y, sigma=s) for s in (0.05, 0.005))
    assert right.noise == wrong.noise == 1.0
    line = next(c for c in right.candidates if c.form.name == "linear")
    assert line.fit.rss == pytest.approx(
        np.sum((y - np.polyval(np.polyfit(x, y, 1), x)) ** 2) / 0.05**2)
    assert line.std["a"] == pytest.approx(0.05 / np.sqrt(np.sum((x - x.mean()) ** 2)))
    other = next(c for c in wrong.candidates if c.form.name == "linear")
    assert other.fit.rss == pytest.approx(100 * line.fit.rss)
    assert line.adequacy > 0.01 > other.adequacy
    by_sample = np.where(x < 0, 0.05, 0.5)
    weighed = next(c for c in name_edge(x, y, sigma=by_sample).candidates
                   if c.form.name == "linear")
    a, b = np.polyfit(x, y, 1, w=1 / by_sample)
    assert (weighed.values["a"], weighed.values["d"]) == pytest.approx((a, b))


def test_a_form_that_is_a_constant_on_the_range_is_none() -> None:
    x = np.linspace(1.0, 2.0, 50)
    curve = Curve.of_points(x, x + 0.1 * np.random.default_rng(0).normal(size=50))
    assert fit_form(FORMS["sign"], curve) is None
    assert fit_form(FORMS["linear"], curve) is not None


def test_constants_at_a_pole_have_no_known_error() -> None:
    x = np.linspace(0.0, 1.0, 50)
    curve, form = Curve.of_points(x, np.sqrt(x)), FORMS["shifted square root"]
    raw, one = np.sqrt(x)[:, None], np.ones((50, 1))
    with np.errstate(all="ignore"):
        found = _covariance(form, curve, np.array([0.0]), raw, np.ones(1), one)
    assert found.shape == (3, 3) and np.isnan(found).all()
