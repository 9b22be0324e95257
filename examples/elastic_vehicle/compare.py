"""Passive, skyhook and optimal suspension under an elastic body: simulated root mean squares beside stationary ones.

    python examples/elastic_vehicle/compare.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

import eomgen
from eomgen.control.stationary import road_intensity

SCENE = Path(__file__).with_name("scene.toml")
#: Output, component, title, factor to the unit shown.
ROWS = (
    ("acceleration", None, "acceleration of the middle, m/s²", 1.0),
    ("pitch_acceleration", None, "pitch acceleration, rad/s²", 1.0),
    ("bending", None, "bending, first mode, mm", 1e3),
    ("suspension_travel", 0, "suspension travel front, mm", 1e3),
    ("suspension_travel", 1, "suspension travel rear, mm", 1e3),
    ("tyre_load", 0, "dynamic tyre load front, N", 1.0),
    ("tyre_load", 1, "dynamic tyre load rear, N", 1.0),
)
SPEED, WHEELBASE = 20.0, 1.011 + 1.803
#: Time at which the road has faded in, s.
LATER = 100.0


def suspensions(model: eomgen.Model) -> dict[str, dict[str, float]]:
    """Return the parameters of each suspension; the regulator is what the model has by default."""
    without = dict.fromkeys(model.calibrate(), 0.0)
    return {"passive": without, "skyhook": without | {"skyhook": 2000.0}, "LQR": {}}


def simulated(model: eomgen.Model, parameters: dict[str, float], duration: float) -> np.ndarray:
    """Return the root mean squares of ``ROWS`` after two seconds."""
    run = model.simulate(duration, 1e-3, parameters=parameters)
    if not run.success:
        raise eomgen.NumericalError(run.message)
    late = run.t > 2.0
    values = (run.outputs[name][late] if part is None else run.outputs[name][late, part] for name, part, _, _ in ROWS)
    return np.array([factor * np.sqrt(np.mean(value**2)) for value, (*_, factor) in zip(values, ROWS, strict=True)])


def expected(model: eomgen.Model, parameters: dict[str, float]) -> np.ndarray:
    """Return the root mean squares of the stationary motion on white road velocity, from the model's own linear matrices.

    With X w where a constant road w leads to, x - X w obeys A and is driven by w'. The second road is the first, later by a
    delay, and the state holds what it has answered to the first meanwhile: so with b = -X and the intensity S of w',

        A P + P A^T + S (b_1 b_1^T + b_2 b_2^T + e^(A delay) b_1 b_2^T + b_2 b_1^T e^(A^T delay)) = 0.
    """
    linear = model.linearize(t=LATER, at="initial", parameters=parameters).state_space()
    first, second = np.linalg.solve(linear.A, linear.E).T
    later = np.outer(expm(linear.A * WHEELBASE / SPEED) @ first, second)
    entering = np.outer(first, first) + np.outer(second, second) + later + later.T
    P = solve_continuous_lyapunov(linear.A, -road_intensity("C", SPEED) * entering)
    variances = np.einsum("ij,jk,ik->i", linear.C, P, linear.C)
    outputs = [name if part is None else f"{name}[{part}]" for name, part, _, _ in ROWS]
    factors = np.array([factor for *_, factor in ROWS])
    return factors * np.sqrt([variances[linear.outputs.index(name)] for name in outputs])


def main() -> None:
    model = eomgen.build(SCENE)
    table = {name: (simulated(model, p, 400.0), expected(model, p)) for name, p in suspensions(model).items()}
    print(f"{'root mean square':36}" + "".join(f"{name:>12}{'stationary':>12}" for name in table))
    for row, (_, _, title, _) in enumerate(ROWS):
        print(f"{title:36}" + "".join(f"{run[row]:12.4g}{theory[row]:12.4g}" for run, theory in table.values()))


if __name__ == "__main__":
    main()
