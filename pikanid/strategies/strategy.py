"""What every strategy is: settings, and a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import Field
from typing import Any, ClassVar, Protocol

from pikanid.estimate import Estimate
from pikanid.model import Model
from pikanid.recording import Recording


class Strategy(Protocol):
    """A way to estimate parameters: a frozen dataclass whose fields are its settings.

    Fields called `protocol` and `seed` are set from the command line.

    Attributes:
        name: On the command line and in results; the strategy's file is called so.
        slow: Whether a fit of a few hundred samples takes more than some seconds.
    """

    name: ClassVar[str]
    slow: ClassVar[bool]
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def fit(self, model: Model, recordings: Recording | Sequence[Recording]) -> Estimate:
        """Estimate the model's free parameters from one recording, or from several jointly.

        Raises:
            BadRecording: A channel is missing or unusable.
            BadSetting: The settings do not suit each other, or the strategy by its nature not the
                model.
        """
        ...
