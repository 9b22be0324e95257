"""Roads: the spectrum of ISO 8608 band by band, axles that follow, seeds, and the keys of a scene file."""

from __future__ import annotations

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from eomgen.base.random_inputs import Harmonic, road_harmonics
from eomgen.errors import DescriptionError
from eomgen.formula.recording import unit_circle
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data, load
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

LOW, HIGH = 0.011, 2.83
C_CLASS = 256e-6


def _elevation(harmonics: tuple[Harmonic, ...], times: np.ndarray) -> np.ndarray:
    amplitude, frequency, phase = np.array(harmonics).T
    return np.cos(np.outer(times, frequency) + phase) @ amplitude


def _scene(road: object, **parameters: object) -> Scene:
    return from_data(
        {
            "format": 1,
            "name": "car",
            "parameters": parameters,
            "inputs": {"road": {"road": road}},
            "bodies": {"wheel": {"mass": 1.0}},
            "joints": {"hub": {"type": "prismatic", "parent": "base", "child": "wheel", "axis": [0, 0, 1]}},
        },
        file="car.toml",
    )


@pytest.mark.parametrize("count", [1, 7, 200, 2000])
def test_variance_of_elevation_is_the_integral_of_the_spectrum(count: int) -> None:
    amplitudes = np.array(road_harmonics("C", 20.0, seed=4, harmonics=count))[:, 0]
    integral = quad(
        lambda x: C_CLASS * (math.exp(x) / 0.1) ** -2 * math.exp(x), math.log(LOW), math.log(HIGH), epsrel=1e-13
    )[0]
    assert np.sum(amplitudes**2) / 2 == pytest.approx(integral, rel=1e-12)


@pytest.mark.parametrize("speed", [3.0, 20.0, 90.0])
def test_variance_of_velocity_is_the_integral_of_the_white_spectrum(speed: float) -> None:
    # the band's variance sits at its geometric centre n_c: n_c^2 (1/n_1 - 1/n_2) = n_2 - n_1, so velocities are exact
    # as well
    amplitude, frequency, _ = np.array(road_harmonics("C", speed, seed=4, harmonics=300)).T
    white = 4.0 * math.pi**2 * 0.1**2 * C_CLASS * speed  # (m/s)^2 per Hz, over the frequencies speed * n
    assert np.sum((amplitude * frequency) ** 2) / 2 == pytest.approx(white * speed * (HIGH - LOW), rel=1e-12)


def test_wavelengths_stay_within_the_band_of_the_standard() -> None:
    frequency = np.array(road_harmonics("A", 20.0, harmonics=50))[:, 1]
    assert LOW < frequency.min() / (2 * math.pi * 20.0) < frequency.max() / (2 * math.pi * 20.0) < HIGH
    assert np.all(np.diff(frequency) > 0.0)


def test_rear_wheel_is_the_front_wheel_later() -> None:
    speed, wheelbase = 20.0, 3.1
    front, rear = road_harmonics("C", speed, seed=9), road_harmonics("C", speed, seed=9, offset=wheelbase)
    times = np.linspace(0.0, 30.0, 401)
    scale = np.abs(_elevation(front, times)).max()
    np.testing.assert_allclose(
        _elevation(rear, times + wheelbase / speed), _elevation(front, times), atol=1e-11 * scale, rtol=0
    )
    assert np.abs(_elevation(rear, times) - _elevation(front, times)).max() > 0.1 * scale


def test_seed_decides_the_road() -> None:
    assert road_harmonics("C", 20.0, seed=1) == road_harmonics("C", 20.0, seed=1)
    assert road_harmonics("C", 20.0, seed=1) != road_harmonics("C", 20.0, seed=2)
    first, second = 0.13436424411240122, 0.8474337369372327  # the Mersenne Twister seeded with 1, on every machine
    phases = [phase for _, _, phase in road_harmonics("C", 20.0, seed=1, harmonics=2)]
    assert phases == pytest.approx([2 * math.pi * first, 2 * math.pi * (second - 1.0)], abs=1e-14)


def test_each_class_is_twice_as_high_as_the_one_before() -> None:
    roads = [np.array(road_harmonics(letter, 20.0, seed=3)) for letter in "ABCDEFGH"]
    for smooth, rough in pairwise(roads):
        np.testing.assert_allclose(rough[:, 0] ** 2, 4.0 * smooth[:, 0] ** 2, rtol=1e-14)
        np.testing.assert_array_equal(rough[:, 1:], smooth[:, 1:])
    assert np.sum(roads[0][:, 0] ** 2) / 2 == pytest.approx(16e-6 * 0.01 * (1 / LOW - 1 / HIGH), rel=1e-12)


def test_scene_file_reaches_the_harmonics() -> None:
    scene = _scene(
        {"class": "D", "speed": "fast", "seed": 5, "offset": "2 * base_half", "harmonics": 30}, fast=25, base_half=1.5
    )
    assert scene.inputs[0].harmonics == road_harmonics("D", 25.0, seed=5, offset=3.0, harmonics=30)
    assert scene.inputs[0].given
    assert _scene({"class": "C", "speed": 20}).inputs[0].harmonics == road_harmonics("C", 20.0)
    assert scene.digest != _scene({"class": "D", "speed": 25, "seed": 6, "offset": 3.0, "harmonics": 30}).digest


def test_phases_of_roads_are_in_the_amplitudes_to_the_last_bit() -> None:
    harmonics = road_harmonics("C", 20.0, seed=11, offset=3.1)
    for _, frequency, phase in harmonics:
        for turns in range(4):
            with mpmath.workdps(60):
                exact = mpmath.mpf(phase) + turns * mpmath.pi / 2
                wanted = (float(mpmath.cos(exact)), float(mpmath.sin(exact)))
            assert unit_circle(phase, turns) == wanted
            assert unit_circle(1e5 * frequency)[0] == pytest.approx(math.cos(1e5 * frequency), abs=2e-16)


def _tracks(arguments: tuple[str, ...]) -> System:
    """Return a scene of the heights of one profile at several places of a slider."""
    return derive(
        from_data(
            {
                "format": 1,
                "name": "tracks",
                "parameters": {"late": {"value": 1.5, "tunable": True}},
                "curves": {"ground": {"road": {"class": "C", "seed": 3}}},
                "bodies": {"cart": {"mass": 1.0}},
                "joints": {"slide": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}},
                "outputs": {f"y{k}": {"formula": f"ground({text})"} for k, text in enumerate(arguments)},
            }
        ),
        ["outputs"],
    )


def test_constants_beside_the_argument_are_phases() -> None:
    arguments = {
        "q.slide + 1.25": lambda q: q + 1.25,
        "q.slide - 2": lambda q: q - 2.0,
        "3 - q.slide": lambda q: 3.0 - q,
        "-q.slide": lambda q: -q,
        "2 * (q.slide - 0.5)": lambda q: 2.0 * (q - 0.5),
        "-(1 - 2 * q.slide) + 4": lambda q: 2.0 * q + 3.0,
        "q.slide": lambda q: q,
    }
    system = _tracks(tuple(arguments))
    harmonics = road_harmonics("C", 1.0, seed=3)
    size = sum(amplitude for amplitude, _, _ in harmonics)
    for q in (0.0, 0.3, -7.0, 200.0):
        found = evaluate(system.tape, system.functions["outputs"].refs, {"q": [q], "p": [1.5]})
        for value, place in zip(found, arguments.values(), strict=True):
            exact = math.fsum(a * math.cos(w * place(q) + phase) for a, w, phase in harmonics)
            assert value == pytest.approx(exact, abs=3e-15 * size * (1.0 + 18.0 * abs(q)))


def test_wheels_over_one_profile_share_its_sines() -> None:
    harmonics = 200
    assert _tracks(("q.slide",)).counts["outputs"].functions == 2 * harmonics
    four = ("q.slide + 1", "q.slide", "q.slide - 2.5", "4 - q.slide")
    assert _tracks(four).counts["outputs"].functions == 2 * harmonics
    assert _tracks(("q.slide", "q.slide + late")).counts["outputs"].functions == 2 * 2 * harmonics


def test_tracks_of_other_seeds_and_axles_share_their_sines() -> None:
    system = derive(load("examples/active_vehicle/scene.toml"), ["residual"])
    counts = system.counts["inputs"]
    assert (counts.functions, counts.multiplications, counts.additions) == (2 * 200, 9 * 200, 8 * 200)
    scene = load("examples/active_vehicle/scene.toml")
    size = sum(amplitude for amplitude, _, _ in scene.inputs[0].harmonics)
    for t in (0.0, 0.37, 19.0):
        found = evaluate(system.tape, system.functions["inputs"].refs, {"t": t})
        wanted = [math.fsum(a * math.cos(w * t + p) for a, w, p in item.harmonics) for item in scene.inputs]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-15 * size * (1.0 + 100.0 * t))


@pytest.mark.parametrize(
    ("road", "message"),
    [
        ({"speed": 20}, "inputs.road.road): a road needs one of class, table, points, bump, not none"),
        ({"class": "C", "bump": {"length": 1, "height": 1}, "speed": 20}, "points, bump, not class and bump"),
        ({"class": "C", "speed": 20, "harmonics": 0}, "0 is out of range here: it should be greater than or equal"),
        ({"class": "C", "speed": 20, "harmonics": 2001}, "2001 is out of range here: it should be less than or equal"),
        ({"class": "C", "speed": 20, "seed": -1}, "inputs.road.road.seed): -1 is out of range here"),
        ({"class": "C", "speed": 2e4}, "the speed 20000 m/s is not between 0 and 10000"),
        (
            {"class": "C", "speed": 20, "offset": 1.1e6},
            "inputs.road.road.offset): the offset 1.1e+06 m is beyond 1000000 m, where phases lose their digits",
        ),
    ],
)
def test_refusals_name_key_and_remedy(road: object, message: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        _scene(road, late={"value": 20.0, "tunable": True})
    assert message in str(caught.value)
