"""Two tanks above each other, filled by a pump: free outlets, no overflow."""

from __future__ import annotations

from pikanid.model.model import Model


def cascaded_tanks() -> Model:
    """Two tanks above each other and a pump, by Torricelli's law; the lower level is measured.

    x1' = -k1 √x1 + k4 u,    x2' = k1 √x1 - k3 √x2,    h = x2

    M. Schoukens and J. P. Noël, Three benchmarks addressing open challenges in nonlinear system
    identification, IFAC-PapersOnLine 50-1 (2017), the cascaded tanks without their overflow.  The
    level x2 is in volts of its sensor, u in volts of the pump.  The upper level is not seen, so
    that its scale is free: that in which the upper outlet and the lower inlet have one constant k1.
    √x is ``signed_power(x, 0.5)``, which has a value and a finite slope in an empty tank as well.

    >>> cascaded_tanks().free_names
    ('k1', 'k3', 'k4', 'x1_0', 'x2_0')
    """
    return Model.from_dict({
        "name": "cascaded_tanks",
        "domain": "hydraulics",
        "states": {"x1": {"unit": "V", "initial": "free", "guess": 5.0, "bounds": [0.01, 80.0]},
                   "x2": {"unit": "V", "initial": "free", "guess": 5.2, "bounds": [0.01, 12.0]}},
        "inputs": {"u": {"unit": "V"}},
        "parameters": {
            "k1": {"unit": "V^0.5/s", "guess": 0.055, "bounds": [0.001, 1.0],
                   "description": "outlet of the upper tank = inlet of the lower one"},
            "k3": {"unit": "V^0.5/s", "guess": 0.06, "bounds": [0.001, 1.0],
                   "description": "outlet of the lower tank"},
            "k4": {"unit": "1/s", "guess": 0.04, "bounds": [0.001, 1.0],
                   "description": "pump"}},
        "equations": {
            "x1": "-k1*signed_power(x1, 0.5) + k4*u",
            "x2": "k1*signed_power(x1, 0.5) - k3*signed_power(x2, 0.5)"},
        "outputs": {"h": {"unit": "V", "expression": "x2"}}})
