"""Taylor steps: orders on trees, closed forms, energies, corners at known times, refusals, and what stops a run."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk, erf

import eomgen
from eomgen.errors import EomgenError
from eomgen.lie import product
from tests.models.scenes import flyer_scene, pendulum_scene

Array = NDArray[np.float64]


def controlled_scene() -> eomgen.Scene:
    """Return a cart that a filtered force drives: internal states, functions of time, a force that is no polynomial in
    v."""
    builder = (
        eomgen.SceneBuilder("controlled").parameter("drag", 0.4, tunable=True).input("wish", "sin(2 * t) + 0.3 * t")
    )
    builder.body("cart", 2.0).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], stiffness=5.0)
    builder.body("pole", 1.0, center_of_mass=[0, 0, -0.6], inertia=[0.1, 0.1, 0.01])
    builder.joint("hinge", "revolute", "cart", "pole", axis=[0, 1, 0], initial={"position": 0.5})
    builder.state("filtered", "4 * (wish - filtered)", initial=0.1).state("slow", "filtered - v.rail - slow")
    return builder.effort("motor", "rail", "filtered - drag * tanh(v.rail) + exp(-slow * slow)").build()


SCENES = {"pendulum": pendulum_scene, "flyer": flyer_scene, "controlled": controlled_scene}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name](), method="taylor")


def kinematics(made: eomgen.Model, q: Array, v: Array) -> Array:
    """Return dq/dt of a product of groups, from NumPy's own quaternion products."""
    rate = np.zeros(made.nq)
    for factor in made.factors:
        own, moves = q[factor.q], v[factor.v]
        if factor.group == "R":
            rate[factor.q] = moves
            continue
        w, x, y, z = own[:4]
        turning = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]) @ moves[:3]
        rate[factor.q_start : factor.q_start + 4] = turning
        if factor.group == "SE3":
            u = np.array([x, y, z])
            rate[factor.q_start + 4 : factor.q_start + 7] = moves[3:] + 2 * np.cross(
                u, np.cross(u, moves[3:]) + w * moves[3:]
            )
    return rate


@cache
def reference(name: str, end: float) -> tuple[Array, Array, Array]:
    """Return q, v and z at the end by DOP853 on forward dynamics and quaternions."""
    made = model(name)
    ends = np.cumsum([made.nq, made.nv])

    def rate(t: float, y: Array) -> Array:
        q, v, z = np.split(y, ends)
        u = made.input_values(np.array([t]))[0] if made.nu else None
        a = made.forward_dynamics(q, v, t, u, z=z)
        own = made.internal_rates(q, v, z, t, u) if made.nz else np.zeros(0)
        return np.concatenate([kinematics(made, q, v), a, own])

    start = np.concatenate([made.initial_q, made.initial_v, made.initial_z])
    found = solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=3e-14, atol=1e-15)
    q, v, z = np.split(found.y[:, -1], ends)
    return q, v, z


def error(made: eomgen.Model, solution: eomgen.Solution, exact: tuple[Array, Array, Array]) -> float:
    q = product.difference(made.factors, solution.q[-1:], exact[0][np.newaxis])
    differences = (q, solution.v[-1] - exact[1], solution.z[-1] - exact[2])
    return float(max(np.abs(difference).max(initial=0.0) for difference in differences))


@pytest.mark.slow_except("3-controlled", "6-pendulum", "2-controlled")
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("order", [2, 3, 4, 6])
def test_order_of_fixed_steps(name: str, order: int) -> None:
    made, exact = model(name), reference(name, 0.8)
    steps = {2: (400, 800), 3: (200, 400), 4: (80, 160), 6: (32, 64)}[order]
    errors = [
        error(made, made.simulate(0.8, 0.8 / count, method="taylor", order=order, tolerance=0), exact)
        for count in steps
    ]
    slope = np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])
    assert errors[1] > 1e-12, "round-off would hide the order"
    assert slope == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_errors_follow_the_tolerance(name: str, tolerance: float) -> None:
    made = model(name)
    solution = made.simulate(0.8, 0.1, method="taylor", tolerance=tolerance)
    assert solution.success, solution.message
    found = error(made, solution, reference(name, 0.8))
    assert found < 100 * tolerance
    assert solution.stats["rejections"] == 0
    assert len(solution.t) == 9
    assert np.allclose(np.linalg.norm(solution.q[:, :4], axis=1), 1.0, rtol=0, atol=1e-15) or name != "flyer"


@pytest.mark.slow
def test_pendulum_against_elliptic_functions() -> None:
    length, start, gravity = 0.7, 2.5, 9.81
    builder = eomgen.SceneBuilder("swing", gravity=[0, 0, -gravity]).body("bob", 1.3, center_of_mass=[0, 0, -length])
    builder.joint("hinge", "revolute", "base", "bob", axis=[0, 1, 0], initial={"position": start})
    solution = eomgen.build(builder.build(), method="taylor").simulate(20.0, 0.25, method="taylor", tolerance=1e-16)
    k, rate = np.sin(start / 2), np.sqrt(gravity / length)
    sn = ellipj(ellipk(k * k) - rate * solution.t, k * k)[0]
    assert np.abs(solution.q[:, 0] - 2 * np.arcsin(k * sn)).max() < 2e-12
    total = solution.energy["total"]
    assert np.ptp(total) < 1e-14 * 20 * gravity * length
    assert solution.stats["expansions"] < 170


LATE = 0.503


def pushed(formula: str, **curve: Any) -> eomgen.Scene:
    builder = (
        eomgen.SceneBuilder("pushed", gravity=[0, 0, 0]).parameter("late", LATE).parameter("soft", 0.2, tunable=True)
    )
    builder.body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=25.0, initial={"position": 0.1})
    if curve:
        builder.curve("told", **curve)
    return builder.input("push", formula).effort("push", "rail", "push").build()


CORNERS = {
    "jump": ("3 if t > late else 0", {}),
    "bend": ("3 * max(0, t - late)", {}),
    "curve": ("told(t)", {"points": [[0, 0], [0.2, 1], [LATE, -2], [0.8, 1], [2, 0]]}),
    "slower curve": ("told(0.5 * t + 0.1)", {"points": [[0.1, 0], [0.2, 1], [0.5 * LATE + 0.1, -2], [0.5, 1], [2, 0]]}),
}


@pytest.mark.slow_except("jump")
@pytest.mark.parametrize("said", CORNERS)
def test_steps_end_at_known_corners(said: str) -> None:
    formula, curve = CORNERS[said]
    made = eomgen.build(pushed(formula, **curve), method="taylor")
    solution = made.simulate(1.2, 0.4, method="taylor", tolerance=1e-13)
    assert solution.success, solution.message

    def rate(t: float, y: Array) -> Array:
        return np.array([y[1], made.input_values(np.array([t]))[0, 0] - 25.0 * y[0]])

    y = np.array([0.1, 0.0])
    places = [point[0] for point in curve.get("points", [])]
    times = [2 * place - 0.2 if said == "slower curve" else place for place in places]
    breaks = [0.0, *sorted({LATE, *(time for time in times if 1e-9 < time < 1.2 and abs(time - LATE) > 1e-9)}), 1.2]
    for start, end in pairwise(breaks):
        inside = (start + 1e-13, end - 1e-13)
        y = solve_ivp(rate, inside, y, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    assert np.abs(np.array([solution.q[-1, 0], solution.v[-1, 0]]) - y).max() < 1e-11
    assert solution.stats["rejections"] == 0
    fine = made.simulate(1.2, 0.02, method="taylor", tolerance=1e-13)
    assert np.abs(fine.q[::20] - solution.q).max() < 1e-11
    assert fine.stats["rejections"] == 0


UNKNOWN = "decided by a tunable parameter or a formula that is not linear in time"
REFUSED = {
    "the motion": ("abs(v.rail)", "abs(), decided by the motion"),
    "a parameter": ("1 if t > soft else 0", f"lt(), {UNKNOWN}"),
    "a formula of time": ("max(0, sin(t))", f"max(), {UNKNOWN}"),
    "a curve of a coordinate": ("told(q.rail)", "the pieces of curve 'told', decided by the motion"),
}


@pytest.mark.slow
@pytest.mark.parametrize("said", REFUSED)
def test_corners_at_unknown_times_are_refused(said: str) -> None:
    formula, text = REFUSED[said]
    builder = eomgen.SceneBuilder("rough").parameter("soft", 0.2, tunable=True)
    builder.body("mass", 1.0).joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0])
    builder.curve("told", points=[[-1, 0], [0.2, 1], [1, -2]])
    made = eomgen.build(builder.effort("push", "rail", formula).build())
    with pytest.raises(EomgenError) as caught:
        made.simulate(1.0, 0.1, method="taylor")
    assert (
        str(caught.value)
        == "model error: taylor cannot run on this scene: a Taylor series needs smooth equations, or discontinuities"
        f" at known times; here are {text}; try: generalized_alpha"
    )


@pytest.mark.slow
def test_a_motion_that_reaches_infinity_stops_where_no_step_is_left() -> None:
    builder = eomgen.SceneBuilder("explosion", gravity=[0, 0, 0]).body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], initial={"position": 1.0, "velocity": 1.0})
    made = eomgen.build(builder.effort("push", "rail", "2 * q.rail**3").build(), method="taylor")  # q = 1/(1 - t)
    solution = made.simulate(2.0, 0.01, method="taylor", tolerance=1e-10)
    assert not solution.success
    assert 0.99 <= solution.t[-1] <= 1.0
    assert solution.q[99, 0] == pytest.approx(100.0, rel=1e-6)
    assert (
        solution.message
        == f"stopped at t = {solution.t[-1]:.9g} s, after {len(solution.t) - 1} of 200 steps: the step became too small"
        " for the time to move on: the motion has a singularity near, or a corner; try: the forces and formulas"
        " near that time, or another method"
    )


@pytest.mark.slow_except("0.02-0.8-1e-12")
@pytest.mark.parametrize("tolerance", [1e-6, 1e-12])
@pytest.mark.parametrize("place", [0.8, 0.837, 0.861])
@pytest.mark.parametrize("width", [0.02, 0.03, 0.05, 0.08, 0.2])
def test_pulses_a_fifth_of_a_row_wide(width: float, place: float, tolerance: float) -> None:
    solution = pulsed().simulate(
        1.6, 0.1, method="taylor", tolerance=tolerance, parameters={"width": width, "place": place}
    )
    assert solution.success, solution.message
    push = [erf((t - place) / width) / 2 + erf(place / width) / 2 for t in solution.t]
    assert np.abs(solution.v[:, 0] - push).max() < 1e3 * tolerance
    assert solution.stats["expansions"] < 120


@cache
def pulsed() -> eomgen.Model:
    builder = eomgen.SceneBuilder("pulsed", gravity=[0, 0, 0]).body("ball", 1.0)
    builder.parameter("width", 0.02, tunable=True).parameter("place", 0.8, tunable=True)
    builder.joint("rail", "prismatic", "base", "ball", axis=[1, 0, 0])
    return eomgen.build(
        builder.effort("push", "rail", "exp(-((t - place) / width)**2) / (width * sqrt(pi))").build(), method="taylor"
    )


ENDLESS: list[dict[str, Any]] = [{"order": 2, "tolerance": 1e-16}, {"order": 3, "tolerance": 1e-20}]


@pytest.mark.parametrize("options", ENDLESS)
def test_a_row_that_would_not_end_stops_the_run(options: dict[str, Any]) -> None:
    solution = model("pendulum").simulate(1.0, 0.1, method="taylor", **options)
    assert not solution.success
    assert (
        solution.message
        == "stopped at t = 0 s, after 0 of 10 steps: 100000 series were not enough for one row: the motion is stiff, or"
        " the tolerance cannot be met at this order; try: generalized_alpha, a larger tolerance, or shorter rows"
    )


@pytest.mark.parametrize("name", SCENES)
def test_states_between_rows_are_those_of_the_method(name: str) -> None:
    made = model(name)
    coarse = made.simulate(0.8, 0.4, method="taylor", tolerance=1e-13)
    fine = made.simulate(0.8, 0.05, method="taylor", tolerance=1e-13)
    found = coarse.at(fine.t[1::2])
    assert np.abs(found.q - fine.q[1::2]).max() < 1e-12
    assert np.abs(found.v - fine.v[1::2]).max() < 1e-11
    assert np.abs(found.a - fine.a[1::2]).max() < 1e-9
    assert np.abs(found.z - fine.z[1::2]).max(initial=0.0) < 1e-12
    assert np.array_equal(coarse.at(coarse.t[1:]).q, coarse.q[1:])


def test_states_between_rows_across_a_corner() -> None:
    made = eomgen.build(pushed("3 if t > late else 0"), method="taylor")
    coarse, fine = (made.simulate(1.2, step, method="taylor", tolerance=1e-13) for step in (0.6, 0.1))
    assert np.abs(coarse.at(fine.t).q - fine.q).max() < 1e-11
    assert np.abs(coarse.at(fine.t).v - fine.v).max() < 1e-11
