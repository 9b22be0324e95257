"""Solution: the result of a simulation and its outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults, UnknownAttribute, checked_calls, unknown_attribute
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import shown
from eomgen.base.rounding import WRITTEN
from eomgen.base.verb_methods import attach_methods, attribute_of_others
from eomgen.base.verbs import others
from eomgen.compiled.arguments import number_of
from eomgen.compiled.beams import SectionLoads
from eomgen.compiled.coordinates import StateArrays
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.results.dense_output import Rows, largest_errors, state_at
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.events import NO_EVENTS, Events
from eomgen.results.finding import Finding
from eomgen.results.poses import BodyPoses, PosesAndScenery
from eomgen.results.recorded import DeferredEvaluator, ModelOfRun, html, model_of
from eomgen.results.solution_files import (
    STATES,
    column_named,
    columns_of,
    read_all,
    to_pandas,
    to_xarray,
    units_of,
    write_all,
    write_columns,
    write_matlab,
    write_parquet,
)
from eomgen.system.description import component_names

if TYPE_CHECKING:
    import pandas
    import xarray

    from eomgen.products.solution_methods import SolutionMethods
else:
    SolutionMethods = object


#: The attributes that may be evaluated later, with the kinds of results by name.
_LATER = {
    "outputs": "output",
    "energy": "energy",
    "stats": "statistic",
    "metadata": "entry",
    **dict.fromkeys(("findings", "message", "success", "error")),
}


#: Names that other tools give to arguments, and calls in their place.
_MEANT = {
    **dict.fromkeys(("format", "fmt"), 'save("run.csv"), by the ending of the path (.npz, .csv or .mat)'),
    **dict.fromkeys(("fps", "frames", "interval", "speed"), "animate(path), whose page has its own control of speed"),
}


@checked_calls('eomgen.Solution.load("run.npz"), or the result of model.simulate', **_MEANT)
@dataclass(frozen=True, repr=False, eq=False)
class Solution(SolutionMethods):
    """States, outputs and energies at the recorded times.

    Outputs, energies, the judgement of the run (``findings``, ``success``, ``message``) and the error estimate of a run
    of ``simulate`` are evaluated on the first request.

    Attributes
    ----------
    t : (nt,) s
    q : (nt, nq); quaternions (w, x, y, z)
    v, a : (nt, nv); velocities (body axes, angular first) and their time derivatives
    z : (nt, nz); internal states
    multipliers : (nt, number of constraints)
    outputs : name -> (nt,) or (nt, size)
    energy : ``kinetic``, ``potential``, ``total`` (J), ``power``, ``base_power`` (W) -> (nt,); empty without the term
    stats : counts of the stepper, wall time in s, ``energy_error``: imbalance of energies, if
        known
    findings : results of the checks of the run, worded in ``message``; ``docs/python.md`` lists the checks
    success : whether no finding is a failure; ``message`` gives reason, time and remedy
    metadata : scene, version, method, step, parameters, names and units of components
    model : the model with the run's inputs and parameters; None if the model is not at hand, see ``Model.attach``
    error : estimated discretisation error of states, multipliers and outputs
    events : events at the roots of the scene's functions; empty without any
    """

    t: Array
    q: Array
    v: Array
    a: Array
    z: Array
    multipliers: Array
    outputs: Mapping[str, Array] = field(default_factory=dict)
    energy: Mapping[str, Array] = field(default_factory=dict)
    stats: Mapping[str, Any] = field(default_factory=dict)
    message: str = field(default_factory=str)  # factories, so that the class has no attribute in the way of _LATER
    success: bool = field(default_factory=lambda: True)
    findings: tuple[Finding, ...] = field(default_factory=tuple)
    interrupted: bool = False
    metadata: Mapping[str, Any] = field(default_factory=dict)
    model: ModelOfRun | None = None
    error: ErrorEstimate = field(default_factory=lambda: ErrorEstimate.missing("no estimate was made"))
    events: Events = field(default_factory=lambda: NO_EVENTS)

    def __post_init__(self) -> None:
        if self.events is None:  # as of files
            object.__setattr__(self, "events", NO_EVENTS)
        for name, kind in _LATER.items():
            if kind:
                object.__setattr__(self, name, NamedResults(kind, getattr(self, name)))

    if not TYPE_CHECKING:  # a type checker knows the attributes without this method

        def __getattr__(self, name: str) -> object:
            known = vars(self)
            if name not in _LATER or "_evaluated" not in known:
                return attribute_of_others(Solution, self, name, _MEANT, lambda: self._unknown(name))
            value = getattr(known["_evaluated"], name)
            known[name] = NamedResults(_LATER[name], value) if _LATER[name] else value
            if known.keys() >= _LATER.keys():
                del known["_evaluated"]
            return known[name]

    def __dir__(self) -> list[str]:
        return list({*super().__dir__(), *_LATER, *(name for owner, name in others().methods if owner == "Solution")})

    def _unknown(self, name: str) -> NoReturn:
        """Raise the error for an attribute `name` that a solution does not have; for an output's name, its hint is
        ``["name"]``."""
        there = not name.startswith("_") and vars(self).keys() & {"metadata", "_evaluated"}
        named: Mapping[str, Any] = self.metadata if there else {}
        if name in named.get("outputs", ()):
            hint = f'["{name}"] in place of .{name}'
            raise UnknownAttribute(Problem("", f"a Solution has no {shown(name)} [E1292]", hint))
        raise unknown_attribute(self, name)

    def __repr__(self) -> str:
        return f"<Solution of {self.metadata.get('scene', 'a scene')}: {len(self.t)} rows; {self.message}>"

    def _repr_html_(self) -> str:
        return html(self)

    def __getstate__(self) -> dict[str, Any]:
        """Return the data for another process: all that ``save`` keeps, with poses, but not the connection to the
        model."""
        self._poses_or_none()
        self._at_once()
        return {**vars(self), "inputs": self.inputs, "model": None}

    @classmethod
    def later(cls, recorded: Mapping[str, Any], evaluated: DeferredEvaluator, *, at_once: bool = False) -> Solution:
        """Return the solution of a run.

        Parameters
        ----------
        recorded : mapping
            States, ``interrupted``, ``events`` and ``model``.
        evaluated : evaluates the remaining attributes
        at_once : bool
            Whether ``evaluated`` is called now, since a caller's functions were called in the run: such functions may
            change later.

        Returns
        -------
        Solution
        """
        solution = cls.__new__(cls)
        vars(solution).update(recorded, _evaluated=evaluated)
        if recorded["events"] is None:
            vars(solution)["events"] = NO_EVENTS
        if at_once:
            solution._at_once()
        return solution

    def _at_once(self) -> None:
        for name in _LATER:
            getattr(self, name)

    @cached_property
    def inputs(self) -> Mapping[str, Array]:
        """The inputs at the rows, name -> (nt,): the caller's and the scene's own.

        Evaluated when first asked for; ``save`` keeps the inputs.
        """
        return NamedResults("input", {} if self.model is None else self.model.inputs(self.t))

    @cached_property
    def poses_and_scenery(self) -> PosesAndScenery:
        """Poses and scenery together; see ``poses``."""
        if self.model is None:
            fault = "it was stored without poses of bodies, so it cannot be drawn [E1293]"
            hint = "eomgen simulate, or model.simulate(...).save, with a model that has the term poses"
            raise UsageError(Problem("solution", fault, hint))
        return self.model.poses_and_scenery(self.t, self.q)

    @property
    def poses(self) -> Mapping[str, Array]:
        """Pose of each body at all times: name -> (nt, 7), quaternion (body to world axes) and position in the world.

        The name ``base`` has the base's pose, if the base moves. Evaluated by the compiled model on the first request;
        the term ``poses`` is compiled then if the model was built without the term.

        Raises
        ------
        UsageError
            The file was written without poses; a name that no body has (the error is a KeyError, too).
        """
        return BodyPoses(*self.poses_and_scenery)

    @cached_property
    def section_loads(self) -> Mapping[str, SectionLoads]:
        """Strains, moments and forces along each geometrically exact beam at all times, by name; (nt, n, 3) each.

        Evaluated by the compiled model when first asked for, and kept by ``save`` from then on.

        Raises
        ------
        UsageError
            The scene has no geometrically exact beam; the file was written without section loads.
        """
        if self.model is None:
            fault = "it was stored without the loads of sections [E1294]"
            hint = "model.attach(solution).section_loads, or solution.section_loads before save"
            raise UsageError(Problem("solution", fault, hint))
        return self.model.section_loads(StateArrays(self.t, self.q, self.v, self.a, self.z), self.multipliers)

    def plot(self, *names: str | Sequence[str], axes: object = None, over: str | None = None) -> list[Any]:
        """Draw curves over time, or over another column.

        Energies and positions whose changes are relatively small are drawn as changes from the start, as labels say.

        Parameters
        ----------
        *names : str, or lists of str
            ``coordinates`` (or ``q``), ``velocities`` (``v``), ``accelerations`` (``a``), ``states`` (``z``),
            ``inputs`` (``u``), ``outputs``, ``energy``; or columns by name: ``"q.hinge"``, ``"tip"``, ``"tip[0]"``,
            ``"total"``. The outputs, or else the coordinates, if none is given; over an output ``fl_travel`` of several
            alike, only outputs that begin with ``fl_``.
        axes : matplotlib Axes, or several
            Axes to draw on, one for each panel; a new figure of pyplot, which is not shown, if none are given.
        over : str
            Column for the horizontal axis in place of the time: ``plot("toe", "camber", over="travel")``.

        Returns
        -------
        list of matplotlib Axes
            One for each panel of like quantities.

        Raises
        ------
        UsageError
            A name that is none of a curve, or several for ``over``; another number of axes than of panels; more than 24
            panels in a new figure.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> axes = model.simulate(0.1, 1e-3).plot("q", "tip")
        >>> len(axes)
        2
        """
        from eomgen.results.plots import plot  # noqa: PLC0415  # for pictures

        each = [name for item in names for name in ([item] if isinstance(item, str) or not np.iterable(item) else item)]
        return plot(self, each, axes, over)

    def save(self, path: str | Path) -> Path:
        """Write the solution, all data but the model as ``.npz``, or the columns as ``.csv``, ``.mat`` or ``.parquet``.

        An ``.npz`` holds the error estimate, whose runs are made now if they have not been, and the poses of the
        bodies, if the model was built with poses or a caller asked for the poses; section loads if evaluated. A
        ``.csv`` has no units. A ``.mat`` (MATLAB's version 5) holds ``t``, ``q``, ``v``, ``a``, ``z``, ``multipliers``,
        the structs ``inputs``, ``outputs``, ``energy`` and, with events in the scene, ``events``, and ``names``,
        ``units``, ``scene`` and ``message``. A ``.parquet`` holds ``columns()``, with units as metadata; the file is
        written by the package ``pyarrow``.

        Parameters
        ----------
        path : str or Path
            Ends in ``.npz``, ``.csv``, ``.mat`` or ``.parquet``; an existing file is replaced.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        UsageError
            Another suffix; ``pyarrow`` is not installed.
        FileError
            The disk is full or the path cannot be written; a missing folder is not made.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> model.simulate(0.1, 1e-3).save("run.npz").name
        'run.npz'
        """
        path, tables = Path(path), {".csv": write_columns, ".mat": write_matlab, ".parquet": write_parquet}
        if path.suffix == ".npz":
            _ = self.error  # before there are poses: its runs take most memory
            write_all(self, self._poses_or_none(), vars(self).get("section_loads", {}), path)
        elif path.suffix in tables:
            tables[path.suffix](self, path)
        else:
            kind = path.suffix or "a file without a suffix"
            fault = f"a solution cannot be saved as {kind} [E1295]"
            raise UsageError(Problem(str(path), fault, ".npz, .csv, .mat or .parquet"))
        return path

    @classmethod
    def load(cls, path: str | Path) -> Solution:
        """Read a solution from an ``.npz`` file.

        Parameters
        ----------
        path : str or Path
            File of ``save``.

        Returns
        -------
        Solution
            Without a model, which ``Model.attach`` puts back for evaluations such as ``outputs_at``; with poses and
            section loads as far as the file holds them.

        Raises
        ------
        FileError
            The file cannot be read or is not a solution.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> path = model.simulate(0.1, 1e-3).save("run.npz")
        >>> eomgen.Solution.load(path).q.shape
        (101, 2)
        """
        attributes, inputs, seen, loads = read_all(Path(path))
        solution = cls(**attributes)
        vars(solution)["inputs"] = NamedResults("input", inputs)
        if loads:
            vars(solution)["section_loads"] = NamedResults("beam", loads)
        return solution if seen is None else solution._with(seen)

    def at(self, t: ArrayLike) -> StateArrays:
        """Return the state at any time within the solution.

        q lies on the manifold and is smooth; at the rows, v and a are the recorded ones. Between rows ``rk4`` keeps its
        order 4 and generalized-alpha its order 2, in the step if every step is recorded, else in the spacing of the
        rows; ``taylor`` and methods that choose their steps take a step from the row before, to the tolerance of the
        run, unless the solution comes from a file or from another process; ``interpolation_error`` measures the error
        between rows, ``outputs_at`` gives the outputs at such times.

        Parameters
        ----------
        t : array_like
            Times (...) within the solution, s.

        Returns
        -------
        State
            ``t`` (...), ``q`` (..., nq), ``v`` and ``a`` (..., nv), ``z`` (..., nz).

        Raises
        ------
        UsageError
            Times outside the solution, or not finite; half a turn or more between two rows that are interpolated; a
            single row; a solution without the groups of its coordinates, made by hand.
        NumericalError
            A step from the row before cannot be taken.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.simulate(0.1, 1e-3)
        >>> run.at([0.01, 0.0255]).q.shape
        (2, 2)
        """
        if isinstance(t, str):
            t = number_of("t", t)
        return state_at(self._rows, self.metadata, t, self.model.between if self.model else None)

    def outputs_at(self, t: ArrayLike) -> dict[str, Array]:
        """Return the outputs at any time within the solution, from the states of ``at``.

        Internal states, inputs and parameters are the run's.

        Parameters
        ----------
        t : array_like
            Times (...) within the solution, s.

        Returns
        -------
        dict
            Arrays by output, (...) or (..., size), in the units of the outputs.

        Raises
        ------
        UsageError
            Times outside the solution, or half a turn or more between two rows; or the model is not at hand, as the
            solution comes from a file or from another process.
            ``Model.attach`` gives the model back.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> run = model.simulate(0.1, 1e-3)
        >>> run.outputs_at(0.0255)["tip"].round(4)
        array([ 0.5547,  0.    , -0.681 ])
        """
        return model_of(self, "outputs_at", "the outputs between rows need").outputs(self.at(t))

    def interpolation_error(self) -> dict[str, float]:
        """Return the largest error of ``at`` across three spacings of rows: q (an increment), ``v``, ``a``, ``z``.

        That exceeds the error between rows, by 3^3 to 3^6 if rows follow the motion.

        Returns
        -------
        dict
            Name of the array to largest error, in the unit of the array.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").simulate(0.1, 1e-3)
        >>> bool(run.interpolation_error()["q"] < 1e-8)
        True
        """
        return largest_errors(self._rows, self.metadata)

    @property
    def _rows(self) -> Rows:
        return Rows(self.t, self.q, self.v, self.a, self.z)

    def followed_by(self, later: Solution) -> Solution:
        """Return both parts of a run as one solution: this part up to the beginning of the later part, then the later
        part.

        Parameters
        ----------
        later : Solution
            Of ``model.resume``, from the checkpoint of this run on.

        Returns
        -------
        Solution
            With the rows of a run in one piece, and the events of both parts; without an error estimate. Outputs and
            energies that a part was recorded without are not a number at the rows of that part. Findings,
            ``success``, ``message``, ``interrupted``, metadata and model are the later part's; so are ``stats``, with
            the sum of the wall times.

        Raises
        ------
        UsageError
            The parts are not of one run, there is a gap between the parts, the later part begins as early as this part,
            or begins at another state, which is not checked if the scene has events, or without a row at that time.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> first = model.simulate(0.1, 1e-3, checkpoint="run.ckpt")
        >>> second = model.resume("run.ckpt", 0.2)
        >>> float(first.followed_by(second).t[-1])
        0.2
        """
        self._check_end(later)
        step, every = float(later.metadata["step"]), int(later.metadata["record_every"])
        on_grid = round((later.t[0] - float(later.metadata["t_start"])) / step) % every == 0
        head, tail = np.flatnonzero(self.t < later.t[0]), np.arange(min(not on_grid, len(later.t) - 1), len(later.t))

        def join(first: Array, second: Array) -> Array:  # the only row of an absent array is repeated
            return np.concatenate([first.take(head, axis=0, mode="clip"), second.take(tail, axis=0, mode="clip")])

        def union(group: str) -> dict[str, Any]:
            first, second = getattr(self, group), getattr(later, group)
            absent = {name: np.full((1, *array.shape[1:]), np.nan) for name, array in {**first, **second}.items()}
            return {name: join(first.get(name, row), second.get(name, row)) for name, row in absent.items()}

        events, metadata = later.events, later.metadata
        if events.counts and self.events.counts:
            events = self.events.followed_by(events, float(later.t[0]))
            metadata = {**metadata, "events": events.to_dict()}
        states: dict[str, Any] = {name: join(getattr(self, name), getattr(later, name)) for name in ("t", *STATES)}
        whole = replace(
            later,
            events=events,
            metadata=metadata,
            **states,
            stats={**later.stats, "wall_time": sum(part.stats.get("wall_time", 0.0) for part in (self, later))},
            outputs=union("outputs"),
            energy=union("energy"),
            error=ErrorEstimate.missing("the estimate of each part begins where the part begins"),
        )
        vars(whole)["inputs"] = NamedResults("input", union("inputs"))
        if "section_loads" in vars(later) and (self.model or "section_loads" in vars(self)):
            loads = {}
            for beam in later.section_loads:
                (x, *first), (_, *second) = (part.section_loads[beam].named().values() for part in (self, later))
                loads[beam] = SectionLoads(x, *map(join, first, second))
            vars(whole)["section_loads"] = NamedResults("beam", loads)
        if not later.model and later._poses_or_none() and self._poses_or_none():
            vars(whole)["poses_and_scenery"] = later.poses_and_scenery._replace(poses=union("poses"))
        return whole

    def _check_end(self, later: Solution) -> None:
        """Raise UsageError if `later` does not go on from the end of this solution: it is of another run, it begins
        after a gap or as early, or its first q, v or z differs from the row at its time. The last is not checked
        without such a row, or with events."""
        if not isinstance(later, Solution):
            fault = f"a solution is needed, not {type(later).__name__} [E2170]"
            raise UsageError(Problem("followed_by", fault, "first.followed_by(second), second of model.resume"))
        same = ("scene", "fingerprint", "method", "settings", "parameters", "t_start", "record_every")
        unequal = [name for name in same if self.metadata.get(name) != later.metadata.get(name)]
        if unequal or not len(later.t) or later.t[0] > self.t[-1]:
            fault = f"these are not parts of one run: {', '.join(unequal)} differ [E1297]"
            if not unequal:
                begin = f"{later.t[0]:.9g} s" if len(later.t) else "the later part, which has no rows"
                fault = f"there is a gap between the parts, from {self.t[-1]:.9g} s to {begin} [E1298]"
            raise UsageError(Problem("followed_by", fault, "the solution of the run that wrote the checkpoint"))
        begins = float(later.t[0])
        if len(self.t) > 1 and begins <= self.t[0]:
            begin = f"the second part begins at t = {begins:.9g} s, as the first part does"
            fault = f"{begin}, and does not continue that part [E1299]"
            raise UsageError(Problem("followed_by", fault, "first.followed_by(second), second of model.resume"))
        near = np.flatnonzero(np.abs(self.t - begins) <= 1e-9 * float(later.metadata["step"]))
        if self.events.counts or not len(near):  # an event may act at that time, or no row was recorded
            return
        for name, first, second in (("q", self.q, later.q), ("v", self.v, later.v), ("z", self.z, later.z)):
            off = np.abs(first[near[-1]] - second[0]) > WRITTEN * (1.0 + np.abs(second[0]))
            if np.any(off):
                names = later.metadata.get("names", {}).get(name) or component_names("", name, len(off))
                k = int(np.argmax(off))
                values = f"{first[near[-1], k]:.6g} in the first part and {second[0, k]:.6g} in the second"
                fault = f"at t = {begins:.9g} s {names[k]} is {values}, which does not go on from it [E1300]"
                hint = "the solution of model.resume from this run's checkpoint"
                raise UsageError(Problem("followed_by", fault, hint))

    def columns(self) -> dict[str, Array]:
        """Return all columns (nt,) by name: ``t``, ``q.hinge``, ``v.ball[2]``, ``input.motor``, ``output.tip[0]``,
        ``energy.total``.

        Returns
        -------
        dict
            Name to array (nt,), SI units.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").simulate(0.1, 1e-3)
        >>> list(run.columns())[:5]
        ['t', 'q.shoulder', 'q.elbow', 'v.shoulder', 'v.elbow']
        """
        return columns_of(self)

    def __len__(self) -> int:
        """Return the number of recorded times."""
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        """Return a column (nt,) by name, ``solution["q.hinge"]`` or ``solution["tip[2]"]``; an output by the output's
        name, (nt,) or (nt, size).

        Raises
        ------
        UsageError
            No column or output of that name (the error is a KeyError, too).
        """
        return column_named(self, name)

    def units(self) -> dict[str, str]:
        """Return the units of the columns by name: ``s``, ``rad``, ``m/s``, ``N``; ``1`` for pure numbers.

        Multipliers have no unit of their own: forces or moments by the unit of the row.

        Returns
        -------
        dict
            Name of the column to unit.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").simulate(0.1, 1e-3)
        >>> units = run.units()
        >>> units["t"], units["energy.total"]
        ('s', 'J')
        """
        return units_of(self)

    def to_pandas(self) -> pandas.DataFrame:
        """Return all columns as a pandas DataFrame over ``t``; ``attrs`` of the frame have ``units``, ``scene`` and
        ``message``.

        Returns
        -------
        pandas.DataFrame
            A row for each recorded time, with the times as index.

        Raises
        ------
        UsageError
            pandas is not installed.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").simulate(0.1, 1e-3)
        >>> frame = run.to_pandas()
        >>> len(frame), frame.attrs["units"]["energy.total"]
        (101, 'J')
        """
        return to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """Return the solution as an xarray Dataset over ``t``, each variable with ``units``.

        ``q``, ``v``, ``a``, ``z`` and ``multipliers`` have a second dimension with the names of the components; each
        output and energy is a variable.

        Returns
        -------
        xarray.Dataset
            With the dimension ``t`` and the names of components as coordinates.

        Raises
        ------
        UsageError
            xarray is not installed.

        Examples
        --------
        >>> run = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml").simulate(0.1, 1e-3)
        >>> run.to_xarray()["q"].dims
        ('t', 'q_component')
        """
        return to_xarray(self)

    def with_model(self, model: ModelOfRun) -> Solution:
        """Return a copy of this solution that holds the model of its run, with inputs and poses as far as they are
        known; all that is evaluated on request, the error estimate included, is evaluated now. Callers have
        ``Model.attach``, which makes the argument from a model and calls this method.

        Parameters
        ----------
        model : ModelOfRun
            With the inputs, parameters and steps of the run; not checked.

        Returns
        -------
        Solution
            The rows are shared, not copied.
        """
        whole, known = replace(self, model=model), vars(self).get("poses_and_scenery")
        vars(whole)["inputs"] = self.inputs
        return whole if known is None else whole._with(known)

    def _with(self, known: PosesAndScenery) -> Solution:
        """Return this solution, whose poses are known."""
        vars(self)["poses_and_scenery"] = known
        return self

    def _poses_or_none(self) -> PosesAndScenery | None:
        """Return poses and scenery if known or available without compilation; None otherwise, or if their evaluation
        fails."""
        if "poses_and_scenery" not in vars(self) and not (self.model is not None and self.model.has_poses):
            return None
        try:
            return self.poses_and_scenery
        except EomgenError:  # a run without a plot can still be kept
            return None


attach_methods(Solution, _MEANT)
