"""Doctests of modules that need torch and pykan are left out where these are not installed."""

from __future__ import annotations

from importlib.util import find_spec

collect_ignore_glob = (
    []
    if find_spec("torch") and find_spec("kan")
    else [
        "pikanid/approximators/kan/*.py",
        "pikanid/approximators/mlp.py",
        "pikanid/equivalence/*.py",
        "pikanid/optimise/gradient*.py",
        "pikanid/simulation/torch_field.py",
        "pikanid/strategies/pinn*.py",
    ]
)
