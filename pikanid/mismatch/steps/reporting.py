"""From an answer to a diagnosis: proof, place, limits of detection, advice, notes."""

from __future__ import annotations

import numpy as np

from pikanid.mismatch.beyond.force_shape import ForceShape, with_law
from pikanid.mismatch.beyond.latent_force import force_over_time
from pikanid.mismatch.beyond.local_force import local_force
from pikanid.mismatch.case import Case
from pikanid.mismatch.catalogue.site import Site
from pikanid.mismatch.data.left_out import left_out_sentences
from pikanid.mismatch.detect.residual_tests import Detection
from pikanid.mismatch.fitting.as_estimate import as_estimate, widened
from pikanid.mismatch.fitting.decisions import below, smaller
from pikanid.mismatch.fitting.hypothesis import Hypothesis
from pikanid.mismatch.judge.answer import Answer
from pikanid.mismatch.judge.doubt import idle
from pikanid.mismatch.judge.explanations import spread
from pikanid.mismatch.judge.prediction import HeldOut
from pikanid.mismatch.report.advice import advice
from pikanid.mismatch.report.diagnosis import Diagnosis
from pikanid.mismatch.report.explained import explanations
from pikanid.mismatch.report.findings import Curves, OutputError, Proof
from pikanid.mismatch.report.locate import locate, smallest
from pikanid.mismatch.report.own_time import own_time
from pikanid.mismatch.search.overdispersion import overdispersion
from pikanid.mismatch.steps.mislabelled import mislabelled, sampled_otherwise
from pikanid.mismatch.steps.remaining import closest, present, remainder
from pikanid.model import Model
from pikanid.model.domains import not_taken
from pikanid.pieces.sentences import p_text
from pikanid.problem.problem import bind
from pikanid.recording import Recording


def reported(case: Case, detection: Detection, answer: Answer, site: Site,
             shape: ForceShape | None) -> Diagnosis:
    """The diagnosis of a case, with proof, place, advice and notes."""
    alpha, asked = case.settings.alpha, case.settings.least_proof
    case.notes += case.model.unit_disagreements
    for records, which in ((case.records, ""), (case.later, "held-out")):
        case.notes += left_out_sentences(records.left_out, which) if records else []
    if case.excuse:
        case.notes.append(f"{case.excuse[0].upper()}{case.excuse[1:]}: it is left out.")
    best = answer.given[0] if answer.given else case.base
    counts = _overdispersion(case, answer)
    # its standard errors count the colour of the noise, which those of plain least squares do not
    before = widened(as_estimate(case.base, case.before),
                     1.0 if answer.verdict == "none" else overdispersion([case.base]))
    apart = (answer.part.spread if answer.part is not None else
             spread(best, answer.given) if len(answer.given) > 1 else {})
    after = widened(as_estimate(best, case.before), counts, apart) if answer.given else before
    time = own_time(case.model, case.records.recordings)
    given, rejected = explanations(answer, case.evidence(case.search.ranked()), counts,
                                   apart if answer.part else {}, time)
    proof = _proof(case, answer, best)
    alone = not smaller(case.detected().p_value, alpha)
    if alone and not answer.given and proof is not None and proof.p_value < alpha:
        case.notes.append(
            "The recording itself shows nothing, but the model does not predict the held-out one "
            f"({p_text(proof.p_value, 1)}): diagnose that one, with this one held out.")
        case.notes += sampled_otherwise(case)
    if answer.verdict == "unnamed":
        case.notes += mislabelled(case)
    if answer.verdict in ("unnamed", "unconfirmed", "partial"):
        known = (i for c in case.candidates for i in c.ids)
        case.notes += filter(None, [not_taken(case.model, known)])
    if case.proves and (shown := case.predicted(best)) and below(shown.motion, asked):
        case.notes.append(
            "By this model all that moves in the held-out recording is worth "
            f"{shown.motion:.2g} of chi-squared, and {asked:.0f} are needed to confirm anything: "
            "it is at rest, too short, or the model is far off.")
    levels = [level.sentence(o) + _louder(case, o)
              for o, level in case.records.levels[0].items()]
    force = None if answer.verdict == "none" else force_over_time(case.base, site)
    local = local_force(
        case.base, case.model, shape, site, answer.given[0] if answer.given else None) if (
            shape is not None and answer.verdict not in ("named", "set")) else None
    if shape is not None and answer.given:
        shape = with_law(shape, case.base, site, answer.given[0])
    return Diagnosis(
        answer.verdict, detection.p_value, case.settings,
        locate(case.base, best, answer, site, shape, force, case.candidates, local),
        given, rejected, before, after, proof, tuple(levels),
        tuple(case.notes), smallest(case.base, case.candidates, counts, time),
        advice(answer.verdict, given, case.records, case.rate, case.proves,
               case.search.workers, bool(answer.doubt),
               any(i.default is None for i in case.model.inputs), _idle(case, answer),
               proof is not None and proof.p_value >= case.settings.adequate),
        shape=shape,
        force_over_time=force,
        doubt=answer.doubt or (case.excuse if answer.verdict == "unconfirmed" else ""),
        present=present(answer, time), remainder=remainder(case, answer, proof),
        closest=closest(answer))


def _louder(case: Case, output: str) -> str:
    """What is to be said of an output's noise in held-out recordings, if anything."""
    if case.later is None:
        return ""
    times = case.later.sigma(output) / case.records.sigma(output)
    return (f" In the held-out recording {times:.2g} times as much."
            if times > 1 + case.settings.noise.same else "")


def _overdispersion(case: Case, answer: Answer) -> float:
    """What χ² is divided by: one where everything is explained."""
    if answer.part is not None:
        return answer.part.overdispersion
    return 1.0 if answer.verdict in ("none", "named", "set") else case.search.scale()


def _proof(case: Case, answer: Answer, best: Hypothesis) -> Proof | None:
    before, after = case.predicted(case.base), case.predicted(best)
    if case.later is None or before is None or after is None:
        return None
    # all that a named model leaves is noise, not its highest frequencies alone
    share = best.noise if answer.verdict in ("named", "set") else 1.0
    outputs = {o.name: OutputError(before.rmse[o.name], after.rmse[o.name],
                                   after.rmse_moved[o.name],
                                   case.later.sigma(o.name) * share, o.unit)
               for o in case.model.outputs}
    return Proof(outputs, after.detection.p_value, _curves(case, before, after),
                 tuple(r.name for r in case.later.recordings), _idle(case, answer))


def _curves(case: Case, before: HeldOut, after: HeldOut) -> dict[str, Curves]:
    """Of every output of the first held-out recording; a residual is predicted minus measured."""
    assert case.later is not None
    found: dict[str, Curves] = {}
    for (r, name, t, old), (*_, new) in zip(before.residuals, after.residuals, strict=True):
        if r == 0:
            y = _measured(case.model, case.later.recordings[0], name)
            found[name] = Curves(t, y, y + old, y + new, None if found else after.moved)
    return found


def _measured(model: Model, recording: Recording, output: str) -> np.ndarray:
    """The samples (N,) of an output, as they are compared."""
    return next(s.y for s in bind(model, recording).samples
                if model.outputs[s.output].name == output)


def _idle(case: Case, answer: Answer) -> tuple[str, ...]:
    """Names of the effects of the first explanation that do not act in the held-out recordings."""
    seen = case.predicted(answer.given[0]) if answer.given and case.later is not None else None
    return () if seen is None else tuple(
        e.name for e in answer.given[0].effects if idle(e, seen))
