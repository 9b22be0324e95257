"""Initial states from arrays or from joint names, validated before a run, and sentences on their changes by the
constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import distinct, first_of
from eomgen.base.rounding import WRITTEN
from eomgen.compiled.arguments import by_name, check_finite, check_name, check_quaternions, numbers, read_quantities
from eomgen.compiled.beams import placed_nodes
from eomgen.errors import Message, Problem, UsageError
from eomgen.formula.units.labels import several_turns
from eomgen.system.description import WrittenStart

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.lie.product import Factor
    from eomgen.solvers.consistency import Assembly, KeptComponents

_BLOCKS = ("q", "v", "z")
_PARTS = {"q": "position", "v": "velocity"}


@dataclass(frozen=True)
class InitialState:
    """An initial state: configuration q (nq,), velocity v (nv,), internal states z (nz,), in SI units."""

    q: Array
    v: Array
    z: Array


def initial_state(
    model: CompiledModel,
    initial: Mapping[str, Any] | None,
    parameters: Array | None = None,
    *,
    asked: bool = False,
) -> InitialState:
    """Return the scene's initial state with the given values put in.

    Parameters
    ----------
    initial : mapping
        ``q``, ``v``, ``z`` as arrays; or joints: ``{"hinge": 0.3}``, ``{"hinge": {"position": "30 deg", "velocity":
        1.0}}``, ``{"v.hinge": 1.0}``, or one coordinate of several, ``{"blade[2]": 0.1}``; or internal states:
        ``{"filtered": 0.2}``, ``{"z": {"filtered": 0.2}}``.
    parameters : (np,) array, optional
        Of the run; the scene's own state in absolute coordinates may depend on these parameters.
    asked : bool
        Whether to return the state requested by the scene, before the correction of the state at the default
        parameters: if initial values are given or parameters differ, runs move the state onto the constraints as the
        scene's own state was.

    Raises
    ------
    UsageError
        Unknown joints, wrong shapes, values that are not finite, quaternions that are not of unit length.
    """
    state = _scene_start(model, parameters, asked=asked)
    values = {} if initial is None else values_by_joint(model, initial)
    units = {"q": model.q_units, "v": model.v_units, "z": model.z_units}
    blocks = {name: value for name, value in values.items() if _is_block(model, name, value)}
    for name, value in blocks.items():
        if name == "z" and isinstance(value, Mapping):
            state.z[:] = by_name(
                "state", value, model.states, state.z, units=dict(zip(model.states, model.z_units, strict=True))
            )
        else:
            given_value = model.evaluator.with_references("initial q", value) if name == "q" else value
            _put(getattr(state, name), slice(None), f"initial {name}", given_value, units[name])
    joints = {name: value for name, value in values.items() if name not in blocks}
    if "q" not in blocks and model.description.exact_beams:
        before = InitialState(state.q.copy(), state.v.copy(), state.z)
        _joints(model, joints, state)
        state = _with_nodes(model, before, state, parameters, joints)
    else:
        _joints(model, joints, state)
    check_finite("initial q", state.q, model.q_names)
    check_finite("initial v", state.v, model.v_names)
    check_finite("initial z", state.z, model.z_names)
    check_quaternions("initial q", state.q, model.factors)
    return state


def _is_block(model: CompiledModel, name: str, value: Any) -> bool:
    """Return whether an initial value given under ``name`` means all of q, v or z, not a joint or an internal state. A
    joint or a state may have the name of a block, or of each other: a mapping is of the joint and an array of the block
    then. Raises UsageError for a number, which may be of either."""
    joint, state = name in [factor.name for factor in model.factors], name in model.states
    block = name in _BLOCKS and (name != "z" or bool(model.nz) or not joint)
    if block + joint + state > 1 and (np.ndim(value) == 0 and not isinstance(value, Mapping)):
        kinds = {f"all of {name}": block, "the joint": joint, "the internal state": state}
        meant = {
            f'{{"{name}": [...]}} for all of {name}': block,
            f'{{"{name}": {{"position": ...}}}} for the joint': joint,
            f'{{"z": {{"{name}": ...}}}} for the state': state,
        }
        fault = f"{name} may be {' or '.join(kind for kind, there in kinds.items() if there)}"
        raise UsageError(Problem(f"initial {name}", fault, ", ".join(text for text, there in meant.items() if there)))
    return block and not (joint and isinstance(value, Mapping) and {"position", "velocity", "hold"} & value.keys())


def check_initial(initial: object) -> None:
    """Raise UsageError unless the caller's initial state is a mapping or None."""
    if initial is not None and not isinstance(initial, Mapping):
        fault = f"a mapping is needed, not {type(initial).__name__} [E0090]"
        hint = 'dict(q=..., v=...) or {"joint": position}'
        if isinstance(getattr(initial, "initial", None), Mapping):
            hint = "its .initial: initial=found.initial"
        elif hasattr(initial, "t") and hasattr(initial, "q") and hasattr(initial, "v"):
            hint = 'its last row: initial={"q": solution.q[-1], "v": solution.v[-1]}'
        raise UsageError(Problem("initial", fault, hint))


def values_by_joint(model: CompiledModel, initial: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return initial values by joint: ``q.hinge`` and ``v.hinge`` become position and velocity of a joint, and
    ``q.blade[2]`` one of several coordinates; other names stay. Raises UsageError unless given a mapping or None."""
    check_initial(initial)
    result = dict(initial or {})
    for name, value in (initial or {}).items():
        block, _, joint = str(name).partition(".")
        if block in _PARTS and joint.partition("[")[0] in {factor.name for factor in model.factors}:
            before = result.get(joint, {})
            result[joint] = {**(before if isinstance(before, Mapping) else {"position": before}), _PARTS[block]: value}
            del result[name]
    return result


def angles_of_several_turns(model: CompiledModel, initial: Mapping[str, Any] | None) -> list[str]:
    """Return a note on each joint that a caller starts at more than a turn, as a plain number: rad, not degrees.

    Numbers of more than one decimal have no notes, nor have arrays for all of q with such a number: these come from
    programs and other runs.
    """
    if not initial:
        return []
    values, notes = values_by_joint(model, initial), []
    whole = None if "q" not in initial else _written_by_hand(values.get("q"), model.nq)
    for factor in model.factors:
        value = values.get(factor.name, None if whole is None else whole[factor.q_start])
        angle = value.get("position") if isinstance(value, Mapping) else value
        turns = factor.q_size == 1 and model.q_units[factor.q_start] == "rad"
        if not (turns and isinstance(angle, int | float) and float(10.0 * angle).is_integer()):
            continue
        if note := several_turns(f"the joint {factor.name} starts at", angle):
            notes.append(note)
    return notes


def _written_by_hand(q: object, size: int) -> list[float] | None:
    """Return all of q, (nq,), if q has plain numbers of one decimal at most; None for any other value."""
    values = q.tolist() if isinstance(q, np.ndarray) else q
    if not isinstance(values, list | tuple) or len(values) != size:
        return None
    for value in values:  # most arrays have many decimals: the first number decides
        if not isinstance(value, int | float) or not float(10.0 * value).is_integer():
            return None
    return [float(value) for value in values]


def _joints(model: CompiledModel, values: Mapping[str, Any], state: InitialState) -> None:
    """Write initial values given by joints, components and internal states into ``state``, in place. ``values`` maps
    names to a position, or to ``position``, ``velocity`` and ``hold``. Raises UsageError for unknown names."""
    factors = {factor.name: factor for factor in model.factors}
    for name, value in values.items():
        if name in model.states and name not in factors:
            index = model.states.index(name)
            _put(state.z, slice(index, index + 1), f"initial {name}", value, model.z_units)
            continue
        component = _component(factors, str(name))
        if component is None:
            check_name("joint or state" if model.states else "joint", name, [*factors, *model.states])
            component = factors[name].q, factors[name].v
        parts = value if isinstance(value, Mapping) else {"position": value}
        for key, number in parts.items():
            if key == "hold":
                _check_hold(model, str(name), parts)
                continue
            if key not in ("position", "velocity"):
                raise UsageError(
                    Problem(f"initial {name}", f"{key!r} is not known here [E0263]", "position or velocity")
                )
            target, part, units = (
                (state.q, component[0], model.q_units) if key == "position" else (state.v, component[1], model.v_units)
            )
            _put(target, part, f"initial {key} of {name}", number, units)


def _check_hold(model: CompiledModel, name: str, parts: Mapping[str, Any]) -> None:
    """Raise UsageError for a ``hold`` not true or false, without a value, or in absolute coordinates."""
    if not isinstance(parts["hold"], bool):
        raise UsageError(Problem(f"initial {name}", "hold is true or false [E2213]", '{"velocity": 2.0, "hold": True}'))
    if parts["hold"] and not {"position", "velocity"} & set(parts):
        fault = "no position or velocity is given that could be held [E2214]"
        raise UsageError(Problem(f"initial {name}", fault, "a position or a velocity with it"))
    if parts["hold"] and model.description.joints:
        raise UsageError(
            Problem(
                f"initial {name}",
                "absolute coordinates have no coordinates of joints that could be held [E2215]",
                'coordinates = "joint"',
            )
        )


def _component(factors: Mapping[str, Factor], name: str) -> tuple[slice, slice] | None:
    """Return the slices in q and v for one coordinate of a joint or a beam, ``blade[2]``; None for any other name.
    Components of quaternions do not stand alone. ``factors`` are by name."""
    joint, bracket, index = name.removesuffix("]").partition("[")
    factor = factors.get(joint)
    if not (
        bracket and index.isdecimal() and factor is not None and factor.group == "R" and factor.q_size > int(index)
    ):
        return None
    q_index, v_index = factor.q_start + int(index), factor.v_start + int(index)
    return slice(q_index, q_index + 1), slice(v_index, v_index + 1)


def _put(target: Array, part: slice, name: str, value: Any, units: Sequence[str]) -> None:
    array = numbers(name, read_quantities(name, value, units[part]))
    size = len(target[part])
    if array.shape != (size,) and not (size == 1 and array.ndim == 0):
        hint = f"a list of {size} numbers, from Python or in the scene" if array.ndim == 0 else ""
        if size == 4 and array.shape == (3,) and name.startswith("initial position"):
            hint = "a unit quaternion (w, x, y, z), [1, 0, 0, 0] for none; of a rotation by angle about a unit axis n"
            hint += " [cos(angle / 2), *(sin(angle / 2) * n)]"
        if array.ndim == 2 and array.shape[1] == size:
            hint = f"one row of it: {name.rpartition(' ')[2]}[-1] is the last one"
        needed = f"{size} number{'s' * (size != 1)}; q_names, v_names and states of the model are their order"
        raise UsageError(Problem(name, f"the shape is {array.shape}, ({size},) is needed [E0264]", hint or needed))
    target[part] = array


def _with_nodes(
    model: CompiledModel, before: InitialState, state: InitialState, parameters: Array | None, joints: Mapping[str, Any]
) -> InitialState:
    """Return a state in which the nodes of each beam follow its first node rigidly, in the shapes of the scene's start.

    Nodes have coordinates independent of joints. Joints that a caller moves, and parameters of the places of joints,
    move the first node of a beam alone.

    Parameters
    ----------
    before, state : the scene's start, and the start with the caller's values
    joints : these values by joint
    parameters : (np,); defaults if None
    """
    p = model.parameter_array() if parameters is None else parameters
    absolute = model.initial_at is not None  # then poses of bodies agree with joints at the parameters already
    has_other_parameters = p.tolist() != list(model.parameters.values()) and not absolute
    moved = not (np.array_equal(before.q, state.q) and np.array_equal(before.v, state.v))
    if not (has_other_parameters or moved):
        return state
    return InitialState(*placed_nodes(model, (before.q, before.v), (state.q, state.v), p, list(joints)), state.z)


def _scene_start(model: CompiledModel, parameters: Array | None, *, asked: bool) -> InitialState:
    """Return the scene's own initial state, as copies; bodies in absolute coordinates follow joints at the run's
    parameters. ``asked`` returns q and v as written in the scene, before correction onto the constraints."""
    q, v = model.initial_q.copy(), model.initial_v.copy()
    layout = model.library.layout
    if asked and layout.get("asked_q"):
        q, v = (np.array(layout[name], dtype=float) for name in ("asked_q", "asked_v"))
    has_other_parameters = parameters is not None and parameters.tolist() != list(model.parameters.values())
    if model.initial_at is not None and parameters is not None and has_other_parameters:
        start = model.initial_at(dict(zip(model.parameters, parameters.tolist(), strict=True)))
        q, v = (np.array(part, dtype=float) for part in start)
    return InitialState(q, v, model.initial_z.copy())


def kept_components(factors: Sequence[Factor], starts: Sequence[WrittenStart]) -> KeptComponents | None:
    """Return the components of v whose initial coordinates or velocities are held; None if there are none."""
    held = [start for start in starts if start.held]
    if not held:
        return None
    from eomgen.solvers.consistency import KeptComponents  # noqa: PLC0415  # few starts are held

    places = {factor.name: factor.v for factor in factors}
    masks = np.zeros((2, sum(factor.v_size for factor in factors)), dtype=bool)
    for start in held:
        masks[[start.position, start.velocity], places.get(start.joint, slice(0))] = True
    return KeptComponents(masks[0], masks[1], tuple(start.joint for start in held)) if masks.any() else None


def starts_of(model: CompiledModel, initial: Mapping[str, Any] | None) -> tuple[WrittenStart, ...]:
    """Return the joints whose positions or velocities were written, or held, for a run's initial state. Joints that the
    caller names in ``initial`` replace the scene's; the result is empty if the caller gives whole arrays."""
    values = values_by_joint(model, initial) if initial else {}
    if "q" in values or "v" in values:
        return ()
    starts = {start.joint: start for start in model.description.starts}
    for name, value in values.items():
        parts = value if isinstance(value, Mapping) else {"position": value}
        joint = str(name).partition("[")[0]
        before = starts.get(joint, WrittenStart(joint, position=False, velocity=False))
        starts[joint] = WrittenStart(
            joint,
            before.position or "position" in parts,
            before.velocity or "velocity" in parts,
            bool(parts.get("hold", before.held)),
        )
    return tuple(starts.values())


#: Number of corrections that a message lists.
_LISTED = 6


def corrected_start(
    consistent: Assembly,
    guess: tuple[Array, Array],
    names: tuple[Sequence[str], Sequence[str]],
    units: tuple[Sequence[str], Sequence[str]],
    *,
    freedoms: int,
    starts: Sequence[WrittenStart] = (),
) -> list[Message]:
    """Return a message with the largest changes from a guess to the consistent state, in a list; empty if small.

    Values of which no more are given than can be chosen were asked for, and their change is named first with a remedy;
    if there are more, they are guesses of a position of a loop. A value counts as given if it is not 0.

    Parameters
    ----------
    consistent : Assembly
    guess, names, units : of q and of v
    freedoms : velocities that the constraints leave free
    starts : joints with written values, which are fewer than the components of bodies in absolute coordinates
    """
    changed: list[tuple[bool, float, str, str]] = []
    violations = (consistent.violations, {**consistent.violations, **consistent.rate_violations})
    written = [sum(start.position for start in starts), sum(start.velocity for start in starts)]
    for before, after, labels, units_of, off, joints in zip(
        guess, (consistent.q, consistent.v), names, units, violations, written, strict=True
    ):
        if not off:
            continue
        largest = np.maximum(np.abs(before), np.abs(after))[: len(units_of)]  # references of turns have no name
        sizes = _sizes_of_units(units_of, largest, consistent.extent)
        nonzero_count = int(np.count_nonzero(before[: len(units_of)]))
        asked = 0 < min(nonzero_count, joints or nonzero_count) <= freedoms
        for k, (name, unit, size) in enumerate(zip(labels, units_of, sizes, strict=True)):
            share = abs(after[k] - before[k]) / size if size else 0.0
            if share > WRITTEN:
                first, second = distinct(before[k] + 0.0, after[k] + 0.0)
                words = f"{name} {first} -> {second}{'' if unit in ('', '1') else f' {unit}'}"
                # digits of a scene may change
                changed.append((bool(asked and before[k] and share > 0.01), share, words, name))
    if not changed:
        return []
    changed.sort(key=lambda change: (not change[0], -change[1]))
    listing = first_of([words for _, _, words, _ in changed], _LISTED)
    if lost := ", ".join(name for asked_for, _, _, name in changed[:_LISTED] if asked_for):
        return [Message(f"corrected onto the constraints: {listing}; try: hold = true to keep {lost} [W0306]")]
    return [Message(f"corrected onto the constraints: {listing} [W0305]")]


def _sizes_of_units(units: Sequence[str], largest: Array, extent: float) -> list[float]:
    """Return the scale of each coordinate or velocity for relative changes, by its unit; ``largest`` are the
    magnitudes. Lengths are measured by the ``extent`` of the scene in m, velocities in m/s and rad/s by the fastest
    point at it."""
    arms = [extent if unit == "rad/s" else 1.0 for unit in units]
    fastest = float(np.max(largest * arms, initial=0.0))
    sizes = []
    for unit, arm in zip(units, arms, strict=True):
        size = extent if unit == "m" else 1.0
        if unit in ("m/s", "rad/s"):
            size = fastest / arm if arm else 0.0
        elif unit.endswith("/s"):
            size = max(value for value, other_unit in zip(largest, units, strict=False) if other_unit == unit)
        sizes.append(float(size))
    return sizes
