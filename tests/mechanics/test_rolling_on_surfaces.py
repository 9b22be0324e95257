"""Spheres that roll and slide on a surface z = h(x, y): planes as formulas against planes, spheres in troughs and bowls
against Newton's and Euler's equations, and refusals."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.lie.numeric import rotation_matrix

SCENE = """format = 1
name = "ball"
[bodies.ball]
mass = 2
inertia = [0.128, 0.128, 0.128]
[joints.ball]
type = "free"
parent = "base"
child = "ball"
initial = {{ position = {position}, velocity = {velocity} }}
[constraints.road]
type = "{type}"
first = {{ body = "base", axis = {normal}, x_axis = {ahead} }}
second = {{ body = "ball"{axes} }}
{shape}
radius = 0.4
{surface}
"""
START = {"normal": "[0, 0, 1]", "ahead": "[1, 0, 0]", "position": "[0, 0, 0.4]", "velocity": "[0, 0, 0, 0, 0, 0]"}


def model(**keys: str) -> Any:
    text = SCENE.format(**{"type": "rolling", "axes": "", "shape": 'shape = "sphere"', "surface": "", **START, **keys})
    return eomgen.build(eomgen.load(tomllib.loads(text)))


def test_a_plane_as_a_formula_is_the_plane() -> None:
    """Height 0.75 x + 0.2 is the plane with the normal (-0.6, 0, 0.8) through (0, 0, 0.2); same tangents."""
    by_formula = model(surface='surface = "0.75 * x + 0.2"')
    plane = model(normal="[-0.6, 0, 0.8]", ahead="[0.8, 0, 0.6]")
    rng = np.random.default_rng(20)
    q, v = rng.normal(size=(20, 7)), rng.normal(size=(20, 6))
    q[:, :4] /= np.linalg.norm(q[:, :4], axis=1, keepdims=True)
    lower = q - [0, 0, 0, 0, 0, 0, 0.2]
    for first, second in zip(by_formula.constrained_dynamics(q, v), plane.constrained_dynamics(lower, v), strict=True):
        np.testing.assert_allclose(first, second, rtol=1e-12, atol=1e-12)


# -- spheres against Newton's and Euler's equations --------------------------------------------------------------------

SURFACES = {
    "2 * y**2 / 5": (lambda x, y: 0.4 * y * y, lambda x, y: (0.0, 0.8 * y), lambda x, y: (0.0, 0.0, 0.8)),
    "1.5 - sqrt(2.25 - x**2 - y**2)": (
        lambda x, y: 1.5 - np.sqrt(2.25 - x * x - y * y),
        lambda x, y: (x / np.sqrt(2.25 - x * x - y * y), y / np.sqrt(2.25 - x * x - y * y)),
        lambda x, y: tuple(value / (2.25 - x * x - y * y) ** 1.5 for value in (2.25 - y * y, x * y, 2.25 - x * x)),
    ),
    "0.1 * x * y + 0.2 * cos(x)": (
        lambda x, y: 0.1 * x * y + 0.2 * np.cos(x),
        lambda x, y: (0.1 * y - 0.2 * np.sin(x), 0.1 * x),
        lambda x, y: (-0.2 * np.cos(x), 0.1, 0.0),
    ),
}


class RollingSphere:
    """A homogeneous sphere of 0.4 m and 2 kg by the place of its contact and its angular velocity, world axes."""

    radius, mass, inertia, g = 0.4, 2.0, 0.128, 9.81

    def __init__(self, surface: str) -> None:
        self.height, self.slopes, self.curvatures = SURFACES[surface]

    def normal(self, place: np.ndarray) -> np.ndarray:
        hx, hy = self.slopes(*place)
        return np.array([-hx, -hy, 1.0]) / np.sqrt(1.0 + hx * hx + hy * hy)

    def center(self, place: np.ndarray) -> np.ndarray:
        return np.array([*place, self.height(*place)]) + self.radius * self.normal(place)

    def rate(self, _: float, state: np.ndarray) -> np.ndarray:
        place, omega = state[:2], state[2:]
        n = self.normal(place)
        hx, hy = self.slopes(*place)
        hxx, hxy, hyy = self.curvatures(*place)
        along = np.array([[1.0, 0.0], [0.0, 1.0], [hx, hy]])
        size = np.sqrt(1.0 + hx * hx + hy * hy)
        turning = -(np.eye(3) - np.outer(n, n)) @ np.array([[hxx, hxy], [hxy, hyy], [0.0, 0.0]]) / size
        velocity = self.radius * np.cross(omega, n)
        moved = np.linalg.lstsq(along + self.radius * turning, velocity, rcond=None)[0]
        ndot = turning @ moved
        # I omega' = -r n x F with F = m (v' + g) and v' = r (omega' x n + omega x n')
        mr = self.mass * self.radius
        matrix = self.inertia * np.eye(3) + self.radius * mr * (np.eye(3) - np.outer(n, n))
        weight = np.array([0.0, 0.0, self.mass * self.g])
        moment = -self.radius * np.cross(n, mr * np.cross(omega, ndot) + weight)
        return np.concatenate([moved, np.linalg.solve(matrix, moment)])


@pytest.mark.parametrize("surface", SURFACES)
def test_a_sphere_rolls_by_the_equations_of_newton_and_euler(surface: str) -> None:
    oracle = RollingSphere(surface)
    place, omega = np.array([0.3, 0.25]), np.array([0.8, -0.6, 1.5])
    center = oracle.center(place)
    velocity = [*omega, *(0.4 * np.cross(omega, oracle.normal(place)))]
    ball = model(
        position=str(center.tolist()),
        velocity=str([float(part) for part in velocity]),
        surface=f'surface = "{surface}"',
    )
    solution = ball.simulate(1.0, method="rk4_partitioned", step=1e-3)
    exact = solve_ivp(oracle.rate, (0.0, 1.0), [*place, *omega], rtol=1e-12, atol=1e-12, method="DOP853").y[:, -1]
    np.testing.assert_allclose(solution.q[-1, 4:], oracle.center(exact[:2]), atol=1e-10)
    spin = rotation_matrix(solution.q[-1, :4]) @ solution.v[-1, :3]
    np.testing.assert_allclose(spin, exact[2:], atol=1e-10)


def test_a_valley_narrower_than_the_sphere_is_told() -> None:
    """In a valley of the radius 0.1 m a sphere of 0.4 m touches at two points, and no common normal is near."""
    with pytest.raises(eomgen.EomgenError, match="valleys of the surface"):
        model(surface='surface = "5 * x**2"', position="[0.02, 0, 0.4]").simulate(0.1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"0.1 * z"', "the height of a surface depends on x and y, not on z; try: \"0.1 * x**2\""),
        ('"0.1 * x * t"', "the surface changes over time; try: a moving body in first, which carries the surface"),
        ('"abs(x)"', "a constraint needs three derivatives of its surface, and abs has a corner; try: a smooth"
         " function, such as sqrt(x**2 + d**2) for abs(x), or two constraints"),
    ],
)  # fmt: skip
def test_each_mistake_in_a_surface_has_one_message(text: str, message: str) -> None:
    with pytest.raises(eomgen.DescriptionError) as caught:
        model(surface=f"surface = {text}")
    (problem,) = caught.value.problems
    assert str(problem).endswith(message)


def test_other_shapes_touch_planes_alone() -> None:
    with pytest.raises(eomgen.DescriptionError) as caught:
        model(axes=", axis = [0, 1, 0]", shape='shape = "torus"\ntube_radius = 0.1', surface='surface = "0.1 * x"')
    (problem,) = caught.value.problems
    fault = "a torus touches planes alone, and only spheres touch surfaces"
    assert str(problem).endswith(f'{fault}; try: shape = "sphere", or no surface: the plane of the first frame')
