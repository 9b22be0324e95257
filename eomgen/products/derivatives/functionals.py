"""Functionals of a run: sums over the rows to one number, linear in the outputs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.arguments import check_name, numbers
from eomgen.errors import Problem, UsageError

#: A text like ``final(tip)``, or weights of each row by output.
Functional = str | Mapping[str, ArrayLike]
KINDS = ("final", "integral", "mean", "sum")
_CALL = re.compile(r"\s*(\w+)\s*\(\s*(.+?)\s*\)\s*")


@dataclass(frozen=True)
class RowWeights:
    """Weights of outputs at the rows of a run, whose sum is a functional.

    Attributes
    ----------
    outputs : weights of the chosen outputs' components, (outputs,)
    kind : of ``KINDS``; ``given``: ``table`` (rows, outputs) says all
    """

    outputs: Array
    kind: str
    table: Array | None = None

    def row_weights(self, first: int, count: int, steps: int, step: float) -> Array:
        """Return the weights (count, outputs) of ``count`` rows from row ``first`` on.

        Parameters
        ----------
        first, count : int
            First row, and number of rows.
        steps : int
            Number of steps of the run.
        step : float
            Equal size of the steps, s.
        """
        if self.table is not None:
            return self.table[first : first + count]
        number = np.arange(first, first + count)
        last, ends = number == steps, (number == 0) | (number == steps)
        trapezoid = np.where(ends, 0.5, 1.0)
        of_row = {
            "final": np.where(last, 1.0, 0.0),
            "integral": step * trapezoid,
            "mean": trapezoid / steps,
            "sum": np.ones(count),
        }[self.kind]
        return of_row[:, np.newaxis] * self.outputs


def read_functional(
    text: object, components: Mapping[str, Sequence[int]], size: int, steps: int, every: int
) -> RowWeights:
    """Return the row weights of a functional, given as a text ``final(tip)`` or as weights by output.

    Parameters
    ----------
    text : the text, or a mapping from outputs to weights of recorded rows or of all rows
    components : indices of each output's components among the chosen components
    size : number of these
    steps : of the run
    every : steps between recorded rows

    Raises
    ------
    UsageError
        An unknown kind or output, several components, weights of another shape.
    """
    if isinstance(text, str):
        return _from_text(text, components, size)
    if not isinstance(text, Mapping) or not text:
        fault = f"a functional is a text or weights by output, not {type(text).__name__} [E0573]"
        raise UsageError(Problem("of", fault, f'"final({next(iter(components), "output")})"'))
    table = np.zeros((steps + 1, size))
    for name, weights in text.items():
        places = _places(str(name), components)
        array = numbers(f"weights of {name}", weights)
        # of recorded rows, or of the rows of all steps
        shapes = [(rows, *([len(places)] if len(places) > 1 else [])) for rows in (steps // every + 1, steps + 1)]
        if array.shape not in shapes or not np.all(np.isfinite(array)):
            fault = f"weights of {name} have the shape {array.shape} [E0574]"
            if array.shape in shapes:
                fault = f"{name} has nan [E0575]"
            raise UsageError(Problem("of", fault, f"finite numbers, {shapes[0]}: one for each row of the run"))
        table[:: every if array.shape == shapes[0] else 1, places] += array.reshape(len(array), len(places))
    return RowWeights(np.ones(size), "given", table)


def _from_text(text: str, components: Mapping[str, Sequence[int]], size: int) -> RowWeights:
    match = _CALL.fullmatch(text)
    hint = f'"final({next(iter(components), "output")})"; or integral, mean, sum; or weights {{output: array}}'
    if match is None or match[1] not in KINDS:
        raise UsageError(Problem("of", f"the functional {text!r} is none of a run [E0576]", hint))
    places = _places(match[2], components)
    if len(places) > 1:
        fault = f"the output {match[2]} has {len(places)} components, and a functional is one number [E0577]"
        raise UsageError(Problem("of", fault, f'"{match[1]}({match[2]}[0])"'))
    weights = np.zeros(size)
    weights[places] = 1.0
    return RowWeights(weights, match[1])


def consecutive(sizes: Mapping[str, int]) -> dict[str, list[int]]:
    """Return for each output the consecutive numbers of its components, from the sizes of all."""
    ends = np.cumsum(list(sizes.values())).tolist()
    return {name: list(range(end - size, end)) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def _places(name: str, components: Mapping[str, Sequence[int]]) -> list[int]:
    """Return the indices of an output, or of a component, ``tip[1]``."""
    match = re.fullmatch(r"(.+)\[(\d+)\]", name)
    if match is not None and match[1] in components and int(match[2]) < len(components[match[1]]):
        return [components[match[1]][int(match[2])]]
    check_name("output", name, list(components))
    return list(components[name])


def component(tables: Mapping[str, Array], label: str) -> Array:
    """Return the table of an output, or of a component, ``tip[0]``: (rows, ...) of (rows, size, ...)."""
    name, bracket, rest = label.partition("[")
    return tables[name][:, int(rest.rstrip("]"))] if bracket else tables[name]
