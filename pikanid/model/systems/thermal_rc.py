"""A heated room with one thermal resistance and one capacity."""

from __future__ import annotations

from pikanid.model.model import Model


def thermal_rc() -> Model:
    """A heated room, C T' = (T_a - T)/R + P, whose temperature is measured.

    The simplest of the models compared by P. Bacher and H. Madsen, Identifying suitable models for
    the heat dynamics of buildings, Energy and Buildings 43 (2011) 1511-1522: one capacity C behind
    one resistance R, ambient temperature T_a and heating power P.  Guesses are those of a house
    with a time constant R C of 50 h.

    >>> thermal_rc().free_names
    ('R', 'C', 'T_0')
    """
    return Model.from_dict({
        "name": "thermal_rc",
        "states": {"T": {"unit": "degC", "initial": "free", "guess": 20.0,
                         "bounds": [-60.0, 300.0]}},
        "inputs": {"T_a": {"unit": "degC"}, "P": {"unit": "W"}},
        "parameters": {
            "R": {"unit": "K/W", "guess": 0.005, "bounds": [1e-6, 1e4],
                  "description": "thermal resistance to the ambient"},
            "C": {"unit": "J/K", "guess": 3.6e7, "bounds": [1e-2, 1e12],
                  "description": "heat capacity"}},
        "equations": {"T": "(T_a - T)/(R*C) + P/C"},
        "outputs": {"T": {"unit": "degC", "expression": "T"}}})
