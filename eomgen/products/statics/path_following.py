"""Equilibria of a compiled model along a parameter, by arc length: load paths, with limit points and bifurcations;
linear buckling loads about a preload.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.progress import Progress, show_progress
from eomgen.base.threads import one_thread_of_algebra
from eomgen.compiled.arguments import number_of
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.rest.driven_rest import held_base
from eomgen.compiled.rest.loaded_statics import LoadParameter, check_partials, loaded_statics
from eomgen.compiled.rest.sparse_partials import check_continuous
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.products.statics.critical_points import (
    CriticalPoint,
    ExaminedPoint,
    critical_points,
    examined,
    half_way,
    linear_buckling,
    load_scale,
    lowest_frequency_squared,
)
from eomgen.products.statics.equilibrium_path import Critical, EquilibriumPath
from eomgen.solvers.bordered_newton import (
    Balance,
    Direction,
    LoadedState,
    LoadedStatics,
    correct,
    direction,
)
from eomgen.solvers.equilibrium_path import PathEndError, PathPoint, StepLimits, first_point, follow
from eomgen.solvers.load_steps import by_load_steps

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Sizes, in rad or lengths of the scene, of the first step along a branch, in the order of trials.
_ASIDE = (0.05, 0.1, 0.02, 0.2, 0.005)


def equilibrium_path(
    model: CompiledModel,
    parameter: str,
    to: float,
    start: float = 0.0,
    *,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
    max_step: float = 0.3,
    max_points: int = 500,
    stability: bool = True,
    progress: Progress | bool | None = None,
) -> EquilibriumPath:
    """Return equilibria along a parameter: a load path, past limit points, with bifurcations marked.

    The path starts at the equilibrium to which load steps lead from the initial state at ``start``, and is followed by
    steps of arc length until the parameter is ``to``, even if the parameter turns round on the way (Riks 1972, Keller
    1977).

    Parameters
    ----------
    parameter : str
        A tunable parameter, an input, or ``t``, the time in formulas: loads and drives are then followed as slowly
        as rest asks for.
    to, start : float
        Values of the parameter at the end and at the start, in SI units.
    initial : mapping, optional
        As of ``equilibrium``.
    parameters, u : mapping or array_like, optional
        Tunable parameters (np,) and inputs (nu,), SI units, without the varied one.
    t : float, optional
        Time of inputs, base and formulas, s.
    max_step : float
        Largest displacement of a step, rad or lengths of the scene.
    max_points : int
        Equilibria at most.
    stability : bool
        Whether stiffnesses next to zero are looked at, and limit points and bifurcations located.
    progress : callable or bool, optional
        Called with (steps done, all steps); True shows a bar.

    Returns
    -------
    EquilibriumPath
        With ``success`` and ``message``: the end of the path, with the reason; after Ctrl-C the points so far.

    Raises
    ------
    NumericalError
        There is no equilibrium at ``start``.
    UsageError
        There is no such parameter, or terms are missing.
    """
    kind = "number of seconds" if parameter == "t" else "number"
    first, last = number_of("start", start, kind), number_of("to", to, kind)
    if first == last:
        fault = f"{parameter} is to go from {first:.6g} to the same value [E0077]"
        raise UsageError(Problem("equilibrium_path", fault, "another value of to or start"))
    if number_of("max_step", max_step, "number") <= 0.0 or max_points < 2:
        fault = "max_step is positive and max_points at least 2 [E0078]"
        raise UsageError(Problem("equilibrium_path", fault, "the defaults"))
    change = number_of("to - start", last - first, kind)
    varied = _varied_load(model, "equilibrium_path", parameter, parameters, t, u)
    statics, onto = _start_of_path(model, varied, first, change, initial)
    limits = StepLimits(max_step, 0.1 * abs(change))
    scale = 1e6 * load_scale(statics, onto.rest)  # the largest range that is a scale of the load factor
    with show_progress(progress, f"{model.name}: {parameter}") as report, one_thread_of_algebra(model.nv):
        options: tuple[Any, ...] = (last, limits, max_points, stability, report)
        if 0.0 < scale < abs(change):  # limit points would drown in the rounding of the load factor
            near = _start_of_path(model, varied, first, math.copysign(scale, change), initial)
            path = _follow_path(model, varied, *near, *options)
            if path.success or path.interrupted or abs(path.values[-1] - first) < scale:
                return path
        return _follow_path(model, varied, statics, onto, *options)


def _varied_load(
    model: CompiledModel, call: str, parameter: str, parameters: Parameters, t: float, u: Inputs
) -> LoadParameter:
    """Return the parameter or input that varies along a path, for a function named `call` in messages, with the
    parameters, time (s) and inputs that stay fixed. Raises UsageError if there is no such quantity, or if terms are
    missing."""
    check_continuous(model, call)
    check_partials(model, call)
    return LoadParameter.of(model, call, parameter, parameters, number_of("t", t), u)


def _start_of_path(
    model: CompiledModel, varied: LoadParameter, value: float, change: float, initial: Mapping[str, Any] | None
) -> tuple[LoadedStatics, PathPoint]:
    """Return the equations of rest, and the first point of a path, which goes on by ``change`` from a value of the
    varied load. ``initial`` is the initial state in the form of ``simulate``. Raises NumericalError if there is no
    equilibrium at the value."""
    p, time, u = varied.at(value)
    measures = SceneMeasures(model, p, time, held_base(model, p, time))
    begun = initial_state(model, initial, p)
    statics = loaded_statics(model, measures, begun.q, u, np.zeros(model.nv), varied, abs(change))
    guess = LoadedState(begun.q, np.zeros(len(model.multipliers)), begun.z, value)
    try:
        return statics, first_point(statics, _rest_at(statics, guess), float(np.sign(change)))
    except PathEndError as end:
        fault = f"no equilibrium was found at {value:.6g}, where the path is to start: {end.why} [E0079]"
        hint = "a start with smaller loads, or the initial state of an equilibrium"
        raise NumericalError(Problem(varied.name, fault, hint)) from None


def _rest_at(statics: LoadedStatics, guess: LoadedState) -> LoadedState:
    """Return the equilibrium at the start of a path, by load steps from the guess, with the load factor held at the
    guess's."""
    still = Balance(np.zeros(len(statics.sizes)), np.zeros(len(guess.multipliers)), np.zeros(len(guess.z)))
    value = guess.s
    fixed = replace(
        statics,
        balance=lambda rest: statics.balance(replace(rest, s=value)),
        tangents=lambda rest: statics.tangents(replace(rest, s=value)),
        mass=lambda rest: statics.mass(replace(rest, s=value)),
        by_factor=lambda rest: still,
        followed=lambda q, s: statics.followed(q, value),
        strains=lambda s: statics.strains(value),
    )
    rest = by_load_steps(fixed, guess, StepLimits(factor=0.5)).rest
    return replace(rest, s=value)


def _follow_path(
    model: CompiledModel,
    varied: LoadParameter,
    statics: LoadedStatics,
    start: PathPoint,
    target: float,
    limits: StepLimits,
    max_points: int,
    stability: bool,
    report: Progress | None = None,
) -> EquilibriumPath:
    """Return the path from a point to the value ``target`` of the varied number, as far as possible. ``max_points``
    limits the points, ``stability`` is whether critical points are looked for, ``report`` is called with progress.
    Ctrl-C, and a path that ends early, return the points so far with a message."""
    points, critical = [start], list[tuple[int, CriticalPoint]]()
    result: list[ExaminedPoint] = [examined(statics, start)] if stability else []
    message, interrupted, reach = "", False, abs(target - start.rest.s) or 1.0
    try:
        for point in follow(statics, start, target, limits, 0.3):
            if stability:
                result.append(examined(statics, point))
                critical += [(len(points), at) for at in critical_points(statics, result[-2], result[-1])]
            points.append(point)
            if len(points) >= max_points and point.rest.s != target:
                message = f"{max_points} points are not enough; try: max_points={2 * max_points}, or a larger max_step"
                break
            if report is not None:
                report(max(0, round(1000 * (1.0 - abs(target - point.rest.s) / reach))), 1000)
    except PathEndError as end:
        message = end.why
    except KeyboardInterrupt:
        message, interrupted = "interrupted", True
        del result[len(points) :]  # critical points of the interrupted examination
        critical = [(after, at) for after, at in critical if after < len(points)]
    where = f"{varied.name} = {points[-1].rest.s:.6g}{varied.shown_unit}"
    told = f"the path ends at {where}, not at {target:.6g}: {message}" if message else f"the path arrives at {where}"

    def branch(number: int, size: float, to: float) -> EquilibriumPath:
        onto = _aside(statics, critical[number][1], size)
        return _follow_path(model, varied, statics, onto, to, limits, max_points, stability)

    rests = [point.rest for point in points]
    negative, lowest = np.full(len(rests), -1), np.full(len(rests), np.nan)
    if stability:
        negative = np.array([item.stiffness.negative for item in result])
        lowest = np.array([lowest_frequency_squared(statics, item) for item in result])
    s, q, z, multipliers = (np.array([getattr(rest, name) for rest in rests]) for name in _STATES)
    states = (s, q, z, multipliers, *_columns(model, varied, rests), negative, lowest)
    ends = (_marks(model, varied, statics, critical), not message, told, branch, interrupted)
    return EquilibriumPath(varied.name, varied.unit, *states, *ends)


def _marks(
    model: CompiledModel, varied: LoadParameter, statics: LoadedStatics, critical: Sequence[tuple[int, CriticalPoint]]
) -> tuple[Critical, ...]:
    """Return critical points, each after a number of points, with the scene's outputs and positions there."""
    at_critical, _, _ = _columns(model, varied, [item.point.rest for _, item in critical])
    marked = []
    for number, (after, item) in enumerate(critical):
        columns = {name: float(column[number]) for name, column in at_critical.items()}
        rest, mode = item.point.rest, item.modes[:, 0]
        names = components_of(model, statics, mode)
        marked.append(Critical(item.kind, rest.s, rest.q, mode, columns, after, names, item.modes))
    return tuple(marked)


#: Values at rest, as attributes of a point: the varied number, coordinates, internal states, multipliers.
_STATES = ("s", "q", "z", "multipliers")


def components_of(model: CompiledModel, statics: LoadedStatics, mode: Array) -> tuple[str, ...]:
    """Return the names, without ``v.``, of at most 6 components of v that take part in a mode (nv,), largest first. A
    component takes part if it is above 0.3 of the largest one, in rad or parts of the scene's length."""
    sizes = np.abs(mode / statics.sizes)
    order = np.argsort(-sizes, kind="stable")[:6]
    return tuple(model.v_names[k].removeprefix("v.") for k in order if sizes[k] > 0.3 * np.max(sizes))


def _columns(
    model: CompiledModel, varied: LoadParameter, rests: Sequence[LoadedState]
) -> tuple[dict[str, Array], dict[str, str], tuple[str, ...]]:
    """Return by name the scene's outputs and the positions of bodies at equilibria, (n,) each, their units, and the
    names of the outputs."""
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    if not rests:
        return columns, units, ()
    p, t, u = varied.at_each(np.array([rest.s for rest in rests]))
    arguments: dict[str, Any] = {"t": t, "parameters": p, "base": held_base(model, p, t)}
    q, z, multipliers = (np.array([getattr(rest, name) for rest in rests]) for name in _STATES[1:])
    if "outputs" in model.functions:
        still = np.zeros(model.nv)
        values = model.outputs(q, still, still, u=u, z=z, multipliers=multipliers, **arguments)
        for item in model.library.layout["outputs"]:
            name, unit, size = str(item["name"]), str(item["unit"]), int(item["size"])
            column = np.broadcast_to(np.reshape(values[name], (-1, size)), (len(rests), size))
            for k in range(size):
                label = name if size == 1 else f"{name}[{k}]"
                columns[label], units[label] = column[:, k].copy(), unit
    outputs = tuple(columns)
    if "poses" in model.functions:
        poses = model.evaluate("poses", q, **arguments)["pose"]
        places = np.broadcast_to(poses, (len(rests), *poses.shape[-2:]))[..., 4:]
        for number, body in enumerate(model.bodies):
            for axis, letter in enumerate("xyz"):
                label = f"{body}.{letter}"
                columns[label], units[label] = places[:, number, axis].copy(), "m"
    return columns, units, outputs


def _aside(statics: LoadedStatics, critical: CriticalPoint, size: float) -> PathPoint:
    """Return the first point on the path that branches off at a critical point, on the side and at about the distance
    ``size``, relative, of its mode. Raises NumericalError if no equilibrium is found there."""
    rest = critical.point.rest
    unknowns = np.zeros(len(statics.sizes) + len(rest.multipliers) + len(rest.z))
    unknowns[: len(statics.sizes)] = critical.modes[:, 0]
    measured = statics.measure * critical.modes[:, 0]
    length = float(np.sqrt(critical.modes[:, 0] @ measured))
    along = Direction(unknowns / length, 0.0)
    for part in _ASIDE:
        way = size * part * length
        result = correct(statics, rest, along, way)
        if result.trouble:
            continue
        gone = float(result.displacement @ measured)
        onwards = direction(statics, result.rest, along)
        if onwards is not None and gone * way > 0.25 * way**2 * length:
            if way < 0.0:
                onwards = direction(statics, result.rest, Direction(-along.unknowns, 0.0)) or onwards
            return PathPoint(result.rest, onwards, 0.0, result.corrections, 0.0)
    fault = f"no equilibrium was found near the {critical.kind} [E0080]"
    raise NumericalError(Problem("branch", fault, "another size, such as 0.3 or -1"))


@dataclass(frozen=True, repr=False)
class BucklingLoads:
    """Linear buckling loads: values at which the stiffness, extrapolated from a preload, is singular.

    Attributes
    ----------
    parameter, unit : name and unit of the varied parameter
    at : value of the parameter at the preload
    values : (n,) of the parameter, nearest to the preload first
    modes : (nv, n) displacements, the largest component of each 1 rad, or the scene's length
    components : of each mode, the names of the largest components
    warning : that extrapolation is inaccurate because the structure bends before buckling; empty if accurate
    """

    parameter: str
    unit: str
    at: float
    values: Array
    modes: Array
    components: tuple[tuple[str, ...], ...]
    warning: str = ""

    @property
    def reversed(self) -> tuple[bool, ...]:
        """Whether each critical value belongs to the reversed load."""
        return tuple(bool(value < 0.0) if self.at >= 0.0 else bool(value > 0.0) for value in self.values)

    def __repr__(self) -> str:
        pairs = zip(self.values, self.reversed, strict=True)
        values = ", ".join(f"{value:.6g}{' (reversed load)' if turned else ''}" for value, turned in pairs)
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return f"<BucklingLoads: {self.parameter} = {values or 'none'}{unit if len(self.values) else ''}>"


def buckling_loads(
    model: CompiledModel,
    parameter: str,
    at: float = 0.0,
    count: int = 4,
    *,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
) -> BucklingLoads:
    """Return linear buckling loads, at which the stiffness, extrapolated along the path of a preload, is singular.

    The loads are accurate if the structure bends little up to these loads; ``equilibrium_path`` computes exact
    bifurcations and limit points.

    Parameters
    ----------
    parameter : str
        Load of the scene: a tunable parameter, an input, or ``t``.
    at : float
        Value of the parameter at the preload, SI.
    count : int
        Number of loads, the nearest to the preload.
    initial : mapping, optional
        As of ``equilibrium``, without the load.
    parameters, u : mapping or array_like, optional
        Tunable parameters (np,) and inputs (nu,), SI units, without the load.
    t : float, optional
        Time of inputs, base and formulas, s.

    Returns
    -------
    BucklingLoads
        ``values`` (n,) in SI units, nearest to the preload first, and ``modes`` (nv, n).

    Raises
    ------
    NumericalError
        There is no equilibrium under the preload, or the stiffness of this equilibrium is singular.
    UsageError
        There is no such parameter, or terms are missing.
    """
    if count < 1:
        raise UsageError(Problem("buckling_loads", f"{count} loads are asked for [E0081]", "count=4"))
    value = number_of("at", at)
    varied = _varied_load(model, "buckling_loads", parameter, parameters, t, u)
    reach = abs(value) or 1.0
    for _ in range(5):  # forces by load are differences over a part of the scale
        statics, start = _start_of_path(model, varied, value, reach, initial)
        scale = load_scale(statics, start.rest)
        if not scale > 0.0 or 0.1 * reach <= scale <= 10.0 * reach:
            break
        reach = scale
    try:
        factors, modes = linear_buckling(statics, start.rest, count)
    except ArithmeticError as error:
        fault = f"no buckling loads about {parameter} = {value:.6g}: {error} [E0082]"
        raise NumericalError(Problem("buckling_loads", fault, "another preload, at=...")) from None
    named = tuple(components_of(model, statics, mode) for mode in np.transpose(modes))
    warning = _misleads(statics, start.rest, varied.name, value, factors)
    if warning:
        warnings.warn(f"{model.name}: {warning}", RuntimeWarning, stacklevel=3)
    return BucklingLoads(varied.name, varied.unit, value, value + factors, modes, named, warning)


def _misleads(statics: LoadedStatics, rest: LoadedState, name: str, value: float, factors: Array) -> str:
    """Return a warning if there is no buckling load, or if the lowest load differs from the prediction half way to
    it; empty if both agree. ``name`` and ``value`` are the parameter at the preload, ``factors`` the changes to the
    loads."""
    if not len(factors):
        return (
            f"no buckling load was found: the stiffness at {name} = {value:.6g} does not become singular along the"
            " load, extrapolated in either direction; try: equilibrium_path, which follows large displacements [W0264]"
        )
    lowest = float(factors[0])
    later = half_way(statics, rest, lowest)
    if later is not None and abs(later - lowest) <= 0.05 * abs(lowest):
        return ""
    told = "there is none" if later is None else f"it is {value + later:.6g}"
    return (
        f"the lowest linear buckling load is {name} = {value + lowest:.6g} by the stiffness at {value:.6g}, and"
        f" half way there {told}: the load bends the structure, so extrapolation misleads; try: equilibrium_path, which"
        " finds limit points and bifurcations [W0013]"
    )
