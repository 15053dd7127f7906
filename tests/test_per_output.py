"""Errors of fits and predictions: each output's own, in its own unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pikanid as pk
from pikanid.formula.expressions import symbol
from pikanid.mismatch.catalogue.catalogue import candidates
from pikanid.mismatch.catalogue.sites import sites
from pikanid.mismatch.data.records import Records
from pikanid.mismatch.fitting.fit import fitted
from pikanid.mismatch.judge.prediction import HeldOut, held_out
from pikanid.mismatch.report.findings import OutputError, Proof
from pikanid.mismatch.report.locate import affected, loud_windows
from pikanid.mismatch.settings.settings import DEFAULTS
from pikanid.model.parts import Output
from pikanid.noise.level import NoiseModel
from pikanid.reporting import strict_json

SIGMA = {"theta": 0.002, "swing": 0.3}  # rad, mm


def swinging(unit: str = "mm") -> pk.Model:
    """Two sloshing modes: an angle, and a displacement in mm or m."""
    factor = {"mm": 45.0, "m": 0.045}[unit]
    return pk.systems.sloshing_2d().replace(outputs=(
        Output("theta", symbol("theta"), "rad"), Output("swing", factor * symbol("phi"), unit)))


def moved(seed: int) -> pk.Recording:
    plan = pk.excitation.two_pulse()
    return pk.simulate(swinging(), plan.with_channels(replace(
        plan["u_x"], name="u_y", values=0.7 * plan["u_x"].values)), sigma=SIGMA, seed=seed)


def test_an_estimate_states_the_error_of_each_output() -> None:
    found = pk.NLS().fit(swinging(), moved(0))
    assert found.rmse_by_output == pytest.approx(SIGMA, rel=0.1)
    assert found.rmse == found.rmse_by_output["theta"]
    angle, swing = (f"{v:.3g}" for v in found.rmse_by_output.values())
    assert f"residual {angle} rad of 'theta', {swing} mm of 'swing', " in found.sentence()
    content = strict_json.of_one(found, ["run"])
    assert content["rmse"] == found.rmse
    assert content["outputs"]["swing"] == {"rmse": found.rmse_by_output["swing"], "unit": "mm"}
    alone = pk.NLS().fit(pk.systems.sloshing(), moved(0))
    assert f"residual {alone.rmse:.3g} rad, " in alone.sentence()
    assert "outputs" not in alone.to_dict()


def predicted(unit: str) -> HeldOut:
    """The nominal model's prediction of a motion with a stiffer liquid, in either unit."""
    factor = {"mm": 1.0, "m": 1e-3}[unit]
    levels = {"theta": NoiseModel(SIGMA["theta"], 0.0, 0.0, 0.01, "given"),
              "swing": NoiseModel(factor * SIGMA["swing"], 0.0, 0.0, 0.01, "given")}

    def records(seed: int, times: float = 1.0) -> Records:
        seen = moved(seed)
        swing = replace(seen["swing"], values=times * factor * seen["swing"].values, unit=unit,
                        sigma=factor * SIGMA["swing"])
        return Records((seen.with_channels(swing),), (levels,), DEFAULTS)

    base = fitted(swinging(unit), (), records(0), [{}], 1)
    assert base is not None
    found = held_out(base, swinging(unit), records(1, 1.5), (), 0.0)
    assert found is not None
    return found


def test_a_prediction_is_judged_in_each_output_s_own_unit() -> None:
    fine, coarse = predicted("mm"), predicted("m")
    residuals = {name: gap for _, name, _, gap in fine.residuals}
    for name, gap in residuals.items():
        assert fine.rmse[name] == pytest.approx(np.sqrt(np.mean(gap**2)))
    assert fine.rmse["swing"] == pytest.approx(1000 * coarse.rmse["swing"], rel=1e-6)
    assert fine.rmse["theta"] == pytest.approx(coarse.rmse["theta"], rel=1e-6)
    # what decides is the same in every unit
    assert fine.misfit == pytest.approx(coarse.misfit, rel=1e-6)
    shares = [fine.rmse[name] / SIGMA[name] for name in SIGMA]
    assert fine.misfit == pytest.approx(np.sqrt(np.mean(np.square(shares))), rel=1e-6)


def test_a_proof_is_told_output_by_output() -> None:
    proof = Proof({"theta": OutputError(0.01, 0.002, 0.002, 0.002, "rad"),
                   "swing": OutputError(4.0, 0.31, 0.3, 0.3, "mm")}, 0.4, {})
    assert not proof.sensitive(DEFAULTS)
    assert Proof({**proof.outputs, "swing": OutputError(4.0, 1.0, 0.3, 0.3, "mm")}, 0.4,
                 {}).sensitive(DEFAULTS)
    content = proof.to_dict()
    # ten noises of the nominal model against five
    assert (content["output"], content["rmse_after"], content["unit"]) == ("swing", 0.31, "mm")
    assert content["outputs"]["swing"] == {
        "rmse_before": 4.0, "rmse_after": 0.31, "noise": 0.3, "unit": "mm"}
    alone = Proof({"theta": proof.outputs["theta"]}, 0.4, {}).to_dict()
    assert alone["rmse_after"] == 0.002 and not {"output", "outputs"} & alone.keys()


def test_what_is_missing_in_the_second_coordinate_is_found_there() -> None:
    truth = swinging().with_term("phi_dot", "-200*phi**3")
    plan = pk.excitation.two_pulse()
    recording = pk.simulate(truth, plan.with_channels(replace(plan["u_x"], name="u_y")),
                            sigma=SIGMA, seed=3)
    levels = {o: NoiseModel(s, 0.0, 0.0, 0.01, "given") for o, s in SIGMA.items()}
    # one parameter for each, so that the first coordinate keeps what it needs
    base = fitted(swinging().fix("l_theta", "d_theta").free("m"), (),
                  Records((recording,), (levels,), DEFAULTS), [{}], 1)
    assert base is not None
    found = sites(base.model, (recording,))
    assert [s.q for s in found] == ["theta", "phi"]
    assert affected(base, (), found, candidates(found)).q == "phi"
    assert loud_windows(base)
    quiet = base.minimum.r[: len(recording.t)]
    assert np.sum(quiet**2) < 1.3 * len(quiet)  # nothing is loud in the first output
