"""Generalized-alpha with steps of its own: what the estimate is on every group, with constraints and internal states;
steps of other sizes; stiff transients; what cannot follow a tolerance. How errors follow it is in test_own_steps.py."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from eomgen.integrators.families.register import method_named
from eomgen.lie import product
from eomgen.simulation.stepping.settings import stepper_library, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper
from tests.integrators import similar_scenes
from tests.integrators.test_taylor import SCENES as TREES

Array = NDArray[np.float64]
#: R with a moving base and an input; R3xSO3 and SO3; internal states and an input; loops on both groups; rolling.
SCENES: dict[str, Callable[[], Any]] = {
    **TREES,
    **{name: similar_scenes.BOUND[name] for name in ("rods_r3xso3", "rods_se3", "rolling")},
}
ADAPTIVE = "generalized_alpha_adaptive"
QUIET: dict[str, Any] = {"error_estimate": False}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name](), method=ADAPTIVE)


@cache
def exact(name: str) -> eomgen.Solution:
    """Return the motion over 0.4 s in rows of 0.02 s by another method."""
    made = eomgen.build(SCENES[name](), method="rk4_partitioned") if model(name).multipliers else model(name)
    if made.multipliers:
        return made.simulate(0.4, 0.02 / 64, method="rk4_partitioned", record_every=64, **QUIET)
    return made.simulate(0.4, 0.02, method="rk45", tolerance=1e-12, **QUIET)


def errors(found: eomgen.Solution, true: eomgen.Solution) -> Array:
    """Return the largest errors of q, v, a, multipliers and z over all rows, as far as there are such."""
    names = ("q", "v", "a", "multipliers", "z")
    pairs = ((getattr(found, name), getattr(true, name)) for name in names)
    return np.array([np.abs(ours - other).max() for ours, other in pairs if ours.size])


def true_step(made: eomgen.Model, rows: eomgen.Solution, index: int, step: float) -> tuple[Array, Array, Array]:
    """Return the exact q, v and z a step after a row."""
    start = {"q": rows.q[index], "v": rows.v[index], **({"z": rows.z[index]} if rows.z.size else {})}
    t = float(rows.t[index])
    given: dict[str, Any] = {"method": "rk45", "tolerance": 1e-13}
    if made.multipliers:
        given = {"method": "rk4_partitioned", "record_every": 8}
    end = made.simulate(t + step, step / given.get("record_every", 1), t_start=t, initial=start, **given, **QUIET)
    return end.q[-1], end.v[-1], end.z[-1]


def estimates(made: eomgen.Model, rows: eomgen.Solution, n: int, step: float) -> tuple[Array, Array, Array]:
    """Return the estimates of the errors of q, v and z of step n, by the formulas of the stepper, in NumPy."""
    factors, v, a = made.factors, rows.v, rows.a
    theta = product.difference(factors, rows.q[n], rows.q[n + 1])
    bracket = product.bracket_matrix(factors, v[n]) @ a[n]
    of_q = step * v[n] + step**2 * (a[n] / 3 + a[n + 1] / 6) + step**3 / 12 * bracket - theta
    of_v = step * (5 * a[n + 1] + 8 * a[n] - a[n - 1]) / 12 - (v[n + 1] - v[n])
    rate = np.zeros((3, 0))
    if rows.z.size:
        rate = np.array([made.internal_rates(rows.q[k], v[k], rows.z[k], rows.t[k]) for k in (n - 1, n, n + 1)])
    of_z = step * (5 * rate[2] + 8 * rate[1] - rate[0]) / 12 - (rows.z[n + 1] - rows.z[n])
    return of_q, of_v, of_z


@pytest.mark.slow
@pytest.mark.long_cases("rods_se3")
@pytest.mark.parametrize("name", ["pendulum", "flyer", "controlled", "rods_se3"])
def test_the_estimate_tends_to_the_true_local_error(name: str) -> None:
    made, apart = model(name), []
    for step in (2e-3, 1e-3, 5e-4):
        n = round(0.12 / step)
        rows = made.simulate((n + 1) * step, step, method="generalized_alpha", **QUIET)
        q, v, z = true_step(made, rows, n, step)
        true = (product.difference(made.factors, rows.q[n + 1], q), v - rows.v[n + 1], z - rows.z[n + 1])
        found = estimates(made, rows, n, step)
        pairs = [(ours, other) for ours, other in zip(found, true, strict=True) if other.size]
        pairs = pairs[:1] if made.multipliers else pairs  # velocities are brought onto the constraints behind a step
        apart.append([np.linalg.norm(ours - other) / np.linalg.norm(other) for ours, other in pairs])
    assert np.all(np.array(apart[-1]) < 0.05)
    assert np.all(np.array(apart[1:]) < 0.7 * np.array(apart[:-1]))


def stepper(made: eomgen.Model, step: float, tolerance: float) -> Stepper:
    method = method_named(ADAPTIVE, rho_inf=0.8, tolerance=tolerance)
    library = stepper_library(made, ADAPTIVE, method)
    return Stepper(library, stepper_settings(library.layout["method"], step, method, {}), made.parameter_array())


@pytest.mark.slow
def test_the_compiled_estimate_is_the_one_of_the_formulas() -> None:
    """One step over a row; of the first step the velocity's error is by the trapezoidal rule."""
    made, step, tolerance = model("flyer"), 2e-3, 1e-2
    ours = stepper(made, step, tolerance)
    ours.initialize(0.0, made.initial_q, made.initial_v, None)
    before = ours.row
    ours.run(1, 1, None, np.empty((1, ours.sizes["row"])))
    after = ours.row
    assert ours.statistics["own_steps"] == 1
    nq, nv = made.nq, made.nv
    (q, v, a), (q_end, v_end, a_end) = (np.split(row[1:], [nq, nq + nv]) for row in (before, after))
    off = step * v + step**2 * (a / 3 + a_end / 6) + step**3 / 12 * product.bracket_matrix(made.factors, v) @ a
    off = (off - product.difference(made.factors, q, q_end)) / step
    off_v = 0.5 * (a + a_end) - (v_end - v) / step
    weights = np.sqrt(np.diag(made.mass(made.initial_q)))
    sizes = [max(np.linalg.norm(weights * x) for x in pair) for pair in ((v, v_end), (a, a_end))]
    parts = [np.linalg.norm(weights * x) / (tolerance * size) for x, size in zip((off, off_v), sizes, strict=True)]
    assert ours.state[ours.places["own_error"]][0] == pytest.approx(np.hypot(parts[0], 0.2 * parts[1]), rel=1e-5)


@pytest.mark.slow
@pytest.mark.long_cases("rods_r3xso3")
@pytest.mark.parametrize("name", ["pendulum", "rods_r3xso3"])
def test_steps_that_change_at_random_keep_order_two(name: str) -> None:
    """Steps are set by hand between rows, from half to one and a half of each other; the tolerance asks for nothing."""
    made, rng = model(name), np.random.default_rng(5)
    shares = np.repeat(rng.uniform(0.5, 1.5, 5), 2)
    ends = []
    for halvings in (0, 1, 2):
        mean = 0.01 / 2**halvings
        ours = stepper(made, mean, 0.1)
        u = np.full((2, made.nu), np.nan) if made.nu else None
        status = ours.initialize(0.0, made.initial_q, made.initial_v, u, np.array(made.initial_z))
        for k in range(40 * 2**halvings):
            ours.state[ours.places["own_step"]] = mean * shares[k % len(shares)]
            taken, _ = ours.run(1, 1, None, np.empty((1, ours.sizes["row"])))
            status = status or taken
        assert status == 0 and ours.statistics["rejections"] == 0
        ends.append(ours.row)
    row = exact(name)
    q, v, a = made.nq, made.nv, made.nv
    for first, true in ((1, row.q[-1]), (1 + q, row.v[-1]), (1 + q + v + a, row.multipliers[-1])):
        off = [np.abs(end[first : first + len(true)] - true).max(initial=0.0) for end in ends]
        assert not len(true) or 0.5 * np.log2(off[0] / off[2]) == pytest.approx(2.0, abs=0.2), off


def stiff_scene() -> eomgen.Scene:
    """Return a cart with a pendulum on a soft spring, and a mass on a damped spring of 2000 rad/s that starts off its
    rest."""
    builder, soft, stiff = eomgen.SceneBuilder("stiff_transient"), {"position": 0.3}, {"position": 0.01}
    along = {"axis": [1, 0, 0]}
    builder.body("a", 1.0)
    builder.joint("soft", "prismatic", "base", "a", stiffness=40.0, damping=0.2, initial=soft, **along)
    builder.body("b", 0.5)
    builder.joint("stiff", "prismatic", "a", "b", stiffness=2e6, damping=600.0, initial=stiff, **along)
    builder.body("c", 0.4, center_of_mass=[0, 0, -0.4], inertia=[0.02, 0.02, 0.01])
    return builder.joint("hinge", "revolute", "a", "c", axis=[0, 1, 0], initial={"position": 0.5}).build()


@pytest.mark.slow
def test_a_stiff_transient_takes_a_fifth_of_the_steps() -> None:
    made = eomgen.build(stiff_scene(), method=ADAPTIVE)
    true = made.simulate(5.0, 0.05, method="rk45", tolerance=1e-9, **QUIET)
    fixed = made.simulate(5.0, 0.05 / 256, method="generalized_alpha", record_every=256, **QUIET)
    ours = made.simulate(5.0, 0.05, tolerance=1e-5, **QUIET)
    assert errors(ours, true)[0] < errors(fixed, true)[0]
    assert 5 * ours.stats["own_steps"] < fixed.stats["steps"]


@pytest.mark.slow_cases("generalized_alpha_index3-velocities lie off the constraints by the square of the step")
@pytest.mark.parametrize(
    ("method", "text"),
    [
        ("generalized_alpha_index3", "velocities lie off the constraints by the square of the step"),
        ("hht_index3", "leaves multipliers with errors of first order; try: generalized_alpha, which holds velocities"),
        ("generalized_alpha_f1", "the estimate of errors is for steps with one exponential; try: generalized_alpha"),
        ("generalized_alpha_spatial", "from step to step need steps of one size; try: generalized_alpha, or rk45"),
        ("newmark", "with damping its order is 1; try: trapezoidal, which it is without damping"),
        ("rk4", "it has no estimate of its errors; try: rk45"),
        ("tdg2", "its steps are all of one size; try: generalized_alpha"),
        ("rk4_partitioned", "it has no estimate of its errors; try: rk45_partitioned"),
        ("rattlie", "because its steps are all of one size; try: generalized_alpha, or rk45"),
    ],
)
def test_what_cannot_follow_a_tolerance_says_why_and_what_can(method: str, text: str) -> None:
    with pytest.raises(eomgen.UsageError) as raised:
        model("controlled").simulate(0.4, 0.1, method=method, tolerance=1e-4)
    assert f"tolerance: {method} takes no tolerance: " in str(raised.value) and text in str(raised.value)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "rk45"])
@pytest.mark.parametrize("force", ["3 * t", "t**4", "exp(-1 / (t + 1e-3))"])
def test_a_motion_from_rest_begins_in_steps_of_the_size_of_its_own_time(method: str, force: str) -> None:
    builder = eomgen.SceneBuilder("from_rest").state("lag", f"20 * ({force} - lag)")
    builder.body("a", 2.0).joint("x", "prismatic", "base", "a", axis=[1, 0, 0], stiffness=100.0, damping=1.0)
    made = eomgen.build(builder.effort("push", "x", f"{force} + lag").build(), method=ADAPTIVE)
    true = made.simulate(1.0, 1e-3, method="rk4", record_every=100, **QUIET)
    found = made.simulate(1.0, 0.1, method=method, tolerance=1e-4, **QUIET)
    assert found.success, found.message
    assert found.stats["own_steps"] < 3000 and found.stats["smallest_step"] > 1e-6
    assert errors(found, true)[0] < 1e-3 * np.abs(true.q).max()


def stiff_chain() -> eomgen.Scene:
    """Return three rods on hinges, the last of which has a stiff spring, 3000 rad/s, off its rest."""
    builder = eomgen.SceneBuilder("stiff_chain")
    hinges = ((20.0, 0.4, 0.3), (10.0, 0.2, -0.2), (5e4, 20.0, 0.02))
    for k, (stiffness, damping, start) in enumerate(hinges):
        builder.body(f"rod{k}", 1.0, center_of_mass=[0.25, 0, 0], inertia=[0.002, 0.02, 0.02])
        parent, position = (f"rod{k - 1}", [0.5, 0, 0]) if k else ("base", [0, 0, 0])
        spring = {"stiffness": stiffness, "damping": damping, "initial": {"position": start}}
        builder.joint(f"joint{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=position, **spring)
    return builder.build()


@pytest.mark.slow
def test_a_first_step_that_explodes_is_forgotten() -> None:
    """Nothing moves yet, and steps begin with the spacing of rows, which is far too long for the spring."""
    made = eomgen.build(stiff_chain(), method=ADAPTIVE)
    for spacing in (0.0145, 0.03, 0.1):
        found = made.simulate(spacing, spacing, method="rk45", tolerance=1e-9, **QUIET)
        true = made.simulate(spacing, spacing / 2000, method="rk4", record_every=2000, **QUIET)
        assert found.success and found.stats["own_steps"] < 5000, (spacing, found.message)
        assert np.abs(found.q[-1] - true.q[-1]).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "rk45"])
def test_rounding_at_rest_asks_for_no_steps(method: str) -> None:
    """A weight hangs at rest on springs but for rounding."""
    builder = eomgen.SceneBuilder("hanging")
    builder.body("a", 1.7).joint("z", "prismatic", "base", "a", axis=[0, 0, 1], stiffness=1234.5, damping=3.0)
    builder.body("b", 0.3).joint("w", "prismatic", "a", "b", axis=[0, 0, 1], stiffness=345.6, damping=1.0)
    made = eomgen.build(builder.build(), method=ADAPTIVE)
    found = made.simulate(5.0, 0.1, method=method, tolerance=1e-8, start="equilibrium", **QUIET)
    assert found.success and found.stats["own_steps"] < 1000
    assert np.ptp(found.q, axis=0).max() < 1e-12


@pytest.mark.slow_cases("generalized_alpha_adaptive")
@pytest.mark.parametrize("method", ["rk45", "generalized_alpha_adaptive"])
def test_internal_states_are_controlled_beside_a_body_that_coasts(method: str) -> None:
    """A logistic state against its closed form: the time of a uniform motion is no time of the state."""
    data = {
        "format": 1, "name": "coasting", "gravity": [0, 0, 0], "bodies": {"body": {"mass": 1.0}},
        "joints": {"x": {"type": "prismatic", "parent": "base", "child": "body", "axis": [1, 0, 0]}},
        "states": {"p": {"rate": "p * (1 - p)", "initial": 0.01}},
    }  # fmt: skip  # a scene
    model = eomgen.build(data, method=method)
    for velocity in (0.0, 1.0, 1e3):
        solution = model.simulate(
            20.0, 5.0, tolerance=1e-5, initial={"x": {"velocity": velocity}}, error_estimate=False
        )
        np.testing.assert_allclose(solution.z[:, 0], 1.0 / (1.0 + 99.0 * np.exp(-solution.t)), atol=1e-4)
