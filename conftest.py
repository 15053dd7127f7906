"""For tests and doctests alike: which are left out or have their turn, and how models are run."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec

import pytest

collect_ignore_glob = (
    []
    if find_spec("torch") and find_spec("kan")
    else [
        "pikanid/approximators/kan/*.py",
        "pikanid/approximators/mlp.py",
        "pikanid/validation/equivalence/*.py",
        "pikanid/optimise/gradient*.py",
        "pikanid/simulation/torch_field.py",
        "pikanid/strategies/pinn*.py",
    ]
)
USED = "pikanid.simulation.simulator.compiled"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Turns of slow tests."""
    parser.addoption("--slow-part", metavar="K/N", help="of N parts of equal length the K-th only")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what has its turn another time; of what is selected only, hence last."""
    from turns import keep_part

    keep_part(config, items)


@pytest.fixture(scope="session", autouse=True)
def models_from_tapes() -> Iterator[None]:
    """Compiling every model of every test would take most of the session."""
    from interpreted import from_tapes

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(USED, from_tapes)
        yield


@pytest.fixture(autouse=True)
def compiled_where_marked(
        request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests marked `compiled` are about compiled models."""
    if request.node.get_closest_marker("compiled") is not None:
        from pikanid.simulation.compiled import compiled

        monkeypatch.setattr(USED, compiled)
