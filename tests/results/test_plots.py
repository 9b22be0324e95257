"""What is drawn: panels by unit, names and units on the axes, legends beside the data, and thinning that keeps
extremes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import eomgen
from eomgen.cli import main
from eomgen.results import plots
from tests.models.scenes import flyer, pendulum


@pytest.mark.slow
def test_a_file_for_each_kind_of_quantity(tmp_path: Path) -> None:
    assert [path.name for path in plots.draw(flyer().simulate(0.05, 1e-3), tmp_path)] == [
        "coordinates.png",
        "velocities.png",
        "energy.png",
    ]
    names = [path.name for path in plots.draw(pendulum().simulate(0.05, 1e-3), tmp_path)]
    assert names == ["coordinates.png", "velocities.png", "outputs.png", "energy.png"]


def test_a_panel_holds_whole_corners_of_a_vehicle() -> None:
    """Outputs of included files have the prefix of the include: thirteen angles are no panels of 5, 5 and 3."""
    corners = [f"{corner}_{word}" for corner in ("fl", "fr", "rl", "rr") for word in ("toe", "camber", "steer")]
    outputs = [line(name, np.zeros(3), "deg", "", name) for name in (*corners, "fl_slip", "pitch")]
    assert names_of(outputs) == [[*corners[:3], "fl_slip"], corners[3:9], [*corners[9:], "pitch"]]
    many = [f"fl_{word}{k}" for word in ("hub_", "arm_") for k in range(5)]  # one corner that needs two panels
    assert names_of([line(name, np.zeros(3), "deg", "", name) for name in many]) == [many[:5], many[5:]]


def test_equal_lines_are_named_in_the_legend() -> None:
    load = 3e3 + 400.0 * np.sin(np.arange(5.0))
    tables = {"fl": load, "fr": load + 0.01, "rl": load + 100.0, "still": np.full(5, 3e3), "rest": np.full(5, 3e3)}
    axis = panel_of(*(line(name, values, "N") for name, values in tables.items()))
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert labels == ["fl", "fr (equal to fl)", "rl", "still", "rest"], "flat lines are seen to be equal"


def test_drift_of_an_energy_by_the_method_does_not_fill_a_panel() -> None:
    energy = 0.0492751 * (1.0 - 7e-7 * np.linspace(0.0, 1.0, 5))
    low, high = panel_of(line("energy", energy, "J")).get_ylim()
    assert high - low == pytest.approx(1e-4 * 0.0492751, rel=0.01) and low < energy.min() < energy.max() < high
    low, high = panel_of(line("length", energy)).get_ylim()
    assert high - low < 1e-7
    low, high = panel_of(line("rounded", 5e3 + 1e-11 * np.arange(5.0))).get_ylim()
    assert high - low > 4.9e-6


def test_copies_of_delayed_states_are_left_out() -> None:
    names = ["z.torque_sampled", "z.torque_sampled_2", "z.torque", "z.wheel_sampled"]
    kept = plots._without_copies([line(name, np.zeros(3), "N m") for name in names])
    assert [curve.name for curve in kept] == ["z.torque", "z.wheel_sampled"]


def test_angles_of_hinges_are_apart_from_wheels_that_roll() -> None:
    rolled = {"q.spin": np.linspace(0.0, 95.0, 5), "q.arm": 0.1 * np.sin(np.arange(5.0)), "q.roll": np.arange(5.0)}
    curves = [line(name, values, "rad") for name, values in rolled.items()]
    assert names_of(curves) == [["q.spin", "q.roll"], ["q.arm"]]
    assert [len(panel) for panel in plots._panels(curves[1:])] == [2], "hinges alone share a panel"


def test_thinning_keeps_ends_extremes_and_order() -> None:
    t = np.linspace(0.0, 1.0, 200_001)
    values = np.sin(40_000.0 * t)
    values[123_456] = 7.0
    short_t, short = plots._thin(t, values)
    assert len(short_t) <= 2 * plots._POINTS + 2
    assert short.max() == 7.0 and (short_t[0], short_t[-1]) == (0.0, 1.0)
    assert np.all(np.diff(short_t) > 0.0)
    angle = np.linspace(0.0, 60.0, 50_001)  # over another column
    across, up = plots._thin(np.cos(angle), np.sin(angle))
    assert len(across) <= 2 * plots._POINTS
    np.testing.assert_allclose(across**2 + up**2, 1.0, rtol=1e-14)


def line(name: str, values: Any, unit: str = "m", quantity: str = "", output: str = "", text: str = "") -> Any:
    return plots.PlottedCurve(name, unit, np.asarray(values, float), quantity, output, text)


def names_of(curves: list[plots.PlottedCurve]) -> list[list[str]]:
    """Return the names of the curves of each panel."""
    return [[curve.name for curve in panel] for panel in plots._panels(curves)]


def panel_of(*curves: plots.PlottedCurve) -> Any:
    axis = Figure().subplots()
    plots._panel(axis, np.linspace(0, 1, len(curves[0].values)), curves)
    return axis


def test_curves_share_panels_with_their_unit_and_outputs_are_not_cut_in_two() -> None:
    curves = [line(f"c{index}", np.zeros(3), "rad" if index < 14 else "m") for index in range(16)]
    panels = plots._panels(curves)
    assert [len(panel) for panel in panels] == [5, 5, 4, 2]
    assert all(len({curve.unit for curve in panel}) == 1 for panel in panels)
    curves = [line(f"p{k}[{i}]", np.zeros(3), "m", "position", f"p{k}") for k in range(3) for i in range(3)]
    assert [[curve.output for curve in panel] for panel in plots._panels(curves)] == [
        ["p0"] * 3 + ["p1"] * 3,
        ["p2"] * 3,
    ]
    long = [line(f"all[{i}]", np.zeros(3), "m", "", "all") for i in range(8)]
    assert [len(panel) for panel in plots._panels(long)] == [4, 4]


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("offset", "changes"), [(0.0, False), (1.0, False), (5.5, True), (-5.5, True), (1e10, False)])
def test_energies_far_from_zero_are_drawn_as_changes_in_any_unit(unit: float, offset: float, changes: bool) -> None:
    swing = np.sin(np.linspace(0.0, 6.0, 50)) ** 2
    energy = {"kinetic": unit * swing, "potential": unit * (offset - swing), "base_power": np.zeros(50)}
    curves = plots._energies(cast(Any, SimpleNamespace(energy=energy)))
    assert [curve.name for curve in curves] == ["kinetic", "potential"]
    assert all(("change" in curve.quantity) == changes for curve in curves)
    for curve in curves:
        values = energy[curve.name]
        assert np.array_equal(curve.values, values - values[0] if changes else values)


@pytest.mark.parametrize(("panels", "rows", "columns"), [(1, 1, 1), (3, 3, 1), (4, 2, 2), (5, 3, 2)])
def test_panels_share_the_time_axis_of_the_lowest_of_their_column(panels: int, rows: int, columns: int) -> None:
    figure = Figure()
    drawn = plots._subplots(figure, panels)
    assert len(drawn) == panels and len(figure.axes) == rows * columns
    assert [axis.get_visible() for axis in figure.axes] == [True] * panels + [False] * (rows * columns - panels)
    labelled = [axis.xaxis.get_tick_params()["labelbottom"] for axis in drawn]
    assert labelled == [False] * (panels - columns) + [True] * columns
    assert plots._size(panels) == (9.0 if columns == 1 else 15.0, pytest.approx(0.6 + 2.9 * rows))


def test_small_changes_of_positions_beside_a_long_way_are_drawn_as_changes() -> None:
    """The height of a car that drives 20 m, and the place that it keeps, are changes in a panel of their own; a way of
    a thirtieth is a position."""
    way, height = np.linspace(0.0, 20.0, 9), 0.3 + 0.05 * np.sin(np.arange(9.0))
    tables = {"hub[0]": way, "hub[1]": np.full(9, 0.7), "hub[2]": height, "seat[0]": 5.0 + way / 29.0}
    large, small = plots._panels([line(name, row, "m", "position", name[:-3]) for name, row in tables.items()])
    assert [curve.name for curve in large] == ["hub[0]", "seat[0]"]
    np.testing.assert_array_equal(large[1].values, tables["seat[0]"])
    assert [curve.name for curve in small] == ["hub[1]", "hub[2]"]
    assert {curve.quantity for curve in small} == {"change of position from the start"}
    np.testing.assert_array_equal(small[1].values, height - height[0])
    still = [line(f"p[{k}]", row, "m", "position", "p") for k, row in enumerate((way, np.full(9, 0.7)))]
    assert plots._panels(still) == [still]


def swing() -> eomgen.SceneBuilder:
    """Return a rod on a hinge."""
    builder = eomgen.SceneBuilder("swing").body("rod", 1.0, center_of_mass=[0, 0, -1])
    return builder.joint("hinge", "revolute", "base", "rod", axis=[0, 1, 0], initial={"position": 0.5})


@pytest.mark.slow
def test_curves_over_another_column_have_its_values_and_its_label(tmp_path: Path) -> None:
    builder = swing().output("travel", formula="1000 * q.hinge", unit="mm", description="wheel travel")
    builder.output("toe", formula="q.hinge**2").output("both", formula=["q.hinge", "v.hinge"])
    builder.event("middle", "q.hinge", action="record")
    run = eomgen.build(builder.build(), profile="instant").simulate(2.0, 1e-2)
    assert len(run.events)
    (axis,) = run.plot("toe", "travel", over="travel")
    (drawn,) = axis.get_lines()
    np.testing.assert_array_equal(drawn.get_xydata(), np.column_stack([run["travel"], run["toe"]]))
    assert axis.get_xlabel() == "travel: wheel travel, mm" and not axis.figure.get_suptitle()
    pyplot.close("all")
    for over, said in (
        ("trave", "plot over: the solution has no curve 'trave'; try: travel"),
        ("both", "plot over: 'both' are 2 columns, and plot over takes one; try: one of both[0], both[1]"),
    ):
        with pytest.raises(eomgen.UsageError) as caught:
            run.plot("toe", over=over)
        assert said in str(caught.value)
    assert [path.name for path in plots.draw_over(run, tmp_path, "q.hinge")] == ["outputs_over.png"]


def test_a_fast_oscillation_is_thin_and_below_the_other_curves_of_its_panel() -> None:
    t = np.linspace(0.0, 20.0, 4001)
    axis = panel_of(line("fast", np.sin(60.0 * t), "rad"), line("slow", np.sin(t), "rad"))
    fast, slow = axis.get_lines()
    assert fast.get_linewidth() < slow.get_linewidth() and fast.get_zorder() < slow.get_zorder()


HELP = "try: the folder of a run of eomgen simulate"


MISTAKES: dict[str, tuple[list[str], int]] = {
    "plot: the solution has no curve 'tipp'; try: tip": (["{run}", "tipp"], 2),
    "--over: the solution has no curve 'q.hing'; try: q.hinge": (["{run}", "tip", "--over", "q.hing"], 2),
    "--over: 'tip' are 3 columns, and --over takes one; try: one of tip[0], tip[1]": (["{run}", "--over", "tip"], 2),
    "plot: no column is left to draw over q.hinge": (["{run}", "q.hinge", "--over", "q.hinge"], 2),
    "a stored solution is needed, a file .npz; try: {run}/solution.npz": (["{run}/scene.toml"], 2),
    f"scene.toml: there is no such file or folder; {HELP}": (["scene.toml"], 2),
    f"this folder has no solution.npz; {HELP}": (["{run}/empty"], 2),
    "a folder is needed, and .pdf is the ending of a file": (["{run}", "--out", "{run}/picture.pdf"], 7),
}


@pytest.mark.slow
def test_the_verb_draws_what_simulate_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = pendulum().simulate(0.05, 1e-3)
    (tmp_path / "run").mkdir()
    run.save(tmp_path / "run" / "solution.npz")
    figures: dict[str, Any] = {}

    def kept(figure: Any, path: Path, hint: str = "") -> Path:
        figures[str(path.relative_to(tmp_path))] = figure
        return path

    assert main(["plot", str(tmp_path / "run")]) == 0
    names = sorted(path.name for path in (tmp_path / "run").glob("*.png"))
    assert names == ["coordinates.png", "energy.png", "outputs.png", "velocities.png"]
    monkeypatch.setattr(plots, "save_figure", kept)
    npz, out = str(tmp_path / "run" / "solution.npz"), str(tmp_path / "new" / "folder")
    assert main(["plot", npz, "tip[0]", "v.hinge", "--over", "q.hinge", "--out", out]) == 0
    assert main(["plot", npz, "--over", "q.hinge", "--out", out]) == main(["plot", npz, "energy"]) == 0
    over, outputs, energy = figures
    assert (over, outputs) == (
        "new/folder/tip_0_v.hinge_over_q.hinge.png",
        "new/folder/outputs_over_q.hinge.png",
    )
    assert energy == "run/energy.png"
    first, second = figures[over].axes
    for axis, column in ((first, run["tip"][:, 0]), (second, run["v.hinge"])):
        np.testing.assert_array_equal(axis.get_lines()[0].get_xydata(), np.column_stack([run["q.hinge"], column]))
    assert second.get_xlabel() == "q.hinge, rad" and figures[over].get_suptitle() == "shaken: over q.hinge"
    assert [axis.get_xlabel() for axis in figures[energy].axes][-1] == "time, s"


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_of_the_verb_are_named(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pendulum().simulate(0.01).save(tmp_path / "solution.npz")
    (tmp_path / "empty").mkdir()
    words, code = MISTAKES[text]
    assert main(["plot", *(word.format(run=tmp_path) for word in words)]) == code
    error = capsys.readouterr().err
    assert text.format(run=tmp_path) in error and error.count("\n") == 1
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.slow_cases("4")
@pytest.mark.parametrize("panels", [2, 4])
def test_no_text_of_a_file_covers_another_or_is_cut(panels: int) -> None:
    run = pendulum().simulate(0.05, 1e-3)
    wave = np.sin(np.arange(len(run.t)))

    def of(name: str, part: float, described: str = "") -> plots.PlottedCurve:
        return plots.PlottedCurve(name, "N", part * wave, "", "p", described)

    wide = [of("p[0]", 1.0), replace(of("p[1]", 1e-3, "small"), values=18.19 + 1e-4 * wave)]
    tall = [of(f"p{k}", 3e7, f"{k}: of a bearing in which many rollers share the load, " * 3) for k in range(6)]
    tall = [replace(curve, output=f"p{k}") for k, curve in enumerate(tall)]
    shown = [[of("p[0]", 2e8, "the title"), of("p[1]", 2e8, "the title")], tall, [wide[1]], [wide[0]]][:panels]
    figure = plots._figure(run, shown, None, "the heading")
    assert figure.get_layout_engine() is None, "that of matplotlib takes longer than the drawing"
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    boxes = [figure.texts[0].get_window_extent(renderer)]
    for axis in (axis for axis in figure.axes if axis.get_visible()):
        exponent = axis.yaxis.get_offset_text()
        texts = [axis.yaxis.label, axis.xaxis.label, axis._left_title, exponent]
        low, high = axis.get_ylim()
        numbers = [label for label in axis.get_yticklabels() if low <= label.get_position()[1] <= high]
        numbers += [label for label in axis.get_xticklabels() if label.get_visible()]
        inked = [text for text in (*texts, *numbers) if text.get_text()]
        boxes += [text.get_window_extent(renderer) for text in (*inked, axis.get_legend())]
    boxes = [box for box in boxes if box.width > 0.0]
    assert len(boxes) > 10 * panels
    width, height = figure.canvas.get_width_height()
    assert all(box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height for box in boxes)
    covered = [(one, two) for k, one in enumerate(boxes) for two in boxes[:k] if one.overlaps(two)]
    assert covered == []


def test_six_curves_of_a_panel_are_far_apart_in_colour_beside_their_legend() -> None:
    figure = Figure(layout="constrained")
    canvas, axis = FigureCanvasAgg(figure), figure.subplots()
    plots._panel(axis, np.linspace(0, 1, 5), [line(f"c{k}", np.zeros(5)) for k in range(6)])
    canvas.draw()
    assert axis.get_legend().get_window_extent().x0 >= axis.get_window_extent().x1
    colours = np.array([to_rgb(drawn.get_color()) for drawn in axis.get_lines()])
    gaps = np.linalg.norm(colours[:, None] - colours, axis=-1) + 9.0 * np.eye(6)
    assert gaps.min() > 0.4
    assert [drawn.get_linestyle() for drawn in axis.get_lines()] == ["-"] * 3 + ["--"] * 3
