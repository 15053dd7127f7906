"""The exceptions that a user can meet; each carries one sentence of the files beside it."""

from __future__ import annotations

EXIT_MISFIT = 3  # definition: of the command line, where a fit is done but explains nothing


class PikanidError(Exception):
    """Base of every error that the user can mend; the command line turns it into exit code 2."""

    exit_code = 2


class BadModel(PikanidError):
    """The model (Python or TOML) is inconsistent or says something that cannot be read."""


class BadRecording(PikanidError):
    """The recording cannot be read or cannot be used with this model."""


class BadUnit(PikanidError):
    """A unit is unknown or does not fit."""


class BadSetting(PikanidError):
    """An option has a value that cannot work."""


class DatasetUnavailable(PikanidError):
    """A real recording is neither on disk nor can it be fetched."""


class SimulationFailed(PikanidError):
    """The model cannot be simulated at the given parameters."""
