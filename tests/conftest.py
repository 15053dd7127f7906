"""Set-up shared by all tests: a headless plot backend, repeatable property tests, fixtures."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from commandline import SIGMA, Run
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from pikanid import Recording

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


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command line in an empty folder: (exit code, stdout, stderr)."""
    from pikanid.cli import main

    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(words)
        found = capsys.readouterr()
        return code, found.out, found.err

    return call


@pytest.fixture(scope="session")
def noisy() -> Recording:
    """A noisy recording of the slosh pendulum."""
    import pikanid as pk

    return pk.simulate(pk.systems.sloshing(), pk.excitation.two_pulse(), sigma=SIGMA, seed=0)


@pytest.fixture
def recorded(noisy: Recording, tmp_path: Path) -> str:
    """The name of that recording in the current folder."""
    noisy.write(tmp_path / "run.csv")
    return "run.csv"


@pytest.fixture
def read(tmp_path: Path) -> Any:
    """Writes text or bytes to a file and reads it as a recording."""
    from pikanid.recording import Recording

    def go(content: str | bytes, name: str = "run.csv", **settings: Any) -> Recording:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return Recording.read(path, **settings)

    return go
