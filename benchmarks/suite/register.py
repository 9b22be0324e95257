"""The rows of the suite: the work, who does it, what it is held against, and what the ratio should be."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import beam_simulations
from benchmarks.contestants import CPP, TRACE
from benchmarks.suite import environments
from benchmarks.suite.contest import Context, Entry, contest, of_first_rows, relative_to_largest
from benchmarks.suite.environments import JAX, OWN, ROOT
from benchmarks.suite.outcomes import FAILED, MEASURED, MISSING, Outcome
from benchmarks.suite.robot_rows import (
    FROM_JAX,
    SCALAR_LOOP,
    TWO_THREADS,
    WITHOUT_LANES,
    batch_row,
    robot_row,
    thread_row,
)

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
class Goal:
    """Seconds that one contestant should take at most, and what limits it where it takes longer."""

    seconds: float
    limit: str = ""
    own: str = EOMGEN


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
    goals: Sequence[Goal] = ()


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
DIFFRAX = Entry("diffrax", "diffrax_ensemble.py", JAX, {"samples": 1024})
SCIPY = Entry("SciPy", "scipy_ensemble.py", task={"samples": 16}, small={"samples": 2})
MJX = Entry("MJX", "mjx_ensemble.py", JAX, {"samples": 256, "halvings": list(range(8, 18))}, {"halvings": [10, 16]})
PER_TRAJECTORY = "trajectory of 10 s"
AGAINST_HEYOKA = "heyoka's Taylor series at round-off (SciPy's DOP853 at 1e-13 where it is missing), all samples to {}"

PYTHONS_PART = (
    "half is the series in C, whose orders wait for one another; the rest a pilot run and statistics in Python"
)
OF_SERIES = "series of 15 terms in lanes take 90 % of the time; SciPy spends most of its time in Python"
EVEN = "both take series of 17 to 20 terms in lanes; eomgen also compares accelerations at the end of each"

TRAJECTORIES = (
    Row(
        "duffing_1e-9",
        "Many trajectories",
        "Duffing's oscillator from 4096 random starts to 1e-9, one core",
        PER_TRAJECTORY,
        AGAINST_HEYOKA.format("1e-9"),
        _ensemble("duffing", 4096, 1e-9, (HEYOKA, DIFFRAX, SCIPY)),
        (Comparison("heyoka", 1 / 1.2, PYTHONS_PART), Comparison("diffrax"), Comparison("SciPy")),
    ),
    Row(
        "double_pendulum_1e-9",
        "Many trajectories",
        "double pendulum of rods from 4096 random starts to 1e-9, one core",
        PER_TRAJECTORY,
        AGAINST_HEYOKA.format("1e-9"),
        _ensemble("double pendulum", 4096, 1e-9, (HEYOKA, DIFFRAX, SCIPY)),
        (Comparison("heyoka", 1 / 1.2, EVEN, readme=True), Comparison("diffrax"), Comparison("SciPy")),
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
            Comparison("diffrax", 0.1),
            Comparison("SciPy", 1e-3, OF_SERIES, readme=True),
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
        (Comparison("MuJoCo", readme=True), Comparison("EXUDYN")),
    ),
)

# -- functions ---------------------------------------------------------------------------------------------------------


NARROW = (
    "operations are 0.6 of the trace's; on a processor with AVX-512 the ratios of ANYmal and Talos were 0.41 and 0.42"
    " (2026-11-20, 4951b2e)"
)


def _robot(robot: str, name: str, function: str, words: str, target: float | None, limit: str = "") -> Row:
    of_trace = (robot, function) in (
        ("panda", "inverse_dynamics"),
        ("panda", "partials"),
        ("talos", "inverse_dynamics"),
    )
    of_cpp = (robot, function) == ("panda", "inverse_dynamics")
    return Row(
        f"{function}_{robot}",
        "Functions of robots",
        f"{name}: {words}, scalar C",
        "call",
        "Pinocchio's wheel at 64 random states, to 1e-10 of the largest number",
        robot_row(robot, function),
        (
            Comparison(TRACE, target, limit, readme=of_trace),
            Comparison(CPP, readme=of_cpp),
        ),
    )


FUNCTIONS = (
    _robot("panda", "Panda, 7 joints", "inverse_dynamics", "inverse dynamics", 0.6),
    _robot("panda", "Panda, 7 joints", "mass", "mass matrix", None),
    _robot("panda", "Panda, 7 joints", "forward_dynamics", "forward dynamics", None),
    _robot("panda", "Panda, 7 joints", "partials", "partials of inverse dynamics in q, v and a", None),
    _robot("anymal_b", "ANYmal, 18 freedoms", "inverse_dynamics", "inverse dynamics", 0.4, NARROW),
    _robot("talos", "Talos, 38 freedoms", "inverse_dynamics", "inverse dynamics", 0.42, NARROW),
    _robot("talos", "Talos, 38 freedoms", "forward_dynamics", "forward dynamics", None),
)

# -- functions at many states ------------------------------------------------------------------------------------------

MANY, PER_STATE = "Functions at many states", "state"


OF_ROWS = (
    "rows of states are turned into lanes and back, a sixth of the time; vectors of eight lanes take twice the cycles"
    " of a number"
)
OF_REGISTERS = (
    "vectors of eight lanes take twice the cycles of a number, so that four times is the most; 0.28 in cache, and 0.31"
    " from memory by C alone"
)
OF_MEMORY = (
    "memory: a state gives 1.2 kB, which are read before they are written; 0.29 at states whose results stay in a"
    " cache, and 0.31 to 0.45 were seen as other work on this machine left its memory"
)


def _many(
    robot: str, name: str, function: str, words: str, limit: str, *, with_jax: bool = False, states: int = 100_000
) -> Row:
    lanes = Comparison(WITHOUT_LANES, 1 / 3, limit)
    panda = (
        Comparison(SCALAR_LOOP, 20 / 78, limit),
        Comparison(WITHOUT_LANES),
        Comparison(CPP, readme=True),
        Comparison("frax"),
        Comparison("adam"),
        Comparison("frax", 0.2, own=FROM_JAX),
    )
    return Row(
        f"{function}_{robot}_many",
        MANY,
        f"{name}: {words} at {states:_} states from Python, one core".replace("_", " "),
        PER_STATE,
        "Pinocchio's wheel at 64 random states, to 1e-10 of the largest number",
        batch_row(robot, function, states, with_jax=with_jax),
        panda if with_jax else (lanes, Comparison(CPP)),
    )


AT_MANY_STATES = (
    _many("panda", "Panda, 7 joints", "inverse_dynamics", "inverse dynamics", OF_ROWS, with_jax=True),
    _many("panda", "Panda, 7 joints", "forward_dynamics", "forward dynamics", OF_ROWS),
    _many("panda", "Panda, 7 joints", "partials", "partials of inverse dynamics", OF_MEMORY, states=10_000),
    _many("talos", "Talos, 38 freedoms", "inverse_dynamics", "inverse dynamics", OF_REGISTERS),
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

# -- motions to an error -----------------------------------------------------------------------------------------------


def _motion(
    work: str, target: float, small: float, peers: Mapping[str, str], **task: Any
) -> Callable[[Context], list[Outcome]]:
    def run(context: Context) -> list[Outcome]:
        told = {"work": work, "target": small if context.quick else target, **task}
        entries = [
            Entry(name, "motions.py", task={**told, "peer": package})
            for name, package in {EOMGEN: EOMGEN, **peers}.items()
        ]
        return contest(context, entries, told["target"], reference=np.zeros(1))

    return run


def _contact(name: str, scene: str, words: str, target: float) -> Row:
    contestants = {OWN_CONTACT: OWN_CONTACT, **{peer: peer for peer in ("Drake", "Drake, CENIC", "MuJoCo", "EXUDYN")}}
    return Row(
        name,
        "Motions to an error",
        words,
        "run",
        "the limit of the same contestant's own finest runs. Drake's point contact and EXUDYN's spring are formulas in"
        " the two scenes of eomgen, and the motions agree; MuJoCo and CENIC have laws, and motions, of their own",
        _motion("contact", target, 10.0, contestants, scene=scene),
        (
            *(Comparison(peer, 0.2) for peer in ("Drake", "Drake, CENIC", "MuJoCo")),
            Comparison("EXUDYN", 0.2, own=OWN_CONTACT),
        ),
    )


OWN_CONTACT = "eomgen, EXUDYN's law"
MOTIONS = (
    _contact(
        "bouncing_spheres_1e-2", "balls", "ten spheres that bounce on a plane with friction, 1.5 s to 1e-2 m", 1e-2
    ),
    _contact(
        "sliding_car_1e-3", "car", "car of 14 freedoms that lands on its wheels and slides, 1.5 s to 1e-3 m", 1e-3
    ),
    Row(
        "fast_top_1e-5",
        "Motions to an error",
        "fast top, body in absolute coordinates on a ball joint, 1 s to 1e-5 m",
        "run",
        "a Taylor series of 40 digits",
        _motion("top", 1e-5, 1e-3, {"EXUDYN": "exudyn"}),
        (Comparison("EXUDYN", readme=True),),
    ),
    Row(
        "flying_beam_0.03",
        "Motions to an error",
        "geometrically exact beam thrown into space, 5 s to 0.03 m",
        "run",
        "the limit of the same program's finest meshes and steps",
        _motion("beam", 0.03, 1.0, {"EXUDYN": "exudyn", "PyElastica": "pyelastica"}),
        (Comparison("EXUDYN"), Comparison("PyElastica")),
    ),
    Row(
        "stiff_rods_1e-6",
        "Motions to an error",
        "three rods, the last on a stiff spring, 2 s to 1e-6 m by a tolerance",
        "run",
        "an explicit run at 1e-11 that SciPy's Radau confirms",
        _motion("stiff", 1e-6, 1e-3, {"SciPy, Radau": "scipy", "EXUDYN, DOPRI5": "exudyn"}),
        (Comparison("SciPy, Radau"), Comparison("EXUDYN, DOPRI5")),
    ),
    Row(
        "series_top_1e-9",
        "Motions to an error",
        "fast top on its ball joint, 1 s to 1e-9 by Taylor series, one trajectory",
        "run",
        "heyoka in long double at 1e-18",
        _motion("taylor", 1e-9, 1e-9, {"heyoka": "heyoka"}, case="fast top"),
        (Comparison("heyoka"),),
    ),
    Row(
        "series_chain_1e-9",
        "Motions to an error",
        "planar chain of six rods, 2 s to 1e-9 by Taylor series, one trajectory",
        "run",
        "heyoka in long double at 1e-18",
        _motion("taylor", 1e-9, 1e-9, {"heyoka": "heyoka"}, case="6-link chain"),
        (Comparison("heyoka"),),
    ),
)


# -- symbolic tools ----------------------------------------------------------------------------------------------------

_TOOLS = {EOMGEN: EOMGEN, "SymPy + cse + gcc": "sympy", "PyDy": "pydy", "CasADi": "casadi"}


TEMPLATES = "Python derives and schedules, and Jinja compiles its templates, before the compiler begins"


def _symbolic(what: str) -> Callable[[Context], list[Outcome]]:
    def run(context: Context) -> list[Outcome]:
        task, small = {"links": 6, "what": what, "shelf": str(context.shelf)}, {"links": 2}
        entries = [
            Entry(name, "symbolic.py", task={**task, "peer": peer}, small=small) for name, peer in _TOOLS.items()
        ]
        return contest(context, entries, 1e-10, measure=relative_to_largest)

    return run


SYMBOLIC = (
    Row(
        "chain_call",
        "Symbolic tools",
        "planar chain of six rods: compiled forward dynamics",
        "call",
        "each other, at 64 random states, to 1e-10 of the largest number",
        _symbolic("call"),
        (Comparison("SymPy + cse + gcc"), Comparison("PyDy"), Comparison("CasADi")),
    ),
    Row(
        "chain_build",
        "Symbolic tools",
        "planar chain of six rods: from its description to compiled forward dynamics, imports left out",
        "build",
        "each other, at 64 random states, to 1e-10 of the largest number",
        _symbolic("build"),
        (Comparison("SymPy + cse + gcc"), Comparison("PyDy"), Comparison("CasADi", limit=TEMPLATES)),
    ),
)


# -- eomgen by its own goals -------------------------------------------------------------------------------------------

COMPILERS = "gcc takes 1.7 s of processor time on two cores, after 0.7 s in which Python imports and reads"
EQUAL_ELEMENTS = "Python derives, orders and schedules every element by itself; then gcc and figures"
WITH_LANES, SCALAR = "eomgen, lanes", "eomgen, scalar"
DASK, THREADS = "eomgen, four processes of Dask", "eomgen, two threads"
BETWEEN = "four processes and a scheduler share two cores, 14 kB of each sample go between them; 0.80 at 8000 samples"


def _own(
    task: Mapping[str, Any], small: Mapping[str, Any], clock: str = "processor"
) -> Callable[[Context], list[Outcome]]:
    def run(context: Context) -> list[Outcome]:
        cores = 1 if clock == "processor" else os.cpu_count() or 1  # compilers run side by side
        entry = Entry(EOMGEN, "own_steps.py", task=task, small=small, threads=cores)
        return contest(context, [entry], 0.0, clock=clock)

    return run


def _with_lanes(context: Context) -> list[Outcome]:
    task = {
        "work": "ensemble", "example": "four_bar", "samples": 512, "steps": 2000, "step": 5e-4,
        "varied": "v.drive", "around": 30.0, "column": "q.drive",
    }  # fmt: skip  # a table
    small = {"samples": 2, "steps": 20}
    entries = [
        Entry(name, "own_steps.py", task={**task, "lanes": lanes}, small={**small, "lanes": "off"})
        for name, lanes in ((WITH_LANES, "now"), (SCALAR, "off"))
    ]
    return contest(context, entries, 1e-9)


def _on_dask(context: Context) -> list[Outcome]:
    """Return wall seconds of a sample as ``benchmarks.ensembles`` measures them: the same bits, or it ends."""
    how = ["--quick"] if context.quick else ["--memory", "--samples", "16000", "--rounds", "3"]
    python = environments.interpreter(OWN, context.here)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "found.json"
        words = [str(python), "-m", "benchmarks.ensembles", *how, "--json", str(file)]
        ran = subprocess.run(words, capture_output=True, text=True, check=False, cwd=ROOT, timeout=600)
        if ran.returncode:
            said = (ran.stderr.strip().splitlines() or ["it said nothing"])[-1][:200]
            state = MISSING if "No module named" in said else FAILED
            return [Outcome(DASK, state, note=said), Outcome(THREADS, state, note=said)]
        found = json.loads(file.read_text(encoding="utf-8"))
    note = f"{found['samples']} samples, wall time"
    return [
        Outcome(name, MEASURED, found[key] / found["samples"], None, 0.0, note)
        for name, key in ((DASK, "wall dask"), (THREADS, "wall local"))
    ]


OWN_GOALS = (
    Row(
        "four_bar_lanes",
        "eomgen alone",
        "four-bar, generalized-alpha with its constraints, 512 trajectories from Python, one core",
        "step and trajectory",
        "the scalar build, to 1e-9",
        _with_lanes,
        (Comparison(SCALAR, 1 / 4, own=WITH_LANES),),
    ),
    Row(
        "dask",
        "eomgen alone",
        "double pendulum on a shaking base, 5000 steps, an ensemble on Dask's processes",
        "sample",
        "the same bits on threads",
        _on_dask,
        (Comparison(THREADS, 1 / 0.85, BETWEEN, own=DASK),),
    ),
    Row(
        "active_vehicle_step",
        "eomgen alone",
        "active vehicle on a road of 200 harmonics, generalized-alpha",
        "step",
        "its own run, which reaches its end",
        _own({"work": "one", "example": "active_vehicle", "steps": 4000, "step": 1e-3}, {"steps": 50}),
        goals=(Goal(0.6e-6),),
    ),
    Row(
        "first_build",
        "eomgen alone",
        "Panda, 7 joints: from its URDF to a loaded library with partials and stepper, nothing cached, wall time",
        "build",
        "nothing: the library loads",
        _own({"work": "build"}, {}, "wall"),
        goals=(Goal(0.9, COMPILERS),),
    ),
    *(
        Row(
            f"beam_{elements}_{name}",
            "eomgen alone",
            f"exact beam of {elements} elements: eomgen simulate from its file, {case}, wall time",
            "command",
            "its own run, which reaches its end",
            _own({"work": "simulate", "elements": elements, "case": case}, {"elements": 3}, "wall"),
            goals=(Goal(seconds, EQUAL_ELEMENTS),) if seconds and name == "first" else (),
        )
        for elements, seconds in ((50, None), (200, 4.0), (800, 5.0))
        for name, case in (("first", beam_simulations.CASES[0]), ("cached", beam_simulations.CASES[1]))
    ),
)

ROWS: tuple[Row, ...] = (
    *FUNCTIONS,
    *AT_MANY_STATES,
    *TRAJECTORIES,
    *STEPS,
    *MOTIONS,
    *SYMBOLIC,
    *OWN_GOALS,
)
