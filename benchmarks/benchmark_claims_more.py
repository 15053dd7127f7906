"""Those sentences of the paper that need an experiment of their own."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from benchmark_claims import NO, YES, Claim, Found
from benchmark_experiments import LAMBDAS, Basin, Share, Sweep, identifiability
from benchmark_spectrum import FREQUENCIES
from benchmark_tables import TIMES
from benchmark_textbook import Textbook
from diagnosis_real import MODELS

import pikanid as pk
from pikanid.recording import datasets
from pikanid.reporting.benchmark_sheets import digits, percent, with_interval
from pikanid.validation.benchmark import files
from pikanid.validation.benchmark.summary import FAR, Cell, share
from pikanid.validation.equivalence import run_checks

XI = 1.8411837813406593  # first zero of J1': the first mode in an upright cylinder
GRAVITY = 9.81
RADIUS, FILL = 0.033, 0.090  # of the paper's rig [m]


def breakdown(found: Found, textbooks: list[Textbook]) -> list[Claim]:
    """NLS at N = 51, 1°."""
    g = found["sparse_high", "nls", "paper"]
    single = found.get(("sparse_high", "nls-single", "default"))
    parts = [f"exact integration and derivatives, best of five: {percent(g.breakdowns)} %"]
    if single is not None:
        parts.append(f"one start: {percent(single.breakdowns)} %")
    claims = [Claim("Abstract, IV-C, V", "NLS breaks down (d = 1.145) where data are sparse and "
                    "noisy: a local minimum.", "N = 51, 1°: share of seeds that break down",
                    "; ".join(parts), YES if g.breakdowns.low > 0.5 else
                    "not confirmed: the data determine d, and NLS finds it")]
    told = []
    for t in textbooks:
        scenario = files.chosen([t.scenario])[0]
        assert scenario.bound is not None
        broken = np.any([np.abs(t.estimates[:, k] - v) > FAR * scenario.bound[p]
                         for k, (p, v) in enumerate(scenario.true.items())], axis=0)
        d = t.estimates[:, 1]
        told.append(f"{t.solver}, {scenario.label}, {len(d)} seeds: "
                    f"{percent(share(int(broken.sum()), broken.size))} % far off, median d "
                    f"{digits(float(np.median(d)))}, largest {digits(float(d.max()))}")
    claims.append(Claim("IV-C", "(The same, looked at from the other side.)",
                        "NLS with SciPy's adaptive integrators over the whole interval and finite "
                        "differences, best of five: share off by more than six bounds",
                        "; ".join(told),
                        "figures like the paper's come from the integrator, not from the data"))
    return claims


def starts(maps: Mapping[str, Basin]) -> Claim:
    """How far NLS depends on its start."""
    parts = []
    for basin in maps.values():
        n = basin.right.size
        auto, m = basin.auto_right, basin.auto_right.size
        parts.append(
            f"{files.chosen([basin.scenario])[0].label}: one start finds the truth from "
            f"{percent(share(int(basin.right.sum()), n))} % of the map; of "
            f"{int((~basin.right).sum())} wrong ends χ² takes {basin.unseen} for explanations; "
            f"with further starts where χ² complains: {percent(share(int(auto.sum()), m))} %")
    return Claim("I, II-A", "Shooting is sensitive to the start.",
                 "NLS from 0.012 to 0.25 m and 0.01 to 3 N s/m", "; ".join(parts),
                 "confirmed of far starts only; at N = 51 some end at an alias (at 10 Hz, 7.65 Hz "
                 "looks like 2.35 Hz), which at 1° neither χ² nor further starts can tell")


def relaxed(sweeps: Mapping[str, Sweep]) -> list[Claim]:
    """Where relaxation helps."""
    claims = []
    for kind, names, says in (
            ("process noise", ("dense_process", "sparse_process"),
             "Relaxing the physics helps with process noise."),
            ("a model that lacks something", ("dense_drag", "dense_late"),
             "Relaxing the physics helps where the model is misspecified.")):
        parts, gains = [], []
        for name in names:
            one = sweeps[name]
            for k, p in enumerate(("l", "d")):
                rmse, hard = one.rmse(k)
                best = int(np.nanargmin(rmse))
                ratio = _ratio(one, best, k)
                gains.append(ratio[2] < 1.0)
                parts.append(f"{files.chosen([name])[0].label}, {p}: {digits(rmse[best] / hard)} "
                             f"({digits(ratio[1])} to {digits(ratio[2])}) at λ = {LAMBDAS[best]:g}")
        claims.append(Claim("II-B", says, f"{kind}: RMSE of iPDA at its best λ over that of NLS",
                            "; ".join(parts), YES if all(gains) else NO if not any(gains) else
                            f"depends on parameter and sampling: {sum(gains)} of {len(gains)}"))
    return claims


def _ratio(one: Sweep, at: int, parameter: int) -> tuple[float, float, float]:
    """RMSE of iPDA over NLS on the same seeds, with its bootstrap interval."""
    rng = np.random.default_rng(1)
    soft, hard = one.relaxed[at, :, parameter] ** 2, one.hard[:, parameter] ** 2
    drawn = rng.integers(0, soft.size, (2000, soft.size))
    ratios = np.sqrt(np.nanmean(soft[drawn], axis=1) / np.nanmean(hard[drawn], axis=1))
    low, high = np.nanpercentile(ratios, [2.5, 97.5])
    return float(np.sqrt(np.nanmean(soft) / np.nanmean(hard))), float(low), float(high)


def information(shares: list[Share], found: Found) -> list[Claim]:
    """Information partitioning, and how well the parameters are determined."""
    parts = []
    for lam in dict.fromkeys(s.lam for s in shares):
        own = [s for s in shares if s.lam == lam]
        parts.append(f"λ = {lam:g}: " + ", ".join(
            f"{s.auxiliary} unknowns ({digits(s.effective)} effective) {digits(s.stated)}"
            for s in (own[0], own[-1])))
    g = found["dense_low", "ipda", "default"]
    parts.append("λ raised until nothing moves: RMSE/CRB "
                 + with_interval(g.cells["d_theta"].ratio))
    strong = [s for s in shares if s.lam == max(x.lam for x in shares)]
    flat = max(s.stated for s in strong) < 1.2 * min(s.stated for s in strong)
    known = identifiability()
    return [
        Claim("II-E c", "Auxiliary unknowns take information away from the parameters, the more of "
              "them the more.", "standard error of d over CRB, iPDA at fixed λ on finer and finer "
              "grids, N = 501, 0.1°", "; ".join(parts),
              "depends on λ, not on the number of unknowns" if flat else YES),
        Claim("V", "With dense data the Fisher information has full rank.",
              "condition number in relative units, correlation of l and d",
              f"{digits(known['condition'])}, {digits(known['correlation'], 2)}", YES),
        Claim("III, IV-C", "d is far harder to identify than l.",
              "Cramér-Rao bound, N = 501, 0.1°, per cent of the value",
              f"l: {digits(100 * known['l_theta'])} %, d: {digits(100 * known['d_theta'])} %", YES)]


def networks(found: Found) -> list[Claim]:
    """What is said to be in the nature of networks."""
    claims = []
    paper, ours = (found.get(("dense_low", "pinn", p)) for p in ("paper", "default"))
    if paper is not None and ours is not None:
        parts, gone = [], True
        for g in (paper, ours):
            for p, name in (("l_theta", "l"), ("d_theta", "d")):
                parts.append(f"{g.protocol}, {name}: {_bias(g.cells[p])} %")
        gone = abs(ours.cells["d_theta"].bias.value) < 0.2 * abs(paper.cells["d_theta"].bias.value)
        claims.append(Claim(
            "II-E c", "PINNs have a bias by their structure: they solve a modified equation.",
            "bias at N = 501, 0.1°, Table II's descent against Gauss-Newton with exact switches",
            "; ".join(parts), "depends on switches, λ and optimiser: most of it goes" if gone
            else YES))
    return claims


def spectral(found: Mapping[str, np.ndarray]) -> Claim:
    """Networks and high frequencies."""
    network, spline = np.median(found["network"], axis=1), found["spline"]
    rises = network[-1] > 10 * network[0]
    parts = [f"{f:g} Hz: {digits(float(n))} (spline {digits(float(s))})"
             for f, n, s in zip(FREQUENCIES, network, spline, strict=True)]
    return Claim("II-D, II-E c", "Networks learn low frequencies first (spectral bias).",
                 "RMSE left of a sine of size 1 over 5 s, network of the PINN, data alone",
                 "; ".join(parts), YES if rises else NO)


def guidelines(found: Found) -> Claim:
    """Knots by the functional-data literature."""
    parts = []
    for name, protocol in (("ipda", "paper"), ("pikan", "paper"), ("ipda", "default"),
                           ("pikan", "default")):
        g = found["dense_low", name, protocol]
        parts.append(f"{name}, {protocol}: l {_bias(g.cells['l_theta'])} %, d "
                     f"{_bias(g.cells['d_theta'])} %")
    return Claim("II-E b", "Guidelines for knots of the functional-data literature carry over to "
                 "PIKANs.", "bias at N = 501, 0.1°: 80 and 40 uniform intervals against grids that "
                 "follow switches and error", "; ".join(parts),
                 "depends: for smooth inputs they may; where inputs switch, uniform knots bias "
                 "both, and a KAN as much as a spline (bias.md)")


def _bias(cell: Cell) -> str:
    return with_interval(cell.bias, 100 / cell.true)


def equivalent() -> Claim:
    """Section II-E's result."""
    rows = run_checks(quick=True).rows
    passed = sum(r.passed for r in rows)
    return Claim("II-E", "A shallow KAN without base function is iPDA's spline: one objective.",
                 "pykan's loss against Eq. (5) from SciPy's matrices (equivalence.md)",
                 f"{passed} of {len(rows)} comparisons", YES if passed == len(rows) else NO)


def runtimes(found: Found) -> list[Claim]:
    """Table III's row of times."""
    parts = []
    for name, protocol in (("pda", "paper"), ("nls", "paper"), ("ipda", "paper"), ("pinn", "paper"),
                           ("pikan", "paper"), ("pikan", "default")):
        g = found.get(("dense_low", name, protocol))
        if g is not None:
            printed = TIMES["dense_low"][name] if protocol == "paper" else np.nan
            parts.append(f"{name}, {protocol}: {digits(g.cpu)} s"
                         + (f" (paper {printed:g})" if np.isfinite(printed) else ""))
    pda, nls = found["dense_low", "pda", "paper"].cpu, found["dense_low", "nls", "default"].cpu
    scaling = []
    model = pk.systems.sloshing().with_values(l_theta=0.06, d_theta=0.05)
    for dt in (0.01, 0.001):
        drive = pk.excitation.two_pulse(dt=dt)
        rec = pk.simulate(pk.systems.sloshing(), drive, sigma=0.002, seed=0)
        pk.NLS().fit(model, rec)
        begun = time.process_time()
        pk.NLS().fit(model, rec)
        scaling.append(time.process_time() - begun)
    return [
        Claim("IV-B", "PDA is fastest (< 1 ms), then NLS (1 s); PIKAN takes more than 20 minutes.",
              "processor time of a fit, N = 501, 0.1°", "; ".join(parts),
              ("confirmed in order" if pda < nls else "not confirmed: NLS with compiled exact "
               "derivatives is the fastest") + "; PIKAN's minutes are its software's"),
        Claim("II-A", "A gradient of NLS costs in proportion to the number of steps.",
              "NLS with ten times as many samples", f"{digits(scaling[1] / scaling[0])} times the "
              "time", YES if scaling[1] / scaling[0] < 15 else NO)]


def rig() -> list[Claim]:
    """The paper's tank by linear theory, and other water that was filmed."""
    tanh = np.tanh(XI * FILL / RADIUS)
    length = RADIUS / (XI * tanh)
    frequency = np.sqrt(GRAVITY / length) / (2 * np.pi)
    used = np.sqrt(GRAVITY / 0.045) / (2 * np.pi)
    model = pk.Model.from_dict(MODELS["slosh"])
    fit = pk.NLS().fit(model, datasets.slosh_lar_forced())
    theory = np.sqrt(GRAVITY * XI / 0.049 * np.tanh(XI * 0.078 / 0.049))
    low, high = fit.interval("omega")
    h = fit.fits[0]
    explained = 100 * (1 - np.sqrt(np.mean(h.residual**2)) / np.std(h.measured))
    return [
        Claim("III", "A tank with R = 33 mm, h = 90 mm swings as a pendulum of 45 mm.",
              "linear theory of the first mode, l = R/(ξ tanh(ξh/R))",
              f"{1e3 * length:.1f} mm and {frequency:.2f} Hz, against 45 mm and {used:.2f} Hz", NO),
        Claim("III, Fig. 4", "The pendulum analogy describes the first mode of real water.",
              "another rig, filmed (R = 49 mm, h = 78 mm): NLS on one run, ω against linear theory",
              f"ω = {fit.value('omega'):.2f} ({low:.2f} to {high:.2f}) rad/s, theory {theory:.2f}; "
              f"fit {explained:.0f} %; χ²: {fit.adequacy.verdict}",
              "confirmed as to the frequency within a few per cent; not to the cameras' noise"
              if abs(fit.value("omega") / theory - 1) < 0.1 else NO)]
