"""Events and sampled states on the tape: functions of events with rates along the motion, values of their actions,
impulses, and the values that sampled states take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any, Protocol

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula, Symbol
from eomgen.mechanics.kinematics.directions import configuration_directions, rates_of
from eomgen.mechanics.scene_tape import Derivation
from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ZERO, Ref, Tape
from eomgen.system.events import Assignment, EventRow, Mode, mode_parameter
from eomgen.system.signals import SampleRow, Sampling
from eomgen.system.system import Block

#: Quantities without a recorded rate along the motion, on which functions may depend.
_WITHOUT_RATE = frozenset({"a", "lam", "u"})
_SIGNS = {"rising": 1, "falling": -1, "both": 0}
#: Admissible arguments of the function of an impact: the gradient of the function is the direction of the impulse.
_POSITIONS = frozenset({"p", "t", "q", "base"})


def event_rows(derivation: Derivation) -> tuple[EventRow, ...]:
    """Return the events of a scene as data for stepping, in order: places of their formulas in the terms of events.

    Raises
    ------
    ModelError
        The function of an impact depends on more than positions and time, or on no position; the function of an event
        does not change along a run.
    """
    scene = derivation.scene
    starts = accumulate((len(event.actions()) for event in scene.events), initial=0)
    impacts = [event for event in scene.events if event.action == "impact"]
    rows = []
    for event, value, start in zip(scene.events, _values(derivation), starts, strict=False):
        blocks = {symbol.block for symbol in derivation.tape.depends_on([value.ref])}
        impact = event.action == "impact"
        said, hint = "", 'a distance, such as "q.ball"'
        if impact and (more := blocks - _POSITIONS):
            said = f"the impact needs a formula of positions and time, and this one depends on {_words(more)} [E0511]"
        elif not blocks - {"p"}:
            said = "the formula does not change along a run: nothing of the motion and no time is left in it [E0512]"
            hint = 'a formula such as "q.ball" or "t - 2"'
        elif impact and "q" not in blocks:
            said = "the impact needs a formula of positions, for its impulse is along their gradient, and this has none"
            said, hint = f"{said} [E0513]", f'{hint}, or action = "reset"'
        if said:
            raise ModelError([Problem(event.place, said, hint)])
        rows.append(
            EventRow(
                event.name,
                event.action,
                _SIGNS[event.direction],
                has_rate=not blocks & _WITHOUT_RATE,
                assignments=tuple(
                    Assignment(*_number(derivation, symbol), start + k) for k, (symbol, _) in enumerate(event.resets)
                ),
                restitution=start if impact else -1,
                gradient=impacts.index(event) if impact else -1,
                mode=scene.modes.index(event.mode) if event.action == "switch" else -1,
                value=start if event.action == "switch" else -1,
                least_interval=event.least_interval,
                description=event.description,
            )
        )
    return tuple(rows)


def modes(derivation: Derivation) -> tuple[Mode, ...]:
    """Return the modes of a scene, each with the tunable parameter for the value at the start."""
    tunable = [parameter.name for parameter in derivation.scene.parameters if parameter.tunable]
    return tuple(Mode(name, tunable.index(mode_parameter(name))) for name in derivation.scene.modes)


def events(derivation: Derivation) -> list[Block]:
    """Return the blocks of the functions whose roots are the events, and of their rates along the motion, (events,)
    each. A rate is 0 if the function depends on accelerations, multipliers or inputs."""
    tape, scene, nv = derivation.tape, derivation.scene, derivation.tree.nv
    values = _values(derivation)
    direction = rates_of(tape, configuration_directions(derivation.tree), derivation.prescribed)
    direction |= {InputSymbol("v", k): tape.input("a", k) for k in range(nv)}
    direction |= {InputSymbol("z", k): rate.ref for k, rate in enumerate(derivation.internal.rates)}
    with tape.block("rates of the events' functions"):
        rates = jacobian_vector(tape, [value.ref for value in values], direction)
    known = [row.has_rate for row in event_rows(derivation)]
    rates = [rate if has_rate else ZERO for rate, has_rate in zip(rates, known, strict=True)]
    count = len(scene.events)
    return [
        Block("event", (count,), tuple(value.ref for value in values), "functions whose roots are the events"),
        Block("event_rate", (count,), tuple(rates), "their time derivatives; 0 where they are not known"),
    ]


def event_actions(derivation: Derivation) -> list[Block]:
    """Return the block of the values of all formulas of actions: new values, restitutions and modes, event by event."""
    formulas = [formula for event in derivation.scene.events for formula in event.actions()]
    values = _record(derivation, formulas, "actions of the events")
    refs = tuple(value.ref for value in values)
    return [Block("action", (len(refs),), refs, "new values, restitutions and new modes, event by event")]


def event_impulse(derivation: Derivation) -> list[Block]:
    """Return the blocks from which impulses follow: M, B of constraints (if any), and the gradients of impacts in q.
    The gradients are left-trivialised, (impacts, nv)."""
    tape, nv = derivation.tape, derivation.tree.nv
    pairs = zip(derivation.scene.events, _values(derivation), strict=True)
    values = [value.ref for event, value in pairs if event.action == "impact"]
    (M,) = derivation.mass()
    B = derivation.constraint_jacobian() if derivation.constraints is not None else []
    with tape.block("gradients of the impacts"):
        tangents = forward_partials(tape, values, configuration_directions(derivation.tree))
    refs = tuple(tangent.get(k, ZERO) for tangent in tangents for k in range(nv))
    return [M, *B, Block("gradient", (len(values), nv), refs, "d event / dq of the impacts, left-trivialised")]


def needs_impulse(derivation: Derivation) -> bool:
    """Return whether an event changes velocities by impulses: impacts, and resets that constraints bear on."""
    held = derivation.constraints is not None
    return any(event.action == "impact" or (event.action == "reset" and held) for event in derivation.scene.events)


def _values(derivation: Derivation) -> list[Scalar]:
    return _record(derivation, [event.when for event in derivation.scene.events], "functions of the events")


def _record(derivation: Derivation, formulas: Sequence[Formula], label: str) -> list[Scalar]:
    derivation.energies()
    with derivation.tape.block(label):
        return [derivation.quantities.formula(formula) for formula in formulas]


def _number(derivation: Derivation, symbol: Symbol) -> tuple[str, int]:
    """Return the block and the place of a number of the state."""
    if symbol.kind == "state":
        return "z", derivation.quantities.state_numbers[symbol.name]
    coordinates = derivation.tree.coordinates[symbol.name]
    return symbol.kind, (coordinates.components if symbol.kind == "q" else coordinates.dofs)[symbol.index]


def _words(blocks: set[str]) -> str:
    names = {"v": "velocities", "a": "accelerations", "z": "internal states", "lam": "constraint forces", "u": "inputs"}
    return " and ".join(names[block] for block in sorted(blocks))


class SampledStates(Protocol):
    """States on a tape, with the controllers called at samples: of a whole scene, or of a controller alone."""

    @property
    def scene(self) -> Any: ...
    @property
    def tape(self) -> Tape: ...
    @property
    def quantities(self) -> Any: ...


def samples(derivation: SampledStates) -> list[Block]:
    """Return the block of the new values of all sampled states, as if all were sampled now."""
    with derivation.tape.block("samples"):
        refs = tuple(derivation.quantities.formula(item.formula).ref for _, item in _sampled_states(derivation))
    return [Block("sample", (len(refs),), refs, "new values of the sampled states")]


def _asked_states(
    derivation: SampledStates, sampled: Mapping[int, Sampling], controllers: Mapping[str, int], refs: Sequence[Ref]
) -> dict[int, set[int]]:
    """Return for each sampled state the numbers of the sampled states whose new values it needs at the same time.
    ``refs`` are the recorded formulas. States with a delay (registers) need none; an output of a controller needs the
    states of the controller's signals."""
    asked: dict[int, set[int]] = {}
    numbers = {state.name: number for number, state in enumerate(derivation.scene.states)}
    for (number, item), ref in zip(sampled.items(), refs, strict=True):
        if item.controller:
            called = derivation.scene.sampled[controllers[item.controller]]
            asked[number] = {numbers[name] for name in called.signal_states}
            continue
        read = set() if item.register else derivation.tape.depends_on([ref])
        states = {symbol.index for symbol in read if symbol.block == "z"}
        asked[number] = {k for k in states if k in sampled and k != number and not sampled[k].register}
    return asked


def sample_rows(derivation: SampledStates) -> tuple[SampleRow, ...]:
    """Return the sampled states of a scene as data for stepping, in order, each with the level of its evaluation.

    A formula that reads another state sampled at the same time takes that state's new value; for its own state and for
    delayed states, the formula takes the previous value. Outputs of a controller come after the controller's signals.

    Raises
    ------
    ModelError
        Sampled states need the new values of each other.
    """
    sampled = dict(_sampled_states(derivation))
    if not sampled:
        return ()
    (block,) = samples(derivation)
    controllers = {item.name: number for number, item in enumerate(derivation.scene.sampled)}
    asked = _asked_states(derivation, sampled, controllers, block.refs)
    levels: dict[int, int] = {}
    while len(levels) < len(sampled):
        ready = [k for k in sampled if k not in levels and asked[k] <= levels.keys()]
        if not ready:
            raise ModelError(_circle(derivation, sampled, levels))
        levels |= {k: 0 if sampled[k].register else 1 + max((levels[j] for j in asked[k]), default=0) for k in ready}
    return tuple(
        SampleRow(k, item.period, item.offset, item.quantum, levels[k], controllers.get(item.controller, -1))
        for k, item in sampled.items()
    )


def _sampled_states(derivation: SampledStates) -> list[tuple[int, Sampling]]:
    return [(k, state.sampling) for k, state in enumerate(derivation.scene.states) if state.sampling is not None]


def _circle(derivation: SampledStates, sampled: Mapping[int, Sampling], levels: Mapping[int, int]) -> Problem:
    left = [k for k in sampled if k not in levels]
    names = ", ".join(derivation.scene.states[k].name for k in left)
    fault = f"the sampled states {names} ask for each other's value at the same time [E0514]"
    return Problem(sampled[left[0]].place, fault, 'a delay of one of them: delay = "1 ms"')
