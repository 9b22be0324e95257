"""Engines that evaluate the same functions: the compiled model in doubles, and its tape in complex numbers.

A state is a mapping from input block to array (..., size); ``t`` is a block of size 1 like the others. Motions of a
state along directions are written once for both: by the groups' exponential for real steps, and to first order for
infinitesimal ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie.product import Factor, update
from eomgen.pipeline.model import Model
from eomgen.symbolic.evaluate import evaluate as evaluate_tape
from eomgen.system.system import System

Array = NDArray[Any]
Blocks = Mapping[str, Array]

#: An imaginary step so small that its square vanishes beside anything (Squire and Trapp 1998).
COMPLEX_STEP = 1e-40
#: Numbers that one evaluation of a tape may hold at once.
_HELD = 2**24


@dataclass(frozen=True)
class Engine:
    """Functions by name: ``engine(function, blocks)`` gives outputs by name, each (..., *shape)."""

    factors: Sequence[Factor]
    functions: Mapping[str, tuple[str, ...]]
    call: Callable[[str, Blocks], dict[str, Array]]

    def __call__(self, function: str, blocks: Blocks) -> dict[str, Array]:
        return self.call(function, {name: blocks[name] for name in self.functions[function]})

    def __contains__(self, function: str) -> bool:
        return function in self.functions


def compiled(model: Model, system: System) -> Engine:
    """Return the functions of a compiled model."""
    functions = model.functions

    def call(function: str, blocks: Blocks) -> dict[str, Array]:
        values = functions(function, {name: array[..., 0] if name == "t" else array for name, array in blocks.items()})
        return dict(zip(functions.output_names(function), values, strict=True))

    return Engine(system.factors, {name: tuple(functions.inputs(name)) for name in functions.names}, call)


def on_tape(system: System) -> Engine:
    """Return the functions of a system, operation by operation over NumPy arrays, real or complex."""
    tape = system.tape
    lengths = {name: len(tape.live(function.refs)) for name, function in system.functions.items()}

    def call(function: str, blocks: Blocks) -> dict[str, Array]:
        outputs = system.functions[function].outputs
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in blocks.values()))
        flat = {name: np.broadcast_to(a, (*batch, a.shape[-1])).reshape(-1, a.shape[-1]) for name, a in blocks.items()}
        count = int(np.prod(batch))
        part = max(1, _HELD // (2 * max(lengths[function], 1)))
        with np.errstate(all="ignore"):
            values = np.concatenate(
                [
                    evaluate_tape(
                        tape, system.functions[function].refs, {n: a[first : first + part] for n, a in flat.items()}
                    )
                    for first in range(0, count, part)
                ]
            )
        result, start = {}, 0
        for block in outputs:
            size = len(block.refs)
            result[block.name] = values[:, start : start + size].reshape(*batch, *block.shape)
            start += size
        return result

    return Engine(system.factors, {name: function.inputs for name, function in system.functions.items()}, call)


def moved(engine: Engine, state: Blocks, direction: Blocks, step: complex) -> dict[str, Array]:
    """Return the state moved along a direction; a moving base follows time and parameters, given inputs the parameters.

    Parameters
    ----------
    direction : mapping from block to rates (..., size)
        Left-trivialised for q, so of size nv.
    step : number
        Real: q exp(step rate). Imaginary: to first order in the step, which must be infinitesimal.
    """
    result = dict(state)
    for block, by in direction.items():
        shape = np.broadcast_shapes(state[block].shape[:-1], by.shape[:-1])
        here, rate = (np.broadcast_to(array, (*shape, array.shape[-1])) for array in (state[block], by))
        if block != "q":
            result[block] = here + step * rate
        elif isinstance(step, complex):
            result[block] = here + step * configuration_rate(engine.factors, here, rate)
        else:
            result[block] = update(engine.factors, here, step * rate)
    if "p" in direction and "inputs" in engine and "u" in state:
        laws = (engine("inputs", of)["u"] for of in (state, result))
        result["u"] = result["u"] - next(laws) + next(laws)
    if "t" in direction or "p" in direction:
        result |= {name: prescribed(engine, name, result) for name in ("base", "base_rates") if name in state}
    return result


def prescribed(engine: Engine, name: str, state: Blocks) -> Array:
    """Return the base's state or its further rates as a block, (..., size), at the state's time."""
    values = engine(name, state)[name]
    return values.reshape(*values.shape[:-2], -1) if name == "base_rates" else values


def spread(state: Blocks) -> dict[str, Array]:
    """Return the state with an axis for directions before the components."""
    return {name: array[..., np.newaxis, :] for name, array in state.items()}
