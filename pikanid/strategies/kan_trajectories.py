"""The networks of a PIKAN fit, as they are handed to the user."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
    """The fitted curves: `fitted[r][i]` is the network of chain i of recording r, and its
    coefficients, which are put into a pykan model on `device` when that is asked for.
    """

    chains: Chains
    fitted: tuple[tuple[tuple[ShallowKAN | KanCurve, Array], ...], ...]
    device: str = "cpu"

    @staticmethod
    def of(fit: RelaxedFit, device: str = "cpu") -> KanTrajectories:
        """The networks of a fit with its coefficients."""
        found = []
        for part, c in zip(fit.functional.parts, fit.coefficients, strict=True):
            own = []
            for network, table in zip(part.approximators, part.physics.tops, strict=True):
                assert isinstance(network, ShallowKAN | KanCurve)
                own.append((network, c[table.part]))
            found.append(tuple(own))
        return KanTrajectories(fit.chains, tuple(found), device)

    @cached_property
    def networks(self) -> tuple[tuple[ShallowKAN | KanCurve, ...], ...]:
        """`networks[r][i]` is chain i of recording r; pykan takes milliseconds to make one."""
        for own in self.fitted:
            for network, coefficients in own:
                network.set_coefficients(coefficients)
                move(network.kan, self.device)
        return tuple(tuple(network for network, _ in own) for own in self.fitted)

    @property
    def kan(self) -> Any:
        """The pykan model of the first recording's first chain; kinks stand beside it."""
        return self.networks[0][0].kan

    def states(self, t: Array, recording: int = 0) -> Array:
        """Approximated states (M, n) of a recording at times t (M,) [s]."""
        own = self.fitted[recording]
        return np.column_stack([own[i][0].values(t, own[i][1], q)
                                for i, q in zip(self.chains.root, self.chains.order, strict=True)])
