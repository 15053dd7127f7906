"""What can be wrong with a set of concealed effects."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from pikanid.errors.wording import did_you_mean, listed, short


def conceal_diverged() -> str:
    return "The reference rig leaves the finite numbers: the effect is too strong for this drive."


def conceal_remainder() -> str:
    return "These laws cannot leave the share of the misfit that is wanted of them here."


def conceal_faint() -> str:
    return "A hidden effect cannot be made as visible as is wanted in this experiment."


def conceal_the_same() -> str:
    return "A law that is to be in no catalogue is an entry in other words in these experiments."


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
    return (f"'{short(model)}' has splines, or inputs with play, a limited rate or a past, which "
            "concealed recordings are not simulated with: leave them out.")


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


def unknown_scenario(name: str, known: Iterable[str], close: Sequence[str]) -> str:
    return (f"'{short(name)}' is no scenario (known: {listed(known)}; a file of your own ends in "
            f".toml).{did_you_mean(close)}")


def unknown_strategy(name: str, known: Iterable[str]) -> str:
    return f"'{short(name)}' is no strategy of the benchmark (known: {listed(known)})."


def scenario_twice(name: str) -> str:
    return f"Two different scenarios are called '{short(name)}': give one of them another name."


def scenario_compares_nothing(name: str) -> str:
    return (f"Scenario '{short(name)}': no free parameter of the fitted model is one of the model "
            "that makes the data, so that no error could be told: free one, or call it the same.")


def store_in_use(folder: str) -> str:
    return (f"Another benchmark is writing to '{short(folder, 200)}': wait for it, or choose "
            "another --out.")


def store_taken(path: str, count: int) -> str:
    return (f"'{short(path, 200)}' holds {count} trials of an earlier run: continue it with "
            "--resume, or choose another --out.")


def store_unreadable(path: str, detail: str) -> str:
    return (f"The store '{short(path, 200)}' cannot be used: {short(detail)}. Restore it, or "
            "choose another --out.")


def store_of_other_format(path: str) -> str:
    return (f"'{short(path, 200)}' was written by another version of this program: continue it "
            "with that one, or choose another --out.")


def store_of_other_versions(path: str, differ: Sequence[str]) -> str:
    return (f"'{short(path, 200)}' was made with {listed(differ)}: continue it with "
            "the same versions, or choose another --out.")


def store_of_other_scenario(path: str, name: str) -> str:
    return (f"'{short(path, 200)}' holds another scenario called '{short(name)}': give this one "
            "another name, or choose another --out.")


def workers_lost() -> str:
    return ("A worker process was ended from outside (memory may have run out): the trials that "
            "were finished are kept; go on with --resume, perhaps with fewer --workers.")


def no_scheduler(address: str, detail: str) -> str:
    return (f"No Dask scheduler answers at '{short(address, 200)}' ({short(detail)}): start one "
            "with `dask scheduler`, and give its address, such as tcp://127.0.0.1:8786.")


def no_workers(address: str) -> str:
    return (f"The Dask scheduler at '{short(address, 200)}' has no workers: start some with "
            f"`dask worker {short(address, 200)}`.")


def cluster_failed(address: str, detail: str) -> str:
    return (f"A worker of '{short(address, 200)}' cannot run trials ({short(detail, 200)}): the "
            "same versions of Python and pikanid must be installed there; then go on with "
            "--resume.")
