"""How far parameters can be trusted: Fisher information, Cramér-Rao bound, profile likelihood."""

from pikanid.uncertainty.bound import CramerRao, cramer_rao
from pikanid.uncertainty.information import (
    Partition,
    covariance,
    identifiability_warnings,
    information_partition,
)
from pikanid.uncertainty.profile_likelihood import Profile, profile

__all__ = [
    "CramerRao",
    "Partition",
    "Profile",
    "covariance",
    "cramer_rao",
    "identifiability_warnings",
    "information_partition",
    "profile",
]
