"""Negative controls: cases where KAN and Eq. (5) are not the same, and by how much; uniqueness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from scipy.interpolate import BSpline

from pikanid.approximators.kan import build_kan
from pikanid.validation.equivalence.agreement import GRADIENTS, MATRICES, difference
from pikanid.validation.equivalence.ipda import IpdaObjective
from pikanid.validation.equivalence.network import NetworkLoss
from pikanid.validation.equivalence.report import Check
from pikanid.validation.equivalence.setting import Array, Setting

# What a negative control must exceed: a thousand million times what agreement allows.
_CLEAR = 1e-3  # numerical: a thousand million times what agreement allows


def controls(seed: int = 0) -> tuple[Check, ...]:
    """w_b ≠ 0, unmatched knots, unmatched collocation, a deeper KAN: each must differ."""
    rows = []
    for system in ("sloshing", "duffing"):
        setting = Setting(system, "second-order", 3, 20, seed=seed)
        rows += [
            _base_function(setting),
            _unmatched_knots(setting),
            _unmatched_collocation(setting),
            _deeper(setting),
        ]
    return tuple(rows)


def quadratic_at_the_end(seed: int = 0) -> tuple[Check, ...]:
    """Degree 2, second-order form: pykan's second derivative at T is the limit from outside.

    With T among the collocation points both sides differ there; without it they agree.
    """
    rows = []
    for system in ("sloshing", "duffing"):
        setting = Setting(system, "second-order", 2, 20, collocation=97, seed=seed)
        with_end = _gradients(setting)
        without = _gradients(replace(setting, end=False))
        text = setting.describe()
        rows += [
            Check("degree 2 at T", text, "loss", with_end[0], 1e-6, must_differ=True),
            Check("degree 2 without T", text, "loss", without[0], MATRICES),
            Check("degree 2 without T", text, "gradient", without[1], GRADIENTS),
        ]
    return tuple(rows)


def uniqueness(seed: int = 0) -> tuple[Check, ...]:
    """The curve determines the coefficients: full rank, moderate condition, and back again.

    With w_b ≠ 0 the added SiLU is so nearly a spline that they hardly do.
    """
    rows = []
    for degree in (2, 3, 4, 5):
        setting = Setting("duffing", "second-order", degree, 40, seed=seed)
        knots = NetworkLoss(setting).knots
        t = np.linspace(0.0, setting.horizon, 501)
        basis = BSpline.design_matrix(t, knots, degree).toarray()
        coefficients = np.random.default_rng((seed, 6)).normal(size=basis.shape[1])
        found, *_ = np.linalg.lstsq(basis, basis @ coefficients, rcond=None)
        joined = np.hstack([basis, (t / (1.0 + np.exp(-t)))[:, None]])
        text = f"k={degree}, G=40, T=5, 501 points"
        missing = float(basis.shape[1] - np.linalg.matrix_rank(basis))
        rows += [
            Check("uniqueness", text, "missing rank of B", missing, 0.0),
            Check("uniqueness", text, "condition of B", float(np.linalg.cond(basis)), 1e5),
            Check("uniqueness", text, "c back from Bc",
                  difference(np.asarray(found, float), coefficients), 1e-10),
            Check("w_b ≠ 0: hardly unique", text, "condition of [B, SiLU]",
                  float(np.linalg.cond(joined)), 1e5, must_differ=True),
        ]
    return tuple(rows)


def _gradients(setting: Setting) -> tuple[float, float]:
    network = NetworkLoss(setting)
    objective = IpdaObjective(setting, network.knots)
    unknowns = setting.unknowns()
    value_a, gradient_a = network.value_and_gradient(unknowns)
    value_b, gradient_b = objective.value_and_gradient(unknowns)
    return difference(np.array(value_a), np.array(value_b)), difference(gradient_a, gradient_b)


def _control(name: str, setting: Setting, network: float, ipda: float) -> Check:
    found = difference(np.array(network), np.array(ipda))
    return Check(name, setting.describe(), "loss", found, _CLEAR, must_differ=True)


def _base_function(setting: Setting) -> Check:
    kan = build_kan([1, 1], grid=setting.grid, k=setting.degree, grid_range=(0.0, setting.horizon),
                    base="silu")
    kan.act_fun[0].scale_base.data.fill_(0.1)
    unknowns = setting.unknowns()
    network = NetworkLoss(setting, kan)
    ipda = IpdaObjective(setting, network.knots).value_and_gradient(unknowns)[0]
    value = network.value_and_gradient(unknowns)[0]
    return _control("w_b = 0.1", setting, value, ipda)


def _unmatched_knots(setting: Setting) -> Check:
    """As many functions on clamped knots, the textbook's choice, which pykan's are not."""
    network, unknowns = NetworkLoss(setting), setting.unknowns()
    knots = network.knots.copy()
    knots[: setting.degree], knots[-setting.degree :] = 0.0, setting.horizon
    ipda = IpdaObjective(setting, knots).value_and_gradient(unknowns)[0]
    value = network.value_and_gradient(unknowns)[0]
    return _control("clamped knots", setting, value, ipda)


def _unmatched_collocation(setting: Setting) -> Check:
    """The same number of collocation points, placed at random."""
    network, unknowns = NetworkLoss(setting), setting.unknowns()
    other = replace(setting, even_collocation=False)
    ipda = IpdaObjective(other, network.knots).value_and_gradient(unknowns)[0]
    value = network.value_and_gradient(unknowns)[0]
    return _control("other collocation points", setting, value, ipda)


def _deeper(setting: Setting) -> Check:
    """How far curves of a [1, 2, 1] KAN lie from the spline space of its input layer."""
    kan = build_kan([1, 2, 1], grid=setting.grid, k=setting.degree,
                    grid_range=[(0.0, setting.horizon), (-1.0, 1.0)], seed=setting.seed, noise=5.0,
                    start="waves")
    t = np.linspace(0.0, setting.horizon, 2001)
    with torch.no_grad():
        curve: Array = kan(torch.tensor(t[:, None])).numpy()[:, 0]
    basis = BSpline.design_matrix(t, NetworkLoss(setting).knots, setting.degree).toarray()
    best = basis @ np.linalg.lstsq(basis, curve, rcond=None)[0]
    away = float(np.linalg.norm(curve - best) / np.linalg.norm(curve))
    text = f"[1, 2, 1], {setting.describe()}"
    return Check("deeper KAN", text, "distance to spline space", away, _CLEAR, must_differ=True)
