"""Reactions in series in a stirred batch reactor."""

from __future__ import annotations

from pikanid.model.model import Model


def batch_reactor() -> Model:
    """A -> B -> C in a stirred batch reactor at one temperature; A, B and C are measured.

    a' = -k1 a,    b' = k1 a - k2 b,    c' = k2 b

    Mass action: O. Levenspiel, Chemical Reaction Engineering, ch. 3, irreversible reactions in
    series.  Concentrations are in mol/l, rates per minute; a0 is that of A at the first instant,
    when there is neither B nor C.  a + b + c stays as it is.

    >>> batch_reactor().free_names
    ('k1', 'k2', 'a0')
    """
    return Model.from_dict({
        "name": "batch_reactor",
        "states": {"a": {"unit": "mol/l", "initial": "a0"}, "b": {"unit": "mol/l"},
                   "c": {"unit": "mol/l"}},
        "parameters": {
            "k1": {"unit": "1/min", "guess": 0.2, "bounds": [1e-9, 1e9],
                   "description": "rate of A -> B"},
            "k2": {"unit": "1/min", "guess": 0.05, "bounds": [1e-9, 1e9],
                   "description": "rate of B -> C"},
            "a0": {"unit": "mol/l", "guess": 1.0, "bounds": [1e-12, 1e6],
                   "description": "A at the first instant"}},
        "equations": {"a": "-k1*a", "b": "k1*a - k2*b", "c": "k2*b"},
        "outputs": {name: {"unit": "mol/l", "expression": name} for name in ("a", "b", "c")}})
