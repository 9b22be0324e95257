"""Third solutions of the multibody benchmarks of IFToMM, by SciPy: windows, Andrews' and Bricard's mechanism."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def _states(rates: Callable[[float, Array], Array], start: Array, times: Array) -> Array:
    """Return the states (times, n) of a motion."""
    found = solve_ivp(rates, (0.0, float(times[-1])), start, "DOP853", t_eval=times, rtol=3e-13, atol=1e-14).y
    return np.asarray(found.T)


def windows(count: int) -> Callable[[Array], Mapping[str, Array]]:
    """Return the end of the first post of windows whose posts stay parallel, by their angle."""
    pull = -1.5 * 9.81 * (3 * count + 1) / (4 * count + 1)

    def motion(times: Array) -> Mapping[str, Array]:
        start = np.array([np.pi / 2.0, -1.0])
        angle, rate = _states(lambda _, y: np.array([y[1], pull * np.cos(y[0])]), start, times).T
        place = np.column_stack([np.cos(angle), np.sin(angle)])
        return {"place": place, "speed": rate[:, None] * place[:, ::-1] * [-1.0, 1.0]}

    return motion


#: Bars of Andrews' mechanism: mass, moment of inertia about the centre of mass, and that centre in the bar.
BARS = [
    (0.04325, 2.194e-6, [0.00092, 0.0]),
    (0.00365, 4.410e-7, [-0.0115, 0.0]),
    (0.02373, 5.255e-6, [0.01043, -0.01874]),
    (0.00706, 5.667e-7, [0.0, -0.00579]),
    (0.07050, 1.169e-5, [0.02308, 0.00916]),
    (0.00706, 5.667e-7, [0.00579, 0.0]),
    (0.05498, 1.912e-5, [0.00449, -0.01228]),
]
#: Its pins: a bar and a place in it, and another, -1 for the ground; the last three are at the same joint.
PINS: list[tuple[int, list[float], int, list[float]]] = [
    (0, [0.0, 0.0], -1, [0.0, 0.0]),
    (1, [0.0, 0.0], 0, [0.007, 0.0]),
    (2, [0.0, 0.0], -1, [-0.03635, 0.03273]),
    (4, [0.0, 0.0], -1, [-0.06934, -0.00227]),
    (3, [0.0, 0.0], 4, [0.04, 0.0]),
    (6, [0.0, 0.0], -1, [-0.06934, -0.00227]),
    (5, [0.0, 0.0], 6, [0.0, -0.04]),
    (1, [-0.028, 0.0], 2, [0.0, -0.035]),
    (1, [-0.028, 0.0], 3, [0.0, -0.02]),
    (1, [-0.028, 0.0], 5, [0.02, 0.0]),
]


def andrews(times: Array) -> Mapping[str, Array]:
    """Return angles, their rates and forces in the joint of four bars, by the places of all bars and forces in pins."""
    weights = np.array([[mass, mass, inertia] for mass, inertia, _ in BARS]).ravel()
    beta, theta, gamma, phi, delta, omega, epsilon = (
        *(-0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885),
        *(0.487364979543842550, -0.222668390165885885, 1.23054744454982119),
    )
    turns = np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])

    def arm(bar: int, place: list[float], angle: float) -> Array:
        """Return the vector from the centre of mass of a bar to a place in it."""
        x, y = np.subtract(place, BARS[bar][2])
        return np.array([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)])

    places = np.zeros((7, 3))
    places[:, 2] = turns
    for bar, place, other, there in PINS[:7]:
        base = np.array(there) if other < 0 else places[other, :2] + arm(other, there, turns[other])
        places[bar, :2] = base - arm(bar, place, turns[bar])

    def motion(y: Array) -> tuple[Array, Array]:
        """Return accelerations, and the forces of the pins on their second bars."""
        q, v = y[:21].reshape(7, 3), y[21:].reshape(7, 3)
        rows, asked, force = np.zeros((2 * len(PINS), 21)), np.zeros(2 * len(PINS)), np.zeros(21)
        for pin, (bar, own, other, there) in enumerate(PINS):
            for part, place, sign in ((bar, own, 1.0), (other, there, -1.0)):
                if part >= 0:
                    lever, row = arm(part, place, q[part, 2]), slice(2 * pin, 2 * pin + 2)
                    rows[row, 3 * part : 3 * part + 2] = sign * np.eye(2)
                    rows[row, 3 * part + 2] = sign * np.array([-lever[1], lever[0]])
                    asked[row] += sign * lever * v[part, 2] ** 2
        lever = arm(2, [0.02, -0.018], q[2, 2])
        line = q[2, :2] + lever - [0.014, 0.072]
        length = np.hypot(*line)
        pull = -4530.0 * (length - 0.07785) / length * line
        force[2], force[6:9] = 0.033, [*pull, lever[0] * pull[1] - lever[1] * pull[0]]
        weighted = rows / weights
        forces = np.linalg.solve(weighted @ rows.T, weighted @ force - asked)
        return (force - rows.T @ forces) / weights, forces

    start = np.concatenate([places.ravel(), np.zeros(21)])
    states = _states(lambda _, y: np.concatenate([y[21:], motion(y)[0]]), start, times)

    forces = np.array([motion(y)[1][14:] for y in states])
    own, on = np.eye(7), np.zeros((7, 7))
    on[[1, 3, 5], [0, 4, 6]] = 1.0  # bars whose angle is counted from another bar
    return {
        "angles": states[:, 2:21:3] @ (own - on).T,
        "rates": states[:, 23::3] @ (own - on).T,
        "forces": forces,
    }


def bricard(times: Array) -> Mapping[str, Array]:
    """Return the size of EXUDYN's coordinates of Bricard's mechanism, by angles of its hinges along the one motion that
    the loop allows."""
    x, y, z = np.eye(3)
    axes, ends = np.array([y, z, x, y, z]), np.array([x, -y, z, -x, y])
    inertias = [(1.01 * np.eye(3) - 0.99 * np.outer(end, end)) / 12.0 for end in ends]

    def chain(q: Array, v: Array) -> tuple[list[Array], list[Array], list[Array], list[Array]]:
        """Return turns, places of hinges, columns (6, 5) of each rod's middle and end, and their accelerations."""
        turn, place, spin, change = np.eye(3), np.zeros(3), np.zeros((3, 5)), np.zeros(3)
        move, drift = np.zeros((3, 5)), np.zeros(3)
        turns, places, columns, rates = [], [place], [], []
        for k in range(5):
            axis = turn @ axes[k]
            change = change + np.cross(spin @ v, axis * v[k])
            spin = spin + np.outer(axis, np.eye(5)[k])
            turn = turn @ Rotation.from_rotvec(q[k] * axes[k]).as_matrix()
            for share in (0.5, 1.0):
                lever = share * (turn @ ends[k])
                columns.append(np.vstack([move + np.cross(spin.T, lever).T, spin]))
                bend = np.cross(change, lever) + np.cross(spin @ v, np.cross(spin @ v, lever))
                rates.append(np.concatenate([drift + bend, change]))
            move, drift, place = columns[-1][:3], rates[-1][:3], place + turn @ ends[k]
            turns.append(turn)
            places.append(place)
        return turns, places, columns, rates

    def derivatives(_time: float, state: Array) -> Array:
        q, v = np.split(state, 2)
        turns, _, columns, rates = chain(q, v)
        mass, force = np.zeros((5, 5)), np.zeros(5)
        for turn, own, column, rate in zip(turns, inertias, columns[::2], rates[::2], strict=True):
            body = turn @ own @ turn.T
            spin = column[3:] @ v
            weighted = np.vstack([column[:3], body @ column[3:]])
            mass += column.T @ weighted
            push = np.concatenate([-rate[:3] - 9.81 * y, -body @ rate[3:] - np.cross(spin, body @ spin)])
            force += column.T @ push
        # The end stays where it is, and its hinge along x: the rate of the axis has the spin's components across x.
        loop, drift = columns[-1][[0, 1, 2, 4, 5]], rates[-1][[0, 1, 2, 4, 5]]
        left, sizes, right = np.linalg.svd(loop)
        found = -right[:4].T @ ((left.T @ drift)[:4] / sizes[:4])
        free = right[4]
        return np.concatenate([v, found + free * (free @ (force - mass @ found)) / (free @ mass @ free)])

    sizes = []
    for state in _states(derivatives, np.zeros(10), times):
        turns, places, *_ = chain(*np.split(state, 2))
        moved = np.array(places[1:5]) - np.cumsum(ends, axis=0)[:4]
        angles = [Rotation.from_matrix(turn).magnitude() for turn in turns]
        sizes.append(2.0 + np.sqrt((moved**2).sum() + (2.0 - 2.0 * np.cos(np.array(angles) / 2.0)).sum()))
    return {"size": np.array(sizes)[:, None]}


#: Third solutions by the names that rows of ``runs*.toml`` give.
LINKAGES: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "two windows": windows(2),
    "forty windows": windows(40),
    "Andrews' mechanism": andrews,
    "Bricard's mechanism": bricard,
}
