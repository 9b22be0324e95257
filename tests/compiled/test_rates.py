"""Time derivatives from compiled code: against SymPy along a known motion, defaults of inputs and base, refusals of
arguments."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

import eomgen
from eomgen.toolchain.compiler import find_compiler
from tests.models.library import scene
from tests.models.scenes import DAMPING, GRAVITY, INERTIA, LENGTH, MASS, RATE, SHAKE, pendulum_scene
from tests.oracles.evaluation import Array, relative_error

TERMS = ["inverse_dynamics", "rates", "rates_4", "mass_rates", "coupling_rates", "force_rates", "base_motion_rates"]
TIME = sympy.Symbol("t")
MOTION = sympy.Rational(7, 10) * sympy.sin(TIME * sympy.Rational(13, 10)) + sympy.Rational(1, 5) * TIME**2
TORQUE = sympy.sin(3 * TIME) / 5
AT = np.array([0.31, 0.9])


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(pendulum_scene(), terms=TERMS, profile="quick")


def effort(torque: sympy.Expr = TORQUE) -> sympy.Expr:
    """Return tau of the pendulum on its shaking base, by hand."""
    q, v = MOTION, MOTION.diff(TIME)
    shaking = (sympy.Float(SHAKE, 20) * sympy.sin(sympy.Float(RATE, 20) * TIME)).diff(TIME, 2)
    inertia = INERTIA + MASS * LENGTH**2
    arm = MASS * LENGTH
    weight = arm * (GRAVITY * sympy.sin(q) - shaking * sympy.cos(q))
    return inertia * v.diff(TIME) + weight + DAMPING * v - torque


def derivatives(expression: sympy.Expr, order: int, times: Array = AT) -> list[Array]:
    """Return the values of an expression of time and of its derivatives, each (times, 1)."""
    return [
        np.array([[float(expression.diff(TIME, k).subs(TIME, time).evalf(20))] for time in times])
        for k in range(order + 1)
    ]


def test_pendulum_on_a_shaking_base_to_the_fourth_order(model: eomgen.Model) -> None:
    q, v, a, j, s, *higher = derivatives(MOTION, 6)
    expected = derivatives(effort(), 4)
    found = model.rates(q, v, a, j, s, AT)
    assert len(found) == 3
    for k in range(3):
        assert relative_error(found[k], expected[k]) <= 1e-13, k
    found = model.rates(q, v, a, j, s, AT, order=4, a_higher=np.stack(higher, axis=-2))
    for k in range(5):
        assert relative_error(found[k], expected[k]) <= 1e-13, k


def test_inputs_of_the_caller_are_constant_unless_their_derivatives_are_given(model: eomgen.Model) -> None:
    q, v, a, j, s, *higher = derivatives(MOTION, 6)
    other = sympy.cos(2 * TIME)
    u, u_dot, u_ddot, *u_higher = derivatives(other, 4)
    held = model.rates(q, v, a, j, s, AT, u={"torque": u[:, 0]})
    without = model.rates(q, v, a, j, s, AT, u=np.zeros(1))
    assert relative_error(held[0], without[0] - u) <= 1e-14
    for k in (1, 2):
        assert np.array_equal(held[k], without[k])
    for given in (
        {"u": u, "u_dot": u_dot, "u_ddot": u_ddot},
        {"u": {"torque": u[:, 0]}, "u_dot": {"torque": u_dot[:, 0]}, "u_ddot": u_ddot},
    ):
        found = model.rates(q, v, a, j, s, AT, **given)
        for expected, value in zip(derivatives(effort(other), 2), found, strict=True):
            assert relative_error(value, expected) <= 1e-13
    rows = np.stack(u_higher, axis=-2)
    found = model.rates(q, v, a, j, s, AT, u, u_dot, u_ddot, order=4, a_higher=np.stack(higher, axis=-2), u_higher=rows)
    assert relative_error(found[4], derivatives(effort(other), 4)[4]) <= 1e-13


def test_one_sample_is_a_row_of_a_batch_and_blocks_add_up(model: eomgen.Model) -> None:
    q, v, a, j, s = derivatives(MOTION, 4)
    many = model.rates(q, v, a, j, s, AT)
    one = model.rates(q[1], v[1], a[1], j[1], s[1], AT[1])
    assert all(np.array_equal(row, batch[1]) for row, batch in zip(one, many, strict=True))
    M_dot, M_ddot = model.mass_rates(q, v, a)
    h_dot, h_ddot = model.coupling_rates(q, v, a, j)
    b_dot, b_ddot = model.base_motion_rates(q, v, a, j, AT)
    Q_dot, Q_ddot = model.force_rates(q, v, a, j, AT)
    M = np.full((2, 1, 1), INERTIA + MASS * LENGTH**2)
    first = (M_dot @ a[..., None] + M @ j[..., None])[..., 0] + h_dot + b_dot - Q_dot
    assert relative_error(many[1], first) <= 1e-13
    second = (M_ddot @ a[..., None] + 2.0 * M_dot @ j[..., None] + M @ s[..., None])[..., 0] + h_ddot + b_ddot - Q_ddot
    assert relative_error(many[2], second) <= 1e-13


def test_base_of_the_caller(model: eomgen.Model) -> None:
    q, v, a, j, s = derivatives(MOTION, 4)
    base = model.base(AT)
    shaking = [SHAKE * RATE**k * np.sin(RATE * AT + k * np.pi / 2) for k in range(7)]
    rates = np.zeros((2, 4, 6))
    for row in range(4):
        rates[:, row, 3] = shaking[3 + row]
    expected = model.rates(q, v, a, j, s, AT)
    found = model.rates(q, v, a, j, s, AT, base=base, base_rates=rates)
    for k in range(3):
        assert relative_error(found[k], expected[k]) <= 1e-13


@pytest.mark.slow
def test_free_motion_and_coriolis_matrices_in_compiled_code(rng: np.random.Generator) -> None:
    """The jerk makes tau_dot vanish, and C v is h both times."""
    terms = ["rates", "forward_dynamics", "forward_rates", "coupling", "coriolis", "coriolis_skew", "mass_rates"]
    arm = eomgen.build(Path(__file__).parents[2] / "examples/robot_arm/scene.toml", terms=terms, profile="quick")
    q, v = rng.normal(size=(3, arm.nq)), rng.normal(size=(3, arm.nv))
    u, u_dot, u_ddot = rng.normal(size=(3, 3, arm.nu))
    a, j, s = arm.forward_rates(q, v, 0.2, u, u_dot, u_ddot)
    assert relative_error(a, arm.forward_dynamics(q, v, 0.2, u)) <= 1e-12
    for found in arm.rates(q, v, a, j, s, 0.2, u, u_dot, u_ddot):
        assert np.max(np.abs(found)) <= 1e-9 * np.max(np.abs(s))
    h, M_dot = arm.coupling(q, v), arm.mass_rates(q, v, a)[0]
    for skew in (False, True):
        C = arm.coriolis(q, v, skew=skew)
        assert relative_error((C @ v[..., None])[..., 0], h) <= 1e-12
    difference = M_dot - 2.0 * C
    assert np.max(np.abs(difference + np.swapaxes(difference, -1, -2))) <= 1e-12 * np.max(np.abs(difference))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"s": None}, "usage error: s: the term rates needs the second time derivative of a; try: s=..."),
        ({"j": [1.0, 2.0]}, "usage error: j: the shape is (2,), (..., 1) is needed; try: j as a list of 1 number"),
        (
            {"order": 3},
            "usage error: the term rates_3 is not in this model, which was built with inverse_dynamics, rates",
        ),
        ({"order": 4}, "usage error: a_higher: the term rates_4 needs the time derivatives of a from the third on"),
        (
            {"order": 4, "a_higher": [1.0, 2.0]},
            (
                "usage error: a_higher: the shape is (2,), (..., 2, 1) is needed; try: a_higher row by row, one"
                " derivative each"
            ),
        ),
        (
            {"base": np.zeros(19)},
            (
                "usage error: base_rates: a base that is given needs the further derivatives of its twist as well; try:"
                " base_rates="
            ),
        ),
    ],
)
def test_arguments_that_are_missing_or_wrong(model: eomgen.Model, options: dict[str, Any], text: str) -> None:
    given: dict[str, Any] = {"q": [0.1], "v": [0.2], "a": [0.3], "j": [0.4], "s": [0.5], **options}
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        model.rates(**given)


def test_an_unknown_argument_of_evaluate_is_named(model: eomgen.Model) -> None:
    with pytest.raises(
        eomgen.UsageError, match="jerk: no term takes an argument of this name; try: one of a_higher, base_rates"
    ):
        model.evaluate("rates", [0.1], [0.2], [0.3], jerk=[0.4])
    found = model.evaluate("rates", [0.1], [0.2], [0.3], j=[0.4], s=[0.5])
    assert list(found) == ["tau", "tau_dot", "tau_ddot"]


def test_program_that_stands_alone_prints_the_rates(model: eomgen.Model, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    eomgen.generate(pendulum_scene(), folder, terms=["rates", "rates_3"])
    sources = [str(path) for path in folder.glob("*.c")]
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    program = folder / "program"
    subprocess.run([find_compiler().path, *flags, *sources, "-lm", "-o", str(program)], check=True, timeout=120)
    text = subprocess.run([program], check=True, capture_output=True, text=True, timeout=60).stdout
    printed = {line.split(",")[0]: [float(item) for item in line.split(",")[1:]] for line in text.splitlines()}
    zero = [0.0]
    expected = model.rates(model.initial_q, model.initial_v, zero, zero, zero)
    for k, name in enumerate(("tau", "tau_dot", "tau_ddot")):
        assert printed[f"rates.{name}"] == pytest.approx(expected[k], rel=1e-12, abs=1e-15)
    held = subprocess.run([program, "torque=0.5"], check=True, capture_output=True, text=True, timeout=60).stdout
    still = model.rates(model.initial_q, model.initial_v, zero, zero, zero, u=[0.5])
    assert f"rates.tau_dot,{still[1][0]:.17g}\n" in held


def test_rates_of_base_motion_are_zero_where_b_is(rng: np.random.Generator) -> None:
    """In absolute coordinates bodies hang in the world, and tau is the sum of its blocks there, too."""
    terms = ["mass", *TERMS]
    absolute = eomgen.build(replace(pendulum_scene(), coordinates="absolute"), terms=terms, profile="quick")
    q, (v, a, j, s) = absolute.initial_q, rng.normal(size=(4, 2, absolute.nv))
    found = absolute.base_motion_rates(q, v, a, j, AT)
    np.testing.assert_array_equal(found, np.zeros((2, 2, absolute.nv)))
    assert absolute.having(["base_motion_rates"]) is absolute
    M, h_dot, Q_dot = absolute.mass(q), absolute.coupling_rates(q, v, a, j)[0], absolute.force_rates(q, v, a, j, AT)[0]
    assert relative_error(absolute.rates(q, v, a, j, s, AT)[1], j @ M + h_dot + found[0] - Q_dot) <= 1e-13
    still = eomgen.build(scene("pendulum"), terms=["mass"], profile="quick")
    assert not np.any(still.base_motion_rates([0.5], [1.0], [1.0], [1.0]))
    with pytest.raises(eomgen.UsageError, match=re.escape("j: the shape is (2,), (..., 1) is needed")):
        still.base_motion_rates([0.5], [1.0], [1.0], [1.0, 2.0])
