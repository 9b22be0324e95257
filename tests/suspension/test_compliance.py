"""Compliance of an axle on bushings, loads of springs, files of the study, and refused calls."""

from __future__ import annotations

import contextlib
import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError

SYSTEM = Path(__file__).parents[2] / "examples/car/system"
HUBS = ("left_hub", "right_hub")


@cache
def _curves(name: str) -> eomgen.SuspensionCurves:
    return eomgen.suspension(SYSTEM / f"{name}.toml", HUBS, steering="rack", radius=0.29, rows=9)


@pytest.mark.long
def test_an_axle_on_bushings_yields_as_maxwell_says():
    curves = _curves("front_axle_on_bushings").curves
    steer_by_force = np.radians(curves["side force"].slope("left_hub steer")) / 1e3  # rad/N
    shift_by_moment = 1e-3 * curves["aligning moment"].slope("left_hub contact y")  # m/(N m)
    assert steer_by_force == pytest.approx(5.06e-7, rel=0.01)
    assert shift_by_moment == pytest.approx(steer_by_force, rel=0.01)  # the wheel leans by 0.01 rad


@pytest.mark.long
def test_bushings_change_kinematics_little_and_ideal_joints_yield_nothing():
    ideal, elastic = _curves("front_axle").curves, _curves("front_axle_on_bushings").curves
    camber = "left_hub camber"
    assert np.abs(ideal["travel"].columns[camber] - elastic["travel"].columns[camber]).max() < 0.05
    assert np.ptp(ideal["side force"].columns[camber]) < 1e-12
    assert 0.1 < np.ptp(elastic["side force"].columns[camber]) < 0.13


@pytest.mark.slow
def test_the_rate_of_a_wheel_is_that_of_its_spring():
    curves = _curves("front_axle").curves["travel"]
    ratio, load = curves.columns["left_spring motion ratio"], curves.columns["left_hub load"]
    height = 1e-3 * curves.x
    force = 6100.0 + 42000.0 * np.array(
        [np.trapezoid(ratio[:5], height[:5]), 0.0, np.trapezoid(ratio[4:], height[4:])]
    ) * [-1, 0, 1]
    # the load of the wheel is the spring's by the motion ratio, and a nearly constant weight
    weight = load[[0, 4, 8]] - ratio[[0, 4, 8]] * force
    assert np.ptp(weight) < 0.03 * np.ptp(load)
    assert 200.0 < weight[1] < 450.0


@pytest.mark.slow
def test_braking_supports_by_the_path_of_the_locked_wheel():
    found = eomgen.suspension(
        SYSTEM / "rear_axle.toml", HUBS, radius=0.29, rows=5, other_axle=2.7, height=0.55, brake_share=0.35
    )
    columns = {name: values[2] for name, values in found.curves["travel"].columns.items()}
    expected = -100 * np.tan(np.radians(columns["left_hub braking angle"])) * 0.35 * 2.7 / 0.55
    assert columns["left_hub braking support"] == pytest.approx(expected) == pytest.approx(30.7, abs=0.2)
    assert columns["left_hub driving support"] == pytest.approx(65.0, abs=0.2)
    assert "steering" not in found.curves


@pytest.mark.slow
def test_results_are_written_as_tables_a_figure_and_a_page(tmp_path):
    result = _curves("front_axle")
    files = {file.name: file for file in result.save(tmp_path / "out")}
    assert set(files) == {
        *("characteristics.csv", "suspension.html", "suspension.png", "travel.csv", "roll.csv", "steering.csv"),
        *("side_force.csv", "braking_force.csv", "driving_force.csv", "aligning_moment.csv"),
    }
    head, first, *_ = csv.reader(files["travel.csv"].read_text().splitlines())
    assert head[:3] == ["travel, mm", "left_hub toe, deg", "left_hub camber, deg"]
    assert float(first[0]) == -80.0
    assert float(first[2]) == result.curves["travel"].columns["left_hub camber"][0]
    names = [(panel.name, end) for panel, end, _ in result._panels()]
    assert ("steering", "steer") in names
    assert ("side force", "steer") not in names  # it does not change
    page = files["suspension.html"].read_text()
    assert page.count("<canvas") == len(names)
    assert "roll centre height" in page


_AXLE = SYSTEM / "rear_axle.toml"
#: Arguments in place of the right ones, and what is told.
WRONG = [
    ({"hubs": ["left_hup", "right_hub"]}, "suspension: there is no body 'left_hup'; try: left_hub"),
    ({"hubs": []}, "hubs: different bodies are needed, one or more; try: "),
    ({"hubs": HUBS[:1] * 2}, "hubs: different bodies are needed, one or more; try: "),
    ({"hubs": 3}, "hubs are a list of names, not 3; try: hubs="),
    ({"steering": "rack"}, "suspension: there is no joint 'rack'; try: one of "),
    ({"steering": ["left_lever"]}, "suspension: there is no joint "),
    (
        {"steering": "left_ball"},
        "steering left_ball: the joint has 3 coordinates, and one is needed; try: the joint of",
    ),
    ({"ranges": 3}, 'ranges: values by name are needed, not 3; try: ranges={"travel": 0.1}'),
    ({"ranges": "travel"}, "ranges: values by name are needed, not 'travel'; try: "),
    ({"ranges": {3: 0.1}}, "ranges: values by name are needed, not {3: 0.1}; try: "),
    ({"ranges": {"bump": 0.1}}, "suspension: there is no range 'bump'; try: one of travel, roll, steering"),
    ({"ranges": {"travel": (0.1, -0.1)}}, "ranges travel: a number is needed, not tuple"),
    ({"ranges": {"travel": -0.1}}, "ranges travel: a number above 0 is needed, not -0.1; try: 0.1"),
    ({"ranges": {"travel": np.nan}}, "ranges travel: ranges travel is nan, not a finite number; try: "),
    ({"ranges": {"travel": "5 deg"}}, "ranges travel: '5 deg' is an angle, a quantity in mm is expected; try: "),
    ({"ranges": {"steering": 0.1}}, 'ranges steering: the range needs steering; try: steering="rack"'),
    ({"rows": 4}, "rows: a whole number from 5 on is needed, not 4; try: 5"),
    ({"rows": 9.0}, "rows: a whole number from 5 on is needed, not 9.0; try: 5"),
    ({"rows": 6}, "rows: 6 is even, and the middle row is the design position; try: 7"),
    ({"radius": 0.0}, "radius: a number above 0 is needed, not 0; try: "),
    ({"radius": "0.3 s"}, "radius: '0.3 s' is a time, a length in m is expected"),
    ({"height": np.nan}, "height: height is nan, not a finite number"),
    ({"other_axle": None}, "other_axle: a number is needed, not NoneType"),
    ({"brake_share": 1.5}, "brake_share: 1.5 is not a part from 0 to 1; try: "),
    ({"parameters": 3}, 'parameters: values by name are needed, not 3; try: parameters={"rack_z": 0.2}'),
    ({"parameters": {"bar_x": np.inf}}, "parameters bar_x: parameters bar_x is inf, not a finite number"),
    ({"file": {"format": 1}}, "file: the path of a scene file of the axle is needed, not dict; try: "),
    (
        {"file": SYSTEM / "car.toml", "hubs": ["rear_left_hub"]},
        "suspension: the axle has a tyre, front",
    ),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_wrong_calls_are_refused(changes, message):
    arguments = {"file": _AXLE, "hubs": HUBS, **changes}
    with pytest.raises(UsageError) as caught:
        eomgen.suspension(arguments.pop("file"), arguments.pop("hubs"), **arguments)
    assert f"usage error: {message}" in str(caught.value)


@pytest.mark.slow
def test_a_range_beyond_the_reach_of_the_axle_is_told():
    message = r"suspension: travel, 1000 mm: the constraints are off by .*; try: a smaller end of the range"
    with pytest.raises(NumericalError, match=message):
        eomgen.suspension(_AXLE, HUBS, rows=5, ranges={"travel": 2.0})


@pytest.mark.slow
def test_a_radius_in_mm_is_doubted(caplog: pytest.LogCaptureFixture) -> None:
    with contextlib.suppress(eomgen.NumericalError):
        eomgen.suspension(SYSTEM / "front_axle.toml", HUBS, steering="rack", radius=290.0, rows=5)
    assert "parameters.rig_left_hub_radius: the length is 290 m, and the scene is no larger than" in caplog.text
