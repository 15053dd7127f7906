"""Thresholds that follow from error rates."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np


def quantile(rate: float) -> float:
    """z with Φ(z) = 1 - rate: standard errors that chance exceeds on one side at a rate.

    >>> round(quantile(0.05), 3), round(quantile(0.01), 3)
    (1.645, 2.326)
    """
    return -NormalDist().inv_cdf(rate)  # the tail itself: 1 - rate has no digits left for it


def least_proof(alpha: float, power: float) -> float:
    """χ² that an effect must be worth in held-out recordings for these to prove anything.

    Of two predictions that lie √λ standard deviations apart, the wrong one is refused at the level
    α with a probability of Φ(√λ - z(1-α)) (J. Neyman and E. S. Pearson, Phil. Trans. A 231, 1933),
    which has to be the power:  λ = (z(1-α) + z(power))².

    Args:
        alpha: Rate of false alarms.
        power: Probability with which an effect that is not there must be refuted.

    >>> round(least_proof(0.01, 0.9), 1)
    13.0
    """
    return max(NormalDist().inv_cdf(power) + quantile(alpha), 0.0) ** 2


def visible(alpha: float, power: float, signs: int) -> float:
    """Standard errors from which on an effect is found with a given power.

    The largest of m signs counts: by chance one of them passes z(1 - α/m) at the rate α
    (Bonferroni); an effect does with a probability of Φ(D - z(1 - α/m)).  To one decimal, as the
    number of independent signs is known by its order only.

    >>> visible(0.01, 0.9, 100)
    5.0
    """
    return round(NormalDist().inv_cdf(power) + quantile(alpha / signs), 1)


def separated(confusion: float) -> float:
    """Distance [σ] from which on two hypotheses are told apart.

    Between two that lie D apart the likelihood ratio errs with a probability of Φ(-D/2), whichever
    is true (J. Neyman and E. S. Pearson, Phil. Trans. A 231, 1933).  To one decimal.

    >>> separated(0.023)
    4.0
    """
    return round(2 * quantile(confusion), 1)


def excess(rate: float) -> float:
    """Standard errors by which the noise's power may be larger than it seems, at a rate: z(1-rate),
    to two decimals.

    >>> excess(0.05)
    1.64
    """
    return round(quantile(rate), 2)


def contradiction(rate: float) -> float:
    """Log-likelihood that a noise level may cost where noise was sure.

    Twice the cost of two parameters, level and colour, is χ² of two degrees of freedom (S. S.
    Wilks, Ann. Math. Stat. 9, 1938), and beyond x with a probability of exp(-x/2): -ln(rate), to
    one decimal.

    >>> contradiction(0.01)
    4.6
    """
    return round(-float(np.log(rate)), 1)


def bic(rows: float) -> float:
    """Log-likelihood that one more parameter must gain on so many rows: ln(N)/2 (G. Schwarz, Ann.
    Stat. 6, 1978).
    """
    return 0.5 * float(np.log(rows))


def price(parameters: int, effects: int, rows: int, choices: int, weight: float) -> float:
    """χ² that effects must gain: the extended Bayesian information criterion.

    ln N for each parameter, and 2γ ln P for each effect, chosen among P (J. Chen and Z. Chen,
    Biometrika 95, 2008).

    Args:
        parameters: Of all effects.
        effects: Their number.
        rows: N.
        choices: P.
        weight: γ.
    """
    return parameters * float(np.log(rows)) + 2 * weight * effects * float(np.log(max(choices, 1)))


def dominance(chance: float, spread: float) -> float:
    """κ that a family that is not there exceeds at a rate: ln κ is half-normal, with a spread.

    >>> round(dominance(0.002, 0.45), 1)
    4.0
    """
    return float(np.exp(spread * quantile(chance / 2)))


def odds_against(share: float) -> float:
    """Difference of the criterion at which one hypothesis has that share of another one's weight.

    -2 ln(share): the criterion is -2 ln of the posterior weight but for a constant (R. E. Kass and
    A. E. Raftery, J. Am. Stat. Assoc. 90, 1995).  To one decimal.

    >>> odds_against(0.01)
    9.2
    """
    return round(-2 * float(np.log(share)), 1)
