"""Prey and predators."""

from __future__ import annotations

from pikanid.model.model import Model


def lotka_volterra() -> Model:
    """Prey and predators, x' = α x - β x y and y' = δ x y - γ y, both counted.

    A. J. Lotka, Elements of Physical Biology (1925); V. Volterra, Fluctuations in the abundance of
    a species considered mathematically, Nature 118 (1926) 558-560.  Rates are per year; counts have
    any unit (guesses are thousands of pelts of hares and lynx).  δ x + β y - γ ln x - α ln y stays
    as it is along a solution.

    >>> lotka_volterra().parameter("alpha").unit
    '1/yr'
    """
    return Model.from_dict({
        "name": "lotka_volterra",
        "domain": "populations",
        "states": {"prey": {"initial": "free", "guess": 30.0, "bounds": [1e-6, 1e12]},
                   "predators": {"initial": "free", "guess": 5.0, "bounds": [1e-6, 1e12]}},
        "parameters": {
            "alpha": {"unit": "1/yr", "guess": 0.5, "bounds": [1e-4, 1e4],
                      "description": "growth of the prey"},
            "beta": {"unit": "1/yr", "guess": 0.025, "bounds": [1e-12, 1e4],
                     "description": "loss of prey for each predator"},
            "gamma": {"unit": "1/yr", "guess": 0.8, "bounds": [1e-4, 1e4],
                      "description": "death of the predators"},
            "delta": {"unit": "1/yr", "guess": 0.025, "bounds": [1e-12, 1e4],
                      "description": "growth of the predators for each prey"}},
        "equations": {"prey": "alpha*prey - beta*prey*predators",
                      "predators": "delta*prey*predators - gamma*predators"},
        "outputs": {"prey": {"expression": "prey"}, "predators": {"expression": "predators"}}})
