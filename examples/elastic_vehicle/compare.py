"""Passive, skyhook and optimal suspension under an elastic body: simulated root mean squares beside stationary ones.

python examples/elastic_vehicle/compare.py [half_car] [full_car]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

import eomgen
from eomgen.spectra import Road

FOLDER = Path(__file__).parent
SPEED = 20.0
#: Time at which the road has faded in, s.
LATER = 100.0
#: Output, component, title, factor to the unit shown.
Row = tuple[str, int | None, str, float]


@dataclass(frozen=True)
class Car:
    """A scene and what the stationary values need to know of it.

    Attributes
    ----------
    tracks : inputs of front and rear wheels, for each road that is independent of the others.
    wheelbase : m; a rear wheel is later than its front wheel by wheelbase / speed.
    skyhook : N s/m, where the suspension is skyhook.
    rows : what is shown.
    """

    scene: Path
    tracks: tuple[tuple[str, str], ...]
    wheelbase: float
    skyhook: float
    rows: tuple[Row, ...]

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the rows among the outputs of a linear model."""
        return tuple(name if part is None else f"{name}[{part}]" for name, part, _, _ in self.rows)

    @property
    def factors(self) -> np.ndarray:
        return np.array([factor for *_, factor in self.rows])


HALF_CAR = Car(
    scene=FOLDER / "scene.toml",
    tracks=(("road_front", "road_rear"),),
    wheelbase=1.011 + 1.803,
    skyhook=2000.0,
    rows=(
        ("acceleration", None, "acceleration of the middle, m/s²", 1.0),
        ("pitch_acceleration", None, "pitch acceleration, rad/s²", 1.0),
        ("bending", None, "bending, first mode, mm", 1e3),
        ("suspension_travel", 0, "suspension travel front, mm", 1e3),
        ("suspension_travel", 1, "suspension travel rear, mm", 1e3),
        ("tyre_load", 0, "dynamic tyre load front, N", 1.0),
        ("tyre_load", 1, "dynamic tyre load rear, N", 1.0),
    ),
)
FULL_CAR = Car(
    scene=FOLDER / "full_car.toml",
    tracks=(("left_front", "left_rear"), ("other_front", "other_rear")),
    wheelbase=1.4 + 1.7,
    skyhook=3000.0,
    rows=(
        ("acceleration", None, "acceleration of the middle, m/s²", 1.0),
        ("driver_acceleration", None, "acceleration, driver's seat, m/s²", 1.0),
        ("corner_acceleration", 0, "acceleration, front left, m/s²", 1.0),
        ("corner_acceleration", 2, "acceleration, rear left, m/s²", 1.0),
        ("bending", None, "bending, first mode, mm", 1e3),
        ("twist", None, "twist, first mode, mrad", 1e3),
        ("suspension_travel", 0, "suspension travel front left, mm", 1e3),
        ("suspension_travel", 2, "suspension travel rear left, mm", 1e3),
        ("tyre_load", 0, "dynamic tyre load front left, N", 1.0),
        ("tyre_load", 2, "dynamic tyre load rear left, N", 1.0),
    ),
)
CARS = {"half_car": HALF_CAR, "full_car": FULL_CAR}


def suspensions(model: eomgen.Model, car: Car) -> dict[str, dict[str, float]]:
    """Return the parameters of each suspension; the regulator is what the model has by default."""
    without = {name: 0.0 for name in model.parameters if name.startswith("ride_")}
    return {"passive": without, "skyhook": without | {"skyhook": car.skyhook}, "LQR": {}}


def simulated(model: eomgen.Model, car: Car, parameters: dict[str, float], duration: float) -> np.ndarray:
    """Return the root mean squares of the rows after two seconds."""
    run = model.simulate(duration, 1e-3, record_every=1, parameters=parameters)
    if not run.success:
        raise eomgen.NumericalError(run.message)
    late = run.t > 2.0
    values = (
        run.outputs[name][late] if part is None else run.outputs[name][late, part] for name, part, _, _ in car.rows
    )
    return car.factors * np.sqrt([np.mean(value**2) for value in values])


def expected(model: eomgen.Model, car: Car, parameters: dict[str, float]) -> np.ndarray:
    """Return the root mean squares of the stationary motion on white road velocity, from the model's own linear
    matrices.

    A road is a sum of small independent steps: with g(s) the answer of an output to a unit step in a track, s after the
    front wheel has met it, and S the intensity of the road's velocity, the variance is S times the integral of g^2,
    summed over tracks. With X_f and X_r the states that constant heights under front and rear wheels lead to,

        g = C X_f + F_f - C e^(A s) X_f         until the rear wheel meets the step at s = delay,
        g = -C e^(A (s - delay)) x              from then on, x = e^(A delay) X_f + X_r.

    C X_f + F_f is not zero where a body cannot follow: four wheels on a twisted road. The integral of its square is the
    delay's length, that of the product is e^(A s) integrated, and the rest is C P C^T by Lyapunov's equation,

        A P + P A^T + X_f X_f^T - e^(A delay) X_f X_f^T e^(A^T delay) + x x^T = 0.
    """
    linear = model.linearize(t=LATER, at="initial", parameters=parameters).state_space()
    rows = [linear.outputs.index(name) for name in car.outputs]
    C, F = linear.C[rows], linear.F[rows]
    delay = car.wheelbase / SPEED
    variances = np.zeros(len(rows))
    for track in car.tracks:
        front, rear = (linear.disturbances.index(name) for name in track)
        first, second = -np.linalg.solve(linear.A, linear.E[:, [front, rear]]).T
        later = expm(linear.A * delay) @ first
        entering = np.outer(first, first) - np.outer(later, later) + np.outer(later + second, later + second)
        P = solve_continuous_lyapunov(linear.A, -entering)
        held = C @ first + F[:, front]
        variances += held**2 * delay - 2 * held * (C @ np.linalg.solve(linear.A, later - first))
        variances += np.einsum("ij,jk,ik->i", C, P, C)
    return car.factors * np.sqrt(Road("C").velocity_intensity(SPEED) * variances)


def main() -> int:
    for name in sys.argv[1:] or CARS:
        car = CARS[name]
        model = eomgen.build(car.scene)
        table = {
            name: (simulated(model, car, p, 400.0), expected(model, car, p))
            for name, p in suspensions(model, car).items()
        }
        print(f"{model.name}\n{'root mean square':36}" + "".join(f"{name:>12}{'stationary':>12}" for name in table))
        for row, (_, _, title, _) in enumerate(car.rows):
            print(f"{title:36}" + "".join(f"{run[row]:12.4g}{theory[row]:12.4g}" for run, theory in table.values()))
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
