"""Maps: surfaces of SciPy's splines, motions by SciPy's integration, derivatives, files, mistakes."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import netCDF4
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator, make_interp_spline
from scipy.io import netcdf_file

import eomgen
from eomgen.errors import DescriptionError, ModelError
from eomgen.products.maps.section import MapEntry, _Grid, _GridError
from eomgen.products.maps.surface import MapSurface
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

X, Y = np.array([-10.0, -6.0, -1.0, 0.0, 2.0, 5.0, 10.0]), np.linspace(-2.0, 2.0, 5)


def torque(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(3.0 * np.tanh(x / 4.0) * np.cos(y) + 0.1 * x * y)


VALUES = torque(X[:, None], Y[None])


AXLE = {"type": "revolute", "parent": "base", "child": "wheel", "axis": [0, 0, 1]}


def scene(entry: dict[str, Any] | None = None, **sections: Any) -> dict[str, Any]:
    """Return a wheel whose torque is a map of its speed and its angle."""
    lists = {"x": X.tolist(), "y": Y.tolist(), "values": VALUES.tolist(), "outside": "hold"}
    return {
        "format": 1,
        "name": "motor",
        "maps": {"torque": lists if entry is None else entry},
        "bodies": {"wheel": {"mass": 1.0, "inertia": [1, 1, 1]}},
        "joints": {"axle": {**AXLE, "initial": {"velocity": 3}}},
        "efforts": {"drag": {"joint": "axle", "effort": "-map.torque(v.axle, 0.5 * q.axle)"}},
        "outputs": {"torque": {"formula": "map.torque(v.axle, 0.5 * q.axle)", "unit": "N m"}},
        "simulation": {"method": "rosenbrock", "step": 1e-3},
        **sections,
    }


def refusal(data: dict[str, Any] | Path) -> str:
    with pytest.raises(DescriptionError) as raised:
        eomgen.load(data)  # type: ignore[arg-type]
    return str(raised.value)


def natural(x: np.ndarray, values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return SciPy's quintic spline with natural ends along the first axis."""
    zero = np.zeros(values.shape[1:])
    ends = [(3, zero), (4, zero)]
    return np.asarray(make_interp_spline(x, values, k=5, bc_type=(ends, ends))(places))


@pytest.mark.parametrize("turned", [False, True])
def test_surfaces_are_products_of_splines_along_both_axes(*, turned: bool) -> None:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-10.0, 10.0, 40), rng.uniform(-2.0, 2.0, 40)
    along = natural(X, VALUES, x)
    expected = np.array(
        [natural(Y, row[:, None], np.array([place]))[0, 0] for row, place in zip(along, y, strict=True)]
    )
    surface = MapSurface("s", Y, X, VALUES.T) if turned else MapSurface("s", X, Y, VALUES)
    given = (y, x) if turned else (x, y)
    assert len(surface.terms) == len(Y)
    assert np.abs(surface.value("map", 0, *given) - expected).max() < 1e-12


def test_linear_maps_are_bilinear() -> None:
    rng = np.random.default_rng(4)
    places = np.stack([rng.uniform(-10.0, 10.0, 50), rng.uniform(-2.0, 2.0, 50)], axis=1)
    surface = MapSurface("s", X, Y, VALUES, "linear")
    expected = RegularGridInterpolator((X, Y), VALUES)(places)
    assert np.abs(surface.value("map", 0, *places.T) - expected).max() < 1e-13


def test_beyond_the_grid_values_are_held_or_none() -> None:
    held = MapSurface("s", X, Y, VALUES, outside="hold")
    assert held.value("map", 0, 50.0, 9.0) == pytest.approx(VALUES[-1, -1], abs=1e-14)
    assert np.isnan(MapSurface("s", X, Y, VALUES).value("map", 0, 50.0, 0.0))


@pytest.mark.slow
def test_motions_and_partials_follow_the_map() -> None:
    built = eomgen.build(eomgen.load(scene()), profile="quick")
    run = built.simulate(2.0)
    surface = MapSurface("s", X, Y, VALUES, outside="hold")

    def rates(t: float, state: np.ndarray) -> list[float]:
        return [state[1], -float(surface.value("map", 0, state[1], 0.5 * state[0]))]

    exact = solve_ivp(rates, (0.0, 2.0), [0.0, 3.0], rtol=1e-11, atol=1e-12, max_step=0.01)
    assert abs(run.v[-1, 0] - exact.y[1, -1]) < 1e-6
    assert np.abs(run.outputs["torque"] - surface.value("map", 0, run.v[:, 0], 0.5 * run.q[:, 0])).max() < 1e-12
    linear = built.linearize(q=[0.3], v=[1.7])
    step = 1e-5
    slopes = [
        (surface.value("map", 0, 1.7 + dv, 0.15 + dq) - surface.value("map", 0, 1.7 - dv, 0.15 - dq)) / (2 * step)
        for dq, dv in ((0.5 * step, 0.0), (0.0, step))
    ]
    assert np.abs(linear.state_space().A[-1] + slopes).max() < 1e-8


def write(path: Path, rows: list[tuple[float, float, float]]) -> None:
    lines = [f"{x!r},{y!r},{value!r}" for x, y, value in rows]
    path.write_text("\n".join(["speed,angle,torque", *lines, ""]), encoding="utf-8")


GRID = [(float(x), float(y), float(torque(np.asarray(x), np.asarray(y)))) for x in X for y in Y]


def test_files_give_the_same_surface_as_lists(tmp_path: Path) -> None:
    write(
        tmp_path / "grid.csv",
        [(x * 30.0 / np.pi, y, z) for x, y, z in np.random.default_rng(1).permutation(GRID).tolist()],
    )
    with netcdf_file(tmp_path / "grid.nc", "w") as file:
        for name, data in (("speed", X), ("angle", Y)):
            file.createDimension(name, len(data))
            file.createVariable(name, "d", (name,))[:] = data
        file.createVariable("torque", "d", ("speed", "angle"))[:] = VALUES
    names = {"x": "speed", "y": "angle", "value": "torque"}
    tables = [{"file": "grid.csv", "x_unit": "rpm"}, {"file": "grid.nc", **names}]
    for table in tables:
        surface = eomgen.load(_file(tmp_path, table)).parts["maps"][0]
        assert np.abs(surface.x - X).max() < 1e-12 and np.array_equal(surface.y, Y)
        assert np.abs(surface.z - VALUES).max() < 1e-15


def _file(folder: Path, table: dict[str, Any]) -> Path:
    """Write a scene with a map from a table; return its path."""
    path = folder / "scene.toml"
    keys = ", ".join(f'{key} = "{value}"' for key, value in table.items())
    path.write_text(
        f"""
        format = 1
        name = "motor"
        maps.torque = {{ outside = "hold", table = {{ {keys} }} }}
        bodies.wheel = {{ mass = 1.0, inertia = [1, 1, 1] }}
        joints.axle = {{ type = "revolute", parent = "base", child = "wheel", axis = [0, 0, 1] }}
        efforts.drag = {{ joint = "axle", effort = "-map.torque(v.axle, q.axle)" }}
        """,
        encoding="utf-8",
    )
    return path


def test_holes_and_repeated_nodes_of_a_file_are_told_with_their_place(tmp_path: Path) -> None:
    write(tmp_path / "grid.csv", [row for row in GRID if row[:2] != (2.0, 1.0)])
    assert "the grid of 7 x 5 nodes has 1 hole, the first at x = 2, y = 1; try: a row for each pair" in refusal(
        _file(tmp_path, {"file": "grid.csv"})
    )
    write(tmp_path / "grid.csv", [*GRID, GRID[3]])
    assert "grid.csv:5 (maps.torque.table): the node x = -10, y = 1 has several values; try: one row" in refusal(
        _file(tmp_path, {"file": "grid.csv"})
    )
    (tmp_path / "grid.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    assert "the file cannot be read as NetCDF" in refusal(_file(tmp_path, {"file": "grid.nc"}))


LISTS = {"x": [0, 1, 2], "y": [0, 1], "values": [[1, 2], [3, 4], [5, 6]]}
MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "no values": ({"x": [0, 1], "y": [0, 1]}, "(maps.torque): a map needs values; try: x, y and values, or a table"),
    "few lists": ({**LISTS, "values": [[1, 2]]}, "(maps.torque.values): 1 list of values for 3 nodes of x"),
    "short list": (
        {**LISTS, "values": [[1, 2], [3], [5, 6]]},
        "(maps.torque.values[1]): 1 value for 2 nodes of y; try: one value for each node of y",
    ),
    "order": ({**LISTS, "x": [0, 2, 1]}, "(maps.torque.x): node 3 of x: the points are not in order: 1 comes after 2"),
    "repeated node": (
        {**LISTS, "x": [0, 1, 1]},
        "(maps.torque.x): node 3 of x: 1 occurs again; try: increasing nodes of x, values in the same order",
    ),
    "one node": (
        {"x": [0, 1], "y": [0], "values": [[1], [2]]},
        "(maps.torque.y): a grid has two nodes or more of y, not 1; try: more nodes of y",
    ),
    "both": ({**LISTS, "table": {"file": "a.csv"}}, "(maps.torque.table): table and x, y, values are both given"),
    "period": (
        {**LISTS, "outside": "periodic"},
        "(maps.torque): the values of a periodic map differ between the first and the last node",
    ),
    "no file": ({"table": {"file": "missing.csv"}}, "cannot be read"),
    "beyond": (
        {**LISTS, "values": [[1, 2], [3, -1.1e100], [5, 6]]},
        "(maps.torque): the value at x = 1, y = 1 is beyond 1e+100; try: other units",
    ),
}


@pytest.mark.parametrize(("entry", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_told_with_their_key(entry: dict[str, Any], message: str) -> None:
    assert message in refusal(scene(entry))


def test_the_largest_value_of_a_map_is_accepted() -> None:
    eomgen.load(scene({**LISTS, "values": [[1, 2], [3, -1e100], [5, 6]]}))


LINEAR = {"x": [0, 1, 2], "y": [0, 1], "values": [[1, 2], [3, 4], [5, 7]], "interpolation": "linear", "outside": "hold"}


def test_a_mass_is_no_map() -> None:
    bodies = {"wheel": {"mass": "map.torque(1, 1)", "inertia": [1, 1, 1]}}
    assert "map.torque cannot be used here" in refusal(scene(LINEAR, bodies=bodies))


@pytest.mark.slow
def test_a_run_that_leaves_the_grid_names_the_map_and_the_argument() -> None:
    entry = {"x": X.tolist(), "y": Y.tolist(), "values": (0.0 * VALUES).tolist()}
    run = eomgen.build(eomgen.load(scene(entry)), profile="quick").simulate(3.0)
    assert not run.success
    assert "map.torque along y has points from -2 to 2 and is asked at 2." in run.message


@pytest.mark.parametrize(
    ("effort", "message"),
    [
        ("map.torque(v.axle)", "map.torque() takes 2 arguments, not 1 (column 1); try: map.torque(x, y)"),
        ("map.missing(v.axle, 0)", "missing"),
        ("map.torque", "map.torque is a function of x, y"),
        ("torque(v.axle, 0)", "unknown function 'torque' (column 1); try: map.torque(x, y)"),
        ("maps.torque(v.axle, 0)", "only functions can be called, not 'maps.torque' (column 1); try: map.torque(x, y)"),
        ("derivative.torque(v.axle, 0)", "there is no curve 'torque' (column 1); try: map.torque(x, y), which has no"),
        ("derivative.map.torque(v.axle, 0)", "only functions can be called (column 1); try: map.torque(x, y) without"),
    ],
)
def test_mistakes_in_calls_of_maps_are_told(effort: str, message: str) -> None:
    assert message in refusal(scene(efforts={"drag": {"joint": "axle", "effort": effort}}))


def test_netcdf_files_are_scaled_turned_and_without_missing_values(tmp_path: Path) -> None:
    """A square grid with y first, packed by a scale and an offset; then a missing value."""
    x, y = np.arange(3.0), np.arange(3.0)
    z = 10.0 * x[:, None] + y
    with netcdf_file(tmp_path / "grid.nc", "w") as file:
        for name, data in (("x", x), ("y", y)):
            file.createDimension(name, 3)
            file.createVariable(name, "d", (name,))[:] = data
        packed = file.createVariable("z", "i", ("y", "x"))
        packed[:] = (z.T - 1.0) * 2.0
        packed.scale_factor, packed.add_offset = 0.5, 1.0
        file.variables["x"].units = "rpm"
        file.variables["y"].units = "degrees east"
        file.variables["z"].units = "N m"
    table = {"file": "grid.nc", "x": "x", "y": "y", "value": "z"}
    notes = [note for note in eomgen.load(_file(tmp_path, table)).notes if note.startswith("maps.")]
    text = (
        "maps.torque.table.x: the numbers of the column 'x [rpm]' are taken in SI without a conversion; try: x_unit = "
    )
    assert notes == [f'{text}"rpm"']
    assert not [
        note for note in eomgen.load(_file(tmp_path, {**table, "x_unit": "rpm"})).notes if "taken in SI" in note
    ]
    assert np.array_equal(eomgen.load(_file(tmp_path, table)).parts["maps"][0].z, z)
    with netcdf_file(tmp_path / "grid.nc", "a") as file:
        file.variables["x"][1] = np.nan
    assert "a node of the arguments is not a number" in refusal(_file(tmp_path, table))
    (tmp_path / "grid.nc").write_bytes((tmp_path / "grid.nc").read_bytes()[:60])
    assert "the file cannot be read as NetCDF" in refusal(_file(tmp_path, table))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"value": "w"}, "there is no variable 'w'; try: one of "),
        (
            {"value": "flat"},
            "the variables have the shapes (3,), (2,) and (3,), not (n,), (m,) and (n, m); try: the arg",
        ),
        ({"x": "z"}, "the variables have the shapes (3, 2), (2,) and (3, 2), not"),
        ({}, "the value at x = 1, y = 1 is not a number, or the file's mark of a missing value; try: a grid without"),
    ],
)
def test_variables_of_netcdf_that_are_no_grid(change: dict[str, str], message: str, tmp_path: Path) -> None:
    with netcdf_file(tmp_path / "grid.nc", "w") as file:
        file.createDimension("x", 3)
        file.createDimension("y", 2)
        for name, axes, data in (
            ("x", ("x",), np.arange(3.0)),
            ("y", ("y",), np.arange(2.0)),
            ("z", ("x", "y"), np.ones((3, 2))),
            ("flat", ("x",), np.ones(3)),
        ):
            file.createVariable(name, "d", axes)[:] = data
        file.variables["z"][1, 1] = np.nan
    assert message in refusal(_file(tmp_path, {"file": "grid.nc", "x": "x", "y": "y", "value": "z", **change}))


@pytest.mark.parametrize(
    ("shape", "fits"),
    [((200, 3), True), ((201, 200), True), ((201, 201), False), ((500, 200), True), ((501, 200), False)],
)
def test_grids_have_so_many_nodes_at_most(shape: tuple[int, int], fits: bool) -> None:
    grid = _Grid("maps.m", "m", MapEntry(outside="hold"), SimpleNamespace(report=None), Path())  # type: ignore[arg-type]
    x, y = (np.arange(float(count)) for count in shape)
    if fits:
        grid._check(x, y, np.zeros(shape))
        return
    with pytest.raises(_GridError) as raised:
        grid._check(x, y, np.zeros(shape))
    assert (
        f"the grid has {shape[0]} x {shape[1]} nodes, more than 100000 or than 200 along both axes"
        in raised.value.args[1]
    )


def test_files_of_netcdf_4_and_their_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packed with y first, as netCDF4 writes it; the attribute of a unit is noted."""
    x, y = np.arange(3.0), np.arange(4.0)
    z = 10.0 * x[:, None] + y
    with netCDF4.Dataset(tmp_path / "grid.nc", "w") as file:
        for name, data in (("x", x), ("y", y)):
            file.createDimension(name, len(data))
            file.createVariable(name, "f8", (name,))[:] = data
        packed = file.createVariable("z", "i2", ("y", "x"), fill_value=-1)
        packed.scale_factor, packed.add_offset = 0.5, 1.0
        packed[:] = z.T
        file["x"].units, file["y"].units = "rpm", "V"
    table = {"file": "grid.nc", "x": "x", "y": "y", "value": "z"}
    read = eomgen.load(_file(tmp_path, table))
    assert np.array_equal(read.parts["maps"][0].z, z)
    (note,) = (note for note in read.notes if "taken in SI" in note)
    assert note.startswith("maps.torque.table.x: the numbers of the column 'x [rpm]' are taken in SI without a conver")
    monkeypatch.setitem(sys.modules, "netCDF4", None)
    (tmp_path / "scene.toml").touch()
    fault = (
        "files of NetCDF 4 are read by the package netCDF4, which is not installed; try: pip install 'eomgen[netcdf]',"
    )
    assert fault in refusal(_file(tmp_path, {**table, "x_unit": "rpm"}))


def test_units_of_lists_beside_a_table_are_refused(tmp_path: Path) -> None:
    write(tmp_path / "grid.csv", SMALL)
    path = _file(tmp_path, {"file": "grid.csv"})
    path.write_text(path.read_text().replace("table =", 'x_unit = "rpm", table ='))
    fault = "scene.toml:4 (maps.torque.x_unit): x_unit is the unit of a list, and a table has its own; try: table ="
    assert f'{fault} {{ file = ..., x_unit = "rpm" }}' in refusal(path)


def test_lists_have_units() -> None:
    entry = {"x": [0, 30], "x_unit": "rpm", "y": [0, 90], "y_unit": "deg", "values": [[0, 1], [2, 3]]}
    entry |= {"value_unit": "kN m"}
    (surface,) = eomgen.load(scene({**entry, "interpolation": "linear", "outside": "hold"})).parts["maps"]
    np.testing.assert_allclose([surface.x[1], surface.y[1], surface.z[1, 1]], [np.pi, np.pi / 2, 3000.0], rtol=1e-15)
    assert surface.units == ("rad/s", "rad", "N m")


@pytest.mark.parametrize(("folder", "title"), [(".", "speed [rpm]"), ("sub", "[rpm]")])
def test_units_in_titles_of_columns_are_noted(folder: str, title: str, tmp_path: Path) -> None:
    """Of files above the folder of the scene units alone are quoted."""
    (tmp_path / "sub").mkdir()
    write(tmp_path / "grid.csv", GRID)
    text = (tmp_path / "grid.csv").read_text().replace("speed,angle", "speed [rpm],angle")
    (tmp_path / "grid.csv").write_text(text)
    note = f"maps.torque.table.x: the numbers of the column '{title}' are taken in SI without a conversion"
    note += '; try: x_unit = "rpm"'
    file = "grid.csv" if folder == "." else "../grid.csv"
    assert note in eomgen.load(_file(tmp_path / folder, {"file": file})).notes
    assert note not in eomgen.load(_file(tmp_path / folder, {"file": file, "x_unit": "rpm"})).notes


@pytest.mark.parametrize("section", ["constraint", "drive"])
def test_a_linear_map_in_a_motion_is_one_fault(section: str) -> None:
    """Of all lines of the grid."""
    many = {"x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 2.0], "values": [[0.0] * 3] * 3, "interpolation": "linear"}
    data = scene(many)
    if section == "drive":
        data["joints"]["axle"]["drive"] = "map.torque(t, 1)"
        fault = "(joints.axle.drive): a motion cannot follow map.torque along y, which bends at 1"
    else:
        data["constraints"] = {"c": {"type": "formula", "equation": "map.torque(q.axle, 1)", "unit": "m"}}
        fault = "a constraint needs two derivatives of its equation, and map.torque along y bends at 1"
    assert refusal(data).count("bends") == 1 and fault in refusal(data)


def test_constant_arguments_beyond_the_grid_are_refused() -> None:
    entry = {"x": [0, 1], "y": [0, 1], "values": [[1, 2], [3, 4]], "interpolation": "linear"}
    data = scene(entry, efforts={"drag": {"joint": "axle", "effort": "map.torque(7, 1)"}}, outputs={})
    with pytest.raises(ModelError, match="the map torque has no value at constant arguments beyond the grid"):
        eomgen.build(eomgen.load(data))


def test_columns_without_a_unit_next_to_others_are_noted(tmp_path: Path) -> None:
    write(tmp_path / "grid.csv", GRID)
    fault = "its numbers are taken as they are, without a unit, unlike the numbers of x"

    def found(**units: str) -> list[str]:
        notes = eomgen.load(_file(tmp_path, {"file": "grid.csv", **units})).notes
        return [note for note in notes if note.startswith("maps.")]

    assert found(x_unit="rpm") == [
        f'maps.torque.table.{name}: {fault}; try: {name}_unit = "1" for plain numbers, or the unit of its column'
        for name in ("y", "value")
    ]
    assert found() == found(x_unit="rpm", y_unit="deg", value_unit="1") == []
    text = (tmp_path / "grid.csv").read_text().replace("angle,torque", "angle [rad],torque [N m]")
    (tmp_path / "grid.csv").write_text(text)
    assert found(x_unit="rpm") == []


def test_an_argument_that_is_a_plain_number_is_no_angle(tmp_path: Path) -> None:
    write(tmp_path / "grid.csv", GRID)
    path = _file(tmp_path, {"file": "grid.csv", "y_unit": "1"})
    path.write_text(path.read_text().replace("q.axle)", "gravity.axle)"))
    assert "argument y of map.torque is in 1 by its own entry, and is given here" in refusal(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": ["0 rpm", "9 rpm"]}, "(maps.torque.x[0]): a number is needed here, not '0 rpm'; try: x_unit = \"rpm\""),
        ({"values": [["1 kN m", 2], [3, 4]]}, "not '1 kN m'; try: value_unit = \"kN m\", and numbers alone in values"),
    ],
)
def test_numbers_with_units_in_lists_are_told_the_key(change: dict[str, Any], message: str) -> None:
    assert message in refusal(scene({"x": [0, 1], "y": [0, 1], "values": [[1, 2], [3, 4]], **change}))


SMALL = [(0.0, 0.0, 1.0), (0.0, 1.0, 2.0), (1.0, 0.0, 3.0), (1.0, 1.0, 4.0), (2.0, 0.0, 5.0), (2.0, 1.0, 6.0)]


@pytest.mark.parametrize(
    ("rows", "table", "message"),
    [
        (SMALL, {"x": "speed", "y": "speed"}, "(maps.torque.table): x and y are the same column 'speed'"),
        (SMALL, {"y_unit": "mm"}, "the argument y of map.torque is in m by its own entry, and is given here in rad"),
        (SMALL, {"x_unit": "rmp"}, "(maps.torque.table.x_unit): there is no unit 'rmp'"),
    ],
)
def test_files_and_units_that_do_not_fit(
    tmp_path: Path, rows: list[tuple[float, float, float]], table: dict[str, Any], message: str
) -> None:
    write(tmp_path / "grid.csv", rows)
    assert message in refusal(_file(tmp_path, {"file": "grid.csv", **table}))


def test_a_table_in_the_layout_of_a_matrix_is_told(tmp_path: Path) -> None:
    (tmp_path / "grid.csv").write_text(",0,12,24\n-100,1,4,6\n0,0,3,6\n100,-1,2,5\n", encoding="utf-8")
    assert "; try: a row x, y, value for each node: a first row of numbers is of a matrix" in refusal(
        _file(tmp_path, {"file": "grid.csv"})
    )


def test_surfaces_that_overshoot_are_noted_once() -> None:
    entry = {"x": [-1, 0, 0.01, 1], "y": [-10, 10], "values": [[0, 0], [0, 0], [1, 1], [1, 1]], "outside": "hold"}
    notes = [note for note in eomgen.derive(scene(entry)).notes if "the spline is" in note]
    assert len(notes) == 1 and notes[0].startswith("map.torque along x at y = -10: the spline is ")
    assert not [note for note in eomgen.derive(scene()).notes if "the spline is" in note]
    linear = scene({**entry, "interpolation": "linear"})
    assert not [note for note in eomgen.derive(linear).notes if "the spline is" in note]
    turned = {"x": entry["y"], "y": entry["x"], "values": np.array(entry["values"]).T.tolist(), "outside": "hold"}
    notes = [note for note in eomgen.derive(scene(turned)).notes if "the spline is" in note]
    assert len(notes) == 1 and notes[0].startswith("map.torque along y at x = -10: the spline is ")


@pytest.mark.parametrize(
    ("end", "effort", "noted"),
    [(360.0, "map.torque(q.axle, 0)", True), (6.0, "map.torque(q.axle, 0)", False), (360.0, "map.torque(t, 0)", False)],
)
def test_periods_of_angles_in_degrees_are_noted(end: float, effort: str, *, noted: bool) -> None:
    values = [[0, 1, 0], [1, 2, 1], [0, 1, 0]]
    entry = {"x": [0, end / 3, end], "y": [-1, 0, 1], "values": values, "outside": "periodic"}
    loaded = eomgen.load(scene(entry, efforts={"drag": {"joint": "axle", "effort": effort}}, outputs={}))
    text = (
        'efforts.drag.effort: map.torque along x has a period of 360 rad; try: the unit of degrees: "90 deg" in points,'
    )
    notes = [note for note in loaded.notes if "has a period" in note]
    assert [note[: len(text)] for note in notes] == [text] * noted
