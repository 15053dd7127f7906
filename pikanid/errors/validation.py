"""What can be wrong with a set of concealed effects."""

from __future__ import annotations

from collections.abc import Iterable

from pikanid.errors.wording import listed, short


def conceal_diverged() -> str:
    return "The reference rig leaves the finite numbers: the effect is too strong for this drive."


def conceal_remainder() -> str:
    return "These laws cannot leave the share of the misfit that is wanted of them here."


def conceal_faint() -> str:
    return "A hidden effect cannot be made as visible as is wanted in this experiment."


def conceal_cases(given: int, limit: int) -> str:
    return f"--cases is {given}; give 1 to {limit}."


def conceal_excitation(given: str, known: Iterable[str]) -> str:
    return f"'{short(given)}' is no excitation of concealed recordings (known: {listed(known)})."


def conceal_mix(text: str, known: Iterable[str]) -> str:
    return (f"--mix '{short(text, 200)}' cannot be read: write shares that are not all zero, such "
            f"as 'single=0.6,nothing=0.4' (classes: {listed(known)}).")


def conceal_sigma(sigma: float) -> str:
    return f"--sigma is {sigma:g} rad; noise on an angle must lie between 1e-6 and 0.2 rad."


def conceal_truth_inside(truth: str, folder: str) -> str:
    return (f"The truth '{short(truth, 200)}' would lie inside '{short(folder, 200)}', which is to "
            "be given away: choose a place outside.")


def conceal_taken(place: str) -> str:
    return (f"'{short(place, 200)}' already holds something else: choose another name, or remove "
            "it.")


def conceal_other_settings(place: str) -> str:
    return (f"'{short(place, 200)}' belongs to an unfinished set made with other settings: repeat "
            "those to finish it, or remove it.")



def truth_case(detail: str) -> str:
    return f"A case of the truth file cannot be compared with: {detail}."


def diagnosis_unreadable(case: str, detail: object) -> str:
    return (f"The diagnosis of case '{short(case)}' cannot be scored: {short(str(detail))} "
            "(wanted: verdict, mismatch, and hypotheses with effects' ids and a probability).")


def not_for_scipy(model: str) -> str:
    return (f"'{short(model)}' has splines, play or rate limits of inputs, which concealed "
            "recordings are not simulated with: leave them out.")


def not_the_sealed(truth: str, folder: str) -> str:
    return (f"'{short(truth, 200)}' is not the truth about the recordings in '{short(folder, 200)}'"
            ", or one of them was changed: give the file that was written with them.")


def conceal_two_inputs() -> str:
    return ("--model needs --inputs and --held-out-inputs: two files with the inputs of the model, "
            "one for each recording of a pair.")


def conceal_other_rig(option: str, own: bool) -> str:
    if own:
        return (f"{option} is of the sloshing rig only: with --model, motion comes from "
                "--inputs and --held-out-inputs, and noise from --noise. Leave it out.")
    return f"{option} is of a model of your own: name that with --model, or leave it out."


def conceal_needs_inputs() -> str:
    return ("An input of the model is not in the experiment and has no default: record it, or give "
            "one.")


def conceal_noise(share: float) -> str:
    return f"--noise is {share:g}; give the share of an output's range, 1e-6 to 0.5, such as 0.005."


def conceal_one_time_base(name: str) -> str:
    return (f"The channels of '{short(name)}' have several time bases; recordings are concealed on "
            "one: resample them.")


def conceal_at_rest(output: str) -> str:
    return f"Output '{short(output)}' does not move in this experiment: choose one that drives it."
