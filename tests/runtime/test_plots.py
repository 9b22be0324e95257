"""What is drawn: panels by unit, names and units on the axes, legends beside the data, and thinning that keeps extremes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.runtime import plots
from tests.runtime.scenes import flyer, pendulum


def test_a_file_for_each_kind_of_quantity(tmp_path: Path) -> None:
    assert [path.name for path in plots.draw(flyer().simulate(0.05, 1e-3), tmp_path)] == [
        "coordinates.png",
        "velocities.png",
        "energy.png",
    ]
    names = [path.name for path in plots.draw(pendulum().simulate(0.05, 1e-3), tmp_path)]
    assert names == ["coordinates.png", "velocities.png", "outputs.png", "energy.png"]


def test_curves_share_panels_with_their_unit_only() -> None:
    curves = [plots.Curve(f"c{index}", "rad" if index < 14 else "m", np.zeros(3)) for index in range(16)]
    panels = plots._panels(curves)
    assert [len(panel) for panel in panels] == [5, 5, 4, 2]
    assert all(len({curve.unit for curve in panel}) == 1 for panel in panels)


def test_thinning_keeps_ends_and_extremes() -> None:
    t = np.linspace(0.0, 1.0, 200_001)
    values = np.sin(40_000.0 * t)
    values[123_456] = 7.0
    short_t, short = plots._thinned(t, values)
    assert len(short_t) <= 2 * plots._POINTS + 2
    assert short.max() == 7.0 and (short_t[0], short_t[-1]) == (0.0, 1.0)
    assert np.all(np.diff(short_t) > 0.0)


def test_axes_carry_quantities_and_legends_stay_outside() -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axis = figure.subplots()
    plots._panel(
        axis, np.linspace(0, 1, 5), [plots.Curve("q.hinge", "rad", np.arange(5.0)), plots.Curve("q.knee", "rad", np.zeros(5))]
    )
    canvas.draw()
    assert axis.get_ylabel() == "angle / rad"
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["q.hinge", "q.knee"]
    assert axis.get_legend().get_window_extent().x0 >= axis.get_window_extent().x1


def test_rounding_errors_are_drawn_flat() -> None:
    from matplotlib.figure import Figure

    axis = Figure().subplots()
    plots._panel(axis, np.linspace(0, 1, 5), [plots.Curve("q", "m", 1e-19 * np.arange(5.0))])
    low, high = axis.get_ylim()
    assert high - low >= 1e-12


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(eomgen.FileError, match=r"coordinates\.png: cannot be written \(No such file or directory\)"):
        plots.draw(pendulum().simulate(0.01, 1e-3), tmp_path / "nowhere")
