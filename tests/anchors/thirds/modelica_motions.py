"""Further third solutions of the Modelica Standard Library: machines whose equations take a few lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.anchors.thirds.quaternions import matrix, product, turned

Array = NDArray[np.float64]
GRAVITY = 9.80665
STEEL = 7700.0


def _solved(rates: Callable[[float, Array], Array], start: list[float], times: Array) -> Array:
    """Return the states (n, times) of an initial value problem to 1e-11."""
    end = max(float(times[-1]), 1e-9)
    return np.asarray(solve_ivp(rates, (0.0, end), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y)


def double_pendulum(times: Array) -> Mapping[str, Array]:
    """Return two equal bars, by the angles of both from the horizontal."""
    mass, length, inertia, drag = STEEL * 0.5 * 0.06**2, 0.5, 0.292908, 0.1

    def rates(_: float, state: Array) -> Array:
        upper, lower, upper_rate, lower_rate = state
        both = mass * length**2 / 2
        cos, sin = both * np.cos(upper - lower), both * np.sin(upper - lower)
        matrix = [[inertia + 1.25 * mass * length**2, cos], [cos, inertia + 0.25 * mass * length**2]]
        weight = mass * GRAVITY * length
        efforts = [
            -sin * lower_rate**2 - 1.5 * weight * np.cos(upper) - drag * upper_rate,
            sin * upper_rate**2 - 0.5 * weight * np.cos(lower),
        ]
        return np.append(state[2:], np.linalg.solve(matrix, efforts))

    upper, lower, upper_rate, lower_rate = _solved(rates, [0.0, 0.0, 0.0, 0.0], times)
    angles, speeds = np.column_stack([upper, lower - upper]), np.column_stack([upper_rate, lower_rate - upper_rate])
    return {"angles": angles, "rates": speeds}


def slides_and_spring(times: Array) -> Mapping[str, Array]:
    """Return a body on two slides: each travel is the motion of a mass on a spring."""
    quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    for angle, axis in zip(np.radians([10, 55, 68]) / 2, np.eye(3), strict=True):
        quaternion = product(quaternion, [np.cos(angle), *(np.sin(angle) * axis)])
    turn = matrix(quaternion)
    start, hook = np.array([0.2, -0.3, 0.2]), np.array([0.8, 0.0, 0.3])
    pull = 20.0 * (hook - start - turn @ [0.4, 0.0, 0.0]) - [0.0, GRAVITY, 0.0]
    rest, pulse = (turn.T @ pull)[:2] / 20.0, np.sqrt(20.0)
    travels = np.outer(1.0 - np.cos(pulse * times), rest)
    speeds = np.outer(pulse * np.sin(pulse * times), rest)
    return {"slides": travels, "place": start + travels @ turn[:, :2].T, "speed": speeds @ turn[:, :2].T}


def spring_and_damper(times: Array) -> Mapping[str, Array]:
    """Return a body that moves in a plane on a spring with a damper, and a mass that slides on a spring."""
    hook, pulse = np.array([0.3, 0.0]), np.sqrt(30.0)

    def rates(_: float, state: Array) -> Array:
        arm = 0.2 * np.array([-np.sin(state[2]), np.cos(state[2])])
        line = hook - state[:2] - arm
        speed = state[3:5] + state[5] * np.array([-arm[1], arm[0]])
        length = np.linalg.norm(line)
        pull = (30.0 * (length - 0.1) - 2.0 * speed @ line / length) * line / length
        moment = arm[0] * pull[1] - arm[1] * pull[0]
        return np.concatenate([state[3:], pull - [0.0, GRAVITY], [moment / 0.1]])

    turning = np.radians(2.0)
    x, y, angle, x_rate, y_rate, rate = _solved(rates, [0.3, -0.4, 0.0, 0.2 * turning, 0.0, turning], times)
    zero, sin, cos = np.zeros_like(x), 0.2 * np.sin(angle), 0.2 * np.cos(angle)
    return {
        "place": np.column_stack([x - sin, y + cos, zero]),
        "speed": np.column_stack([x_rate - rate * cos, y_rate - rate * sin, zero]),
        "turning": np.column_stack([zero, zero, rate]),
        "slide": (0.1 + GRAVITY / 30.0 * (1.0 - np.cos(pulse * times)))[:, None],
        "slide_speed": (GRAVITY / pulse * np.sin(pulse * times))[:, None],
    }


def wheel_set(times: Array) -> Mapping[str, Array]:
    """Return a driven axle with a mass in front, by its speed and its rate of turning."""
    radius, half, ahead, wheel, small = 0.1, 0.25, 0.2, 0.5, 0.01
    pushed = 2 * wheel + small + 2 * 0.01 / radius**2
    turned = 2 * wheel * half**2 + 2 * 0.02 + small * ahead**2 + 0.001 + 2 * 0.01 * (half / radius) ** 2

    def rates(time: float, state: Array) -> Array:
        _, _, heading, _, _, speed, turning = state
        left, right = -2.0 * np.sin(2 * np.pi * time), -2.0 * np.cos(2 * np.pi * time)
        push = ((left + right) / radius + small * ahead * turning**2) / pushed
        moment = ((right - left) * half / radius - small * ahead * turning * speed) / turned
        wheels = [(speed - half * turning) / radius, (speed + half * turning) / radius]
        return np.array([speed * np.cos(heading), speed * np.sin(heading), turning, *wheels, push, moment])

    x, y, heading, left, right, speed, turning = _solved(rates, [0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0], times)
    spins = [(speed - half * turning) / radius, (speed + half * turning) / radius]
    angles = np.column_stack([heading, left, right])
    return {"place": np.column_stack([x, y]), "angles": angles, "rates": np.column_stack(spins)}


def bar_on_a_strut(times: Array) -> Mapping[str, Array]:
    """Return a bar on a hinge with a strut of two masses of 1 kg and a damper; derivatives by complex steps."""
    mass, length, tiny = STEEL * 0.7 * 0.035**2, 0.7, 1e-30

    def lines(angle: complex) -> tuple[complex, complex, complex, complex]:
        along, up = length * np.cos(angle), 1.2 + length * np.sin(angle)
        size = np.sqrt(along**2 + up**2)
        change = 1.2 * length * np.cos(angle) / size
        turning = (length**2 + 1.2 * length * np.sin(angle)) / size**2
        bar = mass * (length**2 / 3 + 0.035**2 / 12)
        inertia = bar + (0.2 * turning) ** 2 + change**2 + ((size - 0.2) * turning) ** 2
        height = mass * length / 2 * np.sin(angle) + 0.2 * up / size + (size - 0.2) * up / size
        return inertia, GRAVITY * height, change, size

    def rates(_: float, state: Array) -> Array:
        inertia, weight, change, _size = lines(state[0] + tiny * 1j)
        effort = -inertia.imag / tiny / 2 * state[1] ** 2 - weight.imag / tiny - 3.0 * change.real**2 * state[1]
        return np.array([state[1], effort / inertia.real])

    angle, rate = _solved(rates, [0.0, 0.0], times)
    return {"angle": angle[:, None], "rate": rate[:, None]}


def gaps(times: Array) -> Mapping[str, Array]:
    """Return two masses between springs with dampers, of which the second one lifts off."""

    def rates(_: float, state: Array) -> Array:
        held, loose, held_rate, loose_rate = state
        left, right, damp = 10.0 * max(-0.5 - loose, 0.0), 10.0 * max(loose - 0.5, 0.0), 1.5 * loose_rate
        push = left - right - max(-left, min(left, damp)) - max(-right, min(right, damp))
        return np.array([held_rate, loose_rate, -20.0 * held - 3.0 * held_rate, push])

    held, loose, held_rate, loose_rate = _solved(rates, [2.0, 2.0, 0.0, 0.0], times)[:, :, None]
    return {"gap": 2.0 - loose, "gap_rate": loose_rate, "spring": 2.0 - held, "spring_rate": held_rate}


def cylinder_on_two_hinges(times: Array) -> Mapping[str, Array]:
    """Return a cylinder on hinges about z and then y, under a constant force at its end and a constant torque."""
    mass = STEEL * np.pi / 4 * 0.05**2
    along, across = mass * 0.05**2 / 8, mass * (0.05**2 / 16 + 1 / 3)
    force = 1000.0 * np.array([-0.5, np.sqrt(0.75), 0.0])
    torque = 50.0 * np.array([-1.0 - np.sqrt(3.0), np.sqrt(3.0) - 1.0, 0.0])
    load = force - [0.0, mass * GRAVITY / 2, 0.0]

    def rates(_: float, state: Array) -> Array:
        (sin_1, sin_2), (cos_1, cos_2), (rate_1, rate_2) = np.sin(state[:2]), np.cos(state[:2]), state[2:]
        inertia = along * sin_2**2 + across * cos_2**2
        change = 2 * sin_2 * cos_2 * (along - across)
        push_1 = load @ [-sin_1 * cos_2, cos_1 * cos_2, 0.0] + torque[2]
        push_2 = load @ [-cos_1 * sin_2, -sin_1 * sin_2, -cos_2] + torque @ [-sin_1, cos_1, 0.0]
        pull_1, pull_2 = push_1 - change * rate_1 * rate_2, push_2 + change * rate_1**2 / 2
        return np.array([rate_1, rate_2, pull_1 / inertia, pull_2 / across])

    states = _solved(rates, [0.0, 0.0, 0.0, 0.0], times).T
    return {"angles": states[:, :2], "rates": states[:, 2:]}


def engine_of_one_cylinder(times: Array) -> Mapping[str, Array]:
    """Return a crank with rod, piston and flywheel, from the energy as a function of the crank's angle."""
    piston, rod = STEEL * np.pi / 4 * 0.1**2 * 0.1, STEEL * 0.2 * 0.02 * 0.06
    shaft, pin, web = STEEL * np.pi / 4 * 0.1 * 0.05**2, STEEL * np.pi / 4 * 0.1 * 0.03**2, STEEL * 0.1 * 0.02 * 0.05
    crank = shaft * 0.05**2 / 8 + pin * (0.03**2 / 8 + 0.01) + 2 * web * (0.0125 / 12 + 0.05**2)
    throw = 0.1 * (pin + web)

    def energies(angle: float) -> tuple[float, float]:
        sin, cos = np.sin(angle), np.cos(angle)
        root = np.sqrt(0.04 - 0.01 * sin**2)
        lift = -0.1 * sin - 0.01 * sin * cos / root
        middle = (lift - 0.1 * sin) ** 2 / 4 + (0.05 * cos) ** 2
        turning = rod * (0.2**2 + 0.06**2) / 12 * (0.1 * cos / root) ** 2
        height = throw * cos + piston * (0.1 * cos + root) + rod * (0.1 * cos + root / 2)
        return 1.0 + crank + piston * lift**2 + rod * middle + turning, GRAVITY * height

    inertia, weight = energies(0.0)
    energy = 50.0 * inertia + weight

    def rate(_: float, state: Array) -> Array:
        inertia, weight = energies(float(state[0]))
        return np.array([np.sqrt(2 * (energy - weight) / inertia)])

    angle = _solved(rate, [0.0], times)[0][:, None]
    return {"angle": angle, "rate": np.array([rate(0.0, row) for row in angle])}


def three_springs(times: Array) -> Mapping[str, Array]:
    """Return a body on a chain of springs, whose node is found by Newton's method at every instant."""
    hooks, end = np.array([[0.3, 0.0, 0.0], [0.0, 0.0, 0.3], [0.0, 0.0, 0.0]]), np.array([0.0, 0.2, 0.0])
    stiffness, node = np.array([20.0, 20.0, 40.0]), np.array([0.3, -0.15, 0.1])

    def pull(place: Array) -> Array:
        hooks[2] = place
        for _ in range(20):
            lines = hooks - node
            sizes = np.linalg.norm(lines, axis=1)
            slack = stiffness * (1.0 - 0.1 / sizes)
            step = slack @ lines
            tangent = np.sum(slack) * np.eye(3) + np.einsum("i,ij,ik->jk", 0.1 * stiffness / sizes**3, lines, lines)
            node[:] += np.linalg.solve(tangent, step)
            if np.abs(step).max() < 1e-12:
                break
        return np.asarray(slack[2] * (node - place))

    def rates(_: float, state: Array) -> Array:
        quaternion, speed, turning = state[3:7], state[7:10], state[10:]
        turn = matrix(quaternion)
        force = pull(state[:3] + turn @ end)
        change = np.cross(end, turn.T @ force) / 0.1
        return np.concatenate([speed, turned(quaternion, turning), force / 0.8 - [0.0, GRAVITY, 0.0], change])

    start = [0.5, -0.5, 0.0, 1.0, 0.0, 0.0, 0.0, *np.zeros(6)]
    states = _solved(rates, start, times).T
    arms = np.array([matrix(state[3:7]) @ end for state in states])
    spins = np.array([matrix(state[3:7]) @ np.cross(state[10:], end) for state in states])
    return {"place": states[:, :3] + arms, "speed": states[:, 7:10] + spins, "turning": states[:, 10:]}


def braked_mass(times: Array) -> Mapping[str, Array]:
    """Return a mass of 1 kg at 1 m/s that a brake of 1 N stops from 0.1 s on."""
    braked = np.clip(times - 0.1, 0.0, 1.0)
    return {
        "place": (np.minimum(times, 1.1) - braked**2 / 2)[:, None],
        "speed": (1.0 - braked)[:, None],
    }


MOTIONS: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "bar on a strut": bar_on_a_strut,
    "cylinder on two hinges": cylinder_on_two_hinges,
    "braked mass": braked_mass,
    "double pendulum": double_pendulum,
    "engine of one cylinder": engine_of_one_cylinder,
    "gaps": gaps,
    "slides and spring": slides_and_spring,
    "spring and damper": spring_and_damper,
    "three springs": three_springs,
    "wheel set": wheel_set,
}
