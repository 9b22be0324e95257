"""Lines, labels and units of figures, read from the drawn artists of synthetic results: no model is compiled."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from scipy import stats

import eomgen
from eomgen.cli import simulate
from eomgen.compiled.beams import SectionLoads
from eomgen.errors import Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.products.ensembles import ensemble
from eomgen.products.linear import plots
from eomgen.products.linear.control.margins import Margins
from eomgen.products.linear.control.notebook import plot_margins
from eomgen.products.pictures import section_loads, shapes
from eomgen.products.pictures.command import SectionsOfRun
from eomgen.products.reliability.vibration import result as vibration
from eomgen.products.reliability.vibration.result import Distribution
from eomgen.products.statics.equilibrium_path import Critical, EquilibriumPath

matplotlib.use("Agg")
from matplotlib import pyplot

BLUE, ORANGE = "#0b62c4", "#f08c00"


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def solution_of(rng: np.random.Generator, rows: int = 7) -> Any:
    """Return a run with two beams, the second one bent in one plane."""

    def loads(elements: int) -> SectionLoads:
        sizes = [(rows, elements, 3)] * 4 + [(rows, elements, 2, 3)] * 2
        x = (np.arange(elements) + 0.5) * 0.5
        return SectionLoads(x, *(rng.normal(size=size) for size in sizes))

    rope, mast = loads(3), loads(2)
    mast.moment[..., [0, 2]] = 1e-12
    t = np.linspace(1.0, 4.0, rows) ** 2
    return SimpleNamespace(t=t, model=None, metadata={"scene": "crane"}, section_loads={"rope": rope, "mast": mast})


def test_sections_at_times_are_lines_from_end_to_end_of_elements(rng: np.random.Generator) -> None:
    solution = solution_of(rng)
    loads = solution.section_loads["rope"]
    drawn = section_loads.plot_sections(solution, "rope", "force", "strain", at=[solution.t[2] + 0.1, solution.t[5]])
    assert [axis.get_ylabel() for axis in drawn] == [
        "axial force, N", "shear force along y, N", "shear force along z, N",
        "stretch", "shear along y", "shear along z",
    ]  # fmt: skip
    for place, axis in enumerate(drawn):
        quantity, index = ("force", place) if place < 3 else ("strain", place - 3)
        for line, row in zip(axis.lines, (2, 5), strict=True):
            assert line.get_xdata().tolist() == [0.0, 0.5, 0.5, 1.0, 1.0, 1.5]
            ends = loads.force_at_ends[row, :, :, index].ravel()
            expected = ends if quantity == "force" else np.repeat(loads.strain[row, :, index], 2)
            assert line.get_ydata().tolist() == expected.tolist()
            assert line.get_label() == f"t = {solution.t[row]:.4g} s"
        assert (axis.get_legend() is not None) == (place == 0)
    assert drawn[-1].get_xlabel() == "x at rest, m" and drawn[0].get_xlabel() == ""
    assert drawn[0].figure.get_suptitle() == "crane: rope"
    assert drawn[0].figure.get_size_inches().tolist() == pytest.approx([9.0, 0.6 + 2.6 * 6])


def test_sections_over_time_are_maps_of_the_components_that_differ_from_zero(rng: np.random.Generator) -> None:
    solution = solution_of(rng)
    drawn = section_loads.plot_sections(solution, "mast")
    labels = [axis.collections[0].colorbar.ax.get_ylabel() for axis in drawn]
    assert labels == ["bending moment about y, N m", *(f"{name}, N" for name in section_loads._QUANTITIES["force"][0])]
    loads, t = solution.section_loads["mast"], solution.t
    for axis, values in zip(drawn, (loads.moment[..., 1], *np.moveaxis(loads.force, -1, 0)), strict=True):
        mesh = axis.collections[0]
        np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(2, len(t)), values.T)
        assert mesh.get_clim() == (-np.abs(values).max(), np.abs(values).max())
        corners = mesh.get_coordinates()
        assert corners[0, :, 0].tolist() == [t[0], *(0.5 * (t[1:] + t[:-1])), t[-1]]
        assert corners[:, 0, 1].tolist() == [0.0, 0.5, 1.0]
        assert axis.get_ylabel() == "x at rest, m"
    assert drawn[-1].get_xlabel() == "time, s"


def test_figures_of_sections_have_six_instants_beside_maps(
    rng: np.random.Generator, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    solution, kept = solution_of(rng, 41), []

    def saved(figure: Any, path: Path, hint: str) -> Path:
        kept.append((figure, hint))
        return path

    monkeypatch.setattr(section_loads, "saved", saved)
    section_loads.store_drawn_loads(solution, tmp_path / "loads.npz")
    files = section_loads.draw_sections(solution, section_loads.stored_drawn_loads(tmp_path / "loads.npz"), tmp_path)
    assert files == [tmp_path / "sections_rope.png", tmp_path / "sections_mast.png"]
    for (figure, hint), name, panels in zip(kept, ("rope", "mast"), (6, 4), strict=True):
        assert hint == "another folder, or --no-plots"
        assert figure.get_suptitle() == f"crane: sections of the beam {name}"
        assert figure.get_size_inches().tolist() == pytest.approx([15.0, 0.6 + 2.6 * panels])
        left, right = figure.axes[: 2 * panels : 2], figure.axes[1 : 2 * panels : 2]
        for axis in left:
            labels = [line.get_label() for line in axis.lines]
            assert labels == [f"t = {solution.t[row]:.4g} s" for row in (0, 8, 16, 24, 32, 40)]
        assert [axis.get_legend() is not None for axis in left] == [True] + [False] * (panels - 1)
        assert (left[-1].get_xlabel(), right[-1].get_xlabel()) == ("x at rest, m", "time, s")
        loads = solution.section_loads[name]
        ends = loads.moment_at_ends[8, :, :, 1 if name == "mast" else 0].ravel()
        assert left[0].lines[1].get_ydata().tolist() == ends.tolist()


def test_a_copy_that_draws_finds_the_loads_of_beams_in_a_file(rng: np.random.Generator, tmp_path: Path) -> None:
    solution, orders = solution_of(rng), list[dict[str, Any]]()
    copy: Any = SimpleNamespace(order=orders.append)
    order = {"folder": f"{tmp_path}", "over": None}
    model: Any = SimpleNamespace(description=SimpleNamespace(exact_beams=[("rope",), ("mast",)]))
    with simulate._ordered(order, [SectionsOfRun(solution, model), SectionsOfRun(solution)], copy):
        (stored, nothing) = orders[0].pop("stored")
        loads = section_loads.stored_drawn_loads(Path(stored))
    assert nothing is None
    assert orders == [order]
    assert list(loads) == ["rope", "mast"]
    for name, known in solution.section_loads.items():
        for field in ("x", "moment", "force", "moment_at_ends", "force_at_ends"):
            np.testing.assert_array_equal(getattr(loads[name], field), getattr(known, field))
    assert not list(tmp_path.iterdir())


def test_times_of_sections_end_at_the_first_and_the_last_row(rng: np.random.Generator) -> None:
    solution = solution_of(rng)
    assert section_loads._rows_at(solution, [1.0, 16.0, 2.0]).tolist() == [0, 6, 1]
    for t in (1.0 - 1e-6, 16.0 + 1e-6, math.nan):
        with pytest.raises(UsageError, match="is outside the solution, which goes from 1 s to 16 s; try: times within"):
            section_loads._rows_at(solution, [2.0, t])
    with pytest.raises(UsageError, match="the scene has 2 geometrically exact beams; try: the name of one: rope, mast"):
        section_loads.plot_sections(solution)
    with pytest.raises(UsageError, match="there is no beam 'mest'; try: mast"):
        section_loads.plot_sections(solution, "mest")
    with pytest.raises(UsageError, match="sections have no 'forse'; try: force"):
        section_loads.plot_sections(solution, "mast", "forse")


@pytest.mark.parametrize("at_once", [4_000_000, 20])
def test_the_largest_loads_are_told_with_place_and_time(
    at_once: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(section_loads, "_NUMBERS", at_once)
    solution = solution_of(rng)
    rope = solution.section_loads["rope"]
    rope.moment_at_ends[4, 1, 0] = [20.0, 0.0, -21.0]
    rope.force_at_ends[5, 2, 1] = [-8.0, 9.0, 12.0]
    rope.force_at_ends[1, 0, 0] = np.nan

    def at_rows(state: Any, multipliers: np.ndarray) -> dict[str, SectionLoads]:
        rows = np.searchsorted(solution.t, state.t)
        assert multipliers[:, 0].tolist() == rows.tolist()
        return {"rope": section_loads._of_rows(rope, rows)}

    state = {name: np.zeros((7, 5)) for name in ("q", "v", "a", "z")}
    run = SimpleNamespace(
        t=solution.t, model=SimpleNamespace(section_loads=at_rows), multipliers=np.arange(7.0)[:, None], **state
    )
    assert section_loads.largest_section_loads(run) == {
        "rope": {
            "moment": {"size": 29.0, "x": 0.5, "t": float(solution.t[4])},
            "force": {"size": 17.0, "x": 1.5, "t": float(solution.t[5])},
        }
    }
    assert section_loads.largest_section_loads(solution) == {}


def path_of(**changes: Any) -> EquilibriumPath:
    mode = np.array([0.0, 1.0])
    turn = Critical("limit point", 3.5, np.ones(2), mode, {"tip": 0.25}, 2, ("v.arm",), mode[:, None])
    fork = Critical("bifurcation", 2.0, np.ones(2), mode, {"tip": 0.4}, 3, ("v.leg",), np.eye(2))
    given = {
        "parameter": "load", "unit": "N", "values": np.array([1.0, 3.0, 3.0, 1.5]),
        "q": np.arange(8.0).reshape(4, 2), "z": np.zeros((4, 0)), "multipliers": np.zeros((4, 0)),
        "columns": {"tip": np.array([0.0, 0.2, 0.3, 0.5]), "arm.x": np.array([9.0, 7.0, 7.0, 8.0])},
        "units": {"tip": "m", "arm.x": ""}, "outputs": ("tip",), "negative": np.array([0, 0, 1, 2]),
        "lowest": np.array([4.0, 1.0, -1.0, -2.0]), "critical": (turn, fork), "success": True, "message": "arrived",
        "_branch": lambda number, size, to: (number, size, to),
    }  # fmt: skip
    return EquilibriumPath(**{**given, **changes})


def test_a_path_is_drawn_through_its_critical_points_with_its_stability() -> None:
    (axis,) = path_of().plot()
    lines = [
        (line.get_xdata(), line.get_ydata(), to_hex(line.get_color()), line.get_linestyle()) for line in axis.lines
    ]
    assert [(list(x), list(y), colour, style) for x, y, colour, style in lines[:5]] == [
        ([0.0, 0.2], [1.0, 3.0], BLUE, "-"),
        ([0.2, 0.25], [3.0, 3.5], BLUE, "-"),
        ([0.25, 0.3], [3.5, 3.0], ORANGE, "--"),
        ([0.3, 0.4], [3.0, 2.0], ORANGE, "--"),
        ([0.4, 0.5], [2.0, 1.5], ORANGE, "--"),
    ]
    marks = [(line.get_xydata().tolist(), to_hex(line.get_color()), line.get_marker()) for line in axis.lines[5:]]
    assert marks == [([[0.25, 3.5]], "#b00020", "o"), ([[0.4, 2.0]], "#1b7f3b", "D")]
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert labels == ["stable", "unstable", "limit point", "bifurcation"]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("tip, m", "load, N")
    tip, arm = path_of(unit="1").plot(["tip", "arm.x"])
    assert (arm.get_xlabel(), arm.get_ylabel(), tip.get_xlabel()) == ("arm.x", "load", "tip, m")
    assert [list(line.get_xdata()) for line in arm.lines[1:3]] == [[7.0, 3.5], [3.5, 7.0]]
    (plain,) = path_of(critical=(), negative=np.full(4, -1)).plot("tip")
    assert plain.get_legend() is None and {to_hex(line.get_color()) for line in plain.lines} == {BLUE}


def test_a_path_names_columns_and_branches() -> None:
    path = path_of()
    assert path.largest_column == "tip"
    assert path_of(outputs=()).largest_column == "arm.x"
    assert path_of(outputs=(), columns={}).largest_column == "load"
    assert path.column("load") is path.values and path.column("tip") is path.columns["tip"]
    with pytest.raises(UsageError, match="the path has no column 'tup'; try: tip"):
        path.column("tup")
    assert [path.branch(number, 5.0, -2.0) for number in (0, 1, -1, -2)] == [
        (0, -2.0, 5.0), (1, -2.0, 5.0), (1, -2.0, 5.0), (0, -2.0, 5.0),
    ]  # fmt: skip
    for number in (2, -3):
        with pytest.raises(UsageError, match=f"there is no critical point {number}: the path has 2"):
            path.branch(number, 5.0)
    assert [item.multiplicity for item in path.critical] == [1, 2]
    assert list(path.initial) == ["q"] and path.initial["q"].tolist() == [6.0, 7.0]
    driven = path_of(z=np.arange(4.0)[:, None]).initial
    assert list(driven) == ["q", "z"] and driven["z"].tolist() == [3.0]


def test_margins_are_drawn_with_the_circles_that_they_measure() -> None:
    loop = np.array([0.5 - 0.5j, 20.0 + 1.0j, -0.25 - 0.1j])
    said = [
        "open loop, which leaves the frame", "at negative frequencies", "unit circle",
        "modulus margin 0.6: least distance from -1", "-1: limit of stability",
    ]  # fmt: skip  # a line each
    margins = {
        name: Margins(3.0, 0.5, 40.0 + k, 0.2, 0.6, (1.0,), np.arange(3.0), loop * (k + 1))
        for k, name in enumerate(("u1", "u2"))
    }
    drawn = plot_margins(margins)
    assert len(drawn) == 2 and drawn[0].figure.get_size_inches().tolist() == pytest.approx([10.4, 5.7])
    for k, (name, axis) in enumerate(zip(margins, drawn, strict=True)):
        upper, lower, unit, around, point, *rings = axis.lines
        assert [text.get_text() for text in axis.get_legend().get_texts()] == said
        written = {text.xy: text.get_text() for text in axis.texts if text.get_text()}
        places = [(k + 1) * value for value in loop[:3:2]]
        assert written == {(places[0].real, places[0].imag): "0 Hz", (places[1].real, places[1].imag): "0.318 Hz"}
        assert [complex(*ring.get_xydata()[0]) for ring in rings] == places
        near = (k + 1) * loop[[0, 2]]
        for line, sign in ((upper, 1.0), (lower, -1.0)):
            np.testing.assert_array_equal(line.get_xdata()[[0, 2]], near.real)
            np.testing.assert_array_equal(line.get_ydata()[[0, 2]], sign * near.imag)
            assert np.isnan(line.get_xdata()[1])
        np.testing.assert_allclose(np.hypot(*unit.get_xydata().T), 1.0, rtol=1e-12)
        np.testing.assert_allclose(np.hypot(*(around.get_xydata() - [-1.0, 0.0]).T), 0.6, rtol=1e-12)
        for circle in (unit, around):
            turned = np.unwrap(np.angle((circle.get_xydata() - circle.get_xydata()[:-1].mean(axis=0)) @ [1.0, 1j]))
            assert turned[-1] - turned[0] == pytest.approx(2.0 * math.pi)
        assert point.get_xydata().tolist() == [[-1.0, 0.0]] and point.get_marker() == "+"
        assert axis.get_xlim() == axis.get_ylim() == (-2.6, 2.6) and axis.get_aspect() == 1.0
        assert (axis.get_xlabel(), axis.get_ylabel()) == ("real part", "imaginary part")
        assert axis.get_title("left") == (
            f"open loop at {name}\nstable for gains times 0.5 to 3\nphase margin {40 + k}°, delay margin 200 ms"
        )


def test_responses_are_drawn_with_units_and_continuous_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(plots, "saved", lambda figure, path: kept.append(figure) or path)
    f = np.geomspace(0.1, 100.0, 400)
    chain = 5.0 / (1.0 + 1j * f / 2.0) ** 5
    responses = {("push", "tip"): chain, ("push", "push2"): 0.0 * chain, ("road", "force"): chain**2}
    plots.draw_responses(f, responses, {"push": "N", "push2": "N", "tip": "m"}, "car", Path("a.png"))
    magnitudes, phases = kept[0].axes[:3], kept[0].axes[3:]
    assert kept[0].get_suptitle() == "car: frequency responses"
    assert kept[0].get_size_inches().tolist() == pytest.approx([6.2 * 3 + 0.4, 6.4])
    titles = [axis.get_title("left") for axis in magnitudes]
    assert titles == ["tip for push", "push2 for push", "force for road"]
    assert [axis.get_ylabel() for axis in magnitudes] == ["magnitude, m per N", "magnitude", "magnitude"]
    assert [axis.get_yscale() for axis in magnitudes] == ["log", "linear", "log"]
    assert {axis.get_xscale() for axis in kept[0].axes} == {"log"}
    np.testing.assert_allclose(magnitudes[0].lines[0].get_ydata(), 5.0 / np.hypot(1.0, f / 2.0) ** 5, rtol=1e-12)
    for k, order in ((0, 5), (2, 10)):
        angles = -order * np.degrees(np.arctan(f / 2.0))
        np.testing.assert_allclose(phases[k].lines[0].get_ydata(), angles, atol=1e-9)
        low, high = phases[k].get_ylim()
        assert low + high == pytest.approx(angles.min() + angles.max())
        assert high - low == pytest.approx(1.1 * np.ptp(angles))
        ticks = np.diff(phases[k].get_yticks())
        assert set(ticks) == {90.0 if order == 5 else 180.0}
    assert np.ptp(phases[1].get_ylim()) == pytest.approx(200.0)
    assert [axis.get_ylabel() for axis in phases] == ["phase, °"] * 3
    assert phases[0].get_xlabel() == "frequency, Hz" and phases[0].get_xlim() == (0.1, pytest.approx(100.0))


def modes_of(count: int, coordinates: int, rng: np.random.Generator) -> Any:
    shapes = rng.normal(size=(coordinates, count)) + 1j * rng.normal(size=(coordinates, count))
    shapes /= np.abs(shapes).max(axis=0)
    frequency = np.linspace(1.0, 2.0, count)

    class Modes(SimpleNamespace):
        def __len__(self) -> int:
            return count

    return Modes(
        shapes=shapes, coordinates=tuple(f"c{k}" for k in range(coordinates)), weights=np.ones(coordinates),
        eigenvalues=2j * math.pi * frequency - 0.1, uncertainty=np.full(count, 1e-9),
        oscillating=np.ones(count, bool), frequency=frequency, damping_ratio=np.full(count, 0.05),
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 4])
def test_shapes_of_modes_are_bars_with_amplitudes_and_phases(count: int, rng: np.random.Generator) -> None:
    modes = modes_of(count, 3, rng)
    modes.shapes[1, 0] = 0.0
    drawn = plots.plot_modes(modes)
    assert len(drawn) == count and len(drawn[0].figure.axes) == (6 if count == 4 else count)
    columns, rows = min(count, 3), -(-count // 3)
    size = [4.6 * columns + 0.6, 0.8 + rows * (1.1 + 0.28 * 3)]
    assert drawn[0].figure.get_size_inches().tolist() == pytest.approx(size)
    assert [axis.get_visible() for axis in drawn[0].figure.axes[count:]] == [False] * (columns * rows - count)
    for k, axis in enumerate(drawn):
        values = modes.shapes[:, k]
        assert [bar.get_width() for bar in axis.patches] == np.abs(values).tolist()
        assert [bar.get_y() + 0.5 * bar.get_height() for bar in axis.patches] == pytest.approx([2, 1, 0])
        assert [text.get_text() for text in axis.get_yticklabels()] == ["c0", "c1", "c2"]
        shown = [(k, value) for k, value in enumerate(values) if value]
        degrees = [f"{round(math.degrees(math.atan2(value.imag, value.real)))}°" for _, value in shown]
        assert [text.get_text() for text in axis.texts] == degrees
        places = [(abs(value) + 0.02, 2 - k) for k, value in shown]
        np.testing.assert_allclose([text.get_position() for text in axis.texts], places, rtol=1e-12)
        assert axis.get_title("left") == f"mode {k + 1}: {modes.frequency[k]:.5g} Hz undamped, damping ratio 0.05"
        assert axis.get_xlim() == (0.0, 1.2) and axis.get_ylim() == (-0.6, 2.6)


def test_figures_of_modes_draw_the_largest_coordinates_and_count_modes_left_out(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(plots, "saved", lambda figure, path: kept.append(figure) or path)
    modes = modes_of(plots._MODES + 2, plots._COORDINATES + 4, rng)
    modes.weights[3] = 100.0
    plots.draw_modes(modes, "car", Path("a.png"))
    assert kept[0].get_suptitle() == (
        "car: shapes of modes (2 more are not drawn; of 18 coordinates, of each mode the 14 with most kinetic energy)"
    )
    first = kept[0].axes[0]
    labels = [int(text.get_text()[1:]) for text in first.get_yticklabels()]
    sizes = modes.weights * np.abs(modes.shapes[:, 0])
    assert labels == sorted(np.argsort(-sizes)[: plots._COORDINATES].tolist()) and 3 in labels
    assert [bar.get_width() for bar in first.patches] == np.abs(modes.shapes[labels, 0]).tolist()


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.0, "0°"), (-1.0, "180°"), (complex(-1.0, -1e-9), "180°"), (1j, "90°"), (-1j, "-90°"), (1 - 1j, "-45°")],
)
def test_phases_are_whole_degrees_above_minus_180(value: complex, text: str) -> None:
    assert f"{plots.degrees(value)}°" == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.5, "grows with 0.5 1/s"), (-0.25, "decays with 0.25 1/s"), (1e-3, "no stiffness"), (-1e-3, "no stiffness")],
)
def test_motions_that_do_not_oscillate_are_captioned_by_their_rate(value: float, text: str) -> None:
    modes = SimpleNamespace(eigenvalues=np.array([value + 0j]), oscillating=[False], uncertainty=[1e-3])
    assert plots.caption(modes, 0) == f"mode 1: {text}"  # type: ignore[arg-type]  # a part of it


def sensitivity_of(kind: str, total: dict[str, float], intervals: bool, error: float) -> Any:
    first = {name: 0.5 * share for name, share in total.items()}
    bounds = {name: (share - 0.1, share + 0.2) for name, share in total.items()} if intervals else {}
    lower = {name: (share - 0.05, share + 0.02) for name, share in first.items()} if intervals else {}
    return SimpleNamespace(
        kind=kind, result=f"{kind} of tip", first=first, total=total if intervals else first,
        first_interval=lower, total_interval=bounds, error=error,
    )  # fmt: skip


def test_rankings_are_bars_with_intervals_and_the_largest_share_on_top() -> None:
    total = {"mass": 0.7, "length": 0.2, "damping": 0.05}
    columns = ("tip", "tilt", "none")
    rankings = {
        "tip.max": sensitivity_of("Sobol", total, True, 0.5),
        "tilt.max": sensitivity_of("Sobol", total, False, 0.0),
    }

    def sensitivity(result: str) -> Any:
        if result not in rankings:
            raise UsageError(Problem("sensitivity", "too few samples", ""))
        return rankings[result]

    run: Any = SimpleNamespace(columns=columns, varied=("mass", "length", "damping"), sensitivity=sensitivity)
    figure = ensemble._rankings(run)
    assert figure.get_size_inches().tolist() == pytest.approx([7.5, 0.5 + 2 * (0.35 * 3 + 0.9)])
    upper, lower = figure.axes
    assert upper.get_title("left") == "Sobol of tip, errors of steps up to 50 % of its deviation"
    assert lower.get_title("left") == "Sobol of tip"
    widths = [bar.get_width() for bar in upper.patches]
    assert widths == pytest.approx([0.05, 0.2, 0.7, 0.025, 0.1, 0.35])
    assert [bar.get_width() for bar in lower.patches] == pytest.approx([0.025, 0.1, 0.35])
    for axis in (upper, lower):
        assert [text.get_text() for text in axis.get_yticklabels()] == ["damping", "length", "mass"]
    segments = [[tuple(point) for point in line] for lines in upper.collections for line in lines.get_segments()]
    whole = [((share - 0.1, k + 0.12), (share + 0.2, k + 0.12)) for k, share in enumerate((0.05, 0.2, 0.7))]
    alone = [((share - 0.05, k - 0.12), (share + 0.02, k - 0.12)) for k, share in enumerate((0.025, 0.1, 0.35))]
    np.testing.assert_allclose(segments, [*whole, *alone], atol=1e-12)
    assert not lower.collections and lower.get_xlabel() == "share of the variance (Sobol)"
    assert [text.get_text() for text in upper.get_legend().get_texts()] == ["with interactions", "by itself"]
    assert ensemble._rankings(SimpleNamespace(columns=("none",), varied=("a",), sensitivity=sensitivity)) is None  # type: ignore[arg-type]


def test_distributions_are_drawn_on_a_normal_scale_by_the_smaller_tail() -> None:
    y, order = np.array([6.0, 0.0, 2.0, 4.0]), [1, 2, 3, 0]
    place = np.array([9.0, -2.0, 0.1, 1.5])
    below, above = stats.norm.cdf(place), stats.norm.sf(place)
    counted = Distribution(below.copy(), above.copy(), stats.norm.cdf(place - 0.5), stats.norm.cdf(place + 0.25))
    counted.below[2] = counted.above[2] = np.nan
    result: Any = SimpleNamespace(
        thresholds=y, output="tip", unit="m", scene="mast", t=2.5,
        distributions={"monte_carlo": counted, "form": Distribution(below, above, np.zeros(0), np.zeros(0))},
    )  # fmt: skip
    (axis,) = vibration._distribution(result).axes
    form, samples = axis.lines
    assert form.get_xdata().tolist() == y[order].tolist()
    np.testing.assert_allclose(form.get_ydata(), place[order], rtol=1e-9)
    assert samples.get_xdata().tolist() == [0.0, 4.0, 6.0]
    assert (form.get_label(), samples.get_label()) == ("FORM", "Monte Carlo, 95 % confidence")
    (bars,) = axis.collections
    ends = [((0.0, -2.5), (0.0, -1.75)), ((2.0, -0.4), (2.0, 0.35)), ((4.0, 1.0), (4.0, 1.75))]
    np.testing.assert_allclose(bars.get_segments()[:3], ends, atol=1e-6)
    named = dict(zip([text.get_text() for text in axis.get_yticklabels()], axis.get_yticks(), strict=True))
    for text, share in (("0.01", 0.01), ("0.5", 0.5), ("0.99", 0.99), ("1 - 1e-3", 0.999), ("1 - 1e-5", 1 - 1e-5)):
        assert named[text] == pytest.approx(stats.norm.ppf(share), abs=1e-6)
    assert "1e-3" not in named and axis.get_xlabel() == "tip, m"
    assert axis.get_title() == "mast: tip at t = 2.5 s"
    assert vibration._percent(1e-3) == "0.001" and vibration._percent(1e-5) == "1e-5"


def test_covariances_are_drawn_in_the_order_of_times() -> None:
    result: Any = SimpleNamespace(
        times=np.array([2.0, 0.0, 1.0]), autocovariance={"hermite": np.array([1.0, 4.0, 3.0])},
        output="tip", unit="m", t=1.5,
    )  # fmt: skip
    (axis,) = vibration._covariance(result).axes
    assert axis.lines[0].get_xydata().tolist() == [[0.0, 4.0], [1.0, 3.0], [2.0, 1.0]]
    assert axis.lines[1].get_ydata() == [0.0, 0.0]
    assert axis.get_ylabel() == "covariance, (m)²" and axis.get_xlabel() == "time, s"
    assert axis.get_title() == "covariance of tip with its value at t = 1.5 s"


class Machine:
    """Lines of a machine in the plane of x and z, 2 m long, that coordinates bend: in z, in y, and turned about x."""

    def __init__(self, model: Any, t: float, p: np.ndarray, q: np.ndarray) -> None:
        x = np.linspace(0.0, 2.0, 5)
        places = np.zeros((len(q), 5, 3))
        places[:, :, 0] = x
        places[:, :, 2] = 0.05 * x + q[:, :1] * x**2
        places[:, :, 1] = q[:, 1:2] * x
        self.lines, self.places, self.size = [places], places, 2.0
        self.solids: list[Any] = []
        self.roads: list[Any] = []

    def supports(self) -> np.ndarray:
        return np.array([[[0.0, 0.0, 0.0], [2.0, 0.5, 1.0]]])


MODEL: Any = SimpleNamespace(
    name="mast", factors=tuple(Factor("R", f"c{k}", k, 1, k, 1) for k in range(3)), v_units=["m/s", "m/s", "rad/s"]
)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_mode_shapes_are_drawn_about_the_shape_at_rest(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(shapes, "saved", lambda figure, path: kept.append(figure) or path)
    monkeypatch.setattr(shapes, "_Lines", Machine)
    modes = np.array([[1.0, 0.0, 0.5, 0.0, 1e-6], [0.0, 3.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0, 1.0]])
    q, titles = np.array([0.01, 0.0, 0.0]), [f"title {k}" for k in range(count)]
    shapes.draw_modes(MODEL, q, 0.0, np.zeros(0), modes, titles, Path("a.png"))
    axes = kept[0].axes
    columns = min(count, 3)
    assert len(axes) == count and kept[0].get_size_inches().tolist() == [5.2 * columns, 4.0 * -(-count // columns)]
    assert [axis.get_title() for axis in axes] == titles
    assert kept[0].get_suptitle() == "mast: mode shapes, in the plane of each that shows most"
    x = np.linspace(0.0, 2.0, 5)
    # the largest displacement is a tenth of 2 m: q_0 bends by 4 q_0 at the end, q_1 by 2 q_1; a turn is 1 rad at most
    scales = [(0.05, "z"), (0.1, "y"), (0.05, "z"), (0.0, "z"), (0.0, "z")]
    for axis, (scale, plane) in zip(axes, scales, strict=False):
        assert (axis.get_xlabel(), axis.get_ylabel()) == ("x, m", f"{plane}, m")
        rest, back, there = axis.lines[:3]
        for line, sign in ((rest, 0.0), (back, -1.0), (there, 1.0)):
            heights = 0.05 * x + (0.01 + sign * scale) * x**2 if plane == "z" else sign * scale * x
            np.testing.assert_allclose(line.get_xdata(), x, atol=1e-9)
            np.testing.assert_allclose(line.get_ydata(), heights, atol=2e-5)
        assert axis.lines[3].get_xydata().tolist() == [[0.0, 0.0], [2.0, 1.0 if plane == "z" else 0.5]]
        assert axis.lines[3].get_marker() == "^"


def test_roots_over_a_parameter_are_the_upper_half_plane_with_both_ends_marked() -> None:
    values = np.array([1.0, 2.0, 4.0])
    roots = np.array([[-1 + 5j, -1 - 5j, -9.0], [-2 + 6j, -2 - 6j, -1.0], [1e-13 + 7j, 1e-13 - 7j, -1.1]])
    locus = SimpleNamespace(parameter="speed", values=values, eigenvalues=roots)
    (axis,) = plots.plot_root_locus(locus)  # type: ignore[arg-type]  # has all drawn attributes
    dots = [points.get_offsets().tolist() for points in axis.collections]
    upper = [[-1.0, 5.0], [-2.0, 6.0], [0.0, 7.0]]
    assert dots == [
        upper, upper[:1], upper[-1:], [], [[-9.0, 0.0], [-1.0, 0.0], [-1.1, 0.0]], [[-9.0, 0.0]], [[-1.1, 0.0]],
    ]  # fmt: skip
    assert axis.collections[0].get_array().tolist() == values.tolist()
    assert type(axis.collections[0].norm).__name__ == "LogNorm"
    lines = [line.get_xydata().tolist() for line in axis.lines]
    assert lines[:2] == [upper[:2], [[-1.0, 0.0], [-1.1, 0.0]]]  # further apart than 0.08 (9 + 14) are the others
    assert len(lines) == 3
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("real part, 1/s", "imaginary part, rad/s")
    assert axis.get_title("left") == "× speed = 1   ○ speed = 4"
    even = SimpleNamespace(parameter="speed", values=np.array([1.0, 2.0, 3.0]), eigenvalues=1j * roots.imag)
    (axis,) = plots.plot_root_locus(even)  # type: ignore[arg-type]  # has all drawn attributes
    assert type(axis.collections[0].norm).__name__ == "Normalize" and axis.get_xlim() == pytest.approx((-0.7, 0.7))
    assert axis.figure.axes[1].get_ylabel() == "speed"


@pytest.mark.slow
def test_a_surface_is_drawn_once_below_a_ball_at_rest_with_a_legend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(shapes, "saved", lambda figure, path: kept.append(figure) or path)
    builder = eomgen.SceneBuilder("bowl").body("ball", 1.0, inertia=[4e-4] * 3)
    builder.joint("ball", "free", "base", "ball", initial={"position": [0.08, 0.05, 0.06]})
    contact = {"shape": "sphere", "radius": 0.05, "surface": "0.5 * (x**2 + y**2)"}
    builder.constraint("contact", "rolling", {"body": "base", "axis": [0, 0, 1]}, {"body": "ball"}, **contact)
    model = eomgen.build(builder.build(), profile="instant")
    rest = model.equilibrium()
    shapes.draw_rest(model, rest.q, 0.0, model.parameter_array(), tmp_path / "a.png")
    (figure,) = kept
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["initial shape", "at rest"]
    for axis in figure.axes:
        surface, first, last = axis.collections
        assert [part.get_alpha() for part in (surface, first, last)] == [1.0, 0.15, 1.0]
        ground = np.array([int("c2bcae"[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0
        assert np.allclose(np.cross(surface.get_facecolor()[0, :3], ground), 0.0, atol=0.01)
