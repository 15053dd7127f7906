"""What can be wrong with a comparison of models."""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.errors.wording import listed, short


def no_models() -> str:
    return "There is no model to validate: give at least one."


def no_model_or_estimate(kind: str) -> str:
    return f"A model or an estimate is wanted here, not {short(kind)}: see pikanid.Model."


def other_outputs(first: str, outputs: Iterable[str], other: str, others: Iterable[str]) -> str:
    return (f"'{short(first)}' measures {listed(outputs)}, '{short(other)}' measures "
            f"{listed(others)}: models with the same outputs can be compared.")


def too_few_to_start(recording: str, output: str, count: int, first: int) -> str:
    return (f"Recording '{short(recording)}' has {count} samples of '{short(output)}': with "
            f"first = {first} none is left to score; take fewer.")


def too_few_for_states(recording: str, first: int, count: int) -> str:
    return (f"{first or 'All'} samples of recording '{short(recording)}' are too few for {count} "
            "initial values: raise first.")


def horizon_too_long(recording: str, count: int, window: int, horizon: int) -> str:
    return (f"Recording '{short(recording)}' has {count} samples, fewer than the {window} before "
            f"an origin and the {horizon} ahead: lower horizon or window.")


def baseline_uneven(output: str) -> str:
    return (f"No linear baseline for '{short(output)}': its samples are on no even grid; resample "
            "the recordings for one.")


def baseline_rates(output: str) -> str:
    return (f"No linear baseline for '{short(output)}': the training recordings have different "
            "sampling rates.")


def baseline_unstable(output: str) -> str:
    return f"No linear baseline for '{short(output)}': no ARX model of its data is stable."


def prediction_diverged(model: str, recording: str) -> str:
    return (f"'{short(model)}' cannot be followed along '{short(recording)}': the motion leaves "
            "the finite numbers.")


def predict_alike(names: Iterable[str]) -> str:
    return (f"These models predict the same: {listed(names)}. Is one of them given twice, or was "
            "another meant?")
