"""``Solution.plot``, ``Modes.plot`` and their like: what names mean, whose axes are used, what is refused."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib
import numpy as np
import pytest

import eomgen
from tests.models.scenes import flyer, pendulum

matplotlib.use("Agg")
from matplotlib import pyplot


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def drawn_names(axis: matplotlib.axes.Axes) -> list[str]:
    return [text.get_text().split(":")[0] for text in axis.get_legend().get_texts()]


def test_names_are_kinds_and_columns() -> None:
    run = pendulum().simulate(0.05, 1e-3)
    (position,) = run.plot("coordinates")
    assert drawn_names(position) == ["q.hinge"] and position.get_ylabel() == "q.hinge, rad"
    assert np.array_equal(position.get_lines()[0].get_ydata(), run.q[:, 0])
    acceleration, energy, power = run.plot("a.hinge", "energy")
    assert np.array_equal(acceleration.get_lines()[0].get_ydata(), run.a[:, 0])
    assert acceleration.get_ylabel() == "a.hinge, rad/s^2"
    assert set(drawn_names(energy)) >= {"kinetic", "potential"} and drawn_names(power)[0] == "power of forces"
    for letter, kind in (("q", "coordinates"), ("v", "velocities"), ("a", "accelerations")):
        assert drawn_names(run.plot(letter)[0]) == drawn_names(run.plot(kind)[0])
    (one,) = run.plot("tip[0]")
    assert drawn_names(one) == ["tip[0]"]
    assert drawn_names(run.plot("output.tip")[0]) == drawn_names(run.plot("tip", "tip[1]")[0])


def test_outputs_are_drawn_without_names_or_else_coordinates() -> None:
    assert "tip[0]" in drawn_names(pendulum().simulate(0.02, 1e-3).plot()[0])
    assert drawn_names(flyer().simulate(0.02, 1e-3).plot()[0])[0].startswith("q.")


def test_the_axes_of_a_caller_are_used_and_keep_their_legend_inside() -> None:
    run = pendulum().simulate(0.05, 1e-3)
    figure, axes = pyplot.subplots(2, 1)
    given = run.plot("coordinates", "velocities", axes=axes)
    assert given == list(axes)
    figure.canvas.draw()
    legend, box = axes[0].get_legend().get_window_extent(), axes[0].get_window_extent()
    assert box.x0 <= legend.x0 and legend.x1 <= box.x1


def test_what_cannot_be_drawn_is_named() -> None:
    run = pendulum().simulate(0.02, 1e-3)
    figure, axis = pyplot.subplots()
    wrong = r"plot: axes: 1 axes are given for 2 panels: q\.hinge, v\.hinge; try: axes for 2 panels"
    with pytest.raises(eomgen.UsageError, match=wrong):
        run.plot("coordinates", "velocities", axes=axis)
    with pytest.raises(eomgen.UsageError, match=r"plot: axes: axes of matplotlib are needed, not Figure"):
        run.plot("coordinates", axes=figure)


@pytest.mark.slow
def test_modes_roots_and_responses_draw_themselves() -> None:
    model = pendulum()
    linear = model.linearize(at="initial")
    shapes = linear.modes().plot()
    assert [axis.get_title(loc="left").split(":")[0] for axis in shapes] == ["mode 1"]
    (roots,) = model.root_locus("length", np.linspace(0.5, 1.0, 4), at="initial").plot()
    assert roots.get_xlabel() == "real part, 1/s"
    band = np.geomspace(0.1, 10.0, 50)
    magnitude, phase = linear.plot_response("torque", "angle", band)
    assert (magnitude.get_ylabel(), phase.get_ylabel()) == ("magnitude", "phase, °")
    expected = np.abs(linear.frequency_response(2 * np.pi * band, "torque", "angle"))
    assert np.array_equal(magnitude.get_lines()[0].get_ydata(), expected)
    wrong = r"plot_response: frequencies have to be two or more positive numbers that increase; try: numpy\.geomspace"
    with pytest.raises(eomgen.UsageError, match=wrong):
        linear.plot_response("torque", "angle", [0.0, 1.0])
