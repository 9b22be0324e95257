"""A work-precision study: all configurations of a scene over their steps or tolerances, coarse ones first; with a
journal of points and reference in a folder, from which the study resumes."""

from __future__ import annotations

import hashlib
import json
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from eomgen.base.arrays import count_of
from eomgen.base.calls import names_of
from eomgen.base.data import dataclass, field, replace
from eomgen.base.files import read_arrays, write_arrays
from eomgen.base.journal import Journal
from eomgen.base.json_text import finite
from eomgen.base.messages import counted
from eomgen.base.progress import duration
from eomgen.base.version import __version__
from eomgen.compiled.arguments import number_of
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.products.studies.defaults import MEASURE, TRADEOFF_BUDGET, TRADEOFF_REPEATS
from eomgen.products.studies.seconds import study_seconds
from eomgen.products.studies.work_precision.axes import (
    TOLERANCE,
    Candidate,
    Configuration,
    candidates,
    checked_axes,
    reason,
    refinements,
)
from eomgen.products.studies.work_precision.formulations import JOINT, Formulations, formulations
from eomgen.products.studies.work_precision.observation import (
    STATE,
    ErrorSize,
    check_measure,
    check_output,
    with_arrays,
)
from eomgen.products.studies.work_precision.reference import RunReference, reference
from eomgen.products.studies.work_precision.result import NOT_BUILT, WRONG, Point, Tradeoff
from eomgen.products.studies.work_precision.running import (
    REACHED,
    REFUSED,
    ComparedRun,
    Grid,
    Runner,
    ladder_grid,
    machine,
    measure_seconds,
    per_coarsest,
)
from eomgen.simulation.accuracy.motion_size import RunNames
from eomgen.system.description import Simulation

_POINTS, _REFERENCE = "points.jsonl", "reference.npz"


def identity(
    formulations: Formulations, grid: Grid, parameters: Mapping[str, float] | None, inputs: Mapping[str, Any] | None
) -> str:
    """Return a JSON text that identifies the points of one study: scenes, grid of times, parameters, inputs and
    version. Points are used again only if the text is equal; it differs for other scenes, times or parameters."""
    digests = b"".join(scene.digest for scene in formulations.scenes.values())
    scene_values = {
        "scene": hashlib.sha256(digests).hexdigest(),
        "grid": [grid.start, grid.row, grid.rows, grid.coarsest, grid.recorded],
        "parameters": dict(parameters or {}),
        "inputs": {name: repr(value) for name, value in (inputs or {}).items()},
        "version": __version__,
    }
    return json.dumps(scene_values, sort_keys=True)


class PointJournal:
    """Journal in a folder of the finished points and the reference of a study, from which the study can be resumed.

    ``points`` maps a key (configuration, kind and value) to each point read from the folder.

    Parameters
    ----------
    folder : path or None
        None: no file.
    described : str
        As of ``identity``.
    resume : bool
        Whether to go on with a study that the folder contains.

    Raises
    ------
    FileError
        The folder contains a study without ``resume``, or another study.
    """

    def __init__(self, folder: Path | None, described: str, *, resume: bool) -> None:
        self._folder = folder
        self._lines = Journal(
            folder,
            _POINTS,
            "points of a study",
            identity=described,
            others="another scene, other times or other parameters",
            row_of=lambda line: (str(line["key"]), Point.from_dict(line["point"])),
            resume=resume,
        )
        self.points = dict(self._lines.rows)

    def keep(self, key: str, point: Point) -> None:
        """Write a point."""
        self._lines.append({"key": key, "point": finite(point.to_dict())})

    def keep_reference(self, held: RunReference) -> None:
        """Write the reference (observation, methods, uncertainty) to ``reference.npz``; no file without a folder."""
        if self._folder is None:
            return
        observation = held.observation
        metadata = {
            "factors": [[f.group, f.name, f.q_start, f.q_size, f.v_start, f.v_size] for f in observation.factors],
            "components": observation.components._replace(factors=())._asdict(),
            "rows": list(observation.rows),
            **held.to_dict(),
        }
        write_arrays(self._folder / _REFERENCE, observation.arrays, metadata)

    def reference(self) -> RunReference | None:
        """Return the reference read from ``reference.npz`` of the folder; None without a folder or without this
        file."""
        if self._folder is None or not (self._folder / _REFERENCE).exists():
            return None
        arrays, data = read_arrays(self._folder / _REFERENCE, "reference of a study", "another folder")
        factors = tuple(Factor(*factor) for factor in data["factors"])
        names: dict[str, Any] = dict(data["components"])
        names |= {name: tuple(part) for name, part in names.items() if name != "outputs"}
        observation = with_arrays(arrays, RunNames(**{**names, "factors": factors}), tuple(data["rows"]))
        uncertainty = {name: ErrorSize(**size) for name, size in data["uncertainty"].items()}
        return RunReference(observation, data["by"], data["held against"], uncertainty)


#: Seconds that builds may take besides the budget's computation, if that is smaller.
LEAST_BUILDING = 30.0
#: Called with points done and points known, and with a word on the present work.
Progress = Callable[[int, int, str], None]


@dataclass
class _Ladder:
    """A configuration with the steps or tolerances at which to run it, from coarse to fine.

    Attributes
    ----------
    order : of the method
    kind : ``step`` or ``tolerance``
    values : numbers of steps in the coarsest step, or tolerances
    next : number of the next value to run
    errors : of the points so far
    last_seconds : computation of the last point, s
    refusals : successive runs that were refused
    """

    configuration: Configuration
    order: int
    kind: str
    values: tuple[float, ...]
    next: int = 0
    errors: list[float] = field(default_factory=list)
    last_seconds: float = 0.0
    refusals: int = 0

    @property
    def open(self) -> bool:
        return self.next < len(self.values)

    def end(self) -> None:
        self.values = self.values[: self.next]


def tradeoff(
    scene: Any,
    *,
    outputs: Sequence[str] = (),
    measure: str = MEASURE,
    axes: Sequence[str] = (),
    methods: Sequence[str] = (),
    steps: Sequence[float] = (),
    t_end: float | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    budget: float = TRADEOFF_BUDGET,
    repeats: int = TRADEOFF_REPEATS,
    folder: str | Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    announce: Callable[[str], None] | None = None,
    **reading: Any,
) -> Tradeoff:
    """Measure speed against accuracy of a scene: time and error of all configurations.

    Errors are against a reference: two runs of different methods, or of one method at full and half accuracy, whose
    difference is its uncertainty. The scene's own configuration always runs. Runs that are refused, stop early or take
    longer than a tenth of the budget (1 s at least) are ``points`` without time, in ``Tradeoff.failures``. Failed
    builds, runs not begun for lack of time, and named methods that cannot step the scene are in ``Tradeoff.left_out``
    with the reason; methods that are not named may be left out silently.

    Parameters
    ----------
    scene : str, Path, mapping, Scene or document
        Scene, or the document of another front end.
    outputs : sequence of str
        Names of the scene's outputs, or ``q``, ``v``, ``z``, ``state`` (largest error of these three),
        ``multipliers``. The front is of the first, ``state`` by default; further names are only checked, and points
        have the errors of all quantities.
    measure : str
        Of the error over time: ``largest``, ``rms`` or ``final``.
    axes : sequence of str
        Varied axes: ``formulation``, ``method``, ``parameters``, ``resolution``, ``policy``, ``arithmetic``,
        ``profile``, ``fidelity``; all but ``fidelity`` by default. ``policy``, ``arithmetic`` and ``profile`` are
        varied singly, of the three configurations with most points on the front. Absolute coordinates of a scene with
        joint coordinates without constraints are studied if ``formulation`` is named.
    methods : sequence of str
        Methods to try; by default all that make a difference to the scene, the scene's own if ``axes`` lack ``method``.
    steps : sequence of float
        S; by default from up to 64 times the scene's, halved until errors are the reference's.
    t_end : float
        S; the scene's duration by default. Runs end with the last whole coarsest step before this time.
    parameters, inputs : mapping
        Tunable parameters and inputs by name, as of ``simulate``; the scene's by default.
    budget : float
        Seconds of computation, without references, which take about a quarter as many; builds may take as many again,
        or 30. Configurations not built then are left out.
    repeats : int
        Number of measured times near the front, of which the median is taken.
    folder : path
        Folder for finished points; see also ``Tradeoff.save``.
    resume : bool
        Go on with the points of the folder.
    progress : callable
        Called with points done, points known, and a word on the present work.
    announce : callable
        Called before the runs with how many methods are to be built.
    **reading
        As of ``eomgen.load``.

    Returns
    -------
    Tradeoff
        Times and errors of all runs, with the front.

    Raises
    ------
    UsageError
        An unknown axis, output, method or measure; steps that do not divide the coarsest; a budget, ``repeats``, step
        or ``t_end`` out of range.
    ModelError
        No method runs on the scene.
    NumericalError
        There is no reference: all runs of methods fail, the two runs differ by more than 1 % of the motion, all
        bodies rest, or the two runs do not have the first output in common.
    FileError
        The folder contains the points of another study (scene, times, parameters, inputs or version), or of this study
        without ``resume``.
    """
    began = time.perf_counter()
    chosen, named = checked_axes(axes), names_of("methods", "methods", methods, "rk4")
    check_measure(measure)
    budget, repeats = study_seconds("budget", budget), count_of("repeats", repeats)
    for step in steps:
        if not number_of("steps", step) > 0.0:
            fault = f"steps are positive numbers of seconds, which {step:g} is not [E1143]"
            raise UsageError(Problem("steps", fault, "1e-3"))
    variants = formulations(scene, reading, others="formulation" in chosen, fidelity="fidelity" in chosen)
    defaults = variants.description.simulation
    end = defaults.duration if t_end is None else number_of("t_end", t_end)
    grid = ladder_grid(end, defaults.step, defaults.step * defaults.record_every, steps)
    runner = Runner(variants, grid, parameters, inputs, limit=max(1.0, 0.1 * budget))
    in_coarsest, absolute = per_coarsest(Grid(grid.row * grid.coarsest, 1), steps), "formulation" in axes
    study = _WorkPrecisionStudy(
        runner, defaults, in_coarsest, chosen, named, budget, repeats, progress, announce, absolute
    )
    described = identity(variants, grid, parameters, inputs)
    journal = PointJournal(None if folder is None else Path(folder), described, resume=resume)
    try:
        return study.result(tuple(outputs), measure, journal, began)
    except KeyboardInterrupt as stop:
        if folder is not None:
            stop.add_note(f"{counted(len(study.points), 'run')} are kept in {folder}: --resume goes on with them")
        raise


@dataclass
class _WorkPrecisionStudy:
    """The state of one call of ``tradeoff``: its runner and options, and the points, omissions and seconds so far.

    Attributes
    ----------
    in_coarsest : number of each step in the coarsest
    absolute : whether absolute coordinates of a scene without constraints are asked for
    """

    runner: Runner
    defaults: Simulation
    in_coarsest: tuple[int, ...]
    axes: tuple[str, ...]
    methods: tuple[str, ...]
    budget: float
    repeats: int
    progress: Progress | None
    announce: Callable[[str], None] | None
    absolute: bool
    points: dict[str, Point] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    spent: float = 0.0
    done: int = 0

    @property
    def coarsest(self) -> float:
        """The coarsest step, s."""
        return self.runner.grid.row * self.runner.grid.coarsest

    def result(self, outputs: tuple[str, ...], measure: str, journal: PointJournal, began: float) -> Tradeoff:
        """Run the whole study and return the result: reference, all ladders, variants of the best, and times of the
        front. `outputs` are the quantities of errors, `began` is the start of the call by ``time.perf_counter``. Raises
        NumericalError if the reference has no uncertainty in the first quantity."""
        self.journal = journal
        self.left_out |= self.runner.formulations.refused
        every = self._candidates()
        for name in outputs:
            check_output("outputs", name, self.runner.model(self.runner.formulations.own))
        self.quantity, self.measure = (outputs or (STATE,))[0], measure
        ladders = [self._own(), *self._ladders(every)]
        if self.announce is not None:
            builds = {self.runner.build_name(ladder.configuration) for ladder in ladders} - set(self.runner.compiled)
            runs = f"up to {duration(self.budget)} of runs"
            self.announce(f"methods to build, or to take from the cache: {len(builds)}; then {runs}")
        held = journal.reference()
        if held is None:
            exact = [c for c in every if c.formulation not in self.runner.formulations.simplified]
            held = reference(self.runner, exact, 0.25 * self.budget, self._say)
            journal.keep_reference(held)
        self.reference = held
        if self.quantity not in held.uncertainty:
            fault = f"errors in {self.quantity} is unknown: the two references have no such quantity in common [E1145]"
            raise NumericalError(Problem("reference", fault, "state, or an output of the scene"))
        self.began = time.perf_counter()
        self._sweep(ladders)
        self._sweep(self._refinements())
        self._time_front()
        compiled, took = dict(self.runner.compiled), time.perf_counter() - began
        return replace(self._tradeoff(), machine=machine(), compiled=compiled, seconds=took)

    def _tradeoff(self) -> Tradeoff:
        grid = self.runner.grid
        return Tradeoff(
            self.runner.model(self.runner.formulations.own).name,
            self.quantity,
            self.measure,
            (grid.start, grid.end, grid.rows),
            tuple(self.points.values()),
            self.reference.to_dict(),
            {},
            {},
            dict(self.left_out),
        )

    def _candidates(self) -> tuple[Candidate, ...]:
        """Build the models of all formulations, and return the methods that run on each as candidates. Formulations and
        methods that do not run go to ``left_out`` with the reason. Raises ModelError if none is left, or if the scene's
        own formulation cannot be built."""
        every: list[Candidate] = []
        methods = self.methods if "method" in self.axes else (self.methods or (self.runner.own_method(),))
        scene_formulation = self.runner.formulations.own
        for name in list(self.runner.formulations.scenes):
            is_other = name != scene_formulation and name not in self.runner.formulations.simplified
            constrained = self.absolute or self.runner.model(scene_formulation).multipliers
            if is_other and scene_formulation == JOINT and not constrained:
                self.left_out[name] = "joint coordinates have no constraints; studied with the axis formulation named"
                continue
            self._say(f"building: {name}")
            try:
                model = self.runner.model(name)
            except ModelError as error:
                if name == scene_formulation:
                    raise
                self.left_out[name] = reason(error)
                continue
            every += candidates(name, model, methods, self.left_out)
        if not every:
            why = "; ".join(
                text for name, text in self.left_out.items() if name not in self.runner.formulations.refused
            )
            raise ModelError(Problem("methods", f"no method runs on this scene: {why} [E1128]", "other methods"))
        return tuple(every)

    @property
    def _own_steps(self) -> tuple[int]:
        """Number of the scene's steps in the coarsest."""
        return (max(1, round(self.coarsest / self.defaults.step)),)

    def _own(self) -> _Ladder:
        """Return the scene's own method and step, a ladder of one point."""
        configuration = self.runner.own_configuration()
        return _Ladder(configuration, self.runner.method(configuration).order, "step", self._own_steps)

    def _ladders(self, candidates: Sequence[Candidate]) -> list[_Ladder]:
        ladders = []
        usual = {"rho_inf": self.defaults.rho_inf}
        steps = self.in_coarsest if "resolution" in self.axes else self._own_steps
        for candidate in candidates:
            varied = candidate.configurations() if "parameters" in self.axes else [candidate.configuration(usual)]
            for configuration in varied:
                order = candidate.method.order
                if candidate.tolerances:
                    values = candidate.tolerances if "resolution" in self.axes else candidate.tolerances[-1:]
                    ladders.append(_Ladder(configuration, order, TOLERANCE, values))
                if not candidate.method.chooses_steps:
                    ladders.append(_Ladder(configuration, order, "step", steps))
        return ladders

    def _refinements(self) -> list[_Ladder]:
        """Return ladders with variants of the three configurations with most points on the front. Each variant changes
        one of solver settings, arithmetic and build profile, and has the values of the points on the front."""
        ladders: list[_Ladder] = []
        near: dict[str, list[Point]] = {}
        for point in self._tradeoff().front:
            near.setdefault(point.configuration.key, []).append(point)
        largest = sorted(near.values(), key=len, reverse=True)[:3]
        for members in largest:
            varied = refinements(members[0].configuration, self.axes)
            kind = members[0].kind
            values = [p.value if kind == TOLERANCE else round(self.coarsest / p.value) for p in members]
            values = sorted(values, reverse=kind == TOLERANCE)
            ladders += [_Ladder(changed, members[0].order, kind, tuple(values)) for changed in varied]
        return ladders

    def _sweep(self, ladders: Sequence[_Ladder]) -> None:
        """Run all ladders side by side, one value of each at a time, so that the end of the budget leaves no ladder
        out."""
        for ladder in ladders:
            if not self._prepare(ladder):
                ladder.end()
        while True:
            opened = [ladder for ladder in ladders if ladder.open]
            if not opened:
                return
            for ladder in opened:
                self._take(ladder)
                self._say(ladder.configuration.label, sum(len(ladder.values) - ladder.next for ladder in ladders))

    def _prepare(self, ladder: _Ladder) -> bool:
        self._say(f"building: {ladder.configuration.label}")
        built = sum(self.runner.compiled.values())
        name = self.runner.build_name(ladder.configuration)
        first = name == self.runner.build_name(self._own().configuration)
        if built > max(self.budget, LEAST_BUILDING) and name not in self.runner.compiled and not first:
            self.left_out[ladder.configuration.label] = f"{NOT_BUILT}: builds have taken {built:.3g} s"
            return False
        try:
            self.runner.prepare(ladder.configuration)
        except (ModelError, UsageError) as error:
            self.left_out[ladder.configuration.label] = reason(error)
            return False
        return True

    def _take(self, ladder: _Ladder) -> None:
        """Run the next value of a ladder and add the point. The ladder ends without a run if the value would exceed
        the budget or the time limit, and after the run if the error is small enough or four successive runs were
        refused."""
        value = ladder.values[ladder.next]
        finer = 2.0 if ladder.kind == "step" else 1.5
        expected = finer * ladder.last_seconds
        over = self.spent + expected > self.budget
        if over or expected > self.runner.limit:
            left = len(ladder.values) - ladder.next
            why = "the budget is spent" if over else f"more than {self.runner.limit:.3g} s a run"
            self.left_out[f"{ladder.configuration.label}, {left} finer"] = why
            ladder.end()
            return
        ladder.next += 1
        point = self._point(ladder, value)
        self.done += 1
        ladder.last_seconds = point.took
        error = point.error_of(self.quantity, self.measure)
        ladder.refusals = ladder.refusals + 1 if point.ended == REFUSED else 0
        ladder.errors.append(error)
        if self._fine_enough(ladder) or ladder.refusals > 3:
            ladder.end()

    def _fine_enough(self, ladder: _Ladder) -> bool:
        """Return whether finer points would show the reference's uncertainty, or rounding."""
        floor = max(1e-11, self.reference.bar(self.quantity, self.measure))
        if ladder.errors[-1] <= floor:
            return True
        last = ladder.errors[-3:]
        return len(last) == 3 and last[-1] < 1e-6 and last[1] > 0.7 * last[0] and last[2] > 0.7 * last[1]

    def _point(self, ladder: _Ladder, value: float) -> Point:
        """Return the point of a ladder's configuration at a value, from memory or the journal, or else by a run.
        `value` is a tolerance, or the number of steps in the coarsest step. A new point is written to the journal."""
        shown_value = value if ladder.kind == TOLERANCE else self.coarsest / value
        key = f"{ladder.configuration.key} {ladder.kind} {shown_value!r}"
        if key in self.points:
            return self.points[key]
        if key in self.journal.points:
            self.points[key] = self.journal.points[key]
            return self.points[key]
        began = time.process_time()
        outcome = self._run(ladder.configuration, ladder.kind, shown_value)
        point = self._measure(ladder, shown_value, outcome)
        took = time.process_time() - began
        self.spent += took
        self.points[key] = point = replace(point, took=took)
        self.journal.keep(key, point)
        return point

    def _run(self, configuration: Configuration, kind: str, value: float) -> ComparedRun:
        if kind == TOLERANCE:
            return self.runner.run(configuration, tolerance=value)
        in_coarsest = max(1, round(self.coarsest / value))
        return self.runner.run(configuration, Fraction(in_coarsest, self.runner.grid.coarsest))

    def _measure(self, ladder: _Ladder, value: float, outcome: ComparedRun) -> Point:
        """Return the point of a finished run, with errors against the reference and the median time of repeated runs.
        Errors and times are missing if the run did not reach the end; times are missing if a repeated run fails."""
        point = Point(ladder.configuration, ladder.kind, value, outcome.ended, outcome.said, order=ladder.order)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return replace(point, stats=outcome.stats)
        try:
            taken = measure_seconds(outcome.repeated, 1)  # far from the front as many runs as fit into 0.05 s
            more = math.ceil(0.05 / max(taken[0], 1e-9))
            taken += measure_seconds(outcome.repeated, min(self.repeats, max(3, more)) - 1)
        except NumericalError as error:
            return replace(point, said=str(error), stats=outcome.stats)
        return _with_times(point, taken, error=self.reference.errors_of(outcome.observation), stats=outcome.stats)

    def _time_front(self) -> None:
        """Time points near the front again, with all repetitions of the study; points with as many repetitions stay."""
        front = self._tradeoff().front
        for key, point in list(self.points.items()):
            if point.repeats >= self.repeats or point.seconds is None or self.spent > self.budget:
                continue
            error = point.error_of(self.quantity, self.measure)
            cost = min((p.seconds or 0.0 for p in front if p.error_of(self.quantity, self.measure) <= error), default=0)
            if point.seconds > 1.5 * cost or error > WRONG:
                continue
            began = time.process_time()
            outcome = self._run(point.configuration, point.kind, point.value)
            taken = [] if outcome.repeated is None else measure_seconds(outcome.repeated, self.repeats)
            took = time.process_time() - began
            self.spent += took
            if taken:
                changed = _with_times(point, taken, took=point.took + took)
                self.points[key] = changed
                self.journal.keep(key, changed)

    def _say(self, label: str, left: int = 0) -> None:
        if self.progress is not None:
            self.progress(self.done, self.done + left, label)


def _with_times(point: Point, taken: Sequence[float], **changes: Any) -> Point:
    """Return a point with the seconds of its repeated runs."""
    return replace(point, seconds=statistics.median(taken), least=min(taken), repeats=len(taken), **changes)
