"""Spectra of measured roads against the spectrum that a profile was made with, and rms against the road of a class."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.spectra import MeasuredRoad, Road

ROUGHNESS = 64e-6


def profile(length: float, spacing: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a profile with G_d(n) = 64e-6 m^3 (n / 0.1)^-2 from 0.01 to 2.5 cycle/m, by a sum of random waves."""
    random = np.random.default_rng(seed)
    x = np.arange(0.0, length, spacing)
    edges = np.geomspace(0.01, 2.5, 401)
    n = edges[:-1] + random.random(400) * np.diff(edges)
    power = ROUGHNESS * 0.01 * (1.0 / edges[:-1] - 1.0 / edges[1:])  # the integral of the spectrum
    y = np.zeros(len(x))
    for wave, size, phase in zip(n, np.sqrt(2.0 * power), 2.0 * np.pi * random.random(400), strict=True):
        y += size * np.cos(2.0 * np.pi * wave * x + phase)
    return x, y


@pytest.mark.parametrize(("spacing", "segments", "seed"), [(0.1, 8, 0), (0.1, 40, 1)])
def test_a_profile_of_known_spectrum_has_it(spacing: float, segments: int, seed: int) -> None:
    road = MeasuredRoad.of_profile(*profile(1500.0, spacing, seed), segments)
    assert road.band[0] < 0.1 and 0.9 * 0.5 / spacing < road.band[1] < 0.5 / spacing
    for low, high in ((0.1, 0.3), (0.3, 1.0), (1.0, 2.0)):
        n = np.linspace(low, high, 4001)
        found = np.trapezoid(road.over_distance(n), n)
        assert found == pytest.approx(ROUGHNESS * 0.01 * (1.0 / low - 1.0 / high), rel=0.2)


def quarter_car(inputs: dict[str, Any], **sections: Any) -> eomgen.Model:
    """Return a mass on a spring and a damper that stand on a road, with the road's rate as an input of its own."""
    rail = {"type": "prismatic", "parent": "base", "child": "car", "axis": [0, 0, 1]}
    scene = {
        "format": 1,
        "name": "car",
        "bodies": {"car": {"mass": 1.0}},
        "joints": {"x": {**rail, "stiffness": 400.0, "damping": 12.0}},
        "inputs": inputs,
        "efforts": {"road": {"joint": "x", "effort": "400 * road + 12 * rate"}},
        "outputs": {"travel": {"formula": "q.x - road", "unit": "m"}},
    }
    return eomgen.build({**scene, **sections}, profile="quick")


@pytest.mark.slow
def test_a_measured_road_of_a_scene_excites_its_linear_model() -> None:
    x, y = profile(300.0, 0.25, 3)
    points = np.column_stack([x, y]).tolist()
    curve = {"points": points, "interpolation": "linear", "outside": "hold"}
    speed = {"value": 15.0, "unit": "m/s", "tunable": True}
    inputs = {
        "road": {"formula": "track(speed * t - 1.5)", "unit": "m"},
        "rate": {"formula": "speed * derivative.track(speed * t - 1.5)", "unit": "m/s"},
    }
    model = quarter_car(inputs, curves={"track": curve}, parameters={"speed": speed})
    wheels = model.road_excitation()
    assert wheels.wheels == {"road": 0.0} and wheels.rates == {"road": "rate"} and wheels.speed == 15.0
    assert isinstance(wheels.road, MeasuredRoad)
    assert wheels.name == "road of measured, 299.75 m in 8 segments, 0.015 cycle/m apart at 15 m/s"
    np.testing.assert_array_equal(wheels.road.density, MeasuredRoad.of_profile(x, y).density)
    assert repr(wheels.road).endswith("8 segments, 0.015 cycle/m apart: 131 frequencies, 0.0301 to 1.98 cycle/m>")
    assert len(repr(wheels)) < 400
    lin = model.linearize()
    alike = wheels.at(road=Road(roughness=ROUGHNESS, band=wheels.road.band))
    assert lin.rms("travel", wheels) == pytest.approx(lin.rms("travel", alike), rel=0.2)
    fine = np.linspace(*wheels.band, 20_001)
    assert lin.rms("travel", wheels) == pytest.approx(lin.psd("travel", wheels, fine).rms(), rel=1e-3)
    table = lin.ride_table(wheels, ["travel"], classes=())
    assert table.classes == ("measured",) and table.values == pytest.approx(lin.rms("travel", wheels), rel=1e-9)
    assert lin.ride_table(alike, ["travel"], classes=()).classes == ("roughness 6.4e-05 m^3",)
    assert lin.ride_table(wheels.at(road=Road("B")), ["travel"], classes=()).classes == ("B",)
    assert model.road_excitation(Road("B"), 5.0).speed == 5.0
    with pytest.raises(UsageError, match="a measured road has a spectrum of its own, and no class"):
        lin.ride_table(wheels, classes="AB")
    with pytest.raises(UsageError, match="white noise where the exponent is 2 only"):
        lin.rms_on_white_noise_road("travel", wheels)


@pytest.mark.slow
def test_points_of_a_road_at_a_speed_are_measured_and_other_curves_are_not() -> None:
    x, y = profile(40.0, 0.5, 4)
    points = np.column_stack([x, y]).tolist()
    road = {"points": points, "speed": 10.0, "offset": 2.0, "outside": "hold"}
    rate = {"formula": "0", "unit": "m/s"}
    model = quarter_car({"road": {"road": road, "unit": "m"}, "rate": rate})
    assert model.road_excitation().wheels == {"road": 0.0}
    curve = {"points": points, "outside": "hold"}
    squared = {"formula": "2 * track(10 * t)", "unit": "m"}
    other = quarter_car({"road": squared, "rate": rate}, curves={"track": curve})
    with pytest.raises(UsageError, match="no input of the scene is a random road, nor a measured one: a curve at"):
        other.road_excitation()


@pytest.mark.parametrize(
    ("x", "y", "text"),
    [
        ([0.0, 1.0], [0.0, 1.0], "the profile has 2 points, and needs 32 at distances that increase"),
        (np.zeros(40), np.zeros(40), "the profile has 40 points, and needs 32 at distances that increase"),
        (np.arange(40.0), np.zeros(39), r"the profile has the shapes \(40,\) and \(39,\)"),
        (np.append(np.arange(39.0), 1e4), np.zeros(40), "the widest gap of the profile, 9962 m, leaves no frequencies"),
    ],
)
def test_what_is_no_profile_is_refused(x: Any, y: Any, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        MeasuredRoad.of_profile(x, y)


def test_elevations_in_another_unit_are_noted() -> None:
    x, y = profile(400.0, 0.1, 0)
    with pytest.warns(RuntimeWarning, match=r"the road is \S+ times as rough as class H, by the density at 0\.1"):
        MeasuredRoad.of_profile(x, 1e3 * y)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        MeasuredRoad.of_profile(x, 50.0 * y)
