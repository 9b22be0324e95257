"""Rounding in the stated errors of runs: of single precision, against doubles, and of steps that rounding chooses, as
it grows along an unstable motion, against a Taylor series in forty digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import eomgen


def chain(links: int) -> Any:
    """Return a chain of rods that swings in a plane."""
    builder, parent = eomgen.SceneBuilder("chain", gravity=[0, 0, -9.81]), "base"
    for k in range(links):
        builder.body(f"b{k}", 1.0, center_of_mass=[0, 0, -0.25], inertia=[0.02, 0.02, 0.001])
        place, start = [0, 0, -0.5 if k else 0.0], {"position": 0.3 + 0.1 * k}
        builder.joint(f"j{k}", "revolute", parent, f"b{k}", axis=[0, 1, 0], position=place, initial=start)
        parent = f"b{k}"
    return builder.build()


@pytest.mark.slow_cases("rk4-0.003", "generalized_alpha-0.0001")
@pytest.mark.parametrize(("method", "step"), [("rk4", 3e-3), ("rk4", 3e-4), ("generalized_alpha", 1e-4)])
def test_rounding_of_single_precision_is_in_the_stated_error(method: str, step: float) -> None:
    run = eomgen.build(chain(2), real="float", method=method, profile="quick").simulate(
        2.0, step, record_every=round(0.01 / step)
    )
    exact = eomgen.build(chain(2), method="rk4", profile="quick").simulate(2.01, 1e-3)
    q = np.stack([CubicHermiteSpline(exact.t, exact.q[:, k], exact.v[:, k])(run.t) for k in range(2)], axis=1)
    off = np.abs(run.q - q).max(axis=0)
    assert np.all(off > 1e-7)  # some units in the last place
    assert np.all(off < 3.0 * run.error.increment) and np.all(run.error.increment < 5.0 * off)


@pytest.mark.parametrize(("speed", "steps"), [(130.0, 8000), (0.43, 30_000), (30.0, 3000)])
def test_equal_increments_are_rounded_alike(speed: float, steps: int) -> None:
    """A rotor at constant speed: errors of single precision add up in proportion to the steps."""
    builder = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0]).body("rotor", 1.0, inertia=[1, 1, 1])
    builder.joint("hinge", "revolute", "base", "rotor", axis=[0, 0, 1], initial={"velocity": speed})
    model = eomgen.build(builder.build(), real="float", method="rk4", profile="quick")
    run = model.simulate(2.0, 2.0 / steps, record_every=steps // 50)
    off = float(np.abs(run.q[:, 0] - float(np.float32(speed)) * run.t).max())
    assert off / 3.0 < float(run.error.increment[0]) < 5.0 * off


@pytest.mark.slow
@pytest.mark.parametrize("aside", [1e-8, 1e-12])
def test_errors_of_steps_that_rounding_chooses_are_stated(aside: float) -> None:
    """A brick turns about its axis of middle inertia, and falls out of it by 1e9 times what it began with."""
    start = [aside, 2.0, 0.5 * aside]
    root = {"type": "free", "parent": "base", "child": "brick", "initial": {"velocity": [*start, 0, 0, 0]}}
    model = eomgen.build(
        {"format": 1, "name": "brick", "gravity": [0, 0, 0], "joints": {"root": root},
         "bodies": {"brick": {"mass": 1.0, "inertia": [1.0, 2.0, 3.0]}}}, profile="quick",
    )  # fmt: skip
    run = model.simulate(18.0, 0.02, record_every=900, method="rk45", tolerance=1e-12)

    def rates(_: Any, w: Any) -> list[Any]:
        return [-w[1] * w[2], w[2] * w[0], -w[0] * w[1] / 3]

    with mpmath.workdps(25):
        exact = mpmath.odefun(rates, 0, [mpmath.mpf(one) for one in start], tol=mpmath.mpf(10) ** -20)(18)
        off = max(abs(float(one - value)) for one, value in zip(run.v[-1, :3].tolist(), exact, strict=True))
    assert run.error.v.max() > off / 3.0
    assert run.error.v.max() < 3.0 * off
