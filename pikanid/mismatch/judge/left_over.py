"""What a hypothesis leaves beside noise, in the train and in the held-out recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.prediction import HeldOut, rmse


def left_over(h: Hypothesis, predicted: HeldOut, noise: Sequence[Mapping[str, float]]) -> float:
    """Σ max(rms²/σ² - 1, 0) over outputs, in the train and the held-out recordings; there with the
    parameters moved within their errors.
    """
    return left_in_train(h, noise) + _beside_noise(predicted.rmse_moved, noise[1])


def left_in_train(h: Hypothesis, noise: Sequence[Mapping[str, float]]) -> float:
    """The same of the train recordings alone: what is left in all of them is never less."""
    return _beside_noise(rmse(h.whitened, h.minimum.theta), noise[0])


def _beside_noise(sizes: Mapping[str, float], sigma: Mapping[str, float]) -> float:
    return sum(max((size / sigma[name]) ** 2 - 1, 0.0) for name, size in sizes.items())
