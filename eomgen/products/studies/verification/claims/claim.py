"""Claim: a closed form is the derivative of another function along some directions, or equals a second derivation;
engines evaluate both: the compiled model in doubles, and its tape in complex numbers.

Every claim is a first derivative: a second derivative is the derivative of a first one that is checked itself.

A state is a mapping from input block to array (..., size); ``t`` is a block of size 1 like the others. Motions of a
state along directions are written once for both: by the groups' exponential for real steps, and to first order for
infinitesimal ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass, field
from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie.product import Factor, update
from eomgen.pipeline.model import Model
from eomgen.symbolic.evaluate import evaluate as evaluate_tape
from eomgen.system.description import Description
from eomgen.system.system import System

Array = NDArray[Any]
Blocks = Mapping[str, Array]

#: An imaginary step so small that its square is below the rounding of any number (Squire and Trapp 1998).
COMPLEX_STEP = 1e-40


@dataclass(frozen=True)
class Engine:
    """Functions of a model by name: ``engine(function, blocks)`` gives outputs by name, each (..., *shape).
    ``functions`` maps each function to its input blocks; ``in`` says whether there is a function."""

    factors: Sequence[Factor]
    functions: Mapping[str, tuple[str, ...]]
    call: Callable[[str, Blocks], dict[str, Array]]

    def __call__(self, function: str, blocks: Blocks) -> dict[str, Array]:
        return self.call(function, {name: blocks[name] for name in self.functions[function]})

    def __contains__(self, function: str) -> bool:
        return function in self.functions


def compiled_engine(model: Model, system: System) -> Engine:
    """Return an engine with the compiled functions of a model, in double precision."""
    functions = model.functions

    def call(function: str, blocks: Blocks) -> dict[str, Array]:
        values = functions(function, {name: array[..., 0] if name == "t" else array for name, array in blocks.items()})
        return dict(zip(functions.output_names(function), values, strict=True))

    return Engine(system.factors, {name: tuple(functions.inputs(name)) for name in functions.names}, call)


def on_tape(system: System) -> Engine:
    """Return an engine with the functions of a system, evaluated operation by operation over real or complex arrays."""
    tape = system.tape
    lengths = {name: len(tape.live(function.refs)) for name, function in system.functions.items()}

    def call(function: str, blocks: Blocks) -> dict[str, Array]:
        """Evaluate the outputs of a function for a batch of inputs, in parts of 2^23 values."""
        outputs = system.functions[function].outputs
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in blocks.values()))
        flat = {name: np.broadcast_to(a, (*batch, a.shape[-1])).reshape(-1, a.shape[-1]) for name, a in blocks.items()}
        count = int(np.prod(batch))
        part = max(1, 2**23 // max(lengths[function], 1))
        with np.errstate(all="ignore"):
            values = np.concatenate(
                [
                    np.atleast_2d(  # without inputs there is no batch
                        evaluate_tape(
                            tape, system.functions[function].refs, {n: a[first : first + part] for n, a in flat.items()}
                        )
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


def move_state(engine: Engine, state: Blocks, direction: Blocks, step: complex) -> dict[str, Array]:
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
        result |= {name: base_block(engine, name, result) for name in ("base", "base_rates") if name in state}
    return result


def base_block(engine: Engine, name: str, state: Blocks) -> Array:
    """Return the base's state or further rates as a block, (..., size), at the time of the state."""
    values = engine(name, state)[name]
    return values.reshape(*values.shape[:-2], -1) if name == "base_rates" else values


def spread(state: Blocks) -> dict[str, Array]:
    """Return the state with an axis for directions before the components."""
    return {name: array[..., np.newaxis, :] for name, array in state.items()}


#: Number of components of a block up to which every direction is taken alone; of larger blocks, this number of
#: directions is drawn, half of which are combinations.
COLUMNS = 64
#: The same if each direction is paired with each.
FEW = 12


@dataclass(frozen=True)
class Directions:
    """Directions of differentiation in one block: (size, count), each in the units of the block's scale, with names."""

    matrix: Array
    names: tuple[str, ...]


def directions(names: Sequence[str], scales: Array, rng: np.random.Generator, limit: int = COLUMNS) -> Directions:
    """Return one direction for each component of a block, or ``limit`` random ones for larger blocks. Of the random
    ones, half are components, and half combinations of all. `scales` (size,) are the lengths along each component,
    `names` its names."""
    size, half = len(names), limit // 2
    if size <= limit:
        return Directions(np.diag(scales), tuple(names))
    single = np.sort(rng.choice(size, half, replace=False))
    signs = rng.choice([-1.0, 1.0], (size, half))
    combined = tuple(f"combination {k} of all" for k in range(half))
    return Directions(
        np.concatenate([np.diag(scales)[:, single], scales[:, np.newaxis] * signs], axis=1),
        (*(names[k] for k in single), *combined),
    )


@dataclass(frozen=True)
class Space:
    """The space of a scene's states, for claims: the model, and names, scales and directions of the blocks.

    Attributes
    ----------
    system : System
    engine : Engine
        The compiled functions.
    scene : Scene, or the document of another front end
    description : Description
    along : mapping from q, v, a, z, lam, p to Directions
    few : a selection of directions of v, for checks with a cost in the square of their number
    rows : mapping from ``v``, ``z``, ``lam`` to names
    """

    system: System
    engine: Engine
    scene: object
    description: Description
    along: Mapping[str, Directions]
    few: Directions
    rows: Mapping[str, tuple[str, ...]]

    def has(self, *functions: str) -> bool:
        """Return whether the model has all these functions."""
        return all(function in self.engine for function in functions)


Value = Callable[[Engine, Blocks], Array]
#: Directions of differentiation at states: by block the rates, (..., count, size).
Rates = Callable[[Blocks], dict[str, Array]]


def column(values: Array) -> Array:
    """Return vectors (..., rows) as matrices of one column."""
    return values[..., np.newaxis]


class ClaimOutput:
    """A value of claims: one output of a function, (..., *shape).

    ``ClaimOutput("mass", "M")[..., 0]``, a part of the output, or ``ClaimOutput("mass", "M") @ W`` times a matrix.
    """

    def __init__(self, function: str, entry: str, value: Value | None = None) -> None:
        self.function, self.entry = function, entry
        self._value: Value = value or (lambda engine, state: engine(function, state)[entry])

    def __call__(self, engine: Engine, state: Blocks) -> Array:
        return self._value(engine, state)

    def __getitem__(self, part: Any) -> ClaimOutput:
        return self._with_values(lambda values: values[part])

    def __matmul__(self, matrix: Array) -> ClaimOutput:
        return self._with_values(lambda values: values @ matrix)

    def __rmul__(self, factor: float) -> ClaimOutput:
        return self._with_values(lambda values: factor * values)

    @property
    def column(self) -> ClaimOutput:
        """The output, a vector, as a matrix of one column."""
        return self._with_values(column)

    @property
    def flat(self) -> ClaimOutput:
        """All entries of the output in one vector."""

        def value(engine: Engine, state: Blocks) -> Array:
            batch = np.broadcast_shapes(*(state[block].shape[:-1] for block in engine.functions[self.function]))
            return self(engine, state).reshape(*batch, -1)

        return ClaimOutput(self.function, self.entry, value)

    def _with_values(self, change: Callable[[Array], Array]) -> ClaimOutput:
        return ClaimOutput(self.function, self.entry, lambda engine, state: change(self(engine, state)))


class Second(NamedTuple):
    """Another derivation of a closed form, with its name."""

    name: str
    value: Value

    def __call__(self, engine: Engine, state: Blocks) -> Array:
        return self.value(engine, state)


@dataclass(frozen=True)
class Claim:
    """A claim that a closed form is the derivative of another function, or equals a second derivation.

    Attributes
    ----------
    name, meaning : str
        ``partials.K``, ``d residual / dq``.
    value : callable
        The closed form, (..., rows, columns), from an engine and states.
    source : callable, optional
        The differentiated function, (..., n).
    directions : callable
        Of states: one mapping from blocks to rates (..., count, size).
    combine : callable, optional
        Makes the expected ``value`` from the source's derivatives (..., n, count); the derivatives by default.
    second : callable, optional
        The same numbers by another derivation.
    size : callable, optional
        Natural magnitude (...) of the compared values, if sums may cancel.
    rows, columns : names of rows and columns of ``value``
    functions : names of the functions that the source needs; of an ``ClaimOutput`` its function by default
    sided : whether two exact derivations may take different sides of a kink, as second derivatives of ``min(x, x)`` do
    at : state at which the claim is judged, of a state of the check
    family : the panel of the figure
    """

    name: str
    meaning: str
    value: Value
    source: Value | None = None
    directions: Rates | None = None
    combine: Callable[[Engine, Blocks, Array], Array] | None = None
    second: Second | None = None
    size: Value | None = None
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    functions: tuple[str, ...] = field(default=())
    sided: bool = False
    at: Callable[[Engine, Blocks], dict[str, Array]] = lambda engine, state: dict(state)
    family: str = ""

    @property
    def smooth_functions(self) -> tuple[str, ...]:
        """Functions whose operations decide whether the source is smooth."""
        return (
            (self.source.function,) if not self.functions and isinstance(self.source, ClaimOutput) else self.functions
        )


def jacobian(
    space: Space,
    value: Value,
    source: Value,
    block: str,
    rows: Sequence[str],
    *,
    name: str = "",
    meaning: str = "",
    second: Second | None = None,
    **options: Any,
) -> Claim:
    """Return the claim that ``value`` (..., rows, n) has the partials of ``source`` in a block, left-trivialised in q.

    Outputs have names: ``partials.K`` is ``d r / dq``. ``options`` are further arguments of ``Claim``.
    """
    along = space.along[block]

    def along_directions(of: Value) -> Value:
        return lambda engine, state: np.asarray(of(engine, state) @ along.matrix)

    return Claim(
        name or (f"{value.function}.{value.entry}" if isinstance(value, ClaimOutput) else ""),
        meaning or (f"d {source.entry} / d{block}" if isinstance(source, ClaimOutput) else ""),
        along_directions(value),
        source=source,
        directions=constant_directions({block: along.matrix.T}),
        second=None if second is None else Second(second.name, along_directions(second.value)),
        rows=tuple(rows),
        columns=along.names,
        **options,
    )


#: Each block with the block of its rate along a motion.
_RATES = {"q": "v", "v": "a", "a": "j", "j": "s", "u": "u_dot", "u_dot": "u_ddot"}


def along_motion(engine: Engine, *blocks: str) -> Rates:
    """Return a function that maps a state to the direction of its motion, by block: rates (..., 1, size), and time.
    Blocks without a rate in the state are left out."""

    def directions(state: Blocks) -> dict[str, Array]:
        rates = {block: state[_RATES[block]] for block in blocks if _RATES.get(block) in state}
        if "z" in blocks and "z" in state:
            rates["z"] = engine("internal_rate", state)["zdot"]
        return {block: rate[..., np.newaxis, :] for block, rate in rates.items()} | {"t": np.ones((1, 1))}

    return directions


def constant_directions(rates: dict[str, Array]) -> Rates:
    """Return directions that are the same at all states."""
    return lambda _: rates
