"""Files of linear models read back as the numbers of the model, in columns that their headings name.

Numbers of the tests are different in every place, so a column under a wrong heading is noticed.
"""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np

from eomgen.products.linear import files as linear_files
from eomgen.products.linear.eigenvalue_loci import Campbell, RootLocus
from eomgen.products.linear.spectra import PowerSpectrum, RideTable
from tests.linear.by_hand import linear_model

#: Two coordinates, of which one oscillates; every matrix has numbers of its own.
LINEAR = linear_model(
    [[2.0, 0.5], [0.5, 1.0]], [[0.3, 0.1], [0.2, 40.0]], [[50.0, 3.0], [4.0, 9.0]], ["lift", "tilt"],
    {"u1": [1.0, 0.25]}, {"w1": [0.5, 2.0], "w2": [3.0, -1.0]},
    {"y1": {"q": [1.0, -2.0], "u": [0.7], "w": [0.4, 0.6]}},
    t=2.5, q=np.array([21.0, 31.0]), v=np.array([22.0, 32.0]), a=np.array([23.0, 33.0]), u=np.array([25.0]),
)  # fmt: skip  # a table
MODES = LINEAR.modes()


def columns_of(path: Path) -> dict[str, list[float]]:
    """Return the columns of a table by their headings."""
    headings, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    assert len(set(headings)) == len(headings)
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(headings)}


def test_modes_are_rows_with_real_and_imaginary_parts_of_each_coordinate(tmp_path: Path) -> None:
    values, shapes = MODES.eigenvalues, dict(zip(("lift", "tilt"), MODES.shapes, strict=True))
    expected = {"damping_ratio": -values.real / np.abs(values), "damped frequency [Hz]": values.imag / (2.0 * math.pi)}
    expected |= {"undamped frequency [Hz]": np.abs(values) / (2.0 * math.pi)}
    expected |= {"real [1/s]": values.real, "imaginary [rad/s]": values.imag}
    expected |= {f"{name} real": shape.real for name, shape in shapes.items()}
    expected |= {f"{name} imaginary": shape.imag for name, shape in shapes.items()}
    columns = columns_of(linear_files.write_modes(MODES, tmp_path / "modes.csv"))
    assert set(columns) == set(expected) and 0.0 < MODES.frequency[0] < MODES.frequency[-1]
    for name, column in columns.items():
        np.testing.assert_allclose(column, expected[name], rtol=1e-13)


def test_json_data_of_a_linear_model_hold_its_numbers() -> None:
    data = linear_files.to_json_data(LINEAR, "car")
    assert json.loads(json.dumps(data)) == data and not {"ride", "campbell"}.intersection(data)
    assert (data["scene"], data["about"], data["t"], data["stability"]) == ("car", "equilibrium", 2.5, "stable")
    assert [data[name] for name in "qvz"] == [[21.0, 31.0], [22.0, 32.0], []]
    assert data["disturbances"] == ["w1", "w2"] and data["undamped_frequencies"] == LINEAR.undamped_frequencies.tolist()
    assert data["second_order"] == {name: getattr(LINEAR, name).tolist() for name in ("M0", "C0", "K0", "B0", "E0")}
    assert [mode["oscillating"] for mode in data["modes"]] == MODES.oscillating.tolist()
    for k, mode in enumerate(data["modes"]):
        value, (lift, tilt) = MODES.eigenvalues[k], MODES.shapes[:, k]
        assert mode["eigenvalue"] == [value.real, value.imag]
        assert mode["shape"] == {"lift": [lift.real, lift.imag], "tilt": [tilt.real, tilt.imag]}
        assert (mode["angular_frequency"], mode["uncertainty"]) == (MODES.angular_frequency[k], MODES.uncertainty[k])
        sizes = np.array([abs(value), value.imag]) / (2.0 * math.pi)
        np.testing.assert_allclose([mode[f"{kind}damped_frequency"] for kind in ("un", "")], sizes, rtol=1e-13)


def test_matrices_are_stored_under_their_names(tmp_path: Path) -> None:
    with np.load(linear_files.write_matrices(LINEAR, "car", tmp_path / "car.npz")) as stored:
        arrays = dict(stored)
    metadata = next(json.loads(str(value)) for value in arrays.values() if value.dtype.kind == "U")
    for owner, names in ((LINEAR.state_space(), "ABECDF"), (LINEAR.reference, "qvazu")):
        for name in names:
            np.testing.assert_array_equal(arrays[name], getattr(owner, name))
    for name in ("M0", "C0", "K0", "B0", "E0", "Z0"):
        np.testing.assert_array_equal(arrays[name], getattr(LINEAR, name))
    assert (metadata["scene"], metadata["about"], metadata["t"]) == ("car", "equilibrium", 2.5)
    assert metadata["names"] == {
        "states": ["lift", "tilt", "v.lift", "v.tilt"], "inputs": ["u1"], "disturbances": ["w1", "w2"],
        "outputs": ["y1"], "coordinates": ["lift", "tilt"], "components": ["lift", "tilt"],
    }  # fmt: skip  # names


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
    assert linear_files.to_json_data(LINEAR, "car", table)["ride"][1:3] == [
        {"class": "A", "speed": 20.0, "rms": {"x": 2.0, "y": 3.0}},
        {"class": "B", "speed": 10.0, "rms": {"x": 4.0, "y": 5.0}},
    ]
    lines = linear_files.write_ride(table, tmp_path / "ride.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "class,speed [m/s],rms x [m],rms y (Wk)" and lines[2] == "A,20,2,3" and len(lines) == 5
