"""Bodies that roll and slide on a surface z = h(x, y): planes as formulas against planes, all shapes against Newton's
and Euler's equations, derivatives against complex steps, and refusals."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar, root

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
{surface}
"""
START = {"normal": "[0, 0, 1]", "ahead": "[1, 0, 0]", "position": "[0, 0, 0.4]", "velocity": "[0, 0, 0, 0, 0, 0]"}


def scene(**keys: str) -> dict[str, Any]:
    text = SCENE.format(
        **{"type": "rolling", "axes": "", "shape": 'shape = "sphere"\nradius = 0.4', "surface": "", **START, **keys}
    )
    return tomllib.loads(text)


def model(**keys: str) -> Any:
    return eomgen.build(eomgen.load(scene(**keys)))


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


@pytest.mark.slow
@pytest.mark.slow_cases("1.5 - sqrt(2.25 - x**2 - y**2)")
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
    with pytest.raises(eomgen.EomgenError) as caught:
        eomgen.derive(scene(surface='surface = "sqrt(x)"'))
    assert "try: a start near the surface and within the ends of its curves and maps, and a body that is" in str(
        caught.value
    )
    assert "disc" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('"0.1 * z"', "the height of a surface depends on x and y, not on z; try: \"0.1 * x**2\""),
        ('"0.1 * x * t"', "the surface changes over time; try: a moving body in first, which carries the surface"),
        ('"abs(x)"', "a constraint needs three derivatives of its surface, and abs has a corner; try: a smooth"
         " function, such as sqrt(x**2 + d**2) for abs(x)"),
    ],
)  # fmt: skip
def test_each_mistake_in_a_surface_has_one_message(text: str, message: str) -> None:
    with pytest.raises(eomgen.DescriptionError) as caught:
        model(surface=f"surface = {text}")
    (problem,) = caught.value.problems
    assert str(problem).endswith(message)


# -- other shapes ------------------------------------------------------------------------------------------------------

HILLS = "0.1 * x * y + 0.2 * cos(x)"
BODIES = {
    "disc": 'shape = "disc"\nradius = 0.4',
    "torus": 'shape = "torus"\nradius = 0.4\ntube_radius = 0.1',
    "ellipsoid": 'shape = "ellipsoid"\nsemi_axes = [0.5, 0.4, 0.3]',
}
#: The disc in the first tier; its equations have all parts of the others.
TIERS = [shape if shape == "disc" else pytest.param(shape, marks=pytest.mark.slow) for shape in BODIES]


def shaped(shape: str, **keys: str) -> dict[str, Any]:
    """Return a body of a shape about the y axis, upright and rolling or sliding."""
    return scene(**{"axes": ", axis = [0, 1, 0], x_axis = [1, 0, 0]", "shape": BODIES[shape], **keys})


def lowest(shape: str, n: Any, q: Any) -> Any:
    """Return the lowest point along the normal n of the body at the pose q, by its parts: rim, tube, or ellipsoid."""
    R = rotation_matrix(q[:4])
    if shape == "ellipsoid":  # along x, -z and y of the body: x, y and z of the second frame
        squares = R @ np.diag([0.25, 0.09, 0.16]) @ R.T
        return q[4:] - squares @ n / np.sqrt(n @ squares @ n)
    around = np.linspace(0, 2 * np.pi, 20001)
    rim = 0.4 * (np.outer(np.cos(around), R[:, 0]) + np.outer(np.sin(around), R[:, 2]))
    k = int(np.argmin(rim @ n))
    best = minimize_scalar(
        lambda s: 0.4 * float((np.cos(s) * R[:, 0] + np.sin(s) * R[:, 2]) @ n),
        bounds=(around[k] - 1e-3, around[k] + 1e-3),
        options={"xatol": 1e-12},
    ).x
    point = q[4:] + 0.4 * (np.cos(best) * R[:, 0] + np.sin(best) * R[:, 2])
    return point - 0.1 * n if shape == "torus" else point


def contact(shape: str, q: Any) -> tuple[Any, Any, Any]:
    """Return the body's point next to the surface, the surface's point and its normal, by SciPy's root."""
    height, slopes, _ = SURFACES[HILLS]

    def at(place: Any) -> tuple[Any, Any, Any]:
        hx, hy = slopes(*place)
        n = np.array([-hx, -hy, 1.0]) / np.sqrt(1 + hx * hx + hy * hy)
        return lowest(shape, n, q), np.array([*place, height(*place)]), n

    def off(place: Any) -> Any:
        point, on, _ = at(place)
        hx, hy = slopes(*place)
        return [(point - on) @ [1, 0, hx], (point - on) @ [0, 1, hy]]

    return at(root(off, q[4:6], tol=1e-13).x)


@pytest.mark.long
@pytest.mark.parametrize("shape", TIERS)
def test_other_shapes_roll_by_newton_and_euler_about_their_contact(shape: str) -> None:
    """At rows of a run: contact, no slip, and m (v' + g) and I omega' + omega x I omega of one force at the contact."""
    tilted = "rotation = [{ axis = [1, 0, 0], angle = 0.25 }, { axis = [0, 0, 1], angle = 0.4 }]"
    rolls = shaped(
        shape,
        position=f"[0.3, 0.25, 0.6], {tilted}",
        velocity="[0.2, 2, 0.3, 0.5, 0, 0]",
        surface=f'surface = "{HILLS}"',
    )
    body = eomgen.build(rolls)
    run = body.simulate(0.4, method="rk4_partitioned", step=1e-3, record_every=100)
    assert run.t[-1] == pytest.approx(0.4)
    for q, v in zip(run.q, run.v, strict=True):
        point, on, normal = contact(shape, q)
        assert abs((point - on) @ normal) < 1e-12
        R, arm = rotation_matrix(q[:4]), point - q[4:]
        omega = R @ v[:3]
        assert np.max(np.abs(R @ v[3:] + np.cross(omega, arm))) < 1e-9
        a = np.asarray(body.constrained_dynamics(q[np.newaxis], v[np.newaxis])[0])[0]
        force = 2.0 * (R @ (a[3:] + np.cross(v[:3], v[3:])) + [0, 0, 9.81])
        assert np.max(np.abs(0.128 * (R @ a[:3]) - np.cross(arm, force))) < 1e-8
