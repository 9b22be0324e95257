"""Passive, skyhook, clipped and optimal suspension: simulated root mean squares beside those of the stationary motion.

python examples/active_quarter_car/compare.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

import eomgen
from eomgen.spectra import Road

SCENE = Path(__file__).with_name("scene.toml")
OUTPUTS = ("body_acceleration", "suspension_travel", "tyre_load")
#: Units of the table by those of the outputs.
SCALES = (1.0, 1e3, 1.0)
SPEED, TYRE = 20.0, 160000.0
#: Time at which the road has faded in, s.
LATER = 100.0


def suspensions(model: eomgen.Model) -> dict[str, dict[str, float]]:
    """Return the parameters of each suspension; the regulator is what the model has by default."""
    without = dict.fromkeys(model.calibrate(), 0.0)
    clipped = {"damper": 0.0, "semi": 3000.0, "softest": 300.0, "hardest": 3000.0}
    return {"passive": without, "skyhook": without | {"skyhook": 2000.0}, "clipped": without | clipped, "LQR": {}}


def simulated(model: eomgen.Model, parameters: dict[str, float], duration: float) -> np.ndarray:
    """Return the root mean squares of the outputs after two seconds, in the units of the table."""
    run = model.simulate(duration, 1e-3, parameters=parameters)
    if not run.success:
        raise RuntimeError(run.message)
    late = run.t > 2.0
    return np.array(
        [scale * np.sqrt(np.mean(run.outputs[name][late] ** 2)) for name, scale in zip(OUTPUTS, SCALES, strict=True)]
    )


def expected(model: eomgen.Model, parameters: dict[str, float], road: str = "C") -> np.ndarray:
    """Return the same of the stationary motion on white road velocity, from the model's own linear matrices."""
    linear = model.linearize(t=LATER, parameters=parameters)
    acceleration = -np.linalg.solve(linear.M0, np.hstack([linear.K0, linear.C0]))
    A = np.vstack([np.eye(2, 4, 2), acceleration])  # of heights above the road, and velocities
    noise = np.diag([Road(road).velocity_intensity(SPEED)] * 2 + [0.0] * 2)
    noise[0, 1] = noise[1, 0] = noise[0, 0]
    covariance = solve_continuous_lyapunov(A, -noise)
    body, wheel = linear.coordinates.index("body"), linear.coordinates.index("wheel")
    travel, load = np.zeros(4), np.zeros(4)
    travel[body], travel[wheel], load[wheel] = 1.0, -1.0, TYRE
    rows = np.array([acceleration[body], travel, load])
    return np.array(SCALES) * np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows))


def main() -> None:
    model = eomgen.build(SCENE)
    print(f"{'':12} {'body acceleration, m/s^2':>26} {'suspension travel, mm':>26} {'dynamic tyre load, N':>26}")
    for name, parameters in suspensions(model).items():
        print(f"{name:12}" + "".join(f"{value:26.5g}" for value in simulated(model, parameters, 400.0)))
        if name != "clipped":
            print(f"{'  stationary':12}" + "".join(f"{value:26.6g}" for value in expected(model, parameters)))


if __name__ == "__main__":
    main()
