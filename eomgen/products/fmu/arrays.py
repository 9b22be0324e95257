"""Arrays of FMI 3.0: the numbers of a vector as one variable with a dimension.

The value reference of an array is the one of its first number, so the C keeps its tables of single numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

from eomgen.base.data import dataclass, replace
from eomgen.products.fmu.interface import Interface, Unknown, Variable

#: Kinds of variables whose numbers may be one array; rates follow the states.
_KINDS = ("parameter", "q", "v", "z", "output")
#: Parts of a pose and of its velocity by kind and sizes; names by units.
_PARTS: Mapping[tuple[object, ...], Mapping[str, str]] = {
    ("q", 4, 3): {"": "orientation", "m": "position"},
    ("v", 3, 3): {"rad/s": "angular", "m/s": "linear"},
}
_NUMBERED = re.compile(r"(?s:(?P<base>.+)\[(?P<number>\d+)\])")


@dataclass(frozen=True)
class Listed:
    """A variable of the model description, a scalar or an array.

    Attributes
    ----------
    variable : with name and value reference of the whole
    numbers : the scalar variables of an array, one for a scalar
    """

    variable: Variable
    numbers: tuple[Variable, ...]

    @property
    def size(self) -> int:
        return len(self.numbers)

    @property
    def labels(self) -> Mapping[str, str]:
        """Names of the numbers of an array by their names as scalars."""
        name = self.variable.name
        return {item.name: f"{name}[{index}]" if self.size > 1 else name for index, item in enumerate(self.numbers)}


def listed(interface: Interface) -> tuple[Listed, ...]:
    """Return the variables of the model description in order: vectors as arrays by option, else scalars."""
    variables = interface.variables
    names = _names(variables) if interface.options.arrays else {}
    result, index = list[Listed](), 0
    while index < len(variables):
        item = variables[index]
        state = item.reference if item.derivative is None else item.derivative
        name, size = names.get(state, (item.name, 1))
        if size > 1 and item.derivative is not None:
            name = f"der({name})"
        result.append(Listed(replace(item, name=name), variables[index : index + size]))
        index += size
    return tuple(result)


def folded(interface: Interface, unknowns: Iterable[Unknown]) -> list[Unknown]:
    """Return the entries of the model structure with arrays in place of their numbers.

    An array depends on all arrays with a number that one of its own depends on.
    """
    heads = {item.reference: whole.variable.reference for whole in listed(interface) for item in whole.numbers}
    rows: dict[int, list[Unknown]] = {}
    for unknown in unknowns:
        rows.setdefault(heads[unknown.reference], []).append(unknown)
    return [_united(reference, row, heads) for reference, row in rows.items()]


def _united(reference: int, row: Sequence[Unknown], heads: Mapping[int, int]) -> Unknown:
    kinds: dict[int, set[str]] = {}
    for unknown in row:
        if unknown.dependencies is None:
            return Unknown(reference)
        for dependency, kind in zip(unknown.dependencies, unknown.kinds, strict=True):
            kinds.setdefault(heads[dependency], set()).add(kind)
    every = tuple(sorted(kinds))
    return Unknown(reference, every, tuple(min(kinds[key]) if len(kinds[key]) == 1 else "dependent" for key in every))


def _names(variables: Sequence[Variable]) -> dict[int, tuple[str, int]]:
    """Return (name, size) of each array by the value reference of the first number. A name with several runs of
    numbers, as of a pose, is split into parts by unit; names that exist already make no array."""
    runs = list(_runs(variables))
    sizes: dict[tuple[str, str], list[int]] = {}
    for base, run in runs:
        sizes.setdefault((run[0].kind, base), []).append(len(run))
    taken = {item.name for item in variables}
    result: dict[int, tuple[str, int]] = {}
    for base, run in runs:
        parts = _PARTS.get((run[0].kind, *sizes[run[0].kind, base]), {})
        whole = len(sizes[run[0].kind, base]) == 1
        name = base if whole else f"{base}.{parts.get(run[0].unit, '')}"
        if len(run) > 1 and (whole or parts) and not taken & {name, f"der({name})"}:
            taken |= {name, f"der({name})"}
            result[run[0].reference] = (name, len(run))
    return result


def _runs(variables: Sequence[Variable]) -> Iterator[tuple[str, list[Variable]]]:
    """Yield (name, variables) of numbers ``name[k]`` in a row with equal attributes."""

    def whole_of(item: Variable) -> Variable | None:
        named = _NUMBERED.fullmatch(item.name) if item.kind in _KINDS else None
        return None if named is None else replace(item, name=named["base"], reference=0, index=0, start=None)

    for whole, run in groupby(variables, whole_of):
        if whole is not None:
            yield whole.name, list(run)
