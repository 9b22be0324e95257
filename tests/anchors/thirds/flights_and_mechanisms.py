"""Third solutions of runs: a body on a spring in closed form, and NASA's flights over the equator by SciPy's DOP853.

Flights are in polar coordinates that turn with the Earth, with feet and seconds in the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
FOOT = 0.3048
TURN = np.radians(0.004178073)
MU = 1.407644311e16 / 3.28084**3
SLUG = 14.593902937206363
BRICK = np.array([0.001894220, 0.006211019, 0.007194665]) * SLUG * FOOT**2


def _density(altitude: float) -> float:
    """Return the density of the standard atmosphere below 11 km, kg/m^3."""
    geopotential = 6356766.0 * altitude / (6356766.0 + altitude)
    return float(1.225 * (1.0 - 0.0065 * geopotential / 288.15) ** (9.80665 * 0.0289644 / (8.31432 * 0.0065) - 1.0))


def flight(
    radius: float,
    start: tuple[float, float, float],
    oblateness: float = 1.08262982e-3,
    drag: bool = True,
    wind: float = 0.0,
) -> Callable[[Array], Mapping[str, Array]]:
    """Return altitude, longitude and speeds over times, and with ``drag`` False the rates of the brick that falls.

    ``start`` has the altitude, and the speeds upwards and eastwards over the ground, in feet and seconds."""

    def rates(_: float, y: Array) -> Array:
        altitude, _, up, east = y[:4]
        spin, r = y[4:], radius + altitude
        pull = MU / r**2 * (1.0 + 1.5 * oblateness * (6378137.0 / r) ** 2)
        density = _density(altitude)
        speed = np.hypot(east - wind * FOOT, up)
        push = -0.5 * density * 0.1 * 0.1963495 * FOOT**2 / SLUG * speed if drag else 0.0
        size = np.array([0.33333, 0.66667, 0.33333]) * FOOT
        moment = -0.25 * density * 0.22222 * FOOT**2 * np.hypot(east, up) * size**2 * spin
        return np.array(
            [
                up,
                east / r,
                (east + TURN * r) ** 2 / r - pull + push * up,
                -up * (east / r + 2.0 * TURN) + push * (east - wind * FOOT),
                *((moment - np.cross(spin, BRICK * spin)) / BRICK),
            ]
        )

    def motion(times: Array) -> Mapping[str, Array]:
        altitude, up, east = np.array(start) * FOOT
        first = np.array([altitude, 0.0, up, east, *np.radians([10.0, 20.0, 30.0])])
        solution = solve_ivp(rates, (0.0, float(times[-1])), first, "DOP853", t_eval=times, rtol=1e-12, atol=1e-14)
        altitude, angle, up, east = solution.y[:4]
        return {
            "altitude": altitude[:, None] / FOOT,
            "longitude": np.degrees(angle)[:, None],
            "speed": np.column_stack([east, -up]) / FOOT,
            "rates": np.degrees(solution.y[4:].T),
        }

    return motion


def vertical_spring(times: Array) -> Mapping[str, Array]:
    """Return the damped oscillation of 1 kg that falls from rest on a spring of 10 N/m and a damper of 0.5 N s/m."""
    rest, decay, frequency = 9.80665 / 10.0, 0.25, np.sqrt(10.0 - 0.25**2)
    cosine, sine, size = np.cos(frequency * times), np.sin(frequency * times), np.exp(-decay * times)
    place = -rest + rest * size * (cosine + decay / frequency * sine)
    speed = -rest * 10.0 / frequency * size * sine
    force = 10.0 * place + 0.5 * speed
    up = {"place": place, "speed": speed, "acceleration": -force - 9.80665, "force": force}
    return {name: np.outer(values, [0.0, 0.0, 1.0]) for name, values in up.items()}


def slider_crank(times: Array) -> Mapping[str, Array]:
    """Return the slider-crank of SUNDIALS by the angle of its crank alone, with the integral of the kinetic energy."""

    def rates(_: float, y: Array) -> Array:
        angle, rate = y[:2]
        s1, c1 = np.sin(angle), np.cos(angle)
        s2, c2 = -0.5 * s1, np.sqrt(1.0 - 0.25 * s1 * s1)
        turn, travel = -0.5 * c1 / c2, -0.5 * s1 - s2 * (-0.5 * c1 / c2)
        turn_rate = (0.5 * s1 + s2 * turn**2) / c2
        travel_rate = -0.5 * c1 - c2 * turn**2 - s2 * turn_rate
        line = np.array([0.5 * c2 + 0.25 * c1, -0.5 * s2 - 0.25 * s1])
        change = np.array([travel + 0.5 * s2 * turn + 0.25 * s1, -0.5 * c2 * turn - 0.25 * c1])
        length = np.hypot(*line)
        stretch = line @ change / length
        pull = length - 1.0 + stretch * rate
        mass = 1.0 + travel**2 + 2.0 * turn**2
        load = travel - s2 * turn - pull * stretch - (travel * travel_rate + 2.0 * turn * turn_rate) * rate**2
        return np.array([rate, load / mass, 0.5 * mass * rate**2])

    solution = solve_ivp(
        rates, (0.0, float(times[-1])), [np.pi / 2.0, 0.0, 0.0], "DOP853", t_eval=times, rtol=1e-12, atol=1e-13
    )
    angle, _, integral = solution.y
    rod = -np.arcsin(0.5 * np.sin(angle))
    places = {"angle": angle, "slider": np.cos(rod) + 0.5 * np.cos(angle), "rod": rod, "integral": integral}
    return {name: values[:, None] for name, values in places.items()}


def _rotation(p: Array) -> Array:
    """Return the matrix of a quaternion (x, y, z, w) of any length."""
    x, y, z, w = p / np.sqrt(p @ p)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rod_on_arm(times: Array) -> Mapping[str, Array]:
    """Return the rod of 1 kg whose end is on a circle of 2 m in the plane z = 0: Newton's and Euler's equations with
    two constraint forces."""
    inertia, end = np.array([0.1, 0.04, 0.1]), np.array([0.0, -2.0, 0.0])
    arm = np.array([[0.0, 0.0, -2.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])  # of the cross product with the end

    def accelerations(y: Array) -> tuple[Array, Array]:
        turn, speed, rate = _rotation(y[3:7]), y[7:10], y[10:]
        place, motion = y[:3] + turn @ end, speed + turn @ np.cross(rate, end)
        normals = np.array([[0.0, 0.0, 1.0], [place[0], place[1], 0.0]])
        lever = -turn @ arm  # of the end's velocity by the rate
        rows = np.hstack([normals, normals @ lever])
        free = np.concatenate([[0.0, 0.0, -9.80665], -np.cross(rate, inertia * rate) / inertia])
        spin = turn @ np.cross(rate, np.cross(rate, end))
        asked = -normals @ spin - np.array([0.0, motion[0] ** 2 + motion[1] ** 2])
        weighted = rows / np.concatenate([np.ones(3), inertia])
        both = free + weighted.T @ np.linalg.solve(weighted @ rows.T, asked - rows @ free)
        return both[:3], both[3:]

    def rates(_: float, y: Array) -> Array:
        x, p = y[10:], y[3:7]
        turning = 0.5 * np.concatenate([p[3] * x + np.cross(p[:3], x), [-p[:3] @ x]])
        return np.concatenate([y[7:10], turning, *accelerations(y)])

    start = np.array([2.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, *np.zeros(6)])
    states = solve_ivp(rates, (0.0, float(times[-1])), start, "DOP853", t_eval=times, rtol=1e-10, atol=1e-11).y.T
    pull = np.array([accelerations(y)[0] for y in states])
    return {"place": states[:, :3], "speed": states[:, 7:10], "acceleration": pull}


#: Third solutions by the names that rows of ``runs*.toml`` give.
RUNS: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "vertical spring": vertical_spring,
    "slider-crank": slider_crank,
    "rod on an arm": rod_on_arm,
    "tumbling brick": flight(6378137.0, (3e4, 0.0, 0.0), drag=False),
    "round Earth": flight(20902255.199 * FOOT, (3e4, 0.0, 0.0), oblateness=0.0),
    "steady wind": flight(6378137.0, (3e4, 0.0, 0.0), wind=20.0),
    "cannonball": flight(6378137.0, (0.0, 1000.0, 1000.0)),
}
