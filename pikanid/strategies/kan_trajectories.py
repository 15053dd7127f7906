"""The networks of a PIKAN fit, as they are handed to the user."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pikanid.approximators import Array
from pikanid.approximators.kan import ShallowKAN
from pikanid.approximators.kan.curve import KanCurve
from pikanid.approximators.kan.device import move
from pikanid.problem.chains import Chains
from pikanid.strategies.relaxation import RelaxedFit


@dataclass(frozen=True, eq=False)
class KanTrajectories:
    """The fitted networks: `networks[r][i]` is chain i of recording r."""

    chains: Chains
    networks: tuple[tuple[ShallowKAN | KanCurve, ...], ...]

    @staticmethod
    def of(fit: RelaxedFit, device: str = "cpu") -> KanTrajectories:
        """The networks of a fit, with its coefficients put into the pykan models."""
        found = []
        for part, c in zip(fit.functional.parts, fit.coefficients, strict=True):
            own = []
            for network, table in zip(part.approximators, part.physics.tops, strict=True):
                assert isinstance(network, ShallowKAN | KanCurve)
                network.set_coefficients(c[table.part])
                move(network.kan, device)
                own.append(network)
            found.append(tuple(own))
        return KanTrajectories(fit.chains, tuple(found))

    @property
    def kan(self) -> Any:
        """The pykan model of the first recording's first chain; kinks stand beside it."""
        return self.networks[0][0].kan

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""
        own = self.networks[recording]
        return np.column_stack([
            own[i].values(t, own[i].coefficients.ravel(), q)
            for i, q in zip(self.chains.root, self.chains.order, strict=True)])
