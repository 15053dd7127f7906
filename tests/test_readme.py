"""The README's examples work as printed."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import pikanid as pk
from pikanid.recording.formats import FORMATS
from pikanid.strategies import STRATEGIES

README = (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8")


def block(language: str, after: str = "# pikanid") -> str:
    """The first fenced block of a language after some words."""
    rest = README[README.index(after):]
    found = re.search(rf"^```{language}\n(.*?)^```$", rest, re.MULTILINE | re.DOTALL)
    assert found, f"README has no {language} block"
    return found[1]


def test_python_example(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(block("python", "## In Python"), "README.md", "exec"), names)
    estimate = names["estimate"]
    assert isinstance(estimate, pk.Estimate)
    assert abs(estimate.value("l_theta") - 0.045) < 5 * estimate.std("l_theta")
    assert "l_theta" in capsys.readouterr().out


def test_first_screen_shows_a_diagnosis_of_what_is_shipped() -> None:
    root = Path(__file__).resolve().parents[1]
    first = README[:README.index("## Install")]
    words = block("sh").split()
    assert words[:2] == ["pikanid", "diagnose"]
    for word in words:
        assert (root / word).is_file() or not word.endswith(".csv")
    picture = re.search(r"!\[[^]]+\]\(([^)]+)\)", first)
    assert picture and (root / picture[1]).read_bytes().startswith(b"\x89PNG")


def test_model_file() -> None:
    model = pk.Model.from_dict(tomllib.loads(block("toml")))
    assert model.free_names == ("l",)


def test_commands_are_make_targets() -> None:
    targets = set(re.findall(r"^make (\S+)", README, re.MULTILINE))
    makefile = (Path(__file__).resolve().parents[1] / "Makefile").read_text(encoding="utf-8")
    assert targets == {"study", "test"}
    assert targets <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))


def test_every_strategy_and_every_format_is_named() -> None:
    table = README.split("| strategy | what it does |")[1].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(STRATEGIES.values())
    reads = README.split("reads your own file:")[1].split("\n\n")[0]
    assert [f.title for f in FORMATS if f.title not in reads] == []


def test_every_ready_made_model_is_named() -> None:
    listed = README.split("Ready-made are ")[1].split(";")[0]
    assert re.findall(r"`(\w+)`", listed) == list(pk.systems.SYSTEMS)


@pytest.mark.parametrize("name", ["rotors.toml", "mount.toml"])
def test_effects_of_ones_own(name: str, tmp_path: Path) -> None:
    """Each changes what the model shows."""
    found = re.search(rf"^```toml\n(# {name}\n.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert found
    (tmp_path / name).write_text(found[1], "utf-8")
    (effect,) = pk.read_effects(tmp_path / name)
    assert isinstance(effect, pk.Effect)
    model, drive = pk.systems.sloshing(), pk.excitation.two_pulse()
    without, with_it = (pk.simulate(m, drive)["theta"].values
                        for m in (model, model.with_effect(effect)))
    assert abs(with_it - without).max() > 1e-3
