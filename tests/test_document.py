"""The page in a real browser: nothing fetched, nothing on the console, nothing sticks out."""

from __future__ import annotations

import re
import shutil
import subprocess
from html import escape
from pathlib import Path

import pytest

import pikanid as pk
from pikanid.model.systems import sloshing
from pikanid.reporting.document import document
from pikanid.reporting.validation_page import page

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
               None)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--enable-logging=stderr", "--virtual-time-budget=4000", "--dump-dom")


def seen(html: str, width: int, folder: Path) -> tuple[int, str]:
    """By how much the page is wider than a window of that width, and what the console says."""
    if BROWSER is None:
        pytest.skip("no Chromium on this machine")
    frame = folder / "frame.html"
    frame.write_text(
        f'<!doctype html><iframe width="{width}" height="800" style="border:0" '
        f'srcdoc="{escape(html)}"></iframe><p id="wide"></p><script>onload = () => {{'
        'const inner = document.querySelector("iframe").contentDocument.documentElement;'
        'document.querySelector("#wide").textContent = "OVER" + '
        "(inner.scrollWidth - inner.clientWidth); }</script>",
        encoding="utf-8")
    ran = subprocess.run([BROWSER, *FLAGS, f"--user-data-dir={folder / 'profile'}",
                          frame.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    found = re.search(r'<p id="wide">OVER(\d+)', ran.stdout)
    assert found is not None, ran.stderr
    return int(found[1]), "\n".join(x for x in ran.stderr.splitlines() if ":CONSOLE" in x)


@pytest.fixture(scope="module")
def validation() -> str:
    model = sloshing()
    run = pk.simulate(model, pk.excitation.multisine(duration=4), sigma=2e-3, seed=1)
    return page(pk.validate(model, run), "a run <of> " + "a_very_long_name" * 8)


@pytest.mark.parametrize("width", [360, 1280])
def test_a_page_fits_its_window_and_asks_for_nothing(validation: str, width: int,
                                                     tmp_path: Path) -> None:
    too_wide, console = seen(validation, width, tmp_path)
    assert too_wide == 0 and not console


@pytest.mark.parametrize("part", ["<div style='width:900px'>x</div>",
                                  "<img src='https://example.org/x.png' alt=''>"])
def test_what_sticks_out_or_is_fetched_is_noticed(part: str, tmp_path: Path) -> None:
    too_wide, console = seen(document("wrong", [part]), 360, tmp_path)
    assert too_wide > 0 or "Content Security Policy" in console


def test_text_is_text_and_every_picture_is_inside(validation: str) -> None:
    assert "<of>" not in validation and "&lt;of&gt;" in validation
    sources = re.findall(r'src="([^"]{20})', validation)
    assert sources and all(s.startswith("data:image/svg+xml") for s in sources)
    assert "<script" not in validation
