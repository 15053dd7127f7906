"""The pykan model that the user receives carries the reported curve, kinks and all."""

from __future__ import annotations

import numpy as np

from pikanid.approximators.kan import ShallowKAN, build_kan
from pikanid.validation.equivalence.report import Check
from pikanid.validation.equivalence.setting import Setting

_CURVE = 1e-12  # numerical: rounding of a spline's few terms


def delivered_curve(seed: int = 0) -> tuple[Check, ...]:
    """Basis times coefficients against pykan's forward pass plus the kinks stored beside it.

    Derivatives are compared with autograd through the same forward pass.
    """
    rows = []
    for degree, grid, kinks in (
        (3, 40, ()),
        (5, 40, (0.2, 0.6, 1.2, 1.6)),
        (5, 160, (0.2, 0.6, 1.2, 1.6)),
    ):
        setting = Setting("sloshing", "state", degree, grid, kinks=kinks, even=False, seed=seed)
        kan = build_kan([1, 2], grid=grid, k=degree, grid_range=(0.0, setting.horizon))
        shallow = ShallowKAN(kan, kinks)
        rng = np.random.default_rng((seed, 5))
        coefficients = rng.normal(size=(shallow.n_basis, 2))
        # Jumps as large as those of the paper's excitation, u_x / l.
        for column, place in enumerate(shallow.kink_columns):
            spacing = setting.horizon / grid
            coefficients[place] = rng.normal(size=2) / 0.045 * spacing ** (2 + column % 2)
        shallow.set_coefficients(coefficients)
        t = setting.collocation_times
        text = f"k={degree}, G={grid}, {len(kinks)} kinks, 2 outputs"
        curve = shallow.values(t, coefficients)
        scale = np.abs(curve).max()
        rows.append(
            Check("KAN handed over = reported curve", text, "curve",
                  float(np.abs(shallow.forward(t) - curve).max() / scale), _CURVE)
        )
        slopes = _autograd(setting, shallow)
        wanted = shallow.values(t, coefficients, 1)
        rows.append(
            Check("KAN handed over = reported curve", text, "time derivative",
                  float(np.abs(slopes - wanted).max() / np.abs(wanted).max()), _CURVE)
        )
    return tuple(rows)


def _autograd(setting: Setting, shallow: ShallowKAN) -> np.ndarray:
    """Time derivative (M, outputs) of pykan's forward pass, by torch, and of the kinks."""
    import torch

    t = setting.collocation_times
    times = torch.tensor(t[:, None], requires_grad=True)
    curve = shallow.kan(times)
    slopes = [
        torch.autograd.grad(curve[:, output].sum(), times, retain_graph=True)[0]
        for output in range(setting.outputs)
    ]
    return torch.cat(slopes, dim=1).numpy() + sum(kink(t, 1) for kink in shallow.kinks)
