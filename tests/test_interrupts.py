"""Interrupts that arrive where Python drops them, or that turn into other errors."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator

import pytest

from pikanid import cli
from pikanid.commands import interrupts


class Dropping:
    """An object whose end is interrupted."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.001)  # where Python looks for signals


@pytest.fixture
def heard() -> Iterator[None]:
    """Interrupts count, also where the tests run in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_an_interrupt_in_a_finaliser_ends_the_block() -> None:
    with pytest.raises(KeyboardInterrupt), interrupts.none_lost():
        Dropping()
        for _ in range(200):
            time.sleep(0.01)
        pytest.fail("the interrupt was lost")


def test_other_errors_in_a_finaliser_are_still_told() -> None:
    class Failing:
        def __del__(self) -> None:
            raise ValueError("told")

    seen = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sys.unraisablehook", seen.append)
        with interrupts.none_lost():
            Failing()
    assert [u.exc_type for u in seen] == [ValueError]


def broken_by(first: BaseException) -> Exception:
    try:
        try:
            raise first
        except BaseException:
            raise ImportError("half a library")  # noqa: B904
    except ImportError as failure:
        return failure


def test_what_an_interrupt_became_is_known_by_its_chain() -> None:
    assert interrupts.became(broken_by(KeyboardInterrupt()))
    assert not interrupts.became(broken_by(ValueError()))
    assert not interrupts.became(None)


def test_a_command_that_breaks_by_an_interrupt_is_interrupted(
        monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def app(**_: object) -> int:
        raise broken_by(KeyboardInterrupt())

    monkeypatch.setattr(cli, "app", app)
    assert cli.main(["models"]) == 130
    assert capsys.readouterr().err == "Interrupted.\n"
