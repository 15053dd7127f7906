"""Set-up shared by all tests: a headless plot backend, repeatable property tests, fixtures."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Set before anything imports matplotlib, and inherited by the command lines that tests start.
os.environ["MPLBACKEND"] = "Agg"

# The same examples in every run: a red run can be repeated, and a green one means what it says.
# No deadline, because the first call of a generated function includes compiling it.
settings.register_profile(
    "repeatable",
    deadline=None,
    derandomize=True,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what needs torch and pykan where the `kan` extra is not installed."""
    if find_spec("torch") is not None and find_spec("kan") is not None:
        return
    missing = pytest.mark.skip(reason="needs the `kan` extra: pip install 'pikanid[kan]'")
    for item in items:
        if item.get_closest_marker("kan") is not None:
            item.add_marker(missing)


@pytest.fixture(scope="session")
def recordings_folder() -> Path:
    """The folder of real recordings; skips the test where there is none."""
    folder = os.environ.get("PIKANID_DATA")
    if not folder or not Path(folder).is_dir():
        pytest.skip("real recordings: set PIKANID_DATA to the folder that holds them")
    return Path(folder)
