"""The half car on a road from a CSV file: against its equations written by hand, SciPy's own spline of the file and
DOP853."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

import eomgen

FOLDER = Path(__file__).parents[2] / "examples" / "half_car_on_measured_road"
G, SPEED, BODY, PITCH, WHEEL, FRONT, REAR = 9.81, 10.0, 600.0, 900.0, 40.0, 1.2, 1.4
SPRINGS, DAMPER, TYRE, TYRE_DAMPING, HEIGHT = (18000.0, 20000.0), 1200.0, 180000.0, 150.0, 0.5
AT_REST = ([(1, 0.0), (2, 0.0)], [(1, 0.0), (2, 0.0)])
LOADS = (BODY * G * REAR / (FRONT + REAR), BODY * G * FRONT / (FRONT + REAR))
UNTIL = 6.0


def road():
    distance, height = np.genfromtxt(FOLDER / "road.csv", delimiter=",", skip_header=2, usecols=(0, 1)).T
    spline = make_interp_spline(distance, 1e-3 * height, k=5, bc_type=AT_REST)

    def at(s: float) -> tuple[float, float]:
        inside = distance[0] <= s <= distance[-1]
        return (float(spline(s)), float(spline(s, 1))) if inside else (0.0, 0.0)

    return at


def accelerations(q: np.ndarray, v: np.ndarray, wheels: list[tuple[float, float]]) -> np.ndarray:
    """Return the accelerations of heave, pitch, front and rear wheel; ``wheels`` are height and rate of the road."""
    z, angle = q[:2]
    force, moment, result = -BODY * G, 0.0, [0.0, 0.0]
    for k, (arm, stiffness, load) in enumerate(zip((FRONT, -REAR), SPRINGS, LOADS, strict=True)):
        span = np.array([arm * np.cos(angle) - arm, HEIGHT + z - arm * np.sin(angle) - q[2 + k]])
        by_angle = np.array([-arm * np.sin(angle), -arm * np.cos(angle)])
        length = np.hypot(*span)
        e = span / length
        rate = e @ (np.array([0.0, v[0] - v[2 + k]]) + by_angle * v[1])
        tension = stiffness * (length - HEIGHT - load / stiffness) + DAMPER * rate
        force -= tension * e[1]
        moment -= tension * (e @ by_angle)
        tyre = load + WHEEL * G + TYRE * (wheels[k][0] - q[2 + k]) + TYRE_DAMPING * (wheels[k][1] - v[2 + k])
        result.append((tension * e[1] + tyre - WHEEL * G) / WHEEL)
    return np.array([force / BODY, moment / PITCH, *result[2:]])


@pytest.fixture(scope="module")
def reference():
    at = road()

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        places = (SPEED * t, SPEED * t - FRONT - REAR)
        wheels = [(height, SPEED * slope) for height, slope in map(at, places)]
        return np.concatenate([y[4:], accelerations(y[:4], y[4:], wheels)])

    t = np.linspace(0.0, UNTIL, 601)
    return solve_ivp(rhs, (0.0, UNTIL), np.zeros(8), "DOP853", t, rtol=1e-9, atol=1e-12, max_step=4e-3).y[:4].T


@pytest.mark.slow
@pytest.mark.long_cases("rk4-0.001-5e-07", "rk4-0.0005-5e-08")
@pytest.mark.parametrize(
    ("method", "step", "bound"), [("rk4", 1e-3, 5e-7), ("rk4", 5e-4, 5e-8), ("generalized_alpha", 1e-3, 1e-3)]
)
def test_motion(method: str, step: float, bound: float, reference: np.ndarray) -> None:
    model = eomgen.build(FOLDER / "scene.toml")
    solution = model.simulate(UNTIL, step, method=method, record_every=round(1e-2 / step))
    assert solution.success
    names = ["q.heave", "q.pitch", "q.front", "q.rear"]
    found = solution.q[:, [list(solution.metadata["names"]["q"]).index(name) for name in names]]
    assert np.max(np.abs(reference[:, 2])) > 0.05, "the hump is on the way"
    assert np.max(np.abs(found - reference)) <= bound * np.max(np.abs(reference))
