"""Figures: what they show, and that they leave matplotlib's state alone."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pikanid import errors
from pikanid.estimate.data import Fit
from pikanid.estimate.plots import plot_fits, plot_strategies
from pikanid.figures import ENDINGS, image, save_figure

T = np.linspace(0.0, 2.0, 81)
FIT = Fit("run", "theta", "rad", T, np.sin(T), np.sin(T) + 0.01, np.full(81, 0.02))


def test_one_row_an_output_with_units() -> None:
    figure = plot_fits([FIT, replace(FIT, output="x", unit="")], "title")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["theta [rad]", "residual [rad]", "x [-]", "residual [-]"]
    assert figure.axes[2].get_xlabel() == "time [s]"
    assert figure.get_suptitle() == "title"


def test_residual_is_measured_minus_fitted_with_a_band_of_two_sigma() -> None:
    right = plot_fits([FIT]).axes[1]
    assert np.allclose(right.lines[0].get_ydata(), -0.01)
    (band,) = right.collections
    assert band.get_paths()[0].vertices[:, 1].max() == pytest.approx(0.04)


def test_no_band_without_sigma() -> None:
    assert len(plot_fits([replace(FIT, sigma=None)]).axes[1].collections) == 0


def test_recordings_are_named_where_there_are_several() -> None:
    figure = plot_fits([FIT, replace(FIT, recording="other")])
    assert [figure.axes[k].get_title(loc="left") for k in (1, 3)] == ["run", "other"]


def test_unsorted_samples_are_drawn_in_the_order_of_time() -> None:
    back = replace(FIT, t=T[::-1], measured=FIT.measured[::-1], fitted=FIT.fitted[::-1])
    curve = plot_fits([back]).axes[0].lines[1]
    assert np.all(np.diff(np.asarray(curve.get_xdata())) > 0)


def test_strategies_share_axes_and_differ_in_looks() -> None:
    figure = plot_strategies({"nls": [FIT], "ipda": [FIT]})
    curves = figure.axes[0].lines
    assert [curve.get_label() for curve in curves] == ["measured", "nls", "ipda"]
    assert curves[1].get_color() != curves[2].get_color()
    assert curves[1].get_linestyle() != curves[2].get_linestyle()


def test_nothing_to_draw_is_an_empty_figure() -> None:
    assert plot_fits([]).axes == []


def test_names_are_not_read_as_formulas() -> None:
    image(plot_fits([replace(FIT, output=r"$\frac{1}", unit="")]))


def test_a_notebook_shows_the_figure() -> None:
    assert plot_fits([FIT])._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize("ending", ENDINGS)
def test_figures_are_written_whole(tmp_path: Path, ending: str) -> None:
    save_figure(plot_fits([FIT]), tmp_path / f"fit{ending}")
    assert [path.name for path in tmp_path.iterdir()] == [f"fit{ending}"]
    start = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[ending]
    assert (tmp_path / f"fit{ending}").read_bytes().startswith(start)


def test_wrong_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(errors.BadSetting, match=r"\.png or \.svg"):
        save_figure(plot_fits([FIT]), tmp_path / "fit.gif")
    assert list(tmp_path.iterdir()) == []


def test_the_same_figure_gives_the_same_image() -> None:
    assert image(plot_fits([FIT])) == image(plot_fits([FIT]))


def test_pyplot_and_settings_are_left_alone() -> None:
    code = """
import sys, matplotlib
before = dict(matplotlib.rcParams)
import numpy as np
from pikanid.estimate.data import Fit
from pikanid.estimate.plots import plot_fits
from pikanid.figures import image
t = np.linspace(0, 1, 20)
image(plot_fits([Fit('run', 'y', 'm', t, t, t)]))
assert 'matplotlib.pyplot' not in sys.modules
assert dict(matplotlib.rcParams) == before
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_a_single_fit_shows_its_band_with_the_noise() -> None:
    figure = plot_fits([replace(FIT, spread=np.full(81, 0.01))])
    (band,) = figure.axes[0].collections
    edges = band.get_paths()[0].vertices
    at = np.isclose(edges[:, 0], T[40])
    assert np.ptp(edges[at, 1]) == pytest.approx(2 * 1.96 * np.hypot(0.01, 0.02))
    assert [t.get_text() for t in figure.axes[0].get_legend().get_texts()] == [
        "measured", "95 % band", "fitted"]
    unknown = plot_fits([replace(FIT, sigma=None, spread=np.full(81, 0.01))]).axes[0]
    assert "95 % of the parameters" in [t.get_text() for t in unknown.get_legend().get_texts()]
    both = plot_strategies({"a": [replace(FIT, spread=np.full(81, 0.01))], "b": [FIT]})
    assert not both.axes[0].collections
