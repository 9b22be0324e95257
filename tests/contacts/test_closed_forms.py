"""Motions with contacts against closed forms, integrals of the motion and quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import eomgen
from eomgen.lie.numeric import rotation_matrix
from tests.contacts.pairs import contact, scene_of
from tests.oracles.evaluation import Array

FLOOR = '{ body = "base", axis = [0, 0, 1] }'


def test_a_sphere_between_planes_against_hertz_by_quadrature() -> None:
    """One period of a ball without damping: two flights, and two contacts of the time 2 int dx / v(x)."""
    mass, speed, modulus, radius = 0.5, 1.0, 1e8, 0.05
    text = f"""format = 1
name = "hertz"
gravity = [0, 0, 0]
bodies.ball = {{ mass = {mass} }}
[joints.ball]
type = "prismatic"
parent = "base"
child = "ball"
axis = [0, 0, 1]
initial = {{ position = 0.1, velocity = -{speed} }}
"""
    for name, first in (("floor", FLOOR), ("roof", '{ body = "base", position = [0, 0, 0.2], axis = [0, 0, -1] }')):
        law = f'type = "hertz", modulus = {modulus}, curvature_radius = {radius}'
        text += contact(name, first, 'body = "ball"', law).replace("radius = 0.4", f"radius = {radius}")
    stiffness = 4.0 / 3.0 * modulus * math.sqrt(radius)
    depth = (0.5 * mass * speed**2 / (0.4 * stiffness)) ** 0.4

    def slowness(u: float) -> float:  # with x = depth (1 - u^2), whose integrand has no pole
        return 2.0 * u / math.sqrt(-math.expm1(2.5 * math.log1p(-u * u))) if u > 0.0 else 2.0 / math.sqrt(2.5)

    time = 2.0 * depth / speed * quad(slowness, 0.0, 1.0, epsabs=0.0, epsrel=1e-13)[0]
    period = 2.0 * (0.1 / speed) + 2.0 * time
    run = eomgen.build(scene_of(text), profile="quick").simulate(period, period / 100_000, method="rk4")
    assert abs(run.q[-1, 0] - 0.1) < 1e-10 and abs(run.v[-1, 0] + speed) < 1e-10
    assert abs(run.q[:, 0].min() - (radius - depth)) < 1e-10


def top(law: str) -> str:
    return f"""format = 1
name = "top"
gravity = [0, 0, -9.81]
bodies.top = {{ mass = 0.02, center_of_mass = [0, 0, -0.003], inertia = [3e-6, 3e-6, 2.8e-6] }}
[joints.top]
type = "free"
parent = "base"
child = "top"
[joints.top.initial]
position = [0, 0, 0.0149]
velocity = [0.3, 0.2, 150, 0, 0, 0]
rotation = [{{ axis = [1, 0, 0], angle = 0.1 }}]
{contact("floor", FLOOR, 'body = "top"', 'type = "hunt_crossley", stiffness = 1e6, damping = 0.5', law)}
""".replace("radius = 0.4", "radius = 0.015")


def jellett(q: Array, v: Array) -> float:
    """Return the moment of momentum along the line from the centre of mass to the contact, kg m^3/s."""
    R = rotation_matrix(q[:4])
    return float((R @ ([3e-6, 3e-6, 2.8e-6] * v[:3])) @ (0.003 * R[:, 2] - [0.0, 0.0, 0.015]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "span"),
    [
        pytest.param('type = "viscous", damping = 10', 1.0, id="viscous"),
        pytest.param('type = "coulomb", friction = 0.3, velocity = 0.01', 10.0, id="coulomb", marks=pytest.mark.long),
    ],
)
def test_a_tippe_top_keeps_jelletts_integral(law: str, span: float) -> None:
    """Any force at the contact does, since the line to it has a constant angle with itself and with the axis."""
    run = eomgen.build(scene_of(top(law))).simulate(span, 5e-5, method="rk4")
    integral = np.array([jellett(q, v) for q, v in zip(run.q[::200], run.v[::200], strict=True)])
    np.testing.assert_allclose(integral, integral[0], rtol=1e-9)
    if span == 10.0:  # the top is on its stem
        assert rotation_matrix(run.q[-1, :4])[2, 2] < -0.99


def block_on_an_incline(law: str) -> str:
    """Return the scene of a block on two edges at 0.3 rad."""
    edges = "".join(
        contact(
            f"edge_{k}",
            '{ body = "base", axis = [0, 1, 0], x_axis = [1, 0, 0] }',
            f'body = "block", position = [{x}, -0.05, 0]',
            'type = "linear", stiffness = 1e5, damping = 300',
            law,
            "point",
        )
        for k, x in enumerate((-0.1, 0.1))
    )
    return f"""format = 1
name = "block"
gravity = [{9.81 * math.sin(0.3)}, {-9.81 * math.cos(0.3)}, 0]
bodies.block = {{ mass = 2, inertia = [0.01, 0.01, 0.01] }}
[joints.block]
type = "planar"
parent = "base"
child = "block"
axis = [0, 0, 1]
initial = {{ position = [0, 0, 0.0501] }}
{edges}"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "steps", [pytest.param(8_000, id="short"), pytest.param(1_000_000, id="long", marks=pytest.mark.long)]
)
def test_bristles_hold_a_block_on_an_incline(steps: int) -> None:
    """With a friction of 0.6; a Coulomb law creeps."""
    moved = {}
    for law in ('type = "bristles", friction = 0.6, damping = 20', 'type = "coulomb", friction = 0.6')[
        : 2 if steps == 8_000 else 1
    ]:
        run = eomgen.build(scene_of(block_on_an_incline(law))).simulate(1e-4 * steps, 1e-4, method="rk4")
        settled = run.q[4_000:]
        moved[law[8]] = float(np.abs(settled - settled[0]).max())
    assert moved["b"] < 1e-9
    assert steps > 8_000 or moved["c"] > 1e-4


@pytest.mark.slow
def test_a_block_rests_on_bristles_up_to_its_friction_alone() -> None:
    """Deflections are tan(slope) / friction of the largest; with less friction no state is at rest."""
    tunable = "\n[parameters]\nmu = { value = 0.6, tunable = true }\n"
    text = block_on_an_incline('type = "bristles", friction = "mu"')
    model = eomgen.build(scene_of(text + tunable))
    for friction in (0.6, 0.35, 0.31):
        rest = model.equilibrium(parameters={"mu": friction})
        loads = rest.z.reshape(2, 2)[:, 0]
        assert loads.max() <= 1e-4 and loads.min() > 0.0
        assert loads.mean() == pytest.approx(1e-4 * math.tan(0.3) / friction, rel=0.02)
    pulled = 9.81 * (math.sin(0.3) - 0.25 * math.cos(0.3))
    with pytest.raises(eomgen.errors.NumericalError, match=rf"accelerates with {pulled:.4g} m/s\^2"):
        model.equilibrium(parameters={"mu": 0.25})


@pytest.mark.slow
def test_a_rolling_disc_keeps_its_invariants() -> None:
    """Energy, and both rates about axes of the disc as linear functions of its lean (Routh, Dynamics II, 1905, 244)."""
    A, C, m, r, lean = 0.02, 0.04, 1.0, 0.3, 1.2
    R = rotation_matrix(np.array([math.cos(lean / 2), math.sin(lean / 2), 0.0, 0.0]))
    up = np.array([0.0, 0.0, 1.0])
    down = up - R[2, 2] * R[:, 2]
    arm = -r * down / np.linalg.norm(down)
    omega = np.array([0.5, 2.0, 6.0])
    start = [*omega, *(-R.T @ np.cross(R @ omega, arm))]
    text = f"""format = 1
name = "disc"
gravity = [0, 0, -9.81]
bodies.disc = {{ mass = {m}, inertia = [{A}, {A}, {C}] }}
[joints.disc]
type = "free"
parent = "base"
child = "disc"
[joints.disc.initial]
position = [0, 0, {float(-arm[2])}]
rotation = [{{ axis = [1, 0, 0], angle = {lean} }}]
velocity = {[float(part) for part in start]}
[constraints.floor]
type = "rolling"
first = {{ body = "base", axis = [0, 0, 1] }}
second = {{ body = "disc", axis = [0, 0, 1] }}
radius = {r}
"""
    run = eomgen.build(scene_of(text)).simulate(1.0, 2e-4, method="rk4_partitioned")
    energy = 0.5 * m * np.sum(run.v[:, 3:] ** 2, axis=1) + 0.5 * run.v[:, :3] ** 2 @ [A, A, C] + m * 9.81 * run.q[:, 6]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)

    def lean_and_rates(row: int) -> tuple[float, float, float]:
        axes = rotation_matrix(run.q[row, :4])
        angle = math.acos(axes[2, 2])
        across = axes.T @ (up - axes[2, 2] * axes[:, 2]) / math.sin(angle)
        return angle, float(run.v[row, :3] @ across), float(run.v[row, 2])

    def slopes(angle: float, rates: Array) -> list[float]:
        return [C / A * rates[1] - rates[0] / math.tan(angle), m * r * r / (C + m * r * r) * rates[0]]

    (first, *rates), (last, *later) = lean_and_rates(0), lean_and_rates(-1)
    exact = solve_ivp(slopes, (first, last), rates, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    assert abs(last - first) > 0.3
    np.testing.assert_allclose(later, exact, rtol=1e-9)


def test_the_energy_of_a_bouncing_ball_is_balanced() -> None:
    """The loss of Hunt and Crossley's law at small speeds is e = 1 - damping v."""
    start = "{ position = 0.45 }"
    text = f"""format = 1
name = "ball"
gravity = [0, 0, -9.81]
bodies.ball = {{ mass = 1 }}
joints.ball = {{ type = "prismatic", parent = "base", child = "ball", axis = [0, 0, 1], initial = {start} }}
outputs.energy = {{ formula = ["energy.total", "energy.power"] }}
{contact("floor", FLOOR, 'body = "ball"', 'type = "hunt_crossley", stiffness = 1e7, damping = 0.05')}
"""
    run = eomgen.build(scene_of(text), profile="quick").simulate(0.3, 1e-5, method="rk4")
    total, power = run.outputs["energy"].T
    work = np.cumsum(0.5e-5 * (power[1:] + power[:-1]))
    np.testing.assert_allclose(total[1:], total[0] + work, rtol=1e-5)
    speed = math.sqrt(2 * 9.81 * 0.05)
    assert abs(run.v[:, 0].max() / speed - (1.0 - 0.05 * speed)) < 2e-3
