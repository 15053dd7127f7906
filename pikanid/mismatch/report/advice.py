"""What to record next, in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pikanid import errors
from pikanid.errors.wording import listed
from pikanid.mismatch.catalogue.candidate import SYMBOLIC
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.design.next_experiment import NextExperiment, next_experiment
from pikanid.mismatch.design.profiles import profiles
from pikanid.mismatch.design.ranges import ranges_of
from pikanid.mismatch.judge.answer import Verdict
from pikanid.mismatch.report.findings import Explanation, titles_apart
from pikanid.model import Model
from pikanid.model.parts import Input

ALIKE = 1.0  # numerical: difference in chi-squared, up to which hypotheses fit alike
PROVE = ("Record the system once more, driven differently and over another range of amplitudes, "
         "and give that recording as held-out: it decides what is confirmed.")
REPEAT = ("Record the same again, under the same conditions: what has happened once is not there "
          "then, what lasts is.")
STRENGTHEN = ("Record the same again for several times as long, with a larger swing or with less "
              "noise: what an effect gains in chi-squared grows with the time, and with the square "
              "of its size over the noise.")


def explore(driven: bool, rate: float) -> str:
    """What tells laws of the state, of the input and of the sensor apart.

    Args:
        driven: Whether inputs act.
        rate: Natural frequency [rad/s]; 0 where nothing restores.
    """
    swing = ("a free decay from starts three times apart, until it rests" if rate > 0 else
             "a run from initial values three times apart, until all is steady")
    drive = ("a slow sweep through the resonance at two input levels" if rate > 0 else
             "steps of three or more sizes in both directions, each held until all is steady")
    wanted = ([swing] if rate > 0 or not driven else []) + ([drive] if driven else [])
    return "; ".join([*wanted, "a stretch in which nothing changes before each"])


def advice(verdict: Verdict, given: Sequence[Explanation], records: Records, rate: float,
           proves: bool, workers: int = 1, weak: bool = False, driven: bool = True,
           idle: Sequence[str] = (), all_explained: bool = False) -> str:
    """The next experiment for a verdict; empty where none is needed.

    Args:
        verdict: Of the diagnosis.
        given: Its hypotheses.
        records: That it was made from.
        rate: Natural frequency [rad/s].
        proves: Whether a held-out recording was there.
        workers: Threads.
        weak: Whether something given predicts what is held out, but is too weak to be sure of.
        driven: Whether inputs act.
        idle: Names of given effects that do not act in the held-out recordings.
        all_explained: Whether what is given leaves no more than noise.
    """
    if verdict == "named" and any(e.once for h in given for e in h.effects):
        return ("Find out what happened at that time. The extended model does it again in every "
                "run: take that effect out before you predict with it.")
    if verdict in ("none", "named"):
        return ""
    outside = any(e.ids[0].startswith(SYMBOLIC) for h in given for e in h.effects)
    if verdict == "set" or (weak and outside and len(given) > 1):
        return _separating(given[:records.settings.budget.compared], records, rate, workers)
    if verdict == "partial":
        what = "be sure of more" if all_explained else "learn what is left"
        return f"To {what}, record {explore(driven, rate)}."
    if given and weak and any(e.once for e in given[0].effects):
        return REPEAT
    if given and weak and idle:
        return ("Give a held-out recording in which the motion and the input are as large as in "
                f"this one, so that {listed(idle)} acts there as well: it decides what is "
                "confirmed.")
    if given and (weak or not proves):
        return STRENGTHEN if weak else PROVE
    found = "None of these holds on all recordings" if given else "No law in the catalogue holds"
    return f"{found}. Record {explore(driven, rate)}."


def _separating(given: Sequence[Explanation], records: Records, rate: float, workers: int) -> str:
    """The profile that best tells the most probable hypotheses apart."""
    model = given[0].model
    driven = [i for i in model.inputs if i.default is None]
    names = titles_apart(given)
    text = f"To tell {' from '.join(names)}: "
    if len(driven) != 1 or not rate > 0:
        return f"{text}record {explore(bool(driven), rate)}.{_alike(given)}"
    models = {name: e.model for name, e in zip(names, given, strict=True)}
    found = _best(models, records, driven[0], rate, workers)
    if found is None:
        return text + "choose another excitation; of the usual ones none can be simulated with all."
    apart = f"{found.value:.2g} standard deviations apart"
    if found.value < found.separated:
        return (f"No usual profile tells {' from '.join(names)} (at best {apart}): only a larger "
                "stroke, less noise or a second sensor would.")
    outcome = (f"expected to set them {apart} (now {found.before:.2g}; repeating the last "
               f"experiment, {found.repeated:.2g})")
    return text + f"run {found.profile.name}, {outcome}. `pikanid design` writes the profile."


def _alike(given: Sequence[Explanation]) -> str:
    """That hypotheses may be one and the same to what is measured, where they fit alike."""
    scores = [e.score for e in given]
    apart = max(scores) - min(scores)
    if apart > ALIKE:
        return ""
    return (f" What they predict hardly differs (by {apart:.1g} of chi-squared): if it stays so, "
            "only another quantity that is measured tells them apart.")


def _best(models: Mapping[str, Model], records: Records, driven: Input, rate: float, workers: int
          ) -> NextExperiment | None:
    """The best of the usual profiles, beside what was recorded if that can be simulated with all
    models; None where nothing can.
    """
    sigma = {o: level.sigma for o, level in records.levels[0].items()}
    settings = records.settings
    for recorded in (records.recordings, ()):
        try:
            offered = profiles(min(rate / (2 * np.pi), settings.budget.profile_rate),
                               duration=settings.budget.profile, channel=driven.name,
                               unit=driven.unit, draws=1,
                               span=ranges_of([driven], None, records.recordings, False).get(
                                   driven.name))
            return next_experiment(models, recorded, sigma, offered, workers=workers,
                                   settings=settings)
        except errors.PikanidError:
            continue
    return None
