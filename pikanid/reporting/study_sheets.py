"""The tables of the study."""

from __future__ import annotations

import numpy as np

from pikanid.pieces.sheet import Sheet
from pikanid.reporting.tables import verdict
from pikanid.validation.study.pendulum import Result as Swinging
from pikanid.validation.study.run import Study
from pikanid.validation.study.slosh import TRUE, Result
from pikanid.validation.study.slosh import sampling as sampling_of

# What the paper's Tables III and IV report, (l_theta [m], d_theta [N s/m]) by scenario.
PAPER: dict[str, dict[str, tuple[float, float]]] = {
    "dense_clean": {"nls": (0.0450, 0.150), "pda": (0.0530, 0.144), "ipda": (0.0496, 0.173),
                     "pinn": (0.0451, 0.193), "pikan": (0.0449, 0.289)},
    "dense_low": {"nls": (0.0450, 0.152), "pda": (0.0530, 0.150), "ipda": (0.0496, 0.178),
                     "pinn": (0.0451, 0.201), "pikan": (0.0448, 0.320)},
    "dense_high": {"nls": (0.0449, 0.160), "pda": (0.0529, 0.137), "ipda": (0.0498, 0.163),
                     "pinn": (0.0448, 0.168), "pikan": (0.0451, 0.274)},
    "sparse_clean": {"nls": (0.0450, 0.150), "pda": (0.0532, 0.847), "ipda": (0.0547, 0.377),
                      "pinn": (0.0438, 0.256), "pikan": (0.0449, 0.413)},
    "sparse_low": {"nls": (0.0450, 0.149), "pda": (0.0535, 0.874), "ipda": (0.0550, 0.382),
                      "pinn": (0.0442, 0.292), "pikan": (0.0452, 0.235)},
    "sparse_high": {"nls": (0.0428, 1.145), "pda": (0.0595, 0.691), "ipda": (0.0569, 0.393),
                      "pinn": (0.0439, 0.468), "pikan": (0.0451, 0.151)},
}  # definition: of the paper


def slosh(study: Study, sampling: str, paper: bool = False) -> Sheet:
    """Table III (dense) or IV (sparse), with what the `paper` reports as a last column if asked."""
    rows: list[tuple[str, ...]] = []
    last = ""
    for result in study.slosh_fits:
        if sampling_of(result.scenario) != sampling:
            continue
        noise = result.scenario.label.split(", ")[1]
        rows.append(("" if noise == last else noise, result.strategy, *_slosh_cells(result)))
        last = noise
    numbers = ("l [m]", "error l", "s.e. l", "d [N s/m]", "error d", "s.e. d", "time [ms]")
    headers = ("noise", "strategy", *numbers, "verdict", "paper's l, d")
    width = len(headers) if paper else len(headers) - 1
    return Sheet(headers[:width], tuple(cells[:width] for cells in rows), numbers)


def _slosh_cells(result: Result) -> tuple[str, ...]:
    scenario, found = result.scenario, result.estimate
    paper = PAPER[scenario.name].get(result.strategy)
    reported = f"{paper[0]:.4f}, {paper[1]:.3f}" if paper else ""
    if found is None:
        return (*["-"] * 7, "not usable", reported)
    cells: list[str] = []
    for name, digits in (("l_theta", 6), ("d_theta", 4)):
        cells += [f"{found.value(name):.{digits}f}", small(result.error(name)),
                  "-" if scenario.clean else small(found.std(name))]
    return (*cells, short(1e3 * found.seconds), verdict(found), reported)


def spread(study: Study) -> Sheet:
    """Root mean square error and bias over repeated seeds, in units of the Cramér-Rao bound."""
    rows = []
    for s in study.spreads:
        cells = [short(s.cells[p].ratio.value) for p in TRUE]
        cells += [short(s.cells[p].bias.value / s.cells[p].bound) for p in TRUE]
        rows.append((s.scenario.label, s.strategy, *cells))
    numbers = ("RMSE/CRB l", "RMSE/CRB d", "bias/CRB l", "bias/CRB d")
    return Sheet(("scenario", "strategy", *numbers), tuple(rows), numbers)


def pendulum(study: Study) -> Sheet:
    """The real recording: parameters, and RMSE [rad] on the part fitted and the held-out part."""
    numbers = ("l [m]", "s.e. l", "d [1/s]", "s.e. d", "train", "held-out", "restarted",
               "time [ms]")
    rows = tuple((r.strategy, *_pendulum_cells(r)) for r in study.pendulum_fits)
    return Sheet(("strategy", *numbers, "verdict"), rows, numbers)


def _pendulum_cells(result: Swinging) -> tuple[str, ...]:
    found = result.estimate
    if found is None:
        return (*["-"] * 8, "not usable")
    cells: list[str] = []
    for name in ("l", "d"):
        cells += [f"{found.value(name):.5f}", small(found.std(name))]
    cells += [f"{value:.4f}" for value in (found.rmse, result.held_out, result.restarted)]
    return (*cells, short(1e3 * found.seconds), verdict(found))


def reasons(study: Study) -> list[str]:
    """Why a strategy could not be used, each sentence once."""
    unusable = [(r.strategy, r.reason) for r in study.slosh_fits if r.reason]
    unusable += [(r.strategy, r.reason) for r in study.pendulum_fits if r.reason]
    return [f"{name}: {why}" for name, why in dict.fromkeys(unusable)]


def small(value: float) -> str:
    """Two significant digits, such as an error deserves.

    >>> small(-1.234e-5), small(float("nan"))
    ('-1.2e-05', '-')
    """
    return f"{value:.1e}" if np.isfinite(value) else "-"


def short(value: float) -> str:
    """Three significant digits, or all before the point.

    >>> short(4.1872), short(-1234.5), short(0.8151)
    ('4.19', '-1234', '0.815')
    """
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
