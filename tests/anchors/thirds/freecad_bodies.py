"""Third solutions of assemblies of FreeCAD's solver, by SciPy from equations written for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.anchors.thirds.quaternions import matrix, turned

Array = NDArray[np.float64]


def body_on_a_ball(
    mass: float, inertia: list[float], middle: list[float], point: list[float], start: list[float]
) -> Callable[[Array], Mapping[str, Array]]:
    """Return the motion of a body on a ball joint at the origin: of one of its points, and the force of the joint.

    Vectors are in the body, ``inertia`` about its centre of mass at ``middle``; ``start`` is a quaternion and the
    angular velocity. Gravity is along -y. The force is the one on the base.
    """
    arm, place, weight = np.array(middle), np.array(point), np.array([0.0, -9.81 * mass, 0.0])
    tensor = np.diag(inertia) + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    def accelerated(state: Array) -> Array:
        turn, turning = matrix(state[:4]), state[4:]
        moment = np.cross(arm, turn.T @ weight) - np.cross(turning, tensor @ turning)
        return np.linalg.solve(tensor, moment)

    def rates(_: float, state: Array) -> Array:
        return np.concatenate([turned(state[:4], state[4:]), accelerated(state)])

    def motion(times: Array) -> Mapping[str, Array]:
        end = max(float(times[-1]), 1e-9)
        states = solve_ivp(rates, (0.0, end), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y.T
        rows: dict[str, list[Array]] = {name: [] for name in ("place", "speed", "acceleration", "turning", "bearing")}
        for state in states:
            turn, turning, change = matrix(state[:4]), state[4:], accelerated(state)
            pulls = [np.cross(change, r) + np.cross(turning, np.cross(turning, r)) for r in (place, arm)]
            rows["place"].append(turn @ place)
            rows["speed"].append(turn @ np.cross(turning, place))
            rows["acceleration"].append(turn @ pulls[0])
            rows["turning"].append(turn @ turning)
            rows["bearing"].append(weight - mass * turn @ pulls[1])
        return {name: np.array(values) for name, values in rows.items()}

    return motion


def gyro(times: Array) -> Mapping[str, Array]:
    """Return the motion of a cylinder that spins on a ball joint, by its axis and its angular momentum in the world."""
    mass, arm, spin = 7.6536686473018, 1.5, 62.831853071796
    across, along = 1.1040224936599 + mass * arm**2, 0.93243354610288
    weight = np.array([0.0, -9.81 * mass, 0.0])

    def rates(_: float, state: Array) -> Array:
        axis, momentum = state[:3], state[3:]
        return np.concatenate([np.cross(momentum, axis) / across, arm * np.cross(axis, weight)])

    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, along * spin])
    end = max(float(times[-1]), 1e-9)
    states = solve_ivp(rates, (0.0, end), start, "DOP853", t_eval=times, rtol=1e-12, atol=1e-12).y.T
    axes, momenta = states[:, :3], states[:, 3:]
    speeds, moments = np.array([rates(0.0, state) for state in states]).reshape(-1, 2, 3).swapaxes(0, 1)
    pulls = (np.cross(moments, axes) + np.cross(momenta, speeds)) / across
    return {
        "place": axes,
        "speed": speeds,
        "acceleration": pulls,
        "turning": np.cross(axes, speeds) + spin * axes,
        "bearing": weight - mass * arm * pulls,
    }


FREECAD: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "circular pendulum": body_on_a_ball(
        0.4,
        [0.0026666666666667, 0.034666666666667, 0.034666666666667],
        [0.6, 0.0, 0.0],
        [0.1, -0.1, -0.1],
        [
            -0.130587888241585,
            0.00449751411562509,
            -0.124244136266458,
            0.983610680307399,
            0.0241526995212974,
            -0.148123266425051,
            1.36142553942136,
        ],
    ),
    "gyro": gyro,
}
