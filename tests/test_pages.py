"""All pages in a real browser: phone and desktop, light, dark and print; nothing is fetched."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pikanid as pk
from pikanid.model import systems
from pikanid.reporting import diagnosis_page, estimate_page, study_page, validation_page
from pikanid.reporting.document import document
from pikanid.reporting.study_figures import figures
from pikanid.reporting.study_report import parts
from pikanid.validation.study import pendulum, run

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
         "--disable-background-networking", "--disable-component-update")
PAGES = ("identify", "identify all", "validate", "diagnose", "study")
# What is outside the window although it is in none of the boxes that are scrolled by themselves.
OUTSIDE = """() => [...document.querySelectorAll("body *")].filter(e => {
    if (e.closest(".wide, .figure") && !e.matches(".wide, .figure")) return false;
    const box = e.getBoundingClientRect();
    return box.width && (box.right > innerWidth + 1 || box.left < -1); }).length"""
BROKEN = "() => [...document.images].filter(i => !i.complete || !i.naturalWidth).length"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    library = pytest.importorskip("playwright.sync_api", reason="no playwright: extra dev")
    if BROWSER is None:
        pytest.skip("no Chromium on this machine")
    with library.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=BROWSER, args=list(FLAGS))
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    """One of every kind; the diagnosis is of a simulated pendulum with dry friction."""
    model = systems.sloshing()
    runs = [pk.simulate(model, drive, sigma=2e-3, seed=k) for k, drive in enumerate(
        (pk.excitation.two_pulse(), pk.excitation.multisine(duration=4)))]
    fits = [pk.NLS().fit(model, runs), pk.IPDA().fit(model, runs)]
    long = "a run <of> " + "a_very_long_name" * 8
    scored = pk.validate({"fit": fits[0], "nominal": model}, runs[1], training=runs[0])
    swinging = systems.pendulum().with_values(l=0.25, d=0.05, theta_0=1.0).with_term(
        "theta_dot", "-c*sign(theta_dot)", [pk.Parameter("c", 0.3, "rad/s^2")])
    t = np.arange(0.0, 9.0, 0.02)
    whole = pk.simulate(swinging, pk.Recording.from_arrays(
        t, {"theta": np.zeros(len(t))}, {"theta": "rad"}), sigma=0.002, seed=0)
    study = run.run(seeds=3, strategies=("nls", "ipda"), swing=pendulum.Swing(
        whole.window(0.0, 5.99), whole.window(6.0, 9.0)))
    return {
        "identify": estimate_page.page(fits[:1], {}, long),
        "identify all": estimate_page.page(fits, {"pda": "the reason"}, long),
        "validate": validation_page.page(scored, long, {"fit": fits[0], "nominal": model}),
        "diagnose": diagnosis_page.page(study.diagnosis, long),
        "study": study_page.page(parts(study), figures(study), figures(study, narrow=True))}


def opened(browser: Any, html: str, folder: Path, width: int, scheme: str
           ) -> tuple[Any, list[str], list[str]]:
    """The page in a window, what its console said, and what it asked the network for."""
    file = folder / "page.html"
    file.write_text(html, encoding="utf-8")
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    return page, said, [u for u in asked if not u.startswith(("data:", "file:"))]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_in_a_browser(browser: Any, pages: dict[str, str], tmp_path: Path, name: str,
                             width: int, scheme: str) -> None:
    page, said, asked = opened(browser, pages[name], tmp_path, width, scheme)
    try:
        assert not said and not asked
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate(OUTSIDE) == 0
        assert page.evaluate(BROKEN) == 0
        shade = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (shade == "rgb(255, 255, 255)") == (scheme == "light")
    finally:
        page.close()


@pytest.mark.parametrize("name", PAGES)
def test_a_phone_gets_figures_of_its_own(browser: Any, pages: dict[str, str], tmp_path: Path,
                                         name: str) -> None:
    """None has to be scrolled, and its letters are as large as those of a footnote."""
    page, *_ = opened(browser, pages[name], tmp_path, 360, "light")
    try:
        assert page.evaluate('() => [...document.querySelectorAll(".figure")].every('
                             "f => f.scrollWidth <= f.clientWidth)")
        assert page.evaluate("() => [...document.images].every(i => i.naturalWidth < 450)")
    finally:
        page.close()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_printed(browser: Any, pages: dict[str, str], tmp_path: Path, name: str) -> None:
    page, said, _ = opened(browser, pages[name], tmp_path, 1280, "dark")
    try:
        printed = page.pdf(format="A4")
        assert printed.startswith(b"%PDF") and not said
        assert 1 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 12
    finally:
        page.close()


@pytest.mark.parametrize("part", ["<div style='width:900px'>x</div>",
                                  "<img src='https://example.org/x.png' alt=''>"])
def test_what_sticks_out_or_is_fetched_is_noticed(browser: Any, tmp_path: Path, part: str) -> None:
    page, said, asked = opened(browser, document("wrong", [part]), tmp_path, 360, "light")
    try:
        assert page.evaluate(OUTSIDE) > 0 or said or asked
    finally:
        page.close()


def test_text_is_text_and_every_picture_is_inside(pages: dict[str, str]) -> None:
    for html in (pages["identify"], pages["validate"], pages["diagnose"]):
        assert "<of>" not in html and "&lt;of&gt;" in html
        sources = re.findall(r'src(?:set)?="([^"]{20})', html)
        assert sources and all(s.startswith("data:image/svg+xml") for s in sources)
        assert "<script" not in html


def test_numbers_are_printed_as_in_books(pages: dict[str, str]) -> None:
    for html in pages.values():
        words = re.sub(r"<style>.*?</style>|<code>.*?</code>|src(set)?=\"[^\"]*\"|<pre>.*?</pre>",
                       "", html, flags=re.DOTALL)
        assert re.findall(r"(?<![\w.])\d+(?:\.\d+)?e[+-]\d+", words) == []
        assert "N*s/m" not in words and "^2" not in words
