"""A formula without the constants that trade: as many left as data can see, the same values."""

from __future__ import annotations

import numpy as np
import pytest

from pikanid.formula.expressions import symbol
from pikanid.symbolic.composed import Composition
from pikanid.symbolic.library import LIBRARY
from pikanid.symbolic.refit import Refit, generic_jacobian, refit
from pikanid.symbolic.tidy import tidied

FORMS = {form.name: form for form in LIBRARY}
INPUTS = (symbol("theta"), symbol("omega"))
X = np.random.default_rng(0).uniform(0.2, 1.0, (120, 2))


def fitted(made: Composition, theta: list[float]) -> tuple[Refit, np.ndarray]:
    """The composition, refitted to its own values at θ with a little noise."""
    clean = made.evaluate(np.array(theta), X)[0]
    y = clean + 0.01 * np.std(clean) * np.random.default_rng(1).normal(size=len(X))
    found = refit(made, np.array(theta), X, y, generic_jacobian(made, X))
    assert found is not None
    return found, y


# exp(b·h) and h: b and the amplitudes in h trade; of a product: the factors' amplitudes do
BEHIND_A_RATE = (Composition((((0,),), ((0,),)), {
    (0, 0, 0): FORMS["sine"], (0, 1, 0): FORMS["quadratic"], (1, 0, 0): FORMS["exponential"]},
    INPUTS), [0.8, 2.9, 0.9, 0.0, 1.2, 1.1, 0.0])
PRODUCT = (Composition((((0, 1),), ((0,),)), {
    (0, 0, 0): FORMS["quadratic"], (0, 1, 1): FORMS["cubic"], (1, 0, 0): FORMS["linear"]},
    INPUTS), [1.3, 0.7, 0.4, 0.6, 1.1, 0.2])


@pytest.mark.parametrize(("made", "theta"), [BEHIND_A_RATE, PRODUCT])
def test_constants_that_trade_become_one(made: Composition, theta: list[float]) -> None:
    fit, y = fitted(made, theta)
    assert fit.rank < made.count
    found = tidied(fit, X, y)
    assert np.sum(~found.held) == found.rank
    assert set(found.theta[found.held]) <= {0.0, 1.0}
    assert found.score <= fit.score + 0.1
    np.testing.assert_allclose(made.evaluate(found.theta, X)[0], made.evaluate(fit.theta, X)[0],
                               atol=0.02 * np.std(y))
