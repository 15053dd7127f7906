"""Names an edge: every form fitted, ranked by probability, tested for what it leaves behind.

With prior probabilities π (half for "nothing", the other half to forms, simple ones first) and the
Bayesian information criterion as -2 log of the marginal likelihood (Schwarz, Ann. Stat. 6, 1978,
p. 461),

    P(form | edge) ∝ π(form) exp(-BIC/2).

A form that leaves a trace in the residual (`adequacy`) is out, whatever its rank; where every form
is out, or a free spline is more probable than all of them, the answer is "no simple form".
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pikanid.settings import of_kind
from pikanid.symbolic.adequacy import Smoother
from pikanid.symbolic.curve import Curve
from pikanid.symbolic.fitting import fit_form
from pikanid.symbolic.library import LIBRARY, NOTHING, Form
from pikanid.symbolic.named import Candidate, NamedEdge
from pikanid.symbolic.settings import USUAL, SymbolicSettings


def name_edge(x: np.ndarray, y: np.ndarray, *, sigma: float | np.ndarray | None = None,
              covariance: np.ndarray | None = None, library: Sequence[Form] = LIBRARY,
              argument: str = "x", unit: str = "", x_unit: str = "",
              settings: SymbolicSettings = USUAL) -> NamedEdge:
    """Name the function behind the points of one edge.

    Args:
        x, y: Argument and value (n,), in `x_unit` and `unit`.
        sigma: Standard deviation of independent noise, one or (n,); unknown and equal unless given.
        covariance: Of y (n, n) instead, as a spline's values have it.
        library: The candidates; "nothing" always competes.
        argument: What x is, for sentences and the expression.
        settings: Priors, levels of tests, budgets.

    Raises:
        BadSetting: Fewer than 8 points, values that are not finite, an x that does not move, a
            sigma that is not positive.

    >>> x = np.linspace(-1.0, 1.0, 200)
    >>> noise = np.random.default_rng(0).normal(0.0, 0.05, x.size)
    >>> edge = name_edge(x, 2.0*x**3 + noise)
    >>> edge.name, round(edge.best.values["a"], 1)
    ('cubic', 2.0)
    >>> name_edge(x, noise).name
    'nothing'
    """
    of_kind(settings, SymbolicSettings)
    if covariance is None:
        curve = Curve.of_points(x, y, sigma, argument=argument, unit=unit, x_unit=x_unit)
    else:
        curve = Curve.of_covariance(x, y, covariance, argument=argument, unit=unit, x_unit=x_unit)
    return name_curve(curve, library, settings)


def name_curve(curve: Curve, library: Sequence[Form] = LIBRARY,
               settings: SymbolicSettings = USUAL) -> NamedEdge:
    """The same for a curve that is ready."""
    forms = [NOTHING, *(f for f in library if f.columns)]
    tried = (fit_form(form, curve, settings) for form in forms)
    fits = [f for f in tried if f is not None and f.finite]
    smoother = Smoother.of(curve)
    share_of = {n: (1.0 - settings.nothing) * (1.0 - settings.no_form) * w
                for n, w in priors(forms, settings).items()} | {NOTHING.name: settings.nothing}
    scores = np.array([
        curve.score(fit.rss, fit.form.count + curve.free.shape[1])
        - 2.0 * np.log(share_of[fit.form.name]) for fit in fits])
    p_values = np.array([smoother.p_value(fit) for fit in fits])
    free, free_rss, free_count = smoother.free()
    free -= 2.0 * np.log((1.0 - settings.nothing) * settings.no_form)
    good = p_values >= settings.trace
    every = np.append(np.where(good, scores, np.inf), free)
    if not np.isfinite(every).any():  # too few points for a free spline
        every[-1] = 0.0
    share = np.exp(-0.5 * (every - every.min()))
    share /= share.sum()
    candidates = [Candidate(fit.form, fit, float(p), float(score), float(adequate))
                  for fit, p, score, adequate in zip(fits, share, scores, p_values, strict=False)]
    variance = curve.variance(free_rss, free_count)
    return NamedEdge(curve, _ranked(candidates, curve, variance, settings), float(share[-1]),
                     float(np.sqrt(variance)), settings)


def priors(library: Sequence[Form], settings: SymbolicSettings = USUAL
           ) -> dict[str, float]:
    """Of every form but "nothing", by name: families alike, simpler forms first.

    Every constant beyond the amplitude and the offset makes a form `simpler` times less probable;
    forms of one family with the same number of constants share.
    """
    forms = [f for f in library if f is not NOTHING]
    alike = Counter((f.family, f.count) for f in forms)
    weight = {f.name: settings.simpler ** (2.0 - f.count) / alike[f.family, f.count] for f in forms}
    total = sum(weight.values())
    return {name: w / total for name, w in weight.items()}


def _ranked(candidates: list[Candidate], curve: Curve, variance: float,
            settings: SymbolicSettings) -> tuple[Candidate, ...]:
    """Most probable first; those that the data cannot tell from the first are marked."""
    ranked = sorted(candidates, key=lambda c: (-c.probability, c.score))
    if not ranked:
        return ()
    first = ranked[0].fit
    noise = max(variance, curve.rows * curve.floor)
    return tuple(replace(
        c, agrees=bool(np.sum((c.fit.shape - first.shape) ** 2) <= settings.agrees * noise))
        for c in ranked)
