"""Linear models against closed forms and printed digits: pendulums, the quarter car, the half car, a slider crank."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError

EXAMPLES = Path(__file__).parents[2] / "examples"


def motor() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("motor").input("torque").input("wind", "0.1 * sin(t)")
    builder.body("rod", 1.5, center_of_mass=[0, 0, -0.4], inertia=[0.02, 0.02, 0.001])
    builder.joint("hinge", "revolute", "base", "rod", axis=[0, 1, 0], damping=0.3, initial={"position": 0.2})
    builder.effort("drive", "hinge", "torque + 0.5 * wind")
    return builder.output("angle", formula="sin(q.hinge)").output("power", formula="torque * v.hinge").build()


def test_a_driven_pendulum_hanging_and_upright() -> None:
    model = eomgen.build(motor(), profile="instant")
    inertia, weight = 0.02 + 1.5 * 0.4**2, 1.5 * 9.81 * 0.4
    hanging = model.linearize()
    assert hanging.reference.what == "equilibrium"
    assert abs(hanging.reference.q[0]) <= 1e-9
    for found, expected in (
        (hanging.M0, inertia),
        (hanging.C0, 0.3),
        (hanging.K0, weight),
        (hanging.B0, 1.0),
        (hanging.E0, 0.5),
    ):
        np.testing.assert_allclose(found, [[expected]], rtol=1e-12)
    upright = model.linearize([math.pi], u={"torque": 0.0})
    np.testing.assert_allclose(upright.K0, [[-weight]], rtol=1e-12)
    assert (hanging.modes().stability, upright.modes().stability) == ("stable", "unstable")
    np.testing.assert_allclose(upright.undamped_frequencies, [-math.sqrt(weight / inertia)], rtol=1e-12)
    roots = np.roots([inertia, 0.3, -weight])
    np.testing.assert_allclose(sorted(upright.modes().eigenvalues.real), sorted(roots), rtol=1e-12)
    assert not np.any(upright.modes().oscillating)
    near = model.linearize(initial={"hinge": 3.0}, any_kind=True)
    assert abs(near.reference.q[0] - math.pi) <= 1e-9

    omega = np.array([0.5, 4.0, 30.0])
    expected = 0.5 / (weight - inertia * omega**2 + 0.3j * omega)
    np.testing.assert_allclose(hanging.frequency_response(omega, "wind", "angle"), expected, rtol=1e-12)
    np.testing.assert_allclose(
        hanging.frequency_response(omega, "torque", "v.hinge"), 2j * omega * expected, rtol=1e-12
    )
    moving = model.linearize([0.3], [2.0], u={"torque": 5.0})
    space = moving.state_space()
    np.testing.assert_allclose(space.C, [[math.cos(0.3), 0.0], [0.0, 5.0]], rtol=1e-15)
    np.testing.assert_allclose(space.D, [[0.0], [2.0]], rtol=1e-15)
    assert (space.states, space.inputs, space.disturbances) == (("hinge", "v.hinge"), ("torque",), ("wind",))


def test_quarter_car() -> None:
    """The digits of the dossier's quarter car, 1.10.2."""
    model = eomgen.build(EXAMPLES / "quarter_car" / "scene.toml")
    lin = model.linearize(t=30.0)  # the road has faded in
    eigenvalues = [-1.7116733175 + 7.6694018453j, -13.9411044603 + 67.8527902572j]
    np.testing.assert_allclose(lin.modes().eigenvalues, eigenvalues, rtol=0, atol=1e-10)
    np.testing.assert_allclose(
        lin.undamped_frequencies / (2.0 * math.pi), [1.2382426677, 11.1351894335], rtol=0, atol=1e-10
    )
    invariant = math.sqrt(160000.0 / 36.0)
    for skyhook in (0.0, 2000.0):
        with_skyhook = model.linearize(t=30.0, parameters={"skyhook": skyhook})
        assert abs(with_skyhook.frequency_response(invariant, "road", "body") + 0.15) <= 1e-12
    assert lin.names.disturbances == ("road",)


def slider_crank(coordinates: str) -> eomgen.Scene:
    """Return a crank, a rod and a piston held by a spring along its line; under gravity across it."""
    builder = eomgen.SceneBuilder("slider_crank", gravity=[0, -9.81, 0], coordinates=coordinates)
    builder.body("crank", 1.2, center_of_mass=[0.1, 0, 0], inertia=[0.01, 0.01, 0.02])
    builder.body("rod", 0.7, center_of_mass=[0.35, 0, 0], inertia=[0.01, 0.04, 0.04])
    builder.body("piston", 0.9, inertia=[0.01, 0.01, 0.01])
    bend = -math.asin(0.25 * math.sin(0.9) / 0.7)
    builder.joint("main", "revolute", "base", "crank", axis=[0, 0, 1], initial={"position": 0.9})
    pin = {"position": bend - 0.9}
    builder.joint("pin", "revolute", "crank", "rod", axis=[0, 0, 1], position=[0.25, 0, 0], initial=pin)
    travel = 0.25 * math.cos(0.9) + 0.7 * math.cos(bend)
    builder.joint(
        "slide", "prismatic", "base", "piston", axis=[1, 0, 0], initial={"position": travel}, stiffness=150, rest=0.8
    )
    builder.point("small_end", "rod", [0.7, 0, 0])
    line = {"body": "piston", "axis": [0, 0, 1], "x_axis": [1, 0, 0]}
    return builder.constraint("wrist", "point_on_line", line, "small_end").build()


def _potential_and_inertia(theta: complex) -> tuple[complex, complex]:
    """Return V(theta), and M(theta) from velocities by complex step, of the slider crank in its one coordinate."""

    def places(angle: complex) -> tuple[complex, ...]:
        bend = -np.arcsin(0.25 * np.sin(angle) / 0.7)
        rod_x, rod_y = 0.25 * np.cos(angle) + 0.35 * np.cos(bend), 0.25 * np.sin(angle) + 0.35 * np.sin(bend)
        return (
            0.1 * np.cos(angle),
            0.1 * np.sin(angle),
            angle,
            rod_x,
            rod_y,
            bend,
            0.25 * np.cos(angle) + 0.7 * np.cos(bend),
        )

    h = 1e-30
    rates = [value.imag / h for value in places(theta.real + 1j * h)]
    weights = (1.2, 1.2, 0.02, 0.7, 0.7, 0.04, 0.9)
    _, crank_y, _, _, rod_y, _, piston = places(theta)
    V = 9.81 * (1.2 * crank_y + 0.7 * rod_y) + 75.0 * (piston - 0.8) ** 2
    return V, sum(weight * rate * rate for weight, rate in zip(weights, rates, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_slider_crank_by_multipliers_is_the_one_in_a_single_coordinate(coordinates: str) -> None:
    model = eomgen.build(slider_crank(coordinates), profile="instant")
    independent = ("main",) if coordinates == "joint" else ()
    lin = model.linearize(at="equilibrium", independent=independent)
    pose = model.pose("crank", lin.reference.q)
    theta = 2.0 * math.atan2(pose[3], pose[0])
    h = 1e-4
    slope = _potential_and_inertia(theta + 1e-30j)[0].imag / 1e-30
    assert abs(slope) <= 1e-9
    by_step = [_potential_and_inertia(theta + k * h + 1e-30j)[0].imag / 1e-30 for k in (-2, -1, 1, 2)]
    stiffness = (by_step[0] - 8.0 * by_step[1] + 8.0 * by_step[2] - by_step[3]) / (12.0 * h)
    inertia = _potential_and_inertia(theta)[1]
    np.testing.assert_allclose(lin.undamped_frequencies, [math.sqrt(stiffness / inertia)], rtol=1e-9)
    if coordinates == "joint":
        assert lin.coordinates == ("main",)
        np.testing.assert_allclose((lin.M0[0, 0], lin.K0[0, 0]), (inertia, stiffness), rtol=1e-9)
    else:
        with pytest.raises(UsageError, match="there is no coordinate of a joint 'mian'; try: main"):
            model.linearize(independent=("mian",))
    assert lin.modes().shapes.shape == (model.nv, 1)


@pytest.mark.slow
def test_spinning_body_keeps_or_leaves_its_axis() -> None:
    """Without gravity: rates of small motions about steady spin on a principal axis are those of Euler's equations."""
    inertia, spin = np.array([0.3, 0.5, 0.7]), 4.0
    builder = eomgen.SceneBuilder("tumbler", gravity=[0, 0, 0]).body("body", 1.0, inertia=inertia.tolist())
    model = eomgen.build(builder.joint("ball", "spherical", "base", "body").build(), profile="instant")
    for axis, stability in ((0, "marginal"), (1, "unstable"), (2, "marginal")):
        lin = model.linearize(model.initial_q, spin * np.eye(3)[axis])
        j, k = (n for n in range(3) if n != axis)
        square = spin**2 * (inertia[axis] - inertia[j]) * (inertia[axis] - inertia[k]) / (inertia[j] * inertia[k])
        rates = np.concatenate([lin.modes().eigenvalues, lin.modes().eigenvalues.conj()])
        wanted = 1j * np.sqrt(complex(square))  # the nutation; the others are spin itself and rest
        assert np.min(np.abs(rates - wanted)) <= 1e-10
        assert np.min(np.abs(rates - 1j * spin)) <= 1e-10
        assert lin.modes().stability == stability
