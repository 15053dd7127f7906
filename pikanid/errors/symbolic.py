"""What can be wrong with a discrepancy, and with a formula for one."""

from __future__ import annotations

from collections.abc import Sequence

from pikanid.errors.wording import short


def edge_argument_still(argument: str, value: float) -> str:
    return (f"The argument '{argument}' of the discrepancy stays at {value:.4g} in every "
            "recording: leave it out, or add a recording that moves it.")


def no_static_law(arguments: Sequence[str]) -> str:
    return (f"No static law of {', '.join(arguments)} explains the recording: what is missing "
            "depends on something else, on the past, or sits in a sensor or an input.")


def discrepancy_not_simulated() -> str:
    return ("The model with its discrepancy cannot be simulated along the whole recording: use "
            "fewer arguments, or a nominal model that follows the recording more closely.")


def edge_points(x: int, y: int, fewest: int) -> str:
    return (f"An edge of {x} arguments and {y} values cannot be named: give at least {fewest} "
            "finite points (x, y) over which x moves.")


def candidate_without_argument(text: str, argument: str) -> str:
    return f"The candidate '{short(text)}' does not contain its argument '{argument}'."


def reading_inputs(given: int, names: Sequence[str]) -> str:
    return (f"{given} inputs do not fit the names {', '.join(names) or '(none)'}: give one name an "
            "input, and no formulas where the reading is to be evaluated.")


def network_without_inputs() -> str:
    return "The network has seen no inputs yet: give x, the inputs over which it is to be read."


def edge_sticks(arguments: Sequence[str]) -> str:
    return (f"The jump in {' and '.join(arguments)} brings the model to rest, which the edge alone "
            "cannot judge: give the recordings too, and the laws are compared inside the ODE.")


def no_law_simulated() -> str:
    return "None of the laws tried can be simulated along the recording: read without recordings."


def no_edges(model: str) -> str:
    return (f"The estimate of '{model}' holds no edges to read: give one that kan_discrepancy "
            "made, or a KAN.")


def not_a_network(path: str) -> str:
    return f"'{path}' is neither a saved KAN (.npz, .json) nor a saved estimate (.json, .json.gz)."


def extract_columns(names: Sequence[str], known: Sequence[str]) -> str:
    return (f"The data have no columns {', '.join(names)}; they have {', '.join(known)}. Name the "
            "inputs with --input and the output with --output.")


def nothing_to_push() -> str:
    return "This reading is not that of a KAN: there is no pykan model to put it into."


def nothing_read() -> str:
    return "No formula of the library is finite over the network's inputs: add forms that are."
