"""What can be wrong with an estimate."""

from __future__ import annotations


def undetermined(name: str, value: float, std: float) -> str:
    return (f"The recording does not determine '{name}': its standard error ({std:.2g}) is far "
            f"larger than its value ({value:.3g}).  Fix it, or excite what depends on it.")



def at_bound(name: str, value: str, lower: bool) -> str:
    return (f"'{name}' ended at its {'lower' if lower else 'upper'} bound ({value}); its standard "
            "error is not known.  Widen the bound, unless it is one that physics sets.")


def sigma_unknown(output: str) -> str:
    return (f"The noise of output '{output}' is not known: give it in the output's unit (--sigma "
            "0.1; in Python sigma=0.1).")


def no_influence(name: str) -> str:
    return f"'{name}' has no influence on what was measured: fix it, or measure something else."


def unidentifiable(combination: str, condition: float) -> str:
    return (f"The data do not determine the combination {combination} (condition {condition:.1g}): "
            "fix one of these parameters or excite the system differently.")
