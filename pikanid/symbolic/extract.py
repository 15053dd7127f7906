"""`extract`: whatever holds a network, as a formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pikanid.settings import of_kind
from pikanid.symbolic.library import LIBRARY, Form
from pikanid.symbolic.network import read_network
from pikanid.symbolic.numeric import Array
from pikanid.symbolic.reading import Reading
from pikanid.symbolic.settings import USUAL, SymbolicSettings

if TYPE_CHECKING:
    from pikanid.recording import Recording


def extract(source: Any, x: Array | None = None, y: Array | None = None, *,
            inputs: Sequence[str] | None = None, library: Sequence[Form] = LIBRARY,
            alpha: float = 0.01,
            recordings: Recording | Sequence[Recording] | None = None,
            settings: SymbolicSettings = USUAL) -> Reading:
    """Read a network as a formula with standard errors.

    Args:
        source: A pykan model with one output, trained here or elsewhere; or the result of
            `kan_discrepancy`, or the estimate in it, as it was saved.
        x, y: Of a pykan model, the data behind it: inputs (M, n) and output (M,).  Without y its
            own values are read and nothing can be tested; without x, over the inputs that it saw
            last.
        inputs: Of a pykan model, names of its inputs.
        library: The forms that compete, `LIBRARY` and any `user_form`.
        alpha: Level at which an edge of a pykan model is significant.
        recordings: Of a discrepancy, to refit what was read inside the ODE and choose by the data.
        settings: Priors, levels of tests, budgets.

    Returns:
        Reading, whose `expression` and `parameters` go into `model.with_term`.

    Raises:
        BadSetting: Data that do not fit the network, or nothing to read.

    >>> import numpy as np
    >>> from pikanid.approximators.kan import build_kan
    >>> x = np.random.default_rng(0).uniform(-1, 1, (300, 2))
    >>> y = np.sin(3*x[:, 0]) + x[:, 1]**3 + np.random.default_rng(1).normal(0, 0.02, 300)
    >>> reading = extract(build_kan([2, 1], grid=8), x, y, inputs=["theta", "omega"])
    >>> reading.expression
    a_omega*omega**3 + a_theta*sin(b_theta*theta)
    """
    from pikanid.discrepancy.result import Discrepancy
    from pikanid.estimate import Estimate
    from pikanid.symbolic.missing import read_discrepancy
    from pikanid.symbolic.saved import read_estimate

    of_kind(settings, SymbolicSettings)
    if isinstance(source, Estimate):
        return read_estimate(source, library, settings)
    if isinstance(source, Discrepancy):
        return read_discrepancy(source, library, recordings, settings)
    return read_network(source, x, y, inputs=inputs, library=library, alpha=alpha,
                        settings=settings)
