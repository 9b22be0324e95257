"""``extremes``: a scene along its ladders, cell by cell, each in a separate process and held against references."""

from __future__ import annotations

import dataclasses
import itertools
import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.journal import Journal
from eomgen.base.messages import nearest, shown
from eomgen.base.version import __version__
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.register import AUTO, canonical_name
from eomgen.pipeline.model import Model
from eomgen.products.studies.defaults import EXTREMES_BUDGET, EXTREMES_LIMIT
from eomgen.products.studies.ladders.register import BY_NAME, EQUATIONS, LADDERS, SAME, Ladder, methods_of
from eomgen.products.studies.ladders.result import FAILS, HOLDS, Cell, Extremes, verdict
from eomgen.products.studies.ladders.runs import (
    REACHED,
    ROWS,
    Request,
    RunConditions,
    RunEnding,
    RunnerProcess,
    compile_stepper,
    run_ending,
)
from eomgen.products.studies.ladders.subject import FACTORS, OWN, SINGLE, StructuralZeros, Subject
from eomgen.products.studies.seconds import study_seconds
from eomgen.products.studies.work_precision.observation import angles

#: Two references have to agree to this.
AGREED = 1e-3
#: Limit of the steps of a run of a pair.
MOST_STEPS = 400_000
_DOUBLE = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class ExpectedResult:
    """Expected result of a run.

    Attributes
    ----------
    by : the methods that say so; why there is none
    arrays : of the observation, None if no two methods agree
    uncertainty : the difference of both
    """

    by: str
    arrays: dict[str, Array] | None = None
    uncertainty: float = np.inf


def reference(
    subject: Subject, conditions: RunConditions, ended: Callable[[Request, float], RunEnding]
) -> ExpectedResult:
    """Return the first reference solution, of a method confirmed by a second method or a second step size to 1e-3.

    Without such a pair the result has no arrays, and its text lists the reasons.

    Parameters
    ----------
    subject, conditions : the scene and the conditions of the run
    ended : function of a run and a time limit in s that returns the end of the run
    """
    tried = []
    for name, first, second in _pairs(subject, conditions):
        runs: list[Mapping[str, Array]] = []
        for request in (first, second):
            ending = ended(request, 10.0)
            if ending.how != REACHED or ending.arrays is None or not ending.finite:
                tried.append(f"{name}: {ending.how}")
                break
            if not _resolves_motion(subject, request, ending.arrays):
                tried.append(f"{name}: steps change the coordinates by their rounding only")
                break
            runs.append(ending.arrays)
        else:
            apart = difference(subject, runs[1], runs[0], AGREED).worst
            if apart <= AGREED:
                return ExpectedResult(name, dict(runs[0]), apart)
            tried.append(f"{name}: difference {apart:.2g}")
    return ExpectedResult("; ".join(tried))


def _resolves_motion(subject: Subject, request: Request, arrays: Mapping[str, Array]) -> bool:
    """Return whether a step at the largest speed of a run changes each moving coordinate by ten roundings of the start
    or more. Otherwise finer steps lose more of the motion: two references may agree on a standstill. Rotations and free
    bodies are not judged. `request` has the step and the start, `arrays` are the rows of the run."""
    conditions = request.conditions
    model = subject.model(OWN)
    speed = np.max(np.abs(arrays["v"]), axis=0)
    if conditions.sizes is not None:
        speed = speed * conditions.sizes[1]
    for factor in model.factors:
        if factor.group == "R":
            moves = conditions.step * speed[factor.v]
            if np.any((moves > 0.0) & (moves < 10.0 * np.spacing(np.abs(conditions.q[factor.q])))):
                return False
    return True


class Errors(NamedTuple):
    """Largest errors of a run over all rows: of coordinates relative to the motion, of velocities relative to the
    largest velocity, angles and lengths separately."""

    position: float
    velocity: float

    @property
    def worst(self) -> float:
        """Both on one scale: velocities are about three times as wrong as positions at the same step."""
        return max(self.position, self.velocity / 3.0)


def difference(
    subject: Subject, of: Mapping[str, Array], held: Mapping[str, Array], bound: float, epsilon: float = _DOUBLE
) -> Errors:
    """Return the errors of a run relative to another run; internal states present in both runs count like coordinates.

    Parameters
    ----------
    of : run with the error: ``t``, ``q``, ``v`` and, if present, ``z``, with a row for each time
    held : run that counts as correct
    bound : error of a cell that holds; a part of this, by the rounding of the arithmetic, does not count
    epsilon : rounding of the arithmetic
    """
    if of["q"].shape != held["q"].shape or not all(np.isfinite(array).all() for array in of.values()):
        return Errors(float("inf"), float("inf"))  # max() would drop numbers that are NaN
    model, span, rounding = subject.model(OWN), float(held["t"][-1] - held["t"][0]), 10.0 * epsilon / bound
    scale = {"rad": 1.0, "m": subject.extent}
    position, turned = _relative(_positions(model, of["q"], held["q"]), scale, rounding, 1.0)
    if "z" in of and "z" in held:
        ranges = np.maximum(np.ptp(held["z"], axis=0), rounding * _largest(held["z"]))
        states, _ = _relative(zip(model.z_units, _largest(of["z"] - held["z"]), ranges, strict=True), {}, 0.0, 0.0)
        position = max(position, states)
    apart, speeds = _largest(of["v"] - held["v"]), _largest(held["v"])
    rates = {f"{kind}/s": size for kind, size in scale.items()}
    velocity, _ = _relative(zip(model.v_units, apart, speeds, strict=True), rates, rounding, turned / span)
    result = Errors(position, velocity)
    return result if np.all(np.isfinite(result)) else Errors(float("inf"), float("inf"))


def _relative(
    parts: Iterable[tuple[str, float, float]], scale: Mapping[str, float], rounding: float, least: float
) -> tuple[float, float]:
    """Return the largest error of components, each divided by the largest motion of the same unit, and the largest
    motion on the scales, at least ``least``.

    Motion counts at least as a thousandth of the largest motion on the scales, and as ``rounding`` times the latter.

    Parameters
    ----------
    parts : unit, largest error and largest motion of each component
    scale : by unit
    """
    wrong, moved = dict[str, float](), dict[str, float]()
    for unit, error, motion in parts:
        wrong[unit] = max(wrong.get(unit, 0.0), error)
        moved[unit] = max(moved.get(unit, 0.0), motion)
    most = max((motion / scale[unit] for unit, motion in moved.items() if unit in scale), default=0.0)
    reach = max(least, most)
    floor = max(rounding * reach, 1e-3 * most)
    sizes = {unit: max(motion, floor * scale.get(unit, 0.0)) or 1.0 for unit, motion in moved.items()}
    return max((error / sizes[unit] for unit, error in wrong.items()), default=0.0), reach


def _largest(values: Array) -> Array:
    """Return the largest size of each column, (n, size) -> (size,)."""
    return np.asarray(np.abs(values).max(axis=0, initial=0.0))


def _positions(model: Model, of: Array, held: Array) -> Iterator[tuple[str, float, float]]:
    """Yield (unit, largest error, largest motion) of each coordinate, rotation (``rad``) and place (``m``). `of` and
    `held` (n, nq) are the rows of a run and of its reference, from which the motion is taken."""
    for factor in model.factors:
        here, there = of[:, factor.q], held[:, factor.q]
        if factor.group == "R":
            for k in range(factor.q_size):
                kind = model.q_units[factor.q_start + k]
                motion = float(np.max(np.abs(there[:, k] - there[0, k])))
                yield kind, float(np.max(np.abs(here[:, k] - there[:, k]))), motion
            continue
        error, motion = (float(np.max(angles(of, there[:, :4]))) for of in (here[:, :4], there[:1, :4]))
        yield "rad", error, motion
        if factor.q_size > 4:
            apart, way = here[:, 4:] - there[:, 4:], there[:, 4:] - there[0, 4:]
            yield "m", float(np.max(np.linalg.norm(apart, axis=1))), float(np.max(np.linalg.norm(way, axis=1)))


def _pairs(subject: Subject, conditions: RunConditions) -> Iterator[tuple[str, Request, Request]]:
    """Yield (text, run, run) for accurate runs by unlike methods or at two step sizes, whose agreement gives a
    reference."""
    free = conditions.vary(given={})
    span = conditions.step * conditions.steps
    # Steps that resolve the fastest motion of the scene without factors.
    fine = subject.fine * conditions.parameters.get("unit_time", 1.0)
    count = conditions.steps if 4 * conditions.steps <= MOST_STEPS else ROWS * int(np.ceil(span / fine / ROWS))

    def finer(method: str, times: int, **more: float) -> Request:
        steps = count * times
        return Request(free.vary(step=span / steps, steps=steps), method, {"error_estimate": False, **more})

    def tight(method: str) -> Request:
        changed = free.vary(step=span / ROWS, steps=ROWS)
        return Request(changed, method, {"error_estimate": False, "tolerance": 1e-14})

    times = max(1, min(4 * int(np.ceil(span / count / fine)), MOST_STEPS // (4 * count)))
    step = "of the step" if count == conditions.steps else f"of {span / count:.3g} s"
    for stepped in subject.methods(fine_by="steps"):
        for series in subject.methods(fine_by="tolerance"):
            yield f"{series}, held against {stepped} at 1/{times} {step}", tight(series), finer(stepped, times)
        yield f"{stepped} at 1/{times} and 1/{2 * times} {step}", finer(stepped, 2 * times), finer(stepped, times)
    for damped, few in itertools.product(subject.methods(fine_by="damping"), (4, 64)):
        many = min(few * 4, max(2, MOST_STEPS // count))
        text = f"{damped} at 1/{many} and 1/{many // 2} {step}"
        yield text, finer(damped, many, rho_inf=0.5), finer(damped, max(1, many // 2), rho_inf=0.8)


#: Called with cells done, cells in all, and the present cell.
Progress = Callable[[int, int, str], None]
_CELLS = "cells.jsonl"


def extremes(
    scene: Any,
    *,
    ladders: Sequence[str] = (),
    methods: Sequence[str] = (),
    cells: Sequence[str] = (),
    budget: float = EXTREMES_BUDGET,
    limit: float = EXTREMES_LIMIT,
    folder: str | Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    **reading: Any,
) -> Extremes:
    """Run a scene under extreme conditions, and return a verdict for each.

    Ladders that the scene does not have, and cells after the end of the budget, are left out: ``Extremes.left_out`` has
    the reasons. A run that fails, crashes or hangs is a verdict, not an error.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        Scene that is run under the extreme conditions. Of a Scene, or a file with ``include``, ladders that scale the
        numbers are left out.
    ladders : sequence of str
        Names of ladders; all by default.
    methods : sequence of str
        Names; methods that cannot step the scene are left out. By default, and if none is left, as each ladder
        demands: the scene's method alone (also if methods are given), this and a few or all further methods, or methods
        with ``rho_inf``.
    cells : sequence of str
        ``LADDER:VALUE`` or ``LADDER:VALUE:METHOD`` with any value: these alone, instead of ``ladders``.
    budget : float
        Seconds of computation, compiling aside; a cell that has begun is finished.
    limit : float
        Seconds that a run with the method may take, compiling aside; a longer run is interrupted, and the verdict is
        ``unfinished``, or ``fails`` if the run does not answer. A cell may take longer: runs for references have 10 s
        each (or ``limit``), and a run that fails may be made again in a new process.
    folder : path
        Folder in which each finished cell is kept (``cells.jsonl``), also at Ctrl-C; see also ``Extremes.save``.
    resume : bool
        Go on with the cells of the folder.
    progress : callable
        Called with cells done, cells in all, and the present cell.
    **reading
        Options of ``eomgen.load``.

    Returns
    -------
    Extremes
        Verdict and error of each condition with each method.

    Raises
    ------
    UsageError
        An unknown ladder, method or cell.
    FileError
        The folder contains the cells of another scene or version, or any cells without ``resume``.
    EomgenError
        The scene cannot be read or built.
    """
    began, budget, limit = time.perf_counter(), study_seconds("budget", budget), study_seconds("limit", limit)
    wanted = [_ladder_named("ladders", name) for name in ladders] or LADDERS
    for method in (*methods, *(method for _, _, method in map(_cell_of, cells) if method)):
        if method != AUTO:
            canonical_name(method)
    study = _LadderStudy(Subject(scene, reading), limit)
    entries = [_cell_of(text) for text in cells] or [
        (ladder, value, "") for ladder in wanted for value in ladder.values
    ]
    journal = Journal(
        None if folder is None else Path(folder),
        _CELLS,
        "cells of a study",
        identity=json.dumps({"scene": study.subject.scene.digest.hex(), "version": __version__}),
        others="another scene",
        row_of=lambda line: Cell(**line),
        resume=resume,
    )
    try:
        result, left_out = study.run(entries, methods, journal, budget, progress)
    except KeyboardInterrupt as stop:
        if folder is not None:
            stop.add_note(f"finished cells are kept in {folder}: --resume goes on with them")
        raise
    finally:
        study.runner.close()
    source = str(scene) if isinstance(scene, str | Path) else study.subject.name
    return Extremes(
        study.subject.name, source, tuple(result), left_out, study.subject.period, time.perf_counter() - began
    )


def _cell_of(text: str) -> tuple[Ladder, float, str]:
    name, _, rest = text.partition(":")
    value, _, method = rest.partition(":")
    ladder = _ladder_named(f"--cell {text}", name)
    try:
        return ladder, float(value), method
    except ValueError:
        fault = f"{value!r} is not a value of the ladder {name} [E1099]"
        raise UsageError(Problem(f"--cell {text}", fault, f"--cell {name}:{ladder.values[0]:g}")) from None


def _ladder_named(where: str, name: str) -> Ladder:
    """Return a ladder by name. Raises UsageError with the argument that has the name."""
    if name not in BY_NAME:
        raise UsageError(Problem(where, f"there is no ladder {shown(name)} [E1098]", nearest(name, list(BY_NAME))))
    return BY_NAME[name]


class _LadderStudy:
    def __init__(self, subject: Subject, limit: float) -> None:
        self.subject, self.limit = subject, limit
        self.references: dict[str, ExpectedResult] = {}
        self.runner = RunnerProcess(
            lambda request: compile_stepper(subject.model(request.conditions.model), request.method),
            lambda request: run_ending(
                subject.model(request.conditions.model), request.conditions, request.method, **request.more
            ),
        )

    @cached_property
    def structure(self) -> StructuralZeros:
        """The equations of the scene as given."""
        return StructuralZeros(self.subject)

    def run(
        self,
        entries: Sequence[tuple[Ladder, float, str]],
        methods: Sequence[str],
        journal: Journal[Cell],
        budget: float,
        progress: Progress | None,
    ) -> tuple[list[Cell], dict[str, str]]:
        """Run the cells of all ladders within the budget (s of computation). `entries` are (ladder, value, method); an
        empty method stands for all. Returns the cells, including cells of the journal, and the reasons by name for
        cells that were left out. Each new cell is written to the journal."""
        result: list[Cell] = []
        ladders = dict.fromkeys(ladder for ladder, _, _ in entries)
        left_out = {ladder.name: why for ladder in ladders if (why := ladder.applies(self.subject))}
        known = {row.name: methods_of(row, self.subject, methods) for row in ladders if row.name not in left_out}
        plan = [
            (ladder, value, method)
            for ladder, value, settings in entries
            if ladder.name in known
            for method in ([settings] if settings else known[ladder.name])
        ]
        began = time.perf_counter()
        known_cells = {cell.name: cell for cell in journal.rows}
        for number, (ladder, value, method) in enumerate(plan):
            if progress is not None:
                progress(number, len(plan), f"{ladder.name} {value:g} {method}")
            key = f"{ladder.name}:{value:.9g}:{method}"
            if key in known_cells:
                result.append(known_cells[key])
            elif time.perf_counter() - began - self.runner.compiling > budget:
                left_out[key] = "the budget is spent"
            else:
                cell = self.cell(ladder, value, method)
                journal.append(dataclasses.asdict(cell))
                result.append(cell)
        return result, left_out

    def cell(self, ladder: Ladder, value: float, method: str) -> Cell:
        """Run the scene at one value of a ladder with one method in the separate process, and return the judged cell. A
        failure is confirmed in a fresh process."""
        if ladder.against == EQUATIONS:
            return self._equations(ladder, value, method)
        conditions = ladder.conditions(self.subject, value)
        self.subject.model(conditions.model)  # a model that cannot be built raises here
        request = Request(conditions, method)
        while True:
            ended, used = self.runner.execute(request, self.limit), self.runner.used
            result = self._judge(ladder, value, method, conditions, ended)
            if result.verdict != FAILS or not used:
                return result
            self.runner.close()  # earlier runs of the process must not be the reason

    def _judge(self, ladder: Ladder, value: float, method: str, conditions: RunConditions, ended: RunEnding) -> Cell:
        error, by = None, ""
        if ended.how == REACHED and ended.finite and ended.arrays is not None:
            held = self._reference(ladder, conditions, method)
            by = held.by
            if held.arrays is not None:
                epsilon = float(np.finfo(np.float32 if conditions.model == SINGLE else np.float64).eps)
                error = difference(self.subject, ended.arrays, held.arrays, ladder.bound, epsilon)
        result = verdict(ended, None if error is None else error.worst, ladder.bound)
        q, v = (None, None) if error is None else error
        return Cell(ladder.name, value, method, result, q, v, ladder.bound, ended.said, by, ended.seconds)

    def _equations(self, ladder: Ladder, value: float, method: str) -> Cell:
        structure = self.structure
        began = time.perf_counter()
        ended, excess = structure.verdict_after_change(value)
        if ended.how != REACHED:
            error, result = None, verdict(ended, None, ladder.bound)
        else:  # other equations are not a matter of degree
            error, result = excess * ladder.bound, HOLDS if excess <= 1.0 else FAILS
        took = time.perf_counter() - began
        return Cell(ladder.name, value, method, result, error, None, ladder.bound, ended.said, ladder.against, took)

    def _reference(self, ladder: Ladder, conditions: RunConditions, method: str) -> ExpectedResult:
        if ladder.against == SAME:
            key = f"same {method}"
            if key not in self.references:
                own_conditions = self.subject.conditions(model=FACTORS)
                ended = self.runner.execute(Request(own_conditions, method, {"error_estimate": False}), self.limit)
                arrays = dict(ended.arrays) if ended.how == REACHED and ended.arrays is not None else None
                self.references[key] = ExpectedResult(f"{method}, the scene as it is", arrays, 0.0)
            return self.references[key]
        if conditions.model == SINGLE:  # A reference in single precision would count its rounding as exact
            conditions = conditions.vary(model=OWN)
        key = _key(conditions.vary(given={}))
        if key not in self.references:
            self.references[key] = reference(self.subject, conditions, self.runner.execute)
        return self.references[key]


def _key(conditions: RunConditions) -> str:
    return json.dumps(dataclasses.asdict(conditions), default=lambda array: array.tolist(), sort_keys=True)
