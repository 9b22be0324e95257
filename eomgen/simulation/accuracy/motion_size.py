"""Differences between runs of one model, row by row, and the size of the motion that they are compared with; whole
turns of angles that do not matter.

The equations are evaluated at rows of the run with the angle shifted, which needs no knowledge of the structure of the
equations: a shift by a turn must change no force, rate and constraint, and a shift by another angle some force, rate or
constraint. The angle of a symmetric wheel, for which no shift changes any force, is measured by its travel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.compiled.equations import accelerations
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import evaluate
from eomgen.lie import product
from eomgen.lie.product import Factor
from eomgen.simulation.stepping.states import States, states_of

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.run import Run


TURN = 2.0 * np.pi
#: Number of rows at which equations are evaluated.
ROWS = 8


def whole_turns(run: Run, rows: Array, parameters: Array) -> NDArray[np.bool_]:
    """Return for each velocity, (nv,), whether the velocity is the rate of an angle that travels more than a turn, and
    whole turns of this angle change no equation.

    Parameters
    ----------
    rows : (n, width) of the record
    parameters : (np,), or (n, np), at the rows
    """
    model = run.model
    result = np.zeros(model.nv, dtype=bool)
    travel = np.ptp(rows[:, 1 : 1 + model.nq], axis=0)
    angles = [
        factor
        for factor in model.factors
        if factor.group == "R" and model.q_units[factor.q_start] == "rad" and travel[factor.q_start] > TURN
    ]
    if not angles:
        return result
    places = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), ROWS)).astype(int))
    held = parameters if parameters.ndim == 1 else parameters[places]
    try:
        known = _equations(run, rows[places], held, 0, 0.0)
        for factor in angles:
            turned, moved = (_equations(run, rows[places], held, factor.q_start, shift) for shift in (TURN, 1.0))
            result[factor.v_start] = _same(known, turned) and not _same(known, moved)
    except EomgenError:  # a function of the caller, or a state at which the equations have no value
        return np.zeros(model.nv, dtype=bool)
    return result


def _equations(run: Run, rows: Array, parameters: Array, index: int, shift: float) -> list[Array]:
    """Return forces, rates of internal states and constraints at rows (n, width) if q[place] is increased by `shift`. A
    list of arrays (n, size), one for each of the functions that the model has; `parameters` are (np,), or (n, np)."""
    model = run.model
    t, q, v, a, _, z = states_of(rows, model)
    q[:, index] += shift
    u = None
    if model.nu:
        u = run.signals.rows(t) if run.takes_rows else model.input_values(t, parameters=parameters)
    result = []
    with np.errstate(all="ignore"):
        if model.functions.for_runs("inverse_dynamics"):
            # at the accelerations of the motion forces are zero: no measure for rounding
            result.append(model.inverse_dynamics(q, v, -a, t, u, z=z, parameters=parameters))
        elif model.functions.for_runs("forward_dynamics") and not model.multipliers:
            result.append(accelerations(model, q, v, t, u, z=z, parameters=parameters))
        if "internal_rate" in model.functions:
            result.append(model.internal_rates(q, v, z, t, u, parameters=parameters))
        for name in ("constraint", "constraint_jacobian"):
            if model.multipliers and name in model.functions:
                blocks = model.evaluate(name, q, t=t, parameters=parameters)  # empty of velocity equations alone
                result += [np.asarray(block).reshape(len(t), -1) for block in blocks.values()]
    return result


def _same(first: list[Array], second: list[Array]) -> bool:
    """Return whether values are equal up to rounding; non-finite values are unequal."""
    return all(
        bool(np.all(np.abs(a - b) <= WRITTEN * np.abs(a).max(initial=0.0))) for a, b in zip(first, second, strict=True)
    )


#: Part of the coordinates, or of 1 rad: motion below is rounding.
REST = COMPUTED
#: Rounding of weights that are in balance.
_BALANCED = 16.0 * float(np.finfo(float).eps)
#: Units in which forces are at work.
_FORCES = ("N", "N m")
_DUAL = {"m/s": "N", "rad/s": "N m"}
#: Arrays (n, size) by quantity: ``q``, ``increment``, ``v``, ``z``, ``multipliers``, and ``output.`` with a
#: name.
Kinds = dict[str, Array]


class RunNames(NamedTuple):
    """Names and units of a run's components: q, v and internal states; and the units of outputs by name."""

    factors: tuple[Factor, ...]
    q_names: tuple[str, ...]
    q_units: tuple[str, ...]
    v_units: tuple[str, ...]
    z_names: tuple[str, ...]
    z_units: tuple[str, ...]
    outputs: Mapping[str, str]

    @property
    def nv(self) -> int:
        """Number of velocities."""
        return len(self.v_units)


@dataclass(frozen=True)
class MotionSize:
    """How far a motion goes, component by component, and names and units of increments and internal states.

    Attributes
    ----------
    sizes : kind -> (size,)
    names, units : of the components of the increment, followed by z
    own : of these, whether the size is the component's own, not a part of the largest size of the same unit
    turns : of these, whether the size is limited to one turn
    travel : of these, the range of motion
    still : whether all coordinates rest, apart from changes in their last digits
    """

    sizes: Kinds
    names: tuple[str, ...]
    units: tuple[str, ...]
    own: tuple[bool, ...]
    turns: tuple[bool, ...]
    travel: Array
    still: bool


def columns_of(model: CompiledModel, rows: Array) -> Kinds:
    """Return columns of recorded rows (n, width) by name: q, v, multipliers and z, as views (n, size)."""
    states = states_of(rows, model, views=True)
    return {"q": states.q, "v": states.v, "multipliers": states.multipliers, "z": states.z}


def components_of(model: CompiledModel) -> RunNames:
    """Return names and units of the components of a model's runs."""
    states, units = (tuple(model.z_names), tuple(model.z_units)), (tuple(model.q_units), tuple(model.v_units))
    outputs = {item["name"]: item["unit"] for item in model.library.layout["outputs"]}
    return RunNames(tuple(model.factors), tuple(model.q_names), *units, *states, outputs)


def differences(
    model: CompiledModel, first: Array, second: Array, outputs: tuple[Mapping[str, Array], Mapping[str, Array]]
) -> Kinds:
    """Return absolute differences between rows (n, width) of two runs at the same times, as arrays (n, size) by kind.
    Kinds are q, increment (the group difference, (n, nv)), v, z, multipliers and ``output.`` with each name; `outputs`
    are the outputs of both runs at the rows. Quaternions of either sign are the same rotation."""
    return differences_of(model.factors, columns_of(model, first), columns_of(model, second), outputs)


def differences_of(
    factors: Sequence[Factor], first: Kinds, second: Kinds, outputs: tuple[Mapping[str, Array], Mapping[str, Array]]
) -> Kinds:
    """Return absolute differences between the columns of two runs, by kind as in ``differences``. `first` and `second`
    have q, v, z and multipliers as arrays (n, size), `outputs` the outputs of both runs at these rows. Quaternions of
    either sign are the same rotation."""
    result = {name: np.abs(first[name] - second[name]) for name in ("v", "z", "multipliers")}
    increment = product.difference(factors, first["q"], second["q"])
    result["increment"] = np.abs(increment, out=increment)
    result["q"] = np.abs(first["q"] - second["q"])
    starts = np.array([factor.q_start for factor in factors if factor.group != "R"], int)
    quaternions = starts[:, np.newaxis] + np.arange(4)
    row, turned = np.nonzero(np.sum(first["q"][:, quaternions] * second["q"][:, quaternions], axis=2) < 0.0)
    opposite = row[:, np.newaxis], quaternions[turned]
    result["q"][opposite] = np.abs(first["q"][opposite] + second["q"][opposite])
    ours, theirs = outputs
    return result | {f"output.{name}": np.abs(_table(ours[name]) - _table(theirs[name])) for name in ours}


class Extent(NamedTuple):
    """Motion and forces at work in a run, as scales of components that hardly move.

    Attributes
    ----------
    ways : (nv,), the reach of each component, or its way in the run at the velocity that alone has the largest kinetic
        energy of the run, if that is longer
    states : (nz,), the largest internal states, or the response of their rates to the ways, if that is larger
    duration : s
    forces : the largest force by unit, N or N m: on a component that alone has the accelerations of the run, in the
        metric of kinetic energy; and gravity, m/s^2
    fall : m, of a free fall over the run: weights in balance leave rounding of it
    """

    ways: Array
    states: Array
    duration: float
    forces: Mapping[str, float]
    fall: float


def at_work(run: Run, rows: Array, parameters: Array) -> Extent:
    """Return motion and forces at work in a run, by some of its rows. Without an inertia matrix only the reach is
    known.

    A part that rests by symmetry, or between forces in balance, moves by their rounding. Its own range is not a scale
    of rounding; the range that the energy at work could give it is one, in the units of the component. An internal
    state moves with the coordinates, by the partials of its rate.
    """
    model, whole = run.model, columns_of(run.model, rows)
    reach = Extent(reach_of(model, whole["q"]), _largest(whole["z"]), math.inf, {}, 0.0)
    if not model.nv or not model.functions.for_runs("mass"):
        return reach
    every = max(1, len(rows) // ROWS)
    states = states_of(rows[::every], model, views=True)
    try:
        with np.errstate(all="ignore"):
            held = parameters if parameters.ndim == 1 else parameters[::every]
            mass = model.evaluator.functions("mass", {"q": states.q.copy(), "p": held})[0].reshape(-1, *[model.nv] * 2)
            motion = np.stack([states.v, states.a], axis=2)
            moving, accelerating = (motion * (mass @ motion)).sum(axis=1).max(axis=0).tolist()
            diagonal = np.diagonal(mass, axis1=1, axis2=2).max(axis=0)
            loads = np.sqrt(accelerating * diagonal)
            duration = float(rows[-1, 0] - rows[0, 0])
            ways = np.fmax(reach.ways, duration * np.nan_to_num(np.sqrt(moving / diagonal), posinf=0.0))
            responses = _responses(run, states, held, ways, duration)
    except (EomgenError, np.linalg.LinAlgError):
        return reach
    values = {item.name: item.value for item in model.description.parameters}
    gravity = math.hypot(*(evaluate(entry, lambda symbol: values[symbol.name]) for entry in model.description.gravity))
    forces = {"m/s^2": gravity}
    for unit, load in zip(model.v_units, loads.tolist(), strict=True):
        if (dual := _DUAL.get(unit)) and math.isfinite(load):
            forces[dual] = max(forces.get(dual, 0.0), load)
    return Extent(ways, np.fmax(reach.states, responses), duration, forces, 0.5 * gravity * duration**2)


def _responses(run: Run, states: States, parameters: Array, ways: Array, duration: float) -> Array | float:
    """Return the ways of internal states, (nz,), at the states of rows, if coordinates go ``ways`` (nv,) in a
    duration."""
    if not run.model.functions.for_runs("internal_partials"):
        return 0.0
    u = run.signals.rows(states.t) if run.takes_rows else None
    _, by_q, by_v, by_z = run.model.internal_partials(states.q, states.v, states.z, states.t, u, parameters=parameters)
    pulls = np.abs(by_q) @ ways + np.abs(by_v) @ ways / duration
    held = np.eye(by_z.shape[-1]) / duration - by_z
    gone: Array = np.nan_to_num(np.abs(np.linalg.solve(held, pulls[..., np.newaxis])), posinf=0.0)[..., 0].max(axis=0)
    return gone


def motion_size(
    model: CompiledModel,
    rows: Array,
    outputs: Mapping[str, Array],
    turns: NDArray[np.bool_] | None = None,
    energies: float = 0.0,
    work: Extent | None = None,
) -> MotionSize:
    """Return the size of the motion of recorded rows, (n, width); see ``size_of``."""
    return size_of(components_of(model), columns_of(model, rows), outputs, turns, energies, work)


def size_of(
    model: RunNames,
    column: Kinds,
    outputs: Mapping[str, Array],
    turns: NDArray[np.bool_] | None = None,
    energies: float = 0.0,
    work: Extent | None = None,
) -> MotionSize:
    """Return the size of a motion with given columns, by kind.

    The size of a joint's coordinate is the range of the coordinate, of a rotation the largest angle from the start, of
    a velocity or a multiplier the largest value; a size below a thousandth of the largest one in its unit is raised to
    that thousandth. An angle whose whole turns do not matter, by ``turns`` (nv,), none by default, has the size of a
    turn at most. An output that is rounding in comparison with all outputs of the same unit, such as the moment of a
    bearing compared with its forces, counts as rounding. An energy that is kept, or nearly so, is measured by the
    energies at work, ``energies`` in J.
    """
    travel = np.ptp(column["q"], axis=0)
    turned = np.abs(product.difference(model.factors, column["q"][:1], column["q"]))
    size, names, units, triples = np.zeros(model.nv), [""] * model.nv, [""] * model.nv, []
    for factor in model.factors:
        if factor.group == "R":
            size[factor.v] = travel[factor.q]
            names[factor.v], units[factor.v] = model.q_names[factor.q], model.q_units[factor.q]
            continue
        for start, unit, quantity in ((0, "rad", "rotation"), (3, "m", "position"))[: factor.v_size // 3]:
            part = slice(factor.v_start + start, factor.v_start + start + 3)
            triples.append(part.start)
            names[part], units[part] = [f"the {quantity} of {factor.name}"] * 3, [unit] * 3
    places = np.array(triples, int)[:, np.newaxis] + np.arange(3)
    size[places] = np.max(np.linalg.norm(turned[:, places], axis=2), axis=0)[:, np.newaxis]
    travelled = size.copy()
    turns = np.zeros(model.nv, dtype=bool) if turns is None else turns
    size[turns] = np.minimum(size[turns], TURN)
    reach = _reach(column["q"], model.q_units, units)
    if work is None:
        work = Extent(reach, _largest(column["z"]), math.inf, {}, 0.0)
    sizes = {"increment": _measure(size, units, REST * work.ways)}
    sizes["q"] = _coordinate_sizes(model, sizes["increment"])
    falling = np.where(np.array(model.v_units, dtype=str) == "m/s", REST * work.fall / work.duration, 0.0)
    rounding = np.maximum(REST * work.ways / work.duration, falling)
    sizes["v"] = _measure(np.abs(column["v"]).max(axis=0), model.v_units, rounding)
    sizes["z"] = _measure(np.ptp(column["z"], axis=0), model.z_units, REST * work.states)
    sizes["multipliers"] = _measure(np.abs(column["multipliers"]).max(axis=0))
    units_of = model.outputs
    largest = _at_work(model, column, [(units_of[name], values) for name, values in outputs.items()], work.forces)
    for name, values in outputs.items():
        table = _table(values)
        least = np.maximum(np.abs(table).max(axis=0), largest.get(units_of[name], 0.0))
        extent = np.ptp(table, axis=0)
        if units_of[name] == "J":
            # an energy that hardly changes is kept
            extent = np.where(extent < 0.02 * energies, energies, extent)
        sizes[f"output.{name}"] = _measure(extent, floor=REST * least)
    moved = np.concatenate([size, np.ptp(column["z"], axis=0)])
    is_own_size = moved >= np.concatenate([sizes["increment"], sizes["z"]])
    fallen = np.where(np.array(units, dtype=str) == "m", _BALANCED * work.fall, 0.0)
    least = np.concatenate([np.maximum(SUMMED * reach, fallen), SUMMED * work.states])
    still = bool(np.all(moved <= least))
    of_turns = (*turns.tolist(), *[False] * len(model.z_names))
    travelled = np.concatenate([travelled, np.ptp(column["z"], axis=0)])
    labels = (*names, *model.z_names), (*units, *model.z_units)
    return MotionSize(sizes, *labels, tuple(is_own_size.tolist()), of_turns, travelled, still)


def _at_work(
    model: RunNames, column: Kinds, outputs: Sequence[tuple[str, Array]], inertial: Mapping[str, float]
) -> dict[str, float]:
    """Return by unit the largest magnitude of coordinates, velocities, inertial forces, multipliers and outputs in a
    run. `column` has arrays (n, size) by kind, `outputs` pairs of unit and values (n, ...), `inertial` the largest
    inertial force by unit. Forces and multipliers also count as moments at a lever of 1 m, moments as forces, and with
    the velocities as powers."""
    q, v = _largest(column["q"]), _largest(column["v"])
    of_units = [*zip(model.q_units, q.tolist(), strict=True), *zip(model.v_units, v.tolist(), strict=True)]
    of_forces = [(_FORCES[0], column["multipliers"]), *outputs]
    of_units += [(unit, float(_largest(_table(values)).max(initial=0.0))) for unit, values in of_forces]
    result = dict(inertial)
    for unit, value in of_units:
        result[unit] = max(result.get(unit, 0.0), value)
    force = max(result.get(unit, 0.0) for unit in _FORCES)
    power = max(result.get("W", 0.0), *(force * result.get(unit, 0.0) for unit in _DUAL))
    return result | dict.fromkeys(_FORCES, force) | {"W": power}


def _largest(values: Array) -> Array:
    """Return the largest finite magnitude of each column, (n, size) -> (size,)."""
    largest: Array = np.max(np.abs(values), axis=0, where=np.isfinite(values), initial=0.0)
    return largest


def shares(apart: Kinds, size: MotionSize, kinds: Sequence[str] = ("increment", "z")) -> Array:
    """Return the differences of some kinds, divided by the size of the motion, side by side: (n, components of these
    kinds). Infinite if a difference is not finite, or if coordinates or internal states rest in one run and move in the
    other."""
    result = []
    for kind in kinds:
        with np.errstate(all="ignore"):
            share = apart[kind] / size.sizes[kind]
        rests = ~np.isfinite(size.sizes[kind])
        if kind in ("increment", "z") and np.any(rests):
            share[rests & (apart[kind] > 0.0)] = np.inf
        share[np.isnan(share)] = np.inf
        result.append(share)
    shown = [share for share in result if share.shape[1]]
    return shown[0] if len(shown) == 1 else np.hstack(result)


def _measure(size: Array, units: Sequence[str] = (), floor: Array | float = 0.0) -> Array:
    """Return divisors (size,) for relative errors from the sizes of components. Each is at least a thousandth of the
    largest size with the same unit (`units`; without units, of all), and at least the floor; infinite if both are
    zero."""
    largest: dict[str, float] = {}
    for component, unit in zip(size.tolist(), units, strict=True) if units else ():
        largest[unit] = max(largest.get(unit, 0.0), component)
    least = np.array([largest[unit] for unit in units]) if units else np.fmax.reduce(size, initial=0.0)
    result: Array = np.maximum(np.maximum(size, 1e-3 * least), floor)
    return np.where(result > 0.0, result, np.inf)


def reach_of(model: CompiledModel, q: Array) -> Array:
    """Return for each component of the velocity the largest coordinate of its unit, at least 1 rad of angles, (nv,).

    Parameters
    ----------
    q : (..., nq)
    """
    units = [unit.removesuffix("/s") for unit in model.v_units]
    return _reach(q.reshape(-1, model.nq), model.q_units, units)


def _reach(q: Array, q_units: Sequence[str], units: Sequence[str]) -> Array:
    largest = {unit: 1.0 if unit == "rad" else 0.0 for unit in units}
    for value, unit in zip(np.abs(q).max(axis=0, initial=0.0), q_units, strict=True):
        largest[unit] = max(largest.get(unit, 0.0), float(value))
    return np.array([largest[unit] for unit in units])


def _coordinate_sizes(model: RunNames, increment: Array) -> Array:
    """Return the sizes of the numbers in q, (nq,), from the sizes (nv,) of the increment. A joint coordinate has its
    own size, a quaternion four times the size of the rotation, a position the size of its increment; other numbers have
    size 1."""
    size = np.ones(len(model.q_units))
    for factor in model.factors:
        sizes = increment[factor.v]
        size[factor.q] = sizes if factor.group == "R" else np.concatenate([np.full(4, sizes[0]), sizes[3:]])
    return size


def _table(values: Array) -> Array:
    return values[:, np.newaxis] if values.ndim == 1 else values
