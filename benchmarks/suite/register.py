"""The rows of the suite: the work, who does it, what it is held against, and what the ratio should be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.contestants import CPP, TRACE
from benchmarks.suite.contest import Context, Entry, contest, of_first_rows
from benchmarks.suite.environments import JAX
from benchmarks.suite.outcomes import Outcome
from benchmarks.suite.robot_rows import SCALAR_LOOP, TWO_THREADS, batch_row, robot_row, thread_row

EOMGEN = "eomgen"


@dataclass(frozen=True)
class Comparison:
    """Two contestants of a row, of which the ratio of times is shown.

    Attributes
    ----------
    own, peer : names of outcomes.
    target : largest ratio that was set as a goal, None where there was none.
    limit : what limits the row where it is lost.
    readme : whether it is among the README's rows.
    """

    peer: str
    target: float | None = None
    limit: str = ""
    own: str = EOMGEN
    readme: bool = False


@dataclass(frozen=True)
class Row:
    """One line of work.

    Attributes
    ----------
    per : what one unit is, for which a time is given.
    check : what the numbers are held against, and how closely, before anything is timed.
    """

    name: str
    section: str
    work: str
    per: str
    check: str
    run: Callable[[Context], list[Outcome]]
    comparisons: Sequence[Comparison] = ()
    notes: str = field(default="")


# -- trajectories ------------------------------------------------------------------------------------------------------


def _ensemble(problem: str, samples: int, target: float, peers: Sequence[Entry]) -> Callable[[Context], list[Outcome]]:
    work = {"problem": problem, "samples": samples, "target": target}
    small = {"samples": 4, "target": max(target, 1e-7)}

    def run(context: Context) -> list[Outcome]:
        entries = [
            Entry(one.name, one.script, one.group, {**work, **one.task}, {**small, **one.small}, one.threads)
            for one in (Entry(EOMGEN, "eomgen_ensemble.py", task=OWN_METHODS, small={"methods": ["taylor"]}), *peers)
        ]
        references = [Entry(script, script, task=work, small=small) for script in REFERENCES]
        wanted = small["target"] if context.quick else target
        return contest(context, entries, 1.001 * float(wanted), reference=references, measure=of_first_rows)

    return run


OWN_METHODS = {"methods": ["taylor", "rk45", "rk4"], "workers": 1}
REFERENCES = ("heyoka_ensemble.py", "scipy_ensemble.py")
HEYOKA = Entry("heyoka", "heyoka_ensemble.py")
DIFFRAX = Entry("diffrax", "diffrax_ensemble.py", JAX)
SCIPY = Entry("SciPy", "scipy_ensemble.py", task={"samples": 16}, small={"samples": 2})
MJX = Entry("MJX", "mjx_ensemble.py", JAX, {"samples": 256, "halvings": list(range(8, 18))}, {"halvings": [10, 16]})
PER_TRAJECTORY = "trajectory of 10 s"
AGAINST_HEYOKA = "heyoka's Taylor series at round-off (SciPy's DOP853 at 1e-13 where it is missing), all samples to {}"

TRAJECTORIES = (
    Row(
        "duffing_1e-9",
        "Many trajectories",
        "Duffing's oscillator from 1024 random starts to 1e-9, one core",
        PER_TRAJECTORY,
        AGAINST_HEYOKA.format("1e-9"),
        _ensemble("duffing", 1024, 1e-9, (HEYOKA, DIFFRAX, SCIPY)),
        (Comparison("heyoka", 1 / 1.2, readme=True), Comparison("diffrax"), Comparison("SciPy")),
    ),
    Row(
        "double_pendulum_1e-9",
        "Many trajectories",
        "double pendulum of rods from 1024 random starts to 1e-9, one core",
        PER_TRAJECTORY,
        AGAINST_HEYOKA.format("1e-9"),
        _ensemble("double pendulum", 1024, 1e-9, (HEYOKA, DIFFRAX, SCIPY)),
        (Comparison("heyoka", 1 / 1.2, readme=True), Comparison("diffrax"), Comparison("SciPy")),
    ),
    Row(
        "double_pendulums_from_python",
        "Many trajectories",
        "10 000 double pendulums from Python to 1e-6, one core",
        PER_TRAJECTORY,
        AGAINST_HEYOKA.format("1e-6"),
        _ensemble("double pendulum", 10_000, 1e-6, (MJX, DIFFRAX, SCIPY, HEYOKA)),
        (
            Comparison("MJX", 0.1, readme=True),
            Comparison("diffrax", 0.1, readme=True),
            Comparison("SciPy", 1e-3, readme=True),
            Comparison("heyoka"),
        ),
    ),
)


# -- steps -------------------------------------------------------------------------------------------------------------


def _hinges(context: Context) -> list[Outcome]:
    names = {EOMGEN: "eomgen", "MuJoCo": "mujoco", "EXUDYN": "exudyn"}
    entries = [Entry(name, "hinges.py", task={"peer": peer, "steps": 500}) for name, peer in names.items()]
    return contest(context, entries, 1e-9, reference=np.zeros(1))


STEPS = (
    Row(
        "ten_hinges_rk4",
        "Steps",
        "ten rods on hinges, RK4, step 1 ms, joint coordinates",
        "step",
        "the tip after 0.5 s, to 1e-9 m of where fine runs of MuJoCo and EXUDYN agree",
        _hinges,
        (Comparison("MuJoCo", readme=True), Comparison("EXUDYN", readme=True)),
    ),
)

# -- functions ---------------------------------------------------------------------------------------------------------


def _robot(robot: str, name: str, function: str, words: str, target: float | None, limit: str = "") -> Row:
    readme = robot == "panda"
    return Row(
        f"{function}_{robot}",
        "Functions of robots",
        f"{name}: {words}, scalar C",
        "call",
        "Pinocchio's wheel at 64 random states, to 1e-10 of the largest number",
        robot_row(robot, function),
        (
            Comparison(TRACE, target, limit, readme=readme or bool(target)),
            Comparison(CPP, readme=readme and bool(target)),
        ),
    )


FUNCTIONS = (
    _robot("panda", "Panda, 7 joints", "inverse_dynamics", "inverse dynamics", 0.6),
    _robot("panda", "Panda, 7 joints", "mass", "mass matrix", None),
    _robot("panda", "Panda, 7 joints", "forward_dynamics", "forward dynamics", None),
    _robot("panda", "Panda, 7 joints", "partials", "partials of inverse dynamics in q, v and a", None),
    _robot("anymal_b", "ANYmal, 18 freedoms", "inverse_dynamics", "inverse dynamics", 0.4),
    _robot("talos", "Talos, 38 freedoms", "inverse_dynamics", "inverse dynamics", 0.42),
    _robot("talos", "Talos, 38 freedoms", "forward_dynamics", "forward dynamics", None),
)

# -- functions at many states ------------------------------------------------------------------------------------------

MANY, PER_STATE = "Functions at many states", "state"


def _many(robot: str, name: str, function: str, words: str, *, with_jax: bool = False) -> Row:
    lanes = Comparison(SCALAR_LOOP, 1 / 3, "the row needs AVX2; with AVX-512 the goal is a sixth", readme=not with_jax)
    panda = (
        Comparison(SCALAR_LOOP, 20 / 78, readme=True),
        Comparison(CPP, readme=True),
        Comparison("frax"),
        Comparison("adam"),
        Comparison("MJX"),
    )
    return Row(
        f"{function}_{robot}_many",
        MANY,
        f"{name}: {words} at 100 000 states from Python, one core",
        PER_STATE,
        "Pinocchio's wheel at 64 random states, to 1e-10 of the largest number",
        batch_row(robot, function, with_jax=with_jax),
        panda if with_jax else (lanes, Comparison(CPP)),
    )


AT_MANY_STATES = (
    _many("panda", "Panda, 7 joints", "inverse_dynamics", "inverse dynamics", with_jax=True),
    _many("panda", "Panda, 7 joints", "forward_dynamics", "forward dynamics"),
    _many("panda", "Panda, 7 joints", "partials", "partials of inverse dynamics"),
    _many("talos", "Talos, 38 freedoms", "inverse_dynamics", "inverse dynamics"),
    Row(
        "two_threads",
        MANY,
        "Talos, 38 freedoms: inverse dynamics at 400 000 states from Python, wall time",
        PER_STATE,
        "Pinocchio's wheel at 64 random states, to 1e-10 of the largest number",
        thread_row("talos", "inverse_dynamics"),
        (Comparison(EOMGEN, 1 / 1.8, "memory, or other work on the second core", TWO_THREADS),),
    ),
)

ROWS: tuple[Row, ...] = (*FUNCTIONS, *AT_MANY_STATES, *TRAJECTORIES, *STEPS)
