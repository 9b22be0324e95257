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

from eomgen.cli import simulate
from eomgen.compiled.beams import SectionLoads
from eomgen.errors import UsageError
from eomgen.lie.product import Factor
from eomgen.products.pictures import section_loads, shapes
from eomgen.products.pictures.command import SectionsOfRun

matplotlib.use("Agg")
from matplotlib import pyplot


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


def test_a_copy_that_draws_finds_the_loads_of_beams_in_a_file(rng: np.random.Generator, tmp_path: Path) -> None:
    solution, orders = solution_of(rng), list[dict[str, Any]]()
    copy: Any = SimpleNamespace(order=orders.append)
    order = {"folder": f"{tmp_path}", "over": None}
    model: Any = SimpleNamespace(description=SimpleNamespace(exact_beams=[("rope",), ("mast",)]))
    with simulate._drawing(order, [SectionsOfRun(solution, model), SectionsOfRun(solution)], copy):
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
        return {"rope": section_loads._loads_at_rows(rope, rows)}

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
    monkeypatch.setattr(shapes, "save_figure", lambda figure, path: kept.append(figure) or path)
    monkeypatch.setattr(shapes, "_MachineLines", Machine)
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


def seen(**scenery: Any) -> Any:
    """Return poses of an arm, turned by a quarter about y and moved, and then at rest, with a scenery."""
    half = math.sqrt(0.5)
    poses = {"arm": np.array([[half, 0.0, half, 0.0, 1.0, 2.0, 3.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])}
    return SimpleNamespace(poses=poses, scenery={"bodies": [], "joints": [], "rods": [], **scenery})


def machine(monkeypatch: pytest.MonkeyPatch, **scenery: Any) -> Any:
    monkeypatch.setattr(shapes, "poses_and_scenery", lambda *_: seen(**scenery))
    return shapes._MachineLines(SimpleNamespace(bodies=["arm"]), 0.0, np.zeros(0), np.zeros((2, 1)))  # type: ignore[arg-type]


def test_places_of_bodies_are_turned_and_moved_into_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    """A turn by a quarter about y takes x to -z and z to x."""
    lines = machine(monkeypatch, bodies=[{"name": "arm", "hub": [0, 0, 0], "links": [[1.0, 0.5, 2.0]]}])
    ends = [[[1.0, 2.0, 3.0], [3.0, 2.5, 2.0]], [[0.0, 0.0, 0.0], [1.0, 0.5, 2.0]]]
    (line,) = lines.lines
    np.testing.assert_allclose(line, ends, atol=1e-12)
    np.testing.assert_allclose(lines.places, ends, atol=1e-12)
    assert lines.size == pytest.approx(2.0) and not lines.roads
    np.testing.assert_allclose(lines.all_at("world", [[1.0, 2.0, 3.0]]), np.tile([1.0, 2.0, 3.0], (2, 1, 1)))
    alone = machine(monkeypatch)
    np.testing.assert_allclose(alone.places[:, 0], [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    assert alone.size == 1.0


def test_bodies_with_whole_shapes_have_no_lines_and_supports_are_on_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    part = {"body": "arm", "vertices": [[0.0, 0.0, 0.0], [0.0, 0.0, 4.0]], "whole": True}
    joints = [{"parent": "world", "position": [0.0, 1.0, 0.0], "type": "revolute"},
              {"parent": "base", "position": [0.0, 0.0, 0.0], "type": "free"},
              {"parent": "arm", "position": [0.0, 0.0, 0.0], "type": "revolute"}]  # fmt: skip
    rods = [{"ends": [{"body": "arm", "position": [0, 0, 0]}, {"body": "world", "position": [5.0, 0.0, 0.0]}]}]
    body = {"name": "arm", "hub": [0, 0, 0], "links": [[1.0, 0.0, 0.0]]}
    road = {"places": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}
    lines = machine(monkeypatch, bodies=[body], shapes=[part], joints=joints, rods=rods, roads=[road, {"heights": []}])
    assert lines.lines == [] and lines.size == pytest.approx(4.0) and len(lines.roads) == 1
    np.testing.assert_allclose(
        lines.places, [[[1.0, 2.0, 3.0], [5.0, 2.0, 3.0]], [[0.0] * 3, [0.0, 0.0, 4.0]]], atol=1e-12
    )
    np.testing.assert_allclose(lines.supports(), np.tile([[0.0, 1.0, 0.0], [5.0, 0.0, 0.0]], (2, 1, 1)))
    assert machine(monkeypatch).supports().shape == (2, 0, 3)
    partly = machine(monkeypatch, bodies=[body], shapes=[{**part, "whole": False}])
    assert len(partly.lines) == 1


def test_faces_are_drawn_from_the_back_and_brighter_to_the_viewer() -> None:
    """Of two squares across y, and of one along it, in the plane of x and z, which is seen from negative y."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    side = np.add(square[:, [1, 0, 2]], [0.0, 5.0, 0.0])
    places = np.concatenate([square, np.add(square, [0.0, 2.0, 0.0]), side])
    part = {"faces": [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]], "color": "#ff0000", "opacity": 0.5}
    axis = pyplot.figure().add_subplot()
    shapes._fill(axis, part, places, (0, 2), thin=False, alpha=0.4)
    shapes._fill(axis, {**part, "color": "", "opacity": 1.0}, places, (0, 1), thin=True, alpha=1.0)
    shown, thin = axis.collections
    assert [path.vertices[0].tolist() for path in shown.get_paths()] == [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    widths = [np.ptp(path.vertices[:, 0]) for path in shown.get_paths()]
    assert widths == [0.0, 1.0, 1.0]  # the farthest is the side, which is seen on edge
    np.testing.assert_allclose(shown.get_facecolor()[:, 0], [0.6, 1.0, 1.0])
    assert shown.get_alpha() == pytest.approx(0.2) and thin.get_alpha() == pytest.approx(0.15)
    np.testing.assert_allclose(thin.get_facecolor()[:, :3], 0x99 / 255.0)
    line = axis.lines[0]
    np.testing.assert_array_equal(line.get_xydata(), places[:, [0, 2]])
    assert shapes._nearness(np.array([[1.0, 2.0, 3.0], [3.0, 6.0, 5.0]]), 1) == -4.0
    assert shapes._nearness(np.array([[1.0, 2.0, 3.0], [3.0, 6.0, 5.0]]), 2) == 4.0
