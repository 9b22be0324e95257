"""Sampled states on the tape: the values that they take, and in which order."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.derivation import Derivation
from eomgen.system.signals import SampleRow, Sampling
from eomgen.system.system import Block


def samples(derivation: Derivation) -> list[Block]:
    """Return the values of all sampled states, should all be sampled now."""
    with derivation.tape.block("samples"):
        refs = tuple(derivation.quantities.formula(item.formula).ref for _, item in _sampled(derivation))
    return [Block("sample", (len(refs),), refs, "new values of the sampled states")]


def sample_rows(derivation: Derivation) -> tuple[SampleRow, ...]:
    """Return the sampled states of a scene, in their order.

    A formula that reads another state sampled at the same time takes that state's new value; it takes the previous
    value of its own state and of delayed states. Outputs of a controller come after the controller's signals.

    Raises
    ------
    ModelError
        Sampled states ask for each other.
    """
    sampled = dict(_sampled(derivation))
    if not sampled:
        return ()
    (block,) = samples(derivation)
    asked: dict[int, set[int]] = {}
    numbers = {state.name: number for number, state in enumerate(derivation.scene.states)}
    controllers = {item.name: place for place, item in enumerate(derivation.scene.sampled)}
    for (number, item), ref in zip(sampled.items(), block.refs, strict=True):
        if item.controller:
            called = derivation.scene.sampled[controllers[item.controller]]
            asked[number] = {numbers[name] for name in called.signal_states}
            continue
        states = {symbol.index for symbol in derivation.tape.depends_on([ref]) if symbol.block == "z"}
        asked[number] = {k for k in states if k in sampled and k != number and not sampled[k].register}
        if item.register:
            asked[number] = set()
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


def _sampled(derivation: Derivation) -> list[tuple[int, Sampling]]:
    return [(k, state.sampling) for k, state in enumerate(derivation.scene.states) if state.sampling is not None]


def _circle(derivation: Derivation, sampled: Mapping[int, Sampling], levels: Mapping[int, int]) -> Problem:
    left = [k for k in sampled if k not in levels]
    names = ", ".join(derivation.scene.states[k].name for k in left)
    fault = f"the sampled states {names} ask for each other's value at the same time"
    return Problem(sampled[left[0]].place, fault, 'a delay of one of them: delay = "1 ms"')
