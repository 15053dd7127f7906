"""What is missing in a model?  Detected, located, named, modelled, proved."""

from pikanid.mismatch.api import diagnose
from pikanid.mismatch.result import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
