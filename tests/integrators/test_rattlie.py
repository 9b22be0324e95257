"""RATTLie: against published digits and an oracle; multipliers of both sides on a loop; invariants; steps that vary;
refusals. Orders on every group are in test_orders.py."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.simulation.stepping.settings import chosen_method, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper
from tests.integrators import rattlie_oracle as oracle
from tests.integrators.constrained_models import heavy_top, top_solution
from tests.integrators.stepper_models import rotation
from tests.models.scenes import flyer

Array = oracle.Array
MASS, CENTER, GRAVITY = 15.0, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -9.81])
INERTIA = np.diag([0.234375, 0.46875, 0.234375])
PIVOT_INERTIA = np.diag([15.234375, 0.46875, 15.234375])


def slopes(errors: list[float]) -> Array:
    return np.asarray(np.log2(np.array(errors[:-1]) / errors[1:]))


# -- orders ------------------------------------------------------------------------------------------------------------


def two_arms(drag: float = 0.0, damping: float = 0.0, gravity: float = 9.81) -> eomgen.Scene:
    """Return two links whose inertia matrix varies, with forces that depend on velocities and on time."""
    builder = eomgen.SceneBuilder("two_arms", gravity=[0, 0, -gravity])
    for number, start in enumerate((1.0, 0.8)):
        builder.body(f"link{number}", 1.0, center_of_mass=[0, 0, -1], inertia=[0.1, 0.1, 0.1])
        builder.joint(
            f"hinge{number}", "revolute", f"link{number - 1}" if number else "base", f"link{number}",
            axis=[0, -1, 0], position=[0, 0, -1 if number else 0], damping=damping,
            initial={"position": start, "velocity": 0.5 - number},
        )  # fmt: skip  # one joint
    if drag:
        builder.effort("drag", "hinge0", f"-{drag} * v.hinge0 * sqrt(v.hinge0 ** 2 + 0.01) + sin(3 * t)")
        builder.effort("steered", "hinge1", f"{drag} * v.hinge0 * v.hinge1 * cos(q.hinge1)")
    return builder.build()


def arms_of_the_oracle(drag: float = 0.0, damping: float = 0.0) -> oracle.Motion:
    """Return the same in closed form: M, dT/dq and Q of two links of length 1."""

    def mass(q: oracle.Place) -> Array:
        c = np.cos(q[0][1])
        return np.array([[3.2 + 2 * c, 1.1 + c], [1.1 + c, 1.1]])

    def forces(q: oracle.Place, w: Array, t: float) -> Array:
        one, both = q[0][0], q[0][0] + q[0][1]
        slope = np.array([0.0, -np.sin(q[0][1]) * w[0] * (w[0] + w[1])])
        weight = -9.81 * np.array([2 * np.sin(one) + np.sin(both), np.sin(both)])
        first = -drag * w[0] * np.sqrt(w[0] ** 2 + 0.01) + np.sin(3 * t)
        given = np.array([first, drag * w[0] * w[1] * np.cos(q[0][1])])
        return np.asarray(slope + weight - damping * w + (given if drag else 0.0))

    return oracle.Motion(oracle.real_space(2), mass, forces)


@pytest.mark.slow
@pytest.mark.parametrize("given", [{}, {"drag": 0.7, "damping": 0.4}], ids=["conservative", "drag"])
def test_steps_with_a_mass_matrix_that_varies_are_those_of_the_oracle(given: Mapping[str, float]) -> None:
    made, motion = eomgen.build(two_arms(**given)), arms_of_the_oracle(**given)
    end = made.simulate(2.0, 0.04, method="rattlie", error_estimate=False)
    q, v = (made.initial_q,), made.initial_v
    for number in range(50):
        step = oracle.step(motion, q, v, 0.04 * number, 0.04)
        q, v = step.q, step.v
        np.testing.assert_allclose(end.q[number + 1], q[0], rtol=0, atol=1e-10)
        np.testing.assert_allclose(end.v[number + 1], v, rtol=0, atol=1e-10)


@cache
def four_bar() -> eomgen.Model:
    return eomgen.build("examples/four_bar/scene.toml", profile="quick")


# -- the fast heavy top ------------------------------------------------------------------------------------------------


@cache
def top(group: str) -> eomgen.Model:
    return eomgen.build(heavy_top("SE3" if group == "SO3" else group, coordinates="joint" if group == "SO3" else
                                  "absolute"))  # fmt: skip  # one call


def errors_of_top(group: str, power: int) -> Array:
    """Return largest errors at t = j/16 of rotation angle, position, Omega, multipliers: of the accelerations, before
    and after the row, and mean."""
    worst = np.zeros(7)
    for side in range(1 if group == "SO3" else 4):
        given = {} if group == "SO3" else {"multipliers": float(side)}
        end = top(group).simulate(
            1.0, 2.0**-power, method="rattlie", record_every=2**power // 16, settings=given, error_estimate=False
        )
        for row, t in enumerate(end.t[1:], 1):
            R, x, w, lam = top_solution()(t)
            found = rotation(end.q[row, :4])
            worst[0] = max(worst[0], np.arccos(np.clip((np.trace(found.T @ R) - 1.0) / 2.0, -1.0, 1.0)))
            position = found @ CENTER if group == "SO3" else end.q[row, 4:7]
            worst[1] = max(worst[1], np.linalg.norm(position - x))
            worst[2] = max(worst[2], np.linalg.norm(end.v[row, :3] - w))
            if group != "SO3":
                worst[3 + side] = max(worst[3 + side], np.linalg.norm(end.multipliers[row] - lam))
    return worst


#: At h = 2^-12, by the dossier of formulas, whose NumPy code was written apart from this one.
PUBLISHED = {
    "SO3": (8.71e-4, 5.21e-4, 1.47e-3),
    "SE3": (8.71e-4, 5.21e-4, 1.47e-3, 0.156, 5.03, 4.93, 0.208),
    "R3xSO3": (4.27e-5, 2.65e-5, 6.37e-5, 7.50e-3, 3.78, 3.79, 0.0138),
}


@pytest.mark.slow
@pytest.mark.long_cases("R3xSO3", "SE3", "SO3")
@pytest.mark.parametrize("group", PUBLISHED)
def test_digits_and_orders_of_the_fast_top(group: str) -> None:
    """Multipliers of one side are of order 1, their mean, and those of the accelerations, of order 2."""
    found = np.array([errors_of_top(group, power) for power in (10, 11, 12, 13)])
    size = len(PUBLISHED[group])
    np.testing.assert_allclose(found[2, :size], PUBLISHED[group], rtol=0.01)
    orders = np.log2(found[0, :size] / found[-1, :size]) / 3
    assert orders == pytest.approx([2.0, 2.0, 2.0, 2.0, 1.0, 1.0, 2.0][:size], abs=0.05)


@pytest.mark.long
@pytest.mark.slow
def test_jumps_of_multipliers_are_of_order_1() -> None:
    jumps = [
        top("R3xSO3").simulate(1.0, 2.0**-n, method="rattlie", error_estimate=False).stats["max_jump"]
        for n in (10, 11, 12)
    ]
    np.testing.assert_allclose(jumps[::2], [30.3, 7.57], rtol=0.01)
    assert slopes(jumps) == pytest.approx(1.0, abs=0.05)


def top_of_the_oracle(group: str) -> tuple[oracle.Motion, oracle.Place, Array]:
    omega = np.array([0.0, 150.0, -4.61538])
    if group == "SO3":
        torque = lambda q, *_: MASS * np.cross(CENTER, q[0].T @ GRAVITY)  # noqa: E731  # an equation
        return oracle.Motion(oracle.SO3, lambda _: PIVOT_INERTIA, torque), (np.eye(3),), omega
    M, weight = np.diag([*np.diag(INERTIA), MASS, MASS, MASS]), np.concatenate([np.zeros(3), MASS * GRAVITY])

    def B(q: oracle.Place) -> Array:
        return np.hstack([-oracle.skew(q[0].T @ q[1]), -q[0].T])

    motion = oracle.Motion(oracle.R3xSO3, lambda _: M, lambda *_: weight, lambda q: CENTER - q[0].T @ q[1], B)
    return motion, (np.eye(3), CENTER.copy()), np.concatenate([omega, np.cross(omega, CENTER)])


@pytest.mark.slow
@pytest.mark.long_cases("R3xSO3")
@pytest.mark.parametrize("group", ["SO3", "R3xSO3"])
def test_steps_of_the_top_are_those_of_the_oracle(group: str) -> None:
    motion, q, v = top_of_the_oracle(group)
    step, count, lam = 2.0**-9, 100, []
    x = None
    for number in range(count):
        made = oracle.step(motion, q, v, step * number, step, x)
        q, v, x = made.q, made.v, made.unknown
        lam.append((made.after, made.before))
    given = {} if group == "SO3" else {"multipliers": 1.0}
    end = top(group).simulate(count * step, step, method="rattlie", settings=given, error_estimate=False)
    np.testing.assert_allclose(rotation(end.q[-1, :4]), q[0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(end.v[-1, :3], v[:3], rtol=0, atol=1e-9)
    if group != "SO3":
        np.testing.assert_allclose(end.q[-1, 4:7], q[1], rtol=0, atol=1e-10)
        np.testing.assert_allclose(end.multipliers[-1], lam[-1][1], rtol=1e-7)
        mean = top(group).simulate(step * (count - 1), step, method="rattlie", settings={"multipliers": 3.0})
        np.testing.assert_allclose(mean.multipliers[-1], (lam[-1][0] + lam[-2][1]) / 2, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("group", "lowest", "highest"), [("SE3", -0.03, 0.27), ("R3xSO3", -0.03, 0.03)])
def test_invariants_of_the_top_over_10_s(group: str, lowest: float, highest: float) -> None:
    end = top(group).simulate(10.0, 2.0**-10, method="rattlie", record_every=8, error_estimate=False)
    R = np.array([rotation(q[:4]) for q in end.q])
    omega = end.v[:, :3]
    spin = np.einsum("nij,jk,nk->ni", R, PIVOT_INERTIA, omega)[:, 2]
    energy = 0.5 * np.einsum("ni,ij,nj->n", omega, PIVOT_INERTIA, omega) + MASS * 9.81 * (R @ CENTER)[:, 2]
    assert np.ptp(spin) < 1e-8 * abs(spin[0])
    assert lowest < (energy - energy[0]).min() <= (energy - energy[0]).max() < highest
    assert abs(np.polyfit(end.t, energy, 1)[0]) < 2e-3
    assert end.stats["max_constraint"] < 1e-13
    assert end.stats["max_constraint_velocity"] < 1e-13
    assert np.abs(np.einsum("nji,njk->nik", R, R) - np.eye(3)).max() < 1e-12


# -- invariants of trees -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_energies_of_a_tree_with_a_mass_matrix_that_varies_do_not_drift() -> None:
    """Errors of the energy are O(step^2), and their means over windows go nowhere, where rk4 loses all the time."""
    made = eomgen.build(two_arms())
    spread, drift = [], []
    for step in (0.01, 0.005):
        end = made.simulate(400.0, step, method="rattlie", record_every=4, error_estimate=False)
        total = made.energy(end.q, end.v)["total"]
        spread.append(float(np.quantile(total - total[0], 0.95) - np.quantile(total - total[0], 0.05)))
        drift.append(float(np.polyfit(end.t, total, 1)[0]) * 400.0)
    assert np.log2(spread[0] / spread[1]) == pytest.approx(2.0, abs=0.2)
    assert abs(drift[0]) < 0.2 * spread[0]


@pytest.mark.slow
def test_momenta_of_a_body_in_flight_that_carries_others_are_kept() -> None:
    """Gravity along z leaves the momenta along x and y, and the angular one about z, to rounding over 4000 steps."""
    made = flyer()
    end = made.simulate(8.0, 2e-3, method="rattlie", record_every=10, error_estimate=False)
    kept = []
    for q, v in zip(end.q, end.v, strict=True):
        p = made.mass(q) @ v
        R = rotation(q[:4])
        force = R @ p[3:6]
        kept.append([*force[:2], (R @ p[:3] + np.cross(q[4:7], force))[2]])
    drift = np.ptp(np.array(kept), axis=0)
    assert drift.max() < 1e-11 * np.abs(kept).max()


# -- steps that vary ---------------------------------------------------------------------------------------------------


def varied(group: str, largest: float, end: float) -> tuple[float, float, float]:
    """Return the errors of position, velocity and mean multipliers at random steps in [largest/4, largest], each 1/2 to
    3/2 of the last."""
    made, rng = top(group), np.random.default_rng(7)
    library = made.stepper("rattlie")
    full = dict.fromkeys(("rho_inf", "alpha", "beta", "gamma", "order", "tolerance"))
    method = chosen_method("rattlie", full, made.library.layout["defaults"], True)
    stepper = Stepper(
        library, stepper_settings(library.layout["method"], largest, method, {}), made.parameter_array({})
    )
    assert stepper.initialize(0.0, made.initial_q, made.initial_v, None) == 0
    record, t, step, worst = np.empty((1, stepper.sizes["row"])), 0.0, 0.5 * largest, np.zeros(3)
    while t < end:
        step = float(np.clip(step * rng.uniform(0.5, 1.5), 0.25 * largest, largest))
        stepper.settings[0] = stepper.step_size = step
        assert stepper.run(1, 1, None, record)[0] == 0
        _, _, _, lam = top_solution()(t)
        mean = stepper.state[stepper.places["lam_mean"]]
        worst[2] = max(worst[2], np.linalg.norm(mean - lam))
        t = stepper.t
        _, x, w, _ = top_solution()(t)
        state = stepper.state
        worst[0] = max(worst[0], np.linalg.norm(state[stepper.places["q"]][4:7] - x))
        worst[1] = max(worst[1], np.linalg.norm(state[stepper.places["v"]][:3] - w))
    return float(worst[0]), float(worst[1]), float(worst[2])


@pytest.mark.long
def test_order_at_steps_that_vary() -> None:
    found = np.array([varied("R3xSO3", 2.0**-power, 0.25) for power in (9, 10, 11, 12)])
    orders = np.log2(found[0] / found[-1]) / 3
    assert orders[:2] == pytest.approx(2.0, abs=0.15)
    assert orders[2] > 1.8


# -- the house ---------------------------------------------------------------------------------------------------------


def test_an_iteration_that_is_not_let_converge_is_said() -> None:
    end = four_bar().simulate(0.1, 1e-2, method="rattlie", settings={"max_iterations": 1}, error_estimate=False)
    assert not end.success
    assert "the Newton iteration of a step did not converge" in end.message


@pytest.mark.long
def test_light_spins_on_heavy_chains_are_solved_by_differences() -> None:
    """Rods on ball joints, 1/10000 as heavy about their own axes as what they carry: what momenta change within a step
    is no small part of such an inertia."""
    made = eomgen.build("examples/hanging_chain/scene.toml", profile="quick")
    exact = made.simulate(0.2, 2.5e-5, method="rk4", record_every=8000, error_estimate=False)
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4, 1.25e-4):
        end = made.simulate(0.2, step, method="rattlie", record_every=10**6, error_estimate=False)
        assert end.success, end.message
        errors.append(float(np.abs(end.v[-1] - exact.v[-1]).max()))
    assert slopes(errors)[-1] == pytest.approx(2.0, abs=0.1)
