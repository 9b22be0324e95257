"""A joint whose drive is a polynomial that a caller sets between steps moves as it does by one law for all times."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen

NAMES = tuple(f"c{k}" for k in range(6))
PIECE = 0.02


def target(t: float) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of the planned motion."""
    return 0.2 + 0.1 * np.sin(3 * t), 0.3 * np.cos(3 * t), -0.9 * np.sin(3 * t)


@cache
def cart(law: str, method: str) -> eomgen.Model:
    """Return a cart under a drive, with a pendulum on it."""
    builder = eomgen.SceneBuilder("cart").body("cart", 2.0)
    builder.body("bob", 0.5, center_of_mass=[0, 0, -0.5], inertia=[0.01, 0.01, 0.01])
    for name in (*NAMES, "begin"):
        builder.parameter(name, 0.0, tunable=True)
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], drive=law)
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0])
    return eomgen.build(builder.build(), profile="quick", method=method)


def quintic(start: tuple[float, float, float], end: tuple[float, float, float]) -> dict[str, float]:
    """Return the coefficients of the polynomial over a piece that meets both ends with two derivatives."""
    T = PIECE
    A = [[T**3, T**4, T**5], [3 * T**2, 4 * T**3, 5 * T**4], [6 * T, 12 * T**2, 20 * T**3]]
    (x, v, a), (X, V, B) = start, end
    rest = np.linalg.solve(A, [X - x - v * T - a * T**2 / 2, V - v - a * T, B - a])
    return dict(zip(NAMES, [x, v, a / 2, *rest], strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "error"), [("rk4_partitioned", 1e-7), ("generalized_alpha", 3e-5)])
def test_pieces_set_between_steps_move_the_machine_as_one_law(name: str, error: float) -> None:
    """The pieces are off the sine by the error of Hermite's interpolation, 0.1 (3 T)^6 / 46080, and 9e-14 m is none."""
    law = " + ".join(f"c{k} * (t - begin)**{k}" for k in range(6))
    start = {"x": {"position": 0.2, "velocity": 0.3}, "swing": {"position": 0.3, "velocity": 0.0}}
    first = quintic(target(0.0), target(PIECE))
    run = cart(law, name).start(start, first, name, 1e-3)
    for k in range(25):
        t = k * PIECE
        run.set_parameters({"begin": t, **quintic(target(t), target(t + PIECE))})
        run.step(n=20)
        assert (run.q[0], run.v[0]) == pytest.approx(target(run.t)[:2], abs=1e-12)
    whole = cart("0.2 + 0.1 * sin(3 * t)", name).simulate(0.5, 1e-3, initial=start, error_estimate=False)
    assert run.q == pytest.approx(whole.q[-1], abs=error) and run.v == pytest.approx(whole.v[-1], abs=10 * error)
    assert abs(whole.q[-1, 1] - 0.3) > 0.3, "the pendulum moves"


def test_parameters_are_set_together_or_not_at_all() -> None:
    run = cart("c0 + c1 * t", "generalized_alpha").start(step=1e-3)
    before = dict(run.parameters)
    with pytest.raises(eomgen.UsageError, match="there is no parameter 'c9'"):
        run.set_parameters({"c1": 2.0, "c9": 1.0})
    with pytest.raises(eomgen.UsageError, match="a mapping from names to numbers is needed, not float"):
        run.set_parameters(2.0)  # type: ignore[arg-type]
    assert dict(run.parameters) == before
