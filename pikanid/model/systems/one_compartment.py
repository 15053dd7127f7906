"""A drug that is swallowed: absorption from the gut, elimination from the blood."""

from __future__ import annotations

from pikanid.model.model import Model


def one_compartment() -> Model:
    """A drug taken by mouth, whose concentration c in the blood is measured.

    m' = -k_a m,    c' = k_a m/V - k_e c,    m(0) = dose,    c(0) = 0

    The one-compartment model with first-order absorption of M. Gibaldi and D. Perrier,
    Pharmacokinetics, ch. 1.  Rates are per hour, the amount m in the gut and the volume V per
    kilogram of body weight; V is that over the share of the dose which is absorbed.  The dose is a
    channel of the recording, of which only the first value counts, so that several subjects can be
    fitted jointly.  Exchanging k_a and k_e, with V times k_e/k_a, gives the same c: the guesses say
    that absorption is the faster one.

    >>> one_compartment().free_names
    ('k_a', 'k_e', 'V')
    """
    return Model.from_dict({
        "name": "one_compartment",
        "domain": "kinetics",
        "states": {"m": {"unit": "mg/kg", "initial": "dose"}, "c": {"unit": "mg/l"}},
        "inputs": {"dose": {"unit": "mg/kg"}},
        "parameters": {
            "k_a": {"unit": "1/h", "guess": 1.5, "bounds": [1e-3, 1e3],
                    "description": "absorption"},
            "k_e": {"unit": "1/h", "guess": 0.08, "bounds": [1e-5, 1e2],
                    "description": "elimination"},
            "V": {"unit": "l/kg", "guess": 0.5, "bounds": [1e-3, 1e4],
                  "description": "volume of distribution over the share that is absorbed"}},
        "equations": {"m": "-k_a*m", "c": "k_a*m/V - k_e*c"},
        "outputs": {"c": {"unit": "mg/l", "expression": "c"}}})
