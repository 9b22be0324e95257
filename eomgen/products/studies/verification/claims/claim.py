"""Claim: a closed form is the derivative of another function along some directions, or equals a second derivation.

Every claim is a first derivative: a second derivative is the derivative of a first one that is checked itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from eomgen.products.studies.verification.engines import Array, Blocks, Engine

#: Components of a block up to which every direction is taken alone; beyond, that many are drawn, half of them
#: combinations.
COLUMNS = 64
#: The same if each direction is paired with each.
FEW = 12


@dataclass(frozen=True)
class Directions:
    """Directions of differentiation in one block: (size, count), each in the units of its scale, with their names."""

    matrix: Array
    names: tuple[str, ...]


def directions(names: Sequence[str], scales: Array, rng: np.random.Generator, limit: int = COLUMNS) -> Directions:
    """Return one direction for each component, or ``limit`` random ones: half components, half combinations of all."""
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
    """The space of a scene's states: names, scales and directions of the blocks, and names of rows for messages.

    Attributes
    ----------
    along : mapping from q, v, a, z, lam, p to Directions
    few : some directions of v, for checks with a cost in the square of their number
    rows : mapping from ``v``, ``z``, ``lam``, ... to names
    length : float
        Size of the scene in m, the scale of travels.
    """

    nv: int
    holonomic: int
    bodies: tuple[str, ...]
    along: Mapping[str, Directions]
    few: Directions
    rows: Mapping[str, tuple[str, ...]]
    length: float = 1.0


Value = Callable[[Engine, Blocks], Array]


@dataclass(frozen=True)
class Claim:
    """One closed form.

    Attributes
    ----------
    name, meaning, family : str
        ``partials.K``, ``d residual / dq``, and the panel of the figure that it belongs to.
    value : callable
        The closed form, (..., rows, columns), from an engine and states.
    source : callable, optional
        The differentiated function, (..., n).
    directions : callable
        Of states: one mapping from blocks to rates (..., count, size).
    combine : callable, optional
        Makes the expected ``value`` from the source's derivatives (..., n, count); these themselves by default.
    second : callable, optional
        The same numbers by another derivation, which ``second_name`` names.
    size : callable, optional
        Natural magnitude (...) of the compared values, if sums may cancel.
    functions : names of the functions that the source needs
    sided : whether two exact derivations may take different sides of a kink, as second derivatives of ``min(x, x)`` do
    """

    name: str
    meaning: str
    family: str
    value: Value
    source: Value | None = None
    directions: Callable[[Blocks], dict[str, Array]] | None = None
    combine: Callable[[Engine, Blocks, Array], Array] | None = None
    second: Value | None = None
    second_name: str = ""
    size: Callable[[Engine, Blocks], Array] | None = None
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    functions: tuple[str, ...] = field(default=())
    sided: bool = False


def output(function: str, name: str) -> Value:
    """Return a function that gives one output of a function as a vector."""
    return lambda engine, state: engine(function, state)[name]


def column(values: Array) -> Array:
    """Return vectors (..., rows) as matrices of one column."""
    return values[..., np.newaxis]


def jacobian(
    space: Space,
    family: str,
    function: str,
    entry: str,
    source: tuple[str, str],
    block: str,
    rows: Sequence[str],
    *,
    of: str = "",
    second: Value | None = None,
    second_name: str = "",
    size: Value | None = None,
) -> Claim:
    """Return the claim of a matrix of partials of ``source`` (function, output) in a block, left-trivialised in q.

    ``of`` names the source in messages; its output by default.
    """
    along = space.along[block]
    matrix = along.matrix

    def value(engine: Engine, state: Blocks) -> Array:
        return np.asarray(engine(function, state)[entry] @ matrix)

    def of_second(engine: Engine, state: Blocks) -> Array:
        return np.asarray(second(engine, state) @ matrix) if second is not None else np.zeros(0)

    return Claim(
        f"{function}.{entry}",
        f"d {of or source[1]} / d{block}",
        family,
        value,
        source=output(*source),
        directions=lambda _: {block: matrix.T},
        second=of_second if second is not None else None,
        second_name=second_name,
        rows=tuple(rows),
        columns=along.names,
        functions=(source[0],),
        size=size,
    )


def along_motion(*blocks: tuple[str, str]) -> Callable[[Blocks], dict[str, Array]]:
    """Return the direction of the motion in the given blocks, each with the block that is its rate, and in time."""

    def directions(state: Blocks) -> dict[str, Array]:
        rates = {block: state[rate][..., np.newaxis, :] for block, rate in blocks}
        return rates | {"t": np.ones((1, 1))} if "t" in state else rates

    return directions


def fixed(rates: dict[str, Array]) -> Callable[[Blocks], dict[str, Array]]:
    """Return directions that are the same at all states."""
    return lambda _: rates
