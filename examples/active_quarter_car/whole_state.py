"""A regulator of the whole state, actuator and road included, beside one that knows nothing of the actuator's lag.

python examples/active_quarter_car/whole_state.py [FOLDER]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from scipy.linalg import solve_continuous_are

import eomgen
from eomgen.control import (
    OutputFeedback,
    Regulator,
    driven_by,
    kalman,
    lqr,
    root_mean_squares,
    shaping_filter,
)
from eomgen.linear.linearization import Linearization
from eomgen.linear.state_space import StateSpace
from eomgen.spectra import Road

SCENE = Path(__file__).with_name("lag.toml")
SPEED = 20.0
COST = {"body_acceleration": 1.0, "travel": 1e3, "deflection": 1e4}
#: Of the force asked for, (m/s^2)^2 per N^2: it bounds how much the lag is made up for.
EFFORT = {"force": 1e-7}
SAMPLE, DELAY = "2 ms", "1 ms"
#: Time at which the road has faded in, s.
LATER = 100.0


def on_road(space: StateSpace) -> StateSpace:
    """Return the car on a road of class C: white noise behind a filter, level over lengths of a kilometre."""
    return driven_by(space, shaping_filter([1.0], [1.0, 2.0 * math.pi * 0.001 * SPEED], "roughness", "road", "m"))


def of_second_order(linear: Linearization, car: StateSpace) -> Regulator:
    """Return the optimal gains of an actuator that acts at once, in the car whose actuator lags."""
    actuator = linear.names.states.index("tension")
    space = linear.state_space()
    count, rows = len(linear.coordinates), [space.outputs.index(name) for name in COST]
    n = 2 * count
    forces = np.linalg.solve(linear.M0, np.hstack([-linear.K0, -linear.C0, -linear.Z0[:, [actuator]]]))
    A, B = np.vstack([np.eye(count, n, count), forces[:, :n]]), np.vstack([np.zeros((count, 1)), forces[:, n:]])
    weights, seen, felt = np.diag(list(COST.values())), space.C[rows, :n], space.C[rows][:, [n + actuator]]
    effort, cross = EFFORT["force"] + felt.T @ weights @ felt, seen.T @ weights @ felt
    riccati = solve_continuous_are(A, B, seen.T @ weights @ seen, effort, s=cross)
    gains = np.zeros((1, len(car.states)))
    gains[0, :n] = np.linalg.solve(effort, B.T @ riccati + cross.T)[0]
    gains[0, -1] = -gains[0, :count].sum()  # heights count from the road's
    return Regulator(car, gains)


def suspensions(linear: Linearization) -> dict[str, StateSpace]:
    """Return the car with each regulator."""
    car = on_road(linear.state_space())
    whole = lqr(car, COST, EFFORT)
    seen = kalman(car, noise(), {"travel": 1e-9, "body_velocity": 1e-7})
    return {
        "passive": car,
        "LQR of second order": of_second_order(linear, car).closed_loop,
        "LQR of the whole state": whole.closed_loop,
        "LQG from travel and body velocity": OutputFeedback(whole, seen).closed_loop,
    }


def noise() -> dict[str, float]:
    """Return the intensity of the white noise that makes the road."""
    return {"roughness": Road("C").velocity_intensity(SPEED)}


def sampled(linear: Linearization) -> OutputFeedback:
    """Return the controller that measures every 2 ms and acts 1 ms later; it takes the road for what it is."""
    car = on_road(linear.state_space())
    seen = kalman(car, noise(), {"travel": 1e-8, "body_velocity": 1e-5}, sample=SAMPLE, delay=DELAY)
    return OutputFeedback(lqr(car, COST, EFFORT, sample=SAMPLE, delay=DELAY), seen)


def main(folder: Path | None) -> None:
    model = eomgen.build(SCENE)
    linear = model.linearize(t=LATER)
    print(f"{'':36}{'body acceleration, m/s^2':>26}{'travel, mm':>14}{'tyre load, N':>14}")
    for name, space in suspensions(linear).items():
        sizes = root_mean_squares(space, noise())
        row = (sizes["body_acceleration"], 1e3 * sizes["travel"], 160000.0 * sizes["deflection"])
        print(f"{name:36}{row[0]:26.5g}{row[1]:14.5g}{row[2]:14.5g}")
    law = sampled(linear)
    closed = eomgen.build(eomgen.with_controller(SCENE, law))
    for what, car in (("simulated, passive", model), ("simulated, sampled LQG", closed)):
        run = car.simulate(100.0, 1e-3)
        late = run.t > 2.0
        outputs = (run.outputs["body_acceleration"], 1e3 * run.outputs["travel"], 160000.0 * run.outputs["deflection"])
        row = tuple(float(np.sqrt(np.mean(values[late] ** 2))) for values in outputs)
        print(f"{what:36}{row[0]:26.5g}{row[1]:14.5g}{row[2]:14.5g}")
    margins = law.margins["force"]
    print(f"sampled LQG: delay margin {1e3 * margins.delay_margin:.4g} ms, modulus margin {margins.modulus_margin:.4g}")
    if folder is not None:
        (axes,) = law.plot()
        axes.figure.savefig(folder / "loop.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
