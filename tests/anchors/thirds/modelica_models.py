"""Third solutions of examples of the Modelica Standard Library, by SciPy from equations written for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.anchors.thirds.quaternions import matrix, product, turned

Array = NDArray[np.float64]
GRAVITY = 9.80665
STEEL = 7700.0


def inertias_under_a_sine(times: Array) -> Mapping[str, Array]:
    """Return two inertias of 2 kg m^2, each under a torque of sin(2 pi t) N m, in closed form."""
    pulse = 2.0 * np.pi
    rate = (1.0 - np.cos(pulse * times)) / (2.0 * pulse)
    angle = (times - np.sin(pulse * times) / pulse) / (2.0 * pulse)
    return {"angles": np.column_stack([angle, angle]), "rates": np.column_stack([rate, rate])}


def bevel_gear(carried: float = 1.0) -> Callable[[Array], Mapping[str, Array]]:
    """Return the motion of a cube on joints about x, y and z with two rotors that a bevel gear couples.

    ``carried`` is the share of the rotors' momentum by the turning of the cube that counts: 1. With 0 the library's
    element for rotors results, whose users have to add that inertia to the carrier; its example does not.
    """
    side = 0.1
    mass = STEEL * side**3
    arm = np.full(3, side / 2 / np.sqrt(3.0))
    cube = mass * side**2 / 6 * np.eye(3) + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    rotors, ratios = np.array([1.1, 18.2, 0.0]), np.array([10.0, 1.0, 0.0])
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = cube + carried * np.diag(rotors)
    matrix[:3, 3] = matrix[3, :3] = rotors * ratios
    matrix[3, 3] = rotors @ ratios**2

    def rates(time: float, state: Array) -> Array:
        turning, spin = state[3:6], state[7]
        (sin_x, sin_y, sin_z), (cos_x, cos_y, cos_z) = np.sin(state[:3]), np.cos(state[:3])
        axes = np.array([[cos_y * cos_z, sin_z, 0.0], [-cos_y * sin_z, cos_z, 0.0], [sin_y, 0.0, 1.0]])
        up = np.array([sin_x * sin_y * cos_z + cos_x * sin_z, cos_x * cos_z - sin_x * sin_y * sin_z, -sin_x * cos_y])
        torques = np.array([110.0, 120.0, 130.0, 140.0]) * np.sin(2 * np.pi * np.array([5, 6, 7, 8]) * time)
        moment = np.linalg.solve(axes.T, torques[:3]) - mass * GRAVITY * np.cross(arm, up)
        momentum = cube @ turning + rotors * (ratios * spin + carried * turning)
        efforts = np.append(moment - np.cross(turning, momentum), ratios[0] * torques[3])
        accelerations = np.linalg.solve(matrix, efforts)
        return np.concatenate([np.linalg.solve(axes, turning), accelerations[:3], [spin, accelerations[3]]])

    def motion(times: Array) -> Mapping[str, Array]:
        solution = solve_ivp(rates, (0.0, times[-1]), np.zeros(8), "DOP853", t_eval=times, rtol=1e-12, atol=1e-13)
        states = solution.y.T
        joints = np.array([rates(time, state)[:3] for time, state in zip(times, states, strict=True)])
        return {"angles": states[:, :3], "rates": joints, "rotor": states[:, 6:7], "rotor_rate": states[:, 7:8]}

    return motion


def engine_of_six_cylinders(times: Array) -> Mapping[str, Array]:
    """Return crank and filter of an engine, solved over the crank's angle from one dead centre to the next one."""
    pins, tilts = np.radians([-30, 90, 210, 210, 90, -30]), np.radians([-30, 30, -30, 30, -30, 30])
    leads = pins - tilts
    bore = np.pi / 4 * 0.1**2
    piston, rod = STEEL * bore * 0.1, STEEL * 0.22 * 0.02 * 0.06
    rod_inertia = rod / 12 * (0.22**2 + 0.06**2)
    shaft, pin, web = STEEL * np.pi / 4 * 0.12 * 0.05**2, STEEL * np.pi / 4 * 0.12 * 0.03**2, STEEL * 0.1 * 0.02 * 0.05
    crank_inertia = 6 * (
        shaft * 0.05**2 / 8 + pin * (0.03**2 / 8 + 0.1**2) + 2 * web * ((0.1**2 + 0.05**2) / 12 + 0.05**2)
    )
    throw = pin * 0.1 + 2 * web * 0.05
    rising, falling = [177.4132, -287.2189, 151.8252, -24.9973, 2.4], [145.93, -131.707, 17.3438, 17.9272, 2.4]
    cutoff = 2 * np.pi * 5 / np.sqrt(np.sqrt(2.0) - 1)

    def rates(angle: float, state: Array, pressures: Array) -> tuple[Array, float]:
        _, speed, first, second = state
        sin, cos = np.sin(angle + leads), np.cos(angle + leads)
        root = np.sqrt(0.04 - 0.01 * sin**2)
        top = 0.1 * cos + root
        top_1 = -0.1 * sin - 0.01 * sin * cos / root
        top_2 = -0.1 * cos - 0.01 * ((cos**2 - sin**2) / root + 0.01 * sin**2 * cos**2 / root**3)
        rod_1, rod_2 = -0.055 * sin + 0.45 * top_1, -0.055 * cos + 0.45 * top_2
        side_1, side_2 = 0.055 * cos, -0.055 * sin
        tilt_1, tilt_2 = -0.1 * cos / root, 0.1 * sin / root - 0.001 * sin * cos**2 / root**3
        inertia = 1.0 + crank_inertia + np.sum(piston * top_1**2 + rod * (rod_1**2 + side_1**2))
        inertia += np.sum(rod_inertia * tilt_1**2)
        change = np.sum(
            piston * top_1 * top_2 + rod * (rod_1 * rod_2 + side_1 * side_2) + rod_inertia * tilt_1 * tilt_2
        )
        lift = np.sum((piston * top_1 + rod * rod_1) * np.cos(tilts) - rod * side_1 * np.sin(tilts))
        lift -= throw * np.sum(np.sin(angle + pins))
        height = 1.0 - (0.32 - top) / 0.22
        bar = (((pressures[0] * height + pressures[1]) * height + pressures[2]) * height + pressures[3]) * height
        gas = -np.sum((bar + pressures[4]) * 1e5 * bore * top_1)
        brake = 100.0 * (speed / 200.0) ** 2
        acceleration = (gas - GRAVITY * lift - change * speed**2 - brake) / inertia
        torque = acceleration + brake
        slopes = [1.0, acceleration, cutoff * (torque - first), cutoff * (first - second)]
        return np.array(slopes) / speed, torque

    def pressures(angle: float) -> Array:
        return np.array([rising if rises else falling for rises in np.sin(angle + leads) < 0]).T

    def to_dead_centre(angle: float, state: Array) -> Any:
        curves = pressures(angle + np.pi / 6)

        def slopes(at: float, y: Array) -> Array:
            return rates(at, y, curves)[0]

        end = angle + np.pi / 3
        return solve_ivp(slopes, (angle, end), state, "DOP853", rtol=1e-9, atol=1e-9, dense_output=True)

    angle, state = 0.0, np.array([0.0, 10.0, 0.0, 0.0])
    state[2:] = rates(angle, state, pressures(1e-6))[1]
    rows: list[Array] = []
    while len(rows) < len(times):
        solution = to_dead_centre(angle, state)
        left = times[len(rows) :]
        for time in left[left <= solution.y[0, -1]]:
            rows.append(_at_time(solution, float(time)))
        angle, state = solution.t[-1], solution.y[:, -1]
    result = np.array(rows)
    return {"angle": result[:, :1], "rate": result[:, 1:2], "filtered": result[:, 2:]}


def _at_time(solution: Any, time: float) -> Array:
    """Return the angle at a time, and the other states there, of a solution over the angle."""

    def late(angle: float) -> float:
        return float(solution.sol(angle)[0]) - time

    angle = brentq(late, float(solution.t[0]), float(solution.t[-1]), xtol=1e-14)
    return np.append(angle, solution.sol(angle)[1:])


def free_body(times: Array) -> Mapping[str, Array]:
    """Return the motion of a body of 1 kg and 1 kg m^2 whose ends hang on two springs of 20 N/m without length."""
    ends, hooks = np.array([[-0.2, 0, 0], [0.2, 0, 0]]), np.array([[0.0, 0, 0], [0.8, 0, 0]])

    def rates(_: float, state: Array) -> Array:
        place, quaternion, speed, turning = state[:3], state[3:7], state[7:10], state[10:]
        turn = matrix(quaternion)
        forces = 20.0 * (hooks - place - ends @ turn.T)
        moment = np.sum(np.cross(ends, forces @ turn), axis=0)
        return np.concatenate([speed, turned(quaternion, turning), forces.sum(0) - [0.0, GRAVITY, 0.0], moment])

    half = np.pi / 36
    first, second, third = ([np.cos(half), *(np.sin(half) * axis)] for axis in np.eye(3))
    quaternion = product(product(first, second), third)
    start = np.concatenate([[0.2, -0.5, 0.1] - matrix(quaternion) @ ends[0], quaternion, np.zeros(6)])
    states = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y.T
    turns = [matrix(state[3:7]) for state in states]
    return {
        "place": states[:, :3] + [turn @ ends[0] for turn in turns],
        "speed": states[:, 7:10]
        + [turn @ np.cross(state[10:], ends[0]) for turn, state in zip(turns, states, strict=True)],
        "turning": states[:, 10:],
    }


def ball_and_spring(times: Array) -> Mapping[str, Array]:
    """Return the turning of a body of 1 kg and 1 kg m^2 on a ball joint, with a spring of 20 N/m on its end."""
    pivot, hook = np.array([0.2, -0.3, 0.2]), np.array([0.8, 0.0, 0.3])
    middle, end = np.array([0.2, 0.0, 0.0]), np.array([0.4, 0.0, 0.0])
    inertia = np.array([1.0, 1.0 + 0.04, 1.0 + 0.04])

    def rates(_: float, state: Array) -> Array:
        quaternion, turning = state[:4], state[4:]
        turn = matrix(quaternion)
        pull = 20.0 * (hook - pivot - turn @ end)
        moment = np.cross(end, turn.T @ pull) + np.cross(middle, turn.T @ [0.0, -GRAVITY, 0.0])
        acceleration = (moment - np.cross(turning, inertia * turning)) / inertia
        return np.concatenate([turned(quaternion, turning), acceleration])

    first, second, third = (
        [np.cos(angle / 2), *(np.sin(angle / 2) * axis)]
        for angle, axis in zip(np.radians([10, 55, 68]), np.eye(3), strict=True)
    )
    start = np.append(product(product(first, second), third), np.zeros(3))
    states = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y.T
    return {"turning": states[:, 4:]}


def backlash(times: Array) -> Mapping[str, Array]:
    """Return two inertias of 5 kg m^2 that spring back from a quarter turn, the first with backlash of an eighth."""

    def rates(_: float, state: Array) -> Array:
        press = 2e4 * (max(state[0] - np.pi / 8, 0.0) + min(state[0] + np.pi / 8, 0.0))
        damp = 50.0 * state[1]
        torque = press + max(-abs(press), min(abs(press), damp))
        return np.array([state[1], -torque / 5.0])

    start = np.array([np.pi / 2, 0.0])
    loose = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y.T
    decay = 5.0
    pulse = np.sqrt(4000.0 - decay**2)
    wave = np.exp(-decay * times) * np.pi / 2
    plain = wave * (np.cos(pulse * times) + decay / pulse * np.sin(pulse * times))
    plain_rate = -wave * 4000.0 / pulse * np.sin(pulse * times)
    return {
        "loose": loose[:, :1],
        "loose_rate": loose[:, 1:],
        "plain": plain[:, None],
        "plain_rate": plain_rate[:, None],
    }


def four_bar(times: Array) -> Mapping[str, Array]:
    """Return the crank's motion of a spatial four-bar linkage, from its energy as a function of the crank's angle."""
    crank, slider, coupler = ((STEEL * np.pi / 4 * 0.05**2 * np.sqrt(length)) for length in (0.26, 0.04, 1.1))
    pin, rod = np.array([0.0, 0.5, 0.1]), np.array([-1.0, 0.3, 0.1])
    crank_inertia = crank * (0.26 / 3 + 0.05**2 / 16)
    along = np.outer(rod, rod) / 1.1
    thickness = 0.05**2 / 16
    rod_inertia = coupler * ((thickness + 1.1 / 12) * (np.eye(3) - along) + 2 * thickness * along)

    def energies(angle: float) -> tuple[float, float]:
        sin, cos = np.sin(angle), np.cos(angle)
        place = np.array([0.0, cos * pin[1] - sin * pin[2], sin * pin[1] + cos * pin[2]])
        speed = np.array([0.0, -place[2], place[1]])
        arm = np.array([-np.sqrt(1.1 - (place[1] - 0.2) ** 2 - place[2] ** 2), place[1] - 0.2, place[2]])
        second = np.arctan(0.3) - np.arcsin(arm[1] / np.sqrt(1.09))
        first = np.arctan2(0.1, -np.cos(second) - 0.3 * np.sin(second)) - np.arctan2(arm[2], arm[0])
        (s_1, s_2), (c_1, c_2) = np.sin([first, second]), np.cos([first, second])
        turn = np.array([[c_1 * c_2, -c_1 * s_2, s_1], [s_2, c_2, 0.0], [-s_1 * c_2, s_1 * s_2, c_1]])
        axes = np.column_stack([np.eye(3)[1], turn[:, 2]])
        rates = np.linalg.solve(np.column_stack([np.eye(3)[0], np.cross(axes.T, arm).T]), speed)
        turning = turn.T @ axes @ rates[1:]
        middle = np.array([rates[0], 0.0, 0.0]) + turn @ np.cross(turning, rod / 2)
        inertia = crank_inertia + slider * rates[0] ** 2 + coupler * middle @ middle + turning @ rod_inertia @ turning
        return inertia, GRAVITY * (crank * place[1] / 2 + coupler * (0.2 + arm[1] / 2))

    inertia, height = energies(0.0)
    energy = inertia * (np.pi / 0.6) ** 2 / 2 + height

    def rate(_: float, state: Array) -> Array:
        inertia, height = energies(state[0])
        return np.array([np.sqrt(2 * (energy - height) / inertia)])

    end = max(float(times[-1]), 1e-9)
    angles = solve_ivp(rate, (0.0, end), [0.0], "DOP853", t_eval=times, rtol=1e-11, atol=1e-11).y[0]
    return {"angle": angles[:, None], "rate": np.array([rate(0.0, angle) for angle in angles[:, None]])}


MODELICA: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "inertias under a sine": inertias_under_a_sine,
    "backlash": backlash,
    "ball and spring": ball_and_spring,
    "bevel gear": bevel_gear(),
    "engine of six cylinders": engine_of_six_cylinders,
    "free body": free_body,
    "spatial four-bar": four_bar,
}
