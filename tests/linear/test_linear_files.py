"""Files of linear models read back as the numbers of the model, in columns that their headings name.

Numbers of the tests are different in every place, so a column under a wrong heading is noticed.
"""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from eomgen.products.linear import files as linear_files
from eomgen.products.linear.eigenvalue_loci import Campbell, Crossing, RootLocus
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.modes import Modes
from eomgen.products.linear.spectra import PowerSpectrum, RideTable

VALUES = np.array([-0.5 + 0j, -0.2 + 3j, 0.1 + 7j])
SHAPES = np.array([[1.0, 0.25 - 0.5j, 0.125j], [0.5, 1.0, -0.75 + 0.375j]])
TURN = 2.0 * math.pi
MODES = Modes(
    eigenvalues=VALUES,
    angular_frequency=np.abs(VALUES),
    frequency=np.abs(VALUES) / (2.0 * math.pi),
    damping_ratio=-VALUES.real / np.abs(VALUES),
    uncertainty=np.array([1e-9, 2e-9, 3e-9]),
    shapes=SHAPES,
    state_shapes=np.zeros((4, 3), complex),
    coordinates=("lift", "tilt"),
    weights=np.ones(2),
)


def columns_of(path: Path) -> dict[str, list[float]]:
    """Return the columns of a table by their headings."""
    headings, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    assert len(set(headings)) == len(headings)
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(headings)}


def linear_model() -> Linearization:
    """Return a linear model of two coordinates, as far as files hold it: every matrix has numbers of its own."""
    space: dict[str, Any] = {name: np.full((2, 2), k + 1.0) for k, name in enumerate("ABECDF")}
    space |= {"states": ("s",), "inputs": ("u1",), "disturbances": ("w1", "w2"), "outputs": ("y1",)}
    second = {name: np.full((2, 2), k + 11.0) for k, name in enumerate(("M0", "C0", "K0", "B0", "E0", "Z0"))}
    reference = {name: np.array([k + 21.0]) for k, name in enumerate("qvazu")} | {"what": "equilibrium", "t": 2.5}
    return cast(
        Linearization,
        SimpleNamespace(
            **second,
            reference=SimpleNamespace(**reference),
            coordinates=("lift", "tilt"),
            multiblade=None,
            names=SimpleNamespace(components=("v.lift", "v.tilt")),
            free=SimpleNamespace(holonomic=True, R=np.eye(2)),
            modes=lambda: MODES,
            state_space=lambda: SimpleNamespace(**space),
            undamped_frequencies=np.array([0.5, 1.25]),
        ),
    )


def test_crossings_name_the_first_mode_one() -> None:
    crossings = (Crossing(1.0, 10.0, 10.0, 0, "forward"), Crossing(2.0, 7.0, 14.0, 3, ""))
    diagram = cast(Campbell, SimpleNamespace(crossings=crossings, number=lambda mode: mode + 1))
    assert linear_files.to_json_data(linear_model(), "car", None, diagram)["campbell"] == [
        {"order": 1.0, "speed": 10.0, "frequency": 10.0, "mode": 1, "whirl": "forward"},
        {"order": 2.0, "speed": 7.0, "frequency": 14.0, "mode": 4, "whirl": ""},
    ]


def test_modes_are_rows_with_real_and_imaginary_parts_of_each_coordinate(tmp_path: Path) -> None:
    columns = columns_of(linear_files.write_modes(MODES, tmp_path / "modes.csv"))
    assert columns == {
        "undamped frequency [Hz]": MODES.frequency.tolist(),
        "damped frequency [Hz]": (np.abs(MODES.eigenvalues.imag) / (2.0 * math.pi)).tolist(),
        "damping_ratio": MODES.damping_ratio.tolist(),
        "real [1/s]": [-0.5, -0.2, 0.1],
        "imaginary [rad/s]": [0.0, 3.0, 7.0],
        "lift real": [1.0, 0.25, 0.0],
        "lift imaginary": [0.0, -0.5, 0.125],
        "tilt real": [0.5, 1.0, -0.75],
        "tilt imaginary": [0.0, 0.0, 0.375],
    }


def test_json_data_of_a_linear_model_hold_its_numbers() -> None:
    data = linear_files.to_json_data(linear_model(), "car")
    assert json.loads(json.dumps(data)) == data and not {"ride", "campbell"}.intersection(data)
    assert (data["scene"], data["about"], data["t"], data["stability"]) == ("car", "equilibrium", 2.5, "unstable")
    assert [data[name] for name in "qvz"] == [[21.0], [22.0], [24.0]]
    assert data["disturbances"] == ["w1", "w2"] and data["undamped_frequencies"] == [0.5, 1.25]
    assert {name: rows[0][0] for name, rows in data["second_order"].items()} == {
        "M0": 11.0, "C0": 12.0, "K0": 13.0, "B0": 14.0, "E0": 15.0,
    }  # fmt: skip
    first, _, last = data["modes"]
    assert (first["eigenvalue"], first["oscillating"], last["oscillating"]) == ([-0.5, 0.0], False, True)
    assert last["shape"] == {"lift": [0.0, 0.125], "tilt": [-0.75, 0.375]}
    assert (last["angular_frequency"], last["uncertainty"]) == (abs(0.1 + 7j), 3e-9)
    frequencies = [last[f"{kind}damped_frequency"] for kind in ("un", "")]
    assert frequencies == [MODES.undamped_frequency[2], MODES.damped_frequency[2]] == [abs(0.1 + 7j) / TURN, 7.0 / TURN]


def test_matrices_are_stored_under_their_names(tmp_path: Path) -> None:
    with np.load(linear_files.write_matrices(linear_model(), "car", tmp_path / "car.npz")) as stored:
        arrays = dict(stored)
    metadata = next(json.loads(str(value)) for value in arrays.values() if value.dtype.kind == "U")
    names = ("A", "B", "E", "C", "D", "F", "M0", "C0", "K0", "B0", "E0", "Z0", "q", "v", "a", "z", "u")
    assert [float(arrays[name].ravel()[0]) for name in names] == [*range(1, 7), *range(11, 17), *range(21, 26)]
    assert (metadata["scene"], metadata["about"], metadata["t"]) == ("car", "equilibrium", 2.5)
    assert metadata["names"] == {
        "states": ["s"], "inputs": ["u1"], "disturbances": ["w1", "w2"], "outputs": ["y1"],
        "coordinates": ["lift", "tilt"], "components": ["v.lift", "v.tilt"],
    }  # fmt: skip


def test_roots_and_diagrams_are_columns_over_the_parameter(tmp_path: Path) -> None:
    values, roots = np.array([10.0, 20.0]), np.array([[-1 + 2j, -3 + 4j], [-5 + 6j, -7 + 8j]])
    locus = RootLocus("speed", values, roots, ("stable",) * 2)
    assert columns_of(linear_files.write_root_locus(locus, tmp_path / "roots.csv")) == {
        "speed": [10.0, 20.0],
        "root1 real [1/s]": [-1.0, -5.0],
        "root1 imaginary [rad/s]": [2.0, 6.0],
        "root2 real [1/s]": [-3.0, -7.0],
        "root2 imaginary [rad/s]": [4.0, 8.0],
    }
    diagram = Campbell("speed", "rad/s", values, roots, np.array([[1, -1], [0, 1]]), (), (), ("stable",) * 2)
    columns = columns_of(linear_files.write_campbell(diagram, tmp_path / "diagram.csv"))
    assert columns["speed"] == [10.0, 20.0]
    assert (columns["mode1 whirl"], columns["mode2 whirl"]) == ([1.0, 0.0], [-1.0, 1.0])
    np.testing.assert_allclose(columns["mode2 damped frequency [Hz]"], [2.0 / math.pi, 4.0 / math.pi], rtol=1e-15)
    np.testing.assert_allclose(columns["mode1 damping_ratio"], [5**-0.5, 5 / 61**0.5], rtol=1e-15)


def test_spectra_and_responses_are_columns_over_frequencies(tmp_path: Path) -> None:
    f = np.array([0.5, 1.0, 2.0])
    spectra = [PowerSpectrum("travel", "m", f, 3.0 * f), PowerSpectrum("count", "", f, 5.0 * f)]
    columns = columns_of(linear_files.write_spectra(spectra, tmp_path / "spectra.csv"))
    assert [*columns.values()] == [f.tolist(), (3.0 * f).tolist(), (5.0 * f).tolist()]
    assert [*columns] == ["frequency [Hz]", "travel [m^2/Hz]", "count"]
    responses = {("push", "x"): f * (1 + 2j), ("road", "x"): f * (3 - 4j)}
    assert columns_of(linear_files.write_responses(f, responses, tmp_path / "responses.csv")) == {
        "frequency [Hz]": f.tolist(),
        "x / push real": f.tolist(),
        "x / push imaginary": (2.0 * f).tolist(),
        "x / road real": (3.0 * f).tolist(),
        "x / road imaginary": (-4.0 * f).tolist(),
    }


def test_rides_are_rows_by_class_and_speed(tmp_path: Path) -> None:
    speeds, values = np.array([10.0, 20.0]), np.arange(8.0).reshape(2, 2, 2)
    table = RideTable(("x", "y"), ("m", ""), ("A", "B"), speeds, values, ("", "Wk"))
    assert linear_files.to_json_data(linear_model(), "car", table)["ride"][1:3] == [
        {"class": "A", "speed": 20.0, "rms": {"x": 2.0, "y": 3.0}},
        {"class": "B", "speed": 10.0, "rms": {"x": 4.0, "y": 5.0}},
    ]
    lines = linear_files.write_ride(table, tmp_path / "ride.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "class,speed [m/s],rms x [m],rms y (Wk)" and lines[2] == "A,20,2,3" and len(lines) == 5
