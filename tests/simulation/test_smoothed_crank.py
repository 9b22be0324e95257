"""A slider-crank whose crank follows a law that jumps and is smoothed, against inverse dynamics of one coordinate.

The kinetic energy of the machine is J(theta) theta_dot^2 / 2 and nothing else stores energy, so the motor's torque is
J alpha + J' omega^2 / 2 (Lagrange), with J by hand from the closed loop and J' by a complex step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen

Array = np.ndarray
CRANK, ROD = 0.04, 0.13
JUMP, BEGIN, T = 1.0, 0.1, 0.01


def machine(speed: float, begin: float = BEGIN, **keys: Any) -> eomgen.Scene:
    """Return a crank, a rod and a piston in a plane; the crank turns at a speed and by 1 rad more from 0.1 s on."""
    builder = eomgen.SceneBuilder("crank", **keys)
    builder.body("crank", 1.2, center_of_mass=[-0.008, 0, 0], inertia=[2e-3, 2e-3, 3e-3])
    builder.body("rod", 0.4, center_of_mass=[0.0455, 0, 0], inertia=[2e-5, 8e-4, 8e-4])
    builder.body("piston", 0.5, inertia=[2e-4] * 3)
    law = f"{speed} * t + ({JUMP} if t > {begin} else 0)"
    builder.joint("main", "revolute", "base", "crank", axis=[0, 0, 1], drive=law, smooth=T)
    builder.joint("big_end", "revolute", "crank", "rod", axis=[0, 0, 1], position=[CRANK, 0, 0])
    builder.joint("x", "prismatic", "base", "piston", axis=[1, 0, 0], initial={"position": CRANK + ROD})
    builder.point("small_end", "rod", position=[ROD, 0, 0])
    line = {"body": "piston", "axis": [0, 0, 1], "x_axis": [1, 0, 0]}
    builder.constraint("pin", "point_on_line", line, "small_end")
    builder.output("motor", formula="drive_effort.main")
    return builder.simulation(duration=0.15).build()


def torque(t: Array, speed: float, begin: float = BEGIN) -> Array:
    """Return the motor's torque, N m."""
    s = np.clip((t - begin) / T, 0.0, 1.0)
    theta = speed * t + JUMP * (10 * s**3 - 15 * s**4 + 6 * s**5)
    omega = speed + JUMP / T * (30 * s**2 - 60 * s**3 + 30 * s**4)
    alpha = JUMP / T**2 * (60 * s - 180 * s**2 + 120 * s**3)

    def inertia(angle: Array) -> Array:
        rod = np.arcsin(-CRANK / ROD * np.sin(angle))
        turn = -CRANK / ROD * np.cos(angle) / np.cos(rod)
        across = -CRANK * np.sin(angle) - 0.0455 * np.sin(rod) * turn
        along = CRANK * np.cos(angle) + 0.0455 * np.cos(rod) * turn
        piston = -CRANK * np.sin(angle) - ROD * np.sin(rod) * turn
        return 3e-3 + 1.2 * 0.008**2 + 0.4 * (across**2 + along**2) + 8e-4 * turn**2 + 0.5 * piston**2

    return np.asarray(inertia(theta) * alpha + 0.5 * np.imag(inertia(theta + 1e-30j)) / 1e-30 * omega**2)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4_partitioned", "rk45_partitioned"])
@pytest.mark.parametrize("speed", [0.0, 6.0])
def test_explicit_steps_give_the_torque_of_inverse_dynamics_also_from_rest(method: str, speed: float) -> None:
    """At the start from rest no velocity tells what rounding does to rates: what the correction gives does."""
    found = eomgen.build(machine(speed), profile="quick", method=method).simulate(step=1e-3, error_estimate=False)
    assert found.success, found.message
    assert found.outputs["motor"] == pytest.approx(torque(found.t, speed), abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "keys"),
    [
        ({"method": "generalized_alpha"}, {}),
        ({"method": "generalized_alpha"}, {"coordinates": "absolute"}),
        ({"method": "generalized_alpha_index3"}, {}),
        ({"method": "hht"}, {}),
    ],
    ids=["stabilised", "absolute", "index3", "hht"],
)
@pytest.mark.parametrize("begin", [BEGIN, 0.1003])
def test_implicit_steps_keep_order_2_in_a_transition_and_do_not_ring_behind_it(
    options: dict[str, Any], keys: dict[str, Any], begin: float
) -> None:
    model = eomgen.build(machine(6.0, begin, **keys), profile="quick", **options)
    errors = []
    for step in (5e-4, 2.5e-4):
        found = model.simulate(step=step, error_estimate=False)
        assert found.success, found.message
        error = np.abs(found.outputs["motor"] - torque(found.t, 6.0, begin))
        behind = found.t > begin + T + 1e-9
        errors.append(error[~behind].max())
        assert error[behind].max() < 1e-4  # of 262 N m
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.4)
    assert errors[1] < 0.012 * 262
