"""Righting moments of hulls: second moment of the water plane, wet length and its lever, by quadrature of the solid."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.pipeline.model import Model
from eomgen.scene.load import from_data
from tests.oracles.states import tape_evaluator

RHO, G, AREA = 1025.0, 9.81, 3.0
RADIUS = math.sqrt(AREA / math.pi)


def _scene(
    diameter: float,
    low: float,
    high: float,
    stations: int,
    joint: dict[str, Any] | None = None,
    body: dict[str, Any] | None = None,
    **hull: Any,
) -> dict[str, Any]:
    """Return a hull along z of its body, whose mass is next to nothing unless a body is given."""
    mass = {"mass": 1e-3, "inertia": [1.0, 1.0, 1.0]} if body is None else body
    waves = hull.pop("sea", None)
    column = {"body": "float", "start": [0, 0, low], "end": [0, 0, high], "diameter": diameter, "stations": stations}
    column |= {"added_mass": 0, "drag": 0, **hull} | ({"waves": "sea"} if waves else {})
    return {
        "format": 1,
        "name": "buoy",
        "bodies": {"float": mass},
        "joints": {"moves": {"parent": "base", "child": "float", **(joint or {"type": "free"})}},
        "hulls": {"column": column},
        **({"waves": {"sea": waves}} if waves else {}),
    }


@cache
def _built(stations: int) -> Model:
    """Return the model of a hull whose section of 3 m^2 counts as a circle, whatever its diameter is."""
    return eomgen.build(from_data(_scene(2.4, -4.0, 5.0, stations, area=AREA)))


def _force(data: dict[str, Any], q: list[float], v: list[float], t: float = 0.0) -> Array:
    """Return the generalized forces of a scene, evaluated on the tape."""
    state = {"q": np.array(q), "v": np.array(v, float), "t": np.array([t])}
    return tape_evaluator(eomgen.derive(from_data(data), ["force"]))("force", state)["Q"]


def _turned(angle: float, about: float) -> tuple[Array, Array]:
    """Return a quaternion of a tilt about a horizontal axis, and its matrix."""
    axis = np.array([math.cos(about), math.sin(about), 0.0])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)]), matrix


def _load(model: Model, turned: tuple[Array, Array], place: Array) -> tuple[Array, Array]:
    """Return force and moment about the origin of the body at rest, in world axes, with its next to no weight."""
    quaternion, matrix = turned
    q = np.concatenate([quaternion, place])
    moment, force = np.split(-model.inverse_dynamics(q, np.zeros(6), np.zeros(6), 0.0), 2)
    return matrix @ force + [0, 0, 1e-3 * G], matrix @ moment


def _by_quadrature(radius: float, low: float, high: float, matrix: Array, place: Array) -> tuple[Array, Array]:
    """Return force and moment about the origin of the body of a wall-sided cylinder whose ends the surface leaves dry
    and wet: filaments along its axis, 40 radii by 64 angles, each wet from its lower end to the surface."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    r, turns = radius * (nodes + 1) / 2, (np.arange(64) + 0.5) * (2 * math.pi / 64)
    radii, angles = (item.ravel() for item in np.meshgrid(r, turns, indexing="ij"))
    area = np.repeat(weights * radius / 2 * r, 64) * (2 * math.pi / 64)
    feet = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.full(radii.size, low)], axis=1) @ matrix.T
    axis = matrix[:, 2]
    wet = np.clip(-(feet[:, 2] + place[2]) / axis[2], 0.0, high - low)
    assert np.all((wet > 0) & (wet < high - low)), "the surface crosses an end"
    middles = feet + 0.5 * wet[:, None] * axis
    forces = np.stack([0 * wet, 0 * wet, RHO * G * area * wet], axis=1)
    return forces.sum(axis=0), np.cross(middles, forces).sum(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("diameter", "draught", "kg", "stiffness", "slices"),
    [
        (10.0, 2.0, 1.5, 4.146e6, (1, 3, 8, 100)),
        (10.0, 20.0, 10.1, 3.36e6, (1, 3, 8, 100)),
    ],
)
def test_the_righting_stiffness_of_a_disc_and_of_a_spar(
    diameter: float, draught: float, kg: float, stiffness: float, slices: tuple[int, ...]
) -> None:
    """rho g V GM with GM = KB + I/V - KG: the figures of textbooks on stability, whatever the number of slices."""
    area = math.pi * diameter**2 / 4
    volume, second = area * draught, math.pi * diameter**4 / 64
    exact = RHO * G * volume * (draught / 2 + second / volume - kg)
    assert exact == pytest.approx(stiffness, rel=5e-3)
    body = {"mass": RHO * volume, "center_of_mass": [0, 0, kg - draught], "inertia": [1e6, 1e6, 1e6]}
    for stations in slices:
        joint = {"type": "revolute", "axis": [0, 1, 0]}
        model = eomgen.build(from_data(_scene(diameter, -draught, 3.0, stations, joint, body)))
        moments = [model.inverse_dynamics([angle], [0.0], [0.0], 0.0)[0] for angle in (1e-4, -1e-4)]
        assert (moments[0] - moments[1]) / 2e-4 == pytest.approx(exact, rel=1e-6), stations
        assert model.linearize([0.0], [0.0]).K0[0, 0] == pytest.approx(exact, rel=2e-5), stations


@pytest.mark.parametrize("seed", range(10))
def test_wall_sided_hulls_at_any_angle_against_quadrature(seed: int) -> None:
    """Also at large angles, as long as the surface crosses no end; sections that are no circles count as one."""
    random = np.random.default_rng(seed)
    model = _built(int(random.choice([1, 8])))
    quaternion, matrix = _turned(random.uniform(0, 1.1), random.uniform(0, 2 * math.pi))
    place = np.array([random.normal(), random.normal(), random.uniform(-0.4, 0.4)])
    force, moment = _by_quadrature(RADIUS, -4.0, 5.0, matrix, place)
    found = _load(model, (quaternion, matrix), place)
    np.testing.assert_allclose(found[0], force, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(found[1], moment, rtol=0, atol=1e-8 * RHO * G * AREA * 30)


def _energy(area: float, low: float, high: float, matrix: Array, height: float) -> float:
    """Return rho g times the integral of the depth over the wet part of a hull whose width counts as uniform."""
    half = math.sqrt(3 * area / (4 * math.pi)) * math.hypot(*matrix[2, :2])
    s, of_s = np.polynomial.legendre.leggauss(600)
    y, of_y = np.polynomial.legendre.leggauss(300)
    s, of_s = (low + high) / 2 + (high - low) / 2 * s, (high - low) / 2 * of_s
    depth = -(height + s[:, None] * matrix[2, 2] + half * y)
    return float(RHO * G * area * of_s @ np.maximum(depth, 0.0) @ (0.5 * of_y))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_forces_are_the_gradient_of_one_energy_wherever_the_hull_is(seed: int) -> None:
    """Upright, lying, upside down, partly or wholly wet, the surface across its ends, by any number of slices."""
    random = np.random.default_rng(100 + seed)
    model = _built(int(random.choice([1, 8])))
    angle = float(random.choice([0.0, math.pi / 2, random.uniform(0, math.pi), 1e-4, math.pi / 2 - 1e-4]))
    about, height = random.uniform(0, 2 * math.pi), float(random.choice([0.0, random.uniform(-5.0, 4.0)]))
    quaternion, matrix = _turned(angle, about)
    force, moment = _load(model, (quaternion, matrix), np.array([0.3, -0.2, height]))
    h, size = 1e-2, RHO * G * AREA * 9

    def slope(energy: Any) -> float:
        return -(8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h)

    lift = slope(lambda x: _energy(AREA, -4.0, 5.0, matrix, height + x))
    turn = slope(lambda x: _energy(AREA, -4.0, 5.0, _turned(angle + x, about)[1], height))
    np.testing.assert_allclose(force, [0, 0, lift], rtol=0, atol=6e-4 * size)
    axis = np.array([math.cos(about), math.sin(about), 0.0])
    assert moment @ axis == pytest.approx(turn, abs=1e-3 * size)
    assert abs(moment @ np.cross([0, 0, 1], axis)) < 1e-6 * size


def test_the_pressure_of_a_long_wave_on_a_fixed_disc() -> None:
    """Pressure rho g A exp(kz) cos(kx - wt) over wall and bottom: a moment that the axis of the disc alone lacks."""
    diameter, draught, A, period = 10.0, 2.0, 1e-3, 9.0
    w = 2 * math.pi / period
    k = w**2 / G
    sea = {"regular": [{"amplitude": A, "period": period}], "stretching": "none"}
    data = _scene(diameter, -draught, 2.0, 40, {"type": "revolute", "axis": [0, 1, 0]}, sea=sea)
    moment = _force(data, [0.0], [0.0], period / 4)[0]  # where the surface is steepest
    # by the divergence theorem: forces rho a on the solid, and the wedge between the surface and the water at rest
    nodes, weights = np.polynomial.legendre.leggauss(60)
    z, of_z = draught * (nodes - 1) / 2, draught / 2 * weights
    x, of_x = diameter / 2 * nodes, diameter / 2 * weights
    chord = 2 * np.sqrt((diameter / 2) ** 2 - x**2)
    ax = -G * A * k * np.cos(k * x)[None, :] * np.exp(k * z)[:, None]
    az = -G * A * k * np.sin(k * x)[None, :] * np.exp(k * z)[:, None]
    solid = RHO * of_z @ (z[:, None] * ax - x * az) @ (of_x * chord)
    wedge = -RHO * G * A * (of_x * chord) @ (np.sin(k * x) * x)
    assert moment == pytest.approx(solid + wedge, rel=0.01)
    assert abs(wedge) > 0.3 * abs(solid + wedge)
