"""An epidemic in a closed population."""

from __future__ import annotations

from pikanid.model.model import Model


def sir() -> Model:
    """An epidemic, S' = -β S I/N, I' = β S I/N - γ I, R' = γ I, whose infectious I are counted.

    W. O. Kermack and A. G. McKendrick, A contribution to the mathematical theory of epidemics,
    Proc. R. Soc. London A 115 (1927) 700-721, Eq. (29), with κ = β/N.  Rates are per day; N, the
    size of the population, has to be known: it is that of the boarding school in the British
    Medical Journal of 4 March 1978, p. 587.  I0 people are infectious at the first instant.

    >>> sir().free_names
    ('beta', 'gamma', 'I0')
    """
    return Model.from_dict({
        "name": "sir",
        "domain": "populations",
        "states": {"S": {"initial": "N - I0"}, "I": {"initial": "I0"}, "R": {}},
        "parameters": {
            "beta": {"unit": "1/d", "guess": 1.7, "bounds": [1e-3, 1e3],
                     "description": "infections a day by one infectious person at the outset"},
            "gamma": {"unit": "1/d", "guess": 0.45, "bounds": [1e-3, 1e3],
                      "description": "removal of the infectious"},
            "I0": {"guess": 3.0, "bounds": [1e-6, 1e9],
                   "description": "infectious at the first instant"},
            "N": {"value": 763.0, "description": "size of the population"}},
        "equations": {"S": "-beta*S*I/N", "I": "beta*S*I/N - gamma*I", "R": "gamma*I"},
        "outputs": {"I": {"expression": "I"}}})
