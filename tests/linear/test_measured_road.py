"""Spectra of measured roads against the spectrum that a profile was made with, and rms against the road of a class."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.mechanics.describe import describe
from eomgen.products.linear.analyses.road_excitation import road_excitation
from eomgen.products.linear.linearization import Linearization
from eomgen.spectra import MeasuredRoad, Road, RoadExcitation
from tests.linear.by_hand import linear_model

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


@pytest.mark.parametrize(("points", "asked", "used"), [(32, 8, 1), (47, 8, 1), (48, 8, 2), (160, 8, 8), (160, 3, 3)])
def test_short_profiles_have_segments_of_32_points_at_the_least(points: int, asked: int, used: int) -> None:
    x = 0.5 * np.arange(points)
    road = MeasuredRoad.of_profile(x, np.sin(x), asked, source="here")
    length = 2 * points // (used + 1)
    spacing = 1.0 / (0.5 * length)  # of the frequencies of a segment
    assert road.name == f"here, {x[-1]:.6g} m in {used} segments, {spacing:.3g} cycle/m apart"
    np.testing.assert_allclose(road.frequencies, spacing * np.arange(2, length // 2), rtol=1e-12)
    with pytest.raises(UsageError, match="the profile has 31 points, and needs 32"):
        MeasuredRoad.of_profile(x[:31], x[:31])
    gap = MeasuredRoad.of_profile(x, np.sin(x), asked, widest=2.0)
    assert gap.frequencies[-1] <= 0.25 < gap.frequencies[-1] + spacing + 1e-12


def quarter_car(inputs: dict[str, Any], **sections: Any) -> Any:
    """Return a mass on a spring and a damper that stand on a road, with the road's rate as an input of its own; as far
    as its excitation needs a model."""
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
    return SimpleNamespace(description=describe(eomgen.load({**scene, **sections})))


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
    wheels = road_excitation(model)
    assert wheels.wheels == {"road": 0.0} and wheels.rates == {"road": "rate"} and wheels.speed == 15.0
    assert isinstance(wheels.road, MeasuredRoad)
    assert wheels.name == "road of measured, 299.75 m in 8 segments, 0.015 cycle/m apart at 15 m/s"
    np.testing.assert_array_equal(wheels.road.density, MeasuredRoad.of_profile(x, y).density)
    assert repr(wheels.road).endswith("8 segments, 0.015 cycle/m apart: 131 frequencies, 0.0301 to 1.98 cycle/m>")
    assert len(repr(wheels)) < 400
    assert road_excitation(model, Road("B"), 5.0).speed == 5.0
    assert Road(roughness=ROUGHNESS).label == "roughness 6.4e-05 m^3" and wheels.road.label == "measured"
    with pytest.raises(UsageError, match="a measured road has a spectrum of its own, and no class"):
        wheels.road.of_class("A")
    with pytest.raises(UsageError, match="white noise where the exponent is 2 only"):
        car().rms_on_white_noise_road("travel", wheels)


def car() -> Linearization:
    """Return the linear model of ``quarter_car``."""
    inputs, outputs = {"road": [400.0], "rate": [12.0]}, {"travel": {"q": [1.0], "w": [-1.0, 0.0]}}
    return linear_model(1.0, 12.0, 400.0, ["x"], None, inputs, outputs, ["m"])


@pytest.mark.slow
def test_rides_on_a_measured_road_are_those_on_a_road_of_its_roughness() -> None:
    road = MeasuredRoad.of_profile(*profile(300.0, 0.25, 3))
    lin, wheels = car(), RoadExcitation(road, 15.0, {"road": 0.0}, rates={"road": "rate"})
    alike = wheels.at(road=Road(roughness=ROUGHNESS, band=road.band))
    assert lin.rms("travel", wheels) == pytest.approx(lin.rms("travel", alike), rel=0.2)
    fine = np.linspace(*wheels.band, 20_001)
    assert lin.rms("travel", wheels) == pytest.approx(lin.psd("travel", wheels, fine).rms(), rel=1e-3)
    table = lin.ride_table(wheels, ["travel"], classes=())
    assert lin.ride_table(wheels.at(road=Road("B")), ["travel"], classes=()).classes == ("B",)
    with pytest.raises(UsageError, match="a measured road has a spectrum of its own, and no class"):
        lin.ride_table(wheels, classes="AB")
    assert table.classes == ("measured",) and table.values == pytest.approx(lin.rms("travel", wheels), rel=1e-9)


def test_points_of_a_road_at_a_speed_are_measured_and_other_curves_are_not() -> None:
    x, y = profile(40.0, 0.5, 4)
    points = np.column_stack([x, y]).tolist()
    road = {"points": points, "speed": 10.0, "offset": 2.0, "outside": "hold"}
    rate = {"formula": "0", "unit": "m/s"}
    model = quarter_car({"road": {"road": road, "unit": "m"}, "rate": rate})
    assert road_excitation(model).wheels == {"road": 0.0}
    curve = {"points": points, "outside": "hold"}
    squared = {"formula": "2 * track(10 * t)", "unit": "m"}
    other = quarter_car({"road": squared, "rate": rate}, curves={"track": curve})
    with pytest.raises(UsageError, match="no input of the scene is a road: a random one, or a curve at a speed"):
        road_excitation(other)


def random(name: str = "C", speed: float = 15.0, seed: int = 4, **more: Any) -> dict[str, Any]:
    return {"road": {"class": name, "speed": speed, "seed": seed, **more}, "unit": "m"}


def test_wheels_of_one_seed_or_one_profile_run_in_one_track() -> None:
    wheels = road_excitation(quarter_car({"road": random(offset=1.5), "rate": random(), "third": random(seed=5)}))
    assert (wheels.road, wheels.speed, wheels.coherence) == (Road("C"), 15.0, "independent")
    assert wheels.wheels == {"road": 1.5, "rate": 0.0, "third": 0.0}
    assert wheels.tracks == {"road": 0.0, "rate": 0.0, "third": 1.0}
    x, y = profile(40.0, 0.5, 4)
    points, other = np.column_stack([x, y]).tolist(), np.column_stack([x, 2.0 * y]).tolist()
    behind = {"points": points, "speed": 10.0, "outside": "hold"}
    wheels = road_excitation(
        quarter_car({
            name: {"road": {**behind, "offset": offset}, "unit": "m"} for name, offset in (("road", 3.0), ("rate", 1.0))
        })
    )  # fmt: skip  # two wheels
    assert wheels.wheels == pytest.approx({"road": 2.0, "rate": 0.0}) and set(wheels.tracks.values()) == {0.0}
    cases: list[tuple[dict[str, Any], str]] = [
        ({"road": random(), "rate": random("D")}, "the roads of the scene are of the classes C, D"),
        ({"road": random(), "rate": random(speed=20.0)}, "the wheels of the scene have the speeds 15, 20 m/s"),
        (
            {"road": {"road": behind, "unit": "m"}, "rate": {"road": {**behind, "points": other}, "unit": "m"}},
            "the wheels of the scene run over different profiles",
        ),
    ]
    for inputs, text in cases:
        with pytest.raises(UsageError, match=text):
            road_excitation(quarter_car(inputs))
    assert road_excitation(quarter_car(cases[0][0]), Road("B")).road == Road("B")
    assert road_excitation(quarter_car(cases[1][0]), speed=5.0).speed == 5.0
    apart = road_excitation(quarter_car(cases[2][0]), Road("B"))
    assert apart.tracks == {"road": 0.0, "rate": 1.0}
    curve = {"points": points, "outside": "hold"}
    rates = {name: {"formula": "10 * derivative.track(10 * t)", "unit": "m/s"} for name in ("road", "rate")}
    with pytest.raises(UsageError, match="road, rate is the rate of a measured road, and no input is its elevation"):
        road_excitation(quarter_car(rates, curves={"track": curve}))


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
