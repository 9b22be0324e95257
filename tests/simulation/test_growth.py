"""Motions that grow: by the method alone a run fails, by its own equations it does not, whatever rows and terms there
are."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.library import scene
from tests.simulation.rails import built, on_rail

pytestmark = pytest.mark.slow

STEP = 1e-3


def sled() -> eomgen.Scene:
    """Return a mass on a rail with tunable stiffness and damping, no gravity."""
    builder = on_rail("", "rail", position=1.0, stiffness="k", damping="c")
    return builder.parameter("k", 1e4, tunable=True).parameter("c", 0.0, tunable=True).build()


@cache
def model() -> eomgen.Model:
    return eomgen.build(sled(), profile="quick")


def run(stiffness: float, steps: int, damping: float = 0.0, **options: Any) -> eomgen.Solution:
    options = {"method": "rk4", "parameters": {"k": stiffness, "c": damping}, **options}
    return model().simulate(steps * STEP, STEP, **options)


@pytest.mark.parametrize("every", [1, 10_000])
@pytest.mark.parametrize(
    ("frequency", "steps"), [(2.9, 100), (3.0, 30), (3.16, 700), (5.0, 100), (31.0, 25), (100.0, 30)]
)
def test_a_run_that_explodes_fails_whatever_is_recorded(frequency: float, steps: int, every: int) -> None:
    solution = run((frequency / STEP) ** 2, steps, record_every=every)
    assert not solution.success and not solution.interrupted
    start, _, fault = solution.message.partition(", but the method is unstable at this step: ")
    assert start == f"reached t = {steps * STEP:.9g} s in {steps} steps"
    assert fault.startswith("v.rail grows from ") and f" and {steps * STEP:.6g} s, and to " in fault
    assert ", and the total energy from " in fault and "; try: a step of " in fault
    assert fault.endswith(" s or less, or generalized_alpha, which is stable at larger ones")
    cure = float(fault.partition("try: a step of ")[2].partition(" s or less")[0])
    again = model().simulate(steps * STEP, cure, method="rk4", parameters={"k": (frequency / STEP) ** 2})
    assert again.success and np.abs(again.q).max() < 1.01


def test_growth_that_is_slow_is_seen_over_the_whole_run() -> None:
    limit = math.sqrt(8.0)
    for frequency in (limit + 0.01, limit + 0.03):
        solution = run((frequency / STEP) ** 2, 1000, record_every=1000)
        assert not solution.success and "the method is unstable at this step: v.rail grows" in solution.message
    for frequency in (limit - 0.1, limit - 0.01):
        assert run((frequency / STEP) ** 2, 1000, record_every=1000).success


SERIES: dict[str, Any] = {"method": "taylor", "tolerance": 0.0}


@pytest.mark.parametrize("method", ["generalized_alpha", "trapezoidal"])
@pytest.mark.parametrize("frequency", [2.0, 10.0, 1e5])
@pytest.mark.parametrize("position", [0.0, 1.0])
def test_coarse_steps_that_stay_within_bounds_do_not_fail(method: str, frequency: float, position: float) -> None:
    start = {"rail": {"position": position, "velocity": 1.0}}
    for steps in (10, 200):
        solution = run((frequency / STEP) ** 2, steps, method=method, initial=start)
        assert solution.success and "unstable" not in solution.message
        assert np.max(solution.energy["total"]) <= 1.1 * solution.energy["total"][0]


@cache
def stiff_arm() -> eomgen.Model:
    """Return an arm with a torsion spring: sqrt(1e5 N m / 0.25 kg m^2) = 632 rad/s."""
    arm = {"bodies__rod": {"mass": 1, "center_of_mass": [0, 0, -0.5]}, "joints__hinge__stiffness": 1e5}
    return eomgen.build(scene("pendulum", joints__hinge__initial={"position": 0.1}, **arm), profile="quick")


def test_energy_from_nothing_is_a_failure() -> None:
    """632 rad/s times 4.6 ms = 2.91: it grows, but in 0.1 s too little for the windows."""
    grown = stiff_arm().simulate(0.1, 0.0046, method="rk4")
    assert grown.energy["total"][-1] > 1e3 * grown.energy["total"][0] and not grown.success
    start, _, rest = grown.message.partition(", and the energy is out of balance by ")
    assert start.startswith(f"reached t = 0.1 s in 22 steps, but the estimated error is {grown.error.largest}")
    assert float(rest.partition(" %")[0]) > 49.0
    assert rest.endswith(" % of the energies at work; try: a step smaller than 0.0046 s")
    lost = stiff_arm().simulate(2.0, 0.0025, method="rk4")
    assert lost.success and ", and the energy is out of balance by " in lost.message


def test_a_controller_that_diverges_does_not_fail() -> None:
    builder = on_rail("5 * lead", "rail", velocity=1.0).state("lead", "40 * lead + v.rail", unit="m")
    diverging = built(builder)
    for method in ("rk4", "generalized_alpha"):
        solution = diverging.simulate(1.0, STEP, method=method)
        assert solution.success and abs(solution.z[-1, 0]) > 1e14


@pytest.mark.parametrize(
    "by",
    [*({"method": name} for name in ("rk4", "generalized_alpha", "trapezoidal")), SERIES | {"order": 6}],
)
def test_motions_that_grow_by_their_own_equations_do_not_fail(by: dict[str, Any]) -> None:
    runs = [
        run(-((0.5 / STEP) ** 2), 100, **by),  # a stiffness below zero: e^50
        run(1e4, 1000, damping=-20.0, **by),  # damping below zero: e^10
        run(-1e2, 1000, **by, initial={"rail": 1e-6}),
        run(-((0.3 / STEP) ** 2), 400, damping=-30.0, **by, record_every=400),
    ]
    assert all(solution.success for solution in runs), [solution.message for solution in runs]
    assert np.abs(runs[0].q).max() > 1e20 and np.abs(runs[3].q).max() > 1e45


def test_internal_states_that_decay_too_fast_for_the_step() -> None:
    builder = on_rail("", "rail", position=1.0, stiffness=10.0)
    lagging = built(builder.state("lag", "(q.rail - lag) / 1e-4", unit="m", initial=0.1))
    solution = lagging.simulate(0.05, STEP, method="rk4", record_every=100)
    assert not solution.success and "the method is unstable at this step: z.lag grows from" in solution.message
    assert lagging.simulate(0.05, STEP).success


def test_random_machines_fail_where_steps_alone_make_them_grow(rng: np.random.Generator) -> None:
    """Three masses in a row: eigenvalues say how large the motion becomes, and how large Runge and Kutta's steps make
    it."""
    builder = eomgen.SceneBuilder("row", gravity=[0, 0, 0])
    for k in range(3):
        builder.parameter(f"k{k}", 1.0, tunable=True).parameter(f"c{k}", 0.0, tunable=True)
        builder.body(f"m{k}", 1.0 + k)
        carrier = f"m{k - 1}" if k else "base"
        builder.joint(f"x{k}", "prismatic", carrier, f"m{k}", axis=[1, 0, 0], stiffness=f"k{k}", damping=f"c{k}")
    row = eomgen.build(builder.build(), profile="quick")
    judged = {True: 0, False: 0}
    for _ in range(150):
        p = {f"k{k}": float(10.0 ** rng.uniform(2.0, 7.5)) for k in range(3)}
        p |= {f"c{k}": float(rng.uniform(-2.0, 10.0) * 10.0 ** rng.uniform(-2.0, 1.0)) for k in range(3)}
        K, C, M = row.partials(np.zeros(3), np.zeros(3), np.zeros(3), parameters=p)
        A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
        roots = STEP * np.linalg.eigvals(A)
        by_steps = np.abs(sum(roots**n / math.factorial(n) for n in range(5)))
        steps, start = int(rng.integers(100, 600)), np.concatenate([rng.normal(size=3), 30.0 * rng.normal(size=3)])
        numerical, true = np.log(by_steps.max()), roots.real.max()
        if 0.05 < numerical < 0.25 or numerical * steps > 600.0:
            continue  # near the limit, where it takes longer to be seen, and beyond the finite numbers
        initial = {"q": start[:3], "v": start[3:]}
        made = row.simulate(steps * STEP, STEP, method="rk4", parameters=p, initial=initial, record_every=999)
        unstable = numerical > 0.25 and numerical > 3.0 * true
        assert made.success is not unstable, (numerical, true, steps, made.message)
        judged[unstable] += 1
    assert min(judged.values()) > 10


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_run_that_leaves_the_finite_numbers_warns_by_its_message_alone() -> None:
    growing = built(on_rail("1e4*q.x - (1 if q.x > 1e20*limit else 0)", position=0.5).parameter("limit", 1.0))
    assert "became infinite" in growing.simulate(7.06, 0.01, method="rk4").message


def test_what_rests_but_for_rounding_is_not_doubted() -> None:
    builder = eomgen.SceneBuilder("held", gravity=[0, 0, 0])
    for name, parent, place, start in (("a", "base", 0, {"position": 0.3}), ("b", "a", 1, {"position": 0.4})):
        builder.body(name, 1.0, inertia=[1, 1, 1])
        at = {"axis": [0, 0, 1], "position": [place, 0, 0], "initial": {**start, "velocity": float(place)}}
        builder.joint(f"to_{name}", "revolute", parent, name, **at)
    line = {"body": "base", "position": [1.5, 0, 0], "axis": [0, 0, 1]}
    builder.point("e", "b", [1, 0, 0]).constraint("c", "point_on_line", line, "e")
    solution = built(builder).simulate(0.1, STEP)
    assert np.abs(solution.v[-1]).max() < 1e-20
    assert solution.success and "out of balance" not in solution.message and solution.stats["energy_error"] == 0.0


def test_a_run_that_stops_because_its_equations_diverge_says_so() -> None:
    wall = built(on_rail("20 * q.rail + 0.1 * q.rail**3", "rail", position=1.0))  # infinite at t = 0.978 s
    for method in ("generalized_alpha", "rk45"):
        solution = wall.simulate(5.0, STEP, method=method)
        assert not solution.success and solution.message.startswith("stopped at t = 0.97")
        assert "; v.rail grows from " in solution.message
        hint = "stiffnesses and gains, for it is the equations that diverge: no smaller step helps"
        assert solution.message.endswith(f"; try: the signs and sizes of forces, {hint}")
    push = {"push": {"joint": "hinge", "effort": "1e-9 * sqrt(1 - t)"}}
    ended = eomgen.build(scene("pendulum", efforts=push), profile="quick").simulate(2.0, STEP)
    # it swings through zero
    assert not ended.success and "grows from" not in ended.message and "diverge" not in ended.message
    unstable = run((12.0 / STEP) ** 2, 1000)
    assert unstable.message.startswith("stopped at t = 0.10") and "a step smaller than 0.001 s" in unstable.message


def test_a_run_that_stops_at_angles_beyond_sines_because_it_explodes_names_the_step() -> None:
    """632 rad/s times 0.01 s = 6.3, above 2.8: in half of the step it explodes too."""
    for every in (1, 4):
        stopped = stiff_arm().simulate(2.0, 0.01, method="rk4", record_every=every)
        assert not stopped.success and "rad: sines and cosines" not in stopped.message
        start, _, fault = stopped.message.partition("; the method is unstable at this step: v.hinge grows from ")
        assert start.endswith("after 6 of 200 steps: a value became infinite or not a number") and fault
        hint = "; try: a step of 0.0025 s or less, or generalized_alpha, which is stable at larger ones"
        assert stopped.message.endswith(hint)
    assert np.abs(stiff_arm().simulate(0.1, 0.0025, method="rk4").q).max() < 0.11
    # the angle is large, and no step to blame
    fast = stiff_arm().simulate(1.0, 1e-3, initial={"hinge": {"velocity": 1e13}}, method="rk4")
    assert not fast.success and fast.message.endswith("try: smaller initial angles and velocities, or a shorter run")
