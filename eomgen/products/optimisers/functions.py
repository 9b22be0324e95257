"""Functions of a model, and equations that these form, with patterns of first and second derivatives in components of
q."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass, replace
from eomgen.codegen.program import Program
from eomgen.products.optimisers.group_functions import GroupFunction, group_function
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS

Places = NDArray[np.int64]


@dataclass(frozen=True)
class Pattern:
    """Nonzeros: positions, and places of the values among computed numbers, in the order of compressed columns.

    Attributes
    ----------
    shape : rows and columns
    rows, columns, places : (nonzeros,)
    """

    shape: tuple[int, int]
    rows: Places
    columns: Places
    places: Places

    def block(self, rows: slice, columns: slice) -> Pattern:
        """Return the pattern of a block of the matrix, with rows and columns counted from its corner; places stay."""
        inside = (rows.start <= self.rows) & (self.rows < rows.stop)
        inside &= (columns.start <= self.columns) & (self.columns < columns.stop)
        shape = rows.stop - rows.start, columns.stop - columns.start
        return Pattern(shape, self.rows[inside] - rows.start, self.columns[inside] - columns.start, self.places[inside])

    @property
    def transpose(self) -> Pattern:
        """The transposed matrix."""
        return column_order(self.shape[::-1], self.columns, self.rows, self.places)

    @property
    def casadi_sparsity(self) -> tuple[int, ...]:
        """Rows, columns, starts of the columns and rows of the nonzeros, in the form of CasADi."""
        height, width = self.shape
        if len(self.rows) == height * width and width:
            return height, width, 1
        starts = np.cumsum(np.bincount(self.columns, minlength=width))
        return (height, width, 0, *starts.tolist(), *self.rows.tolist())


def column_order(shape: tuple[int, int], rows: Places, columns: Places, places: Places) -> Pattern:
    """Return a pattern in the order of compressed columns."""
    order = np.lexsort((rows, columns))
    return Pattern(shape, rows[order], columns[order], places[order])


def symmetric(width: int, low: Places, left: Places) -> Pattern:
    """Return the pattern of both triangles of a symmetric matrix from rows `low` and columns `left` of its lower
    triangle. Places are the indices of the nonzeros in the lower triangle."""
    numbers, off = np.arange(len(low)), low != left
    rows, columns = np.concatenate([low, left[off]]), np.concatenate([left, low[off]])
    return column_order((width, width), rows, columns, np.concatenate([numbers, numbers[off]]))


def dense(height: int, width: int = 1) -> Pattern:
    """Return the pattern of a full matrix, with places column by column."""
    columns, rows = np.divmod(np.arange(height * width), height)
    return Pattern((height, width), rows, columns, np.arange(height * width))


def empty(height: int, width: int) -> Pattern:
    """Return the pattern of a matrix of zeros."""
    none = np.zeros(0, np.int64)
    return Pattern((height, width), none, none, none)


@dataclass(frozen=True)
class Exported:
    """A function with first and second derivatives.

    Attributes
    ----------
    name : of the function in the model; ``step``
    sizes : numbers of each input, in order
    output : name and number of rows
    jacobian, hessian : patterns over all inputs side by side; places in the results of the compiled functions
    first, work : numbers that the first derivatives take, and all derivatives with intermediate results
    components : of functions of quaternions, products that give derivatives in components of q
    """

    name: str
    sizes: Mapping[str, int]
    output: tuple[str, int]
    jacobian: Pattern
    hessian: Pattern
    first: int
    work: int
    components: Mapping[str, Any] | None = None

    @property
    def work_of_hessian(self) -> int:
        """Count of numbers in the Hessian."""
        return len(self.lower.rows) if self.components is not None else self.work - self.first

    @cached_property
    def lower(self) -> Pattern:
        """The lower triangle of the Hessian."""
        of, low = self.hessian, self.hessian.rows >= self.hessian.columns
        return Pattern(of.shape, of.rows[low], of.columns[low], of.places[low])

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Columns of each input."""
        result, start = dict[str, slice](), 0
        for name, size in self.sizes.items():
            result[name], start = slice(start, start + size), start + size
        return result


def plain(program: Program, name: str) -> Exported:
    """Return the function `name` of a model with the patterns of first and second derivatives. Derivatives are in
    components of q if the configuration has rotations; arguments on which neither value nor derivatives depend are left
    out."""
    function = program.function(name)
    terms = [term for term in (name, f"{name}_derivatives", f"{name}_hessian") if term in program.function_names]
    taken = {block for term in terms for block in program.function(term).inputs}
    taken |= {"t"} if "base" in taken else set()
    sizes = {block: program.input_size(block) for block in ARGUMENTS if block in taken and block != "base"}
    sizes = {block: size for block, size in sizes.items() if size}
    if "q" in sizes:
        sizes["q"] = program.sizes["v"]
    columns, height = _columns(program, sizes), sum(output.size for output in function.outputs)
    width = sum(sizes.values())
    rows, across = unpacked_places(program.patterns[f"{name}_derivatives"])
    low, left = (columns[places] for places in unpacked_places(program.patterns[f"{name}_hessian"]))
    jacobian = column_order((height, width), rows, columns[across], np.arange(len(rows)))
    output, first = (function.outputs[0].name, height), len(rows)
    result = Exported(name, sizes, output, jacobian, symmetric(width, low, left), first, first + len(low))
    return in_components(program, result) if turning(program) and "q" in sizes else result


def turning(program: Program) -> list[str]:
    """Return the parts of the configuration with a turn: rotations, poses, angles over all turns."""
    return [*(str(factor["name"]) for factor in program.factors if factor["group"] != "R"), *program.angles]


class _Map(NamedTuple):
    """The map from changes of the components of q to left-trivialised directions, by places among numbers in C.

    Attributes
    ----------
    columns : (component, place) of the entries of T of each direction; place 0 is the number 1
    bends : (direction, component, component, place) of the entries of S, lower triangles
    factors : places of rotations and poses
    first, second : numbers of T and of S
    """

    columns: dict[int, list[tuple[int, int]]]
    bends: list[tuple[int, int, int, int]]
    factors: list[dict[str, Any]]
    first: int
    second: int


def _map_of(program: Program, rest: int) -> _Map:
    """Return the map from components of q, and of `rest` further arguments, to directions of v and these arguments."""
    result, first, second = _Map({}, [], [], 0, 0), 1, 0
    for factor in program.factors:
        q, v, group = int(factor["q_start"]), int(factor["v_start"]), str(factor["group"])
        if group == "R":
            result.columns.update({v + k: [(q + k, 0)] for k in range(int(factor["v_size"]))})
            continue
        pose = group == "SE3"
        result.factors.append({"q": q, "first": first, "second": second, "pose": pose})
        pairs = [(a, b) for a in range(4) for b in range(a + 1)]
        for i in range(3):
            result.columns[v + i] = [(q + a, first + 4 * i + a) for a in range(4)]
            result.bends.extend((v + i, q + a, q + b, second + 10 * i + k) for k, (a, b) in enumerate(pairs))
        for i in range(3) if pose else ():
            result.columns[v + 3 + i] = [(q + 4 + j, first + 12 + 3 * i + j) for j in range(3)]
            mixed = [(q + 4 + j, q + a, second + 30 + 12 * i + 3 * a + j) for a in range(4) for j in range(3)]
            result.bends.extend((v + 3 + i, *places) for places in mixed)
        first, second = first + (21 if pose else 12), second + (66 if pose else 30)
    nq, nv = program.input_size("q"), program.sizes["v"]
    result.columns.update({nv + k: [(nq + k, 0)] for k in range(rest)})
    return result._replace(first=first, second=second)


def _entries(pattern: Pattern) -> list[tuple[int, int, int]]:
    """Return row, column and place of each nonzero."""
    return list(zip(pattern.rows.tolist(), pattern.columns.tolist(), pattern.places.tolist(), strict=True))


def in_components(program: Program, tangent: Exported) -> Exported:
    """Return the function `tangent` with derivatives in components of q in place of left-trivialised directions. Near
    q, f(q + dq) = f(q exp(d)) with d_i = T_i dq + 1/2 dq^T S_i dq + ..., so that the Jacobian is J T, and the Hessian
    of weights . f is T^T H T + sum_i (J^T weights)_i S_i. Changes of the length of a quaternion do not count."""
    rest = sum(tangent.sizes.values()) - program.sizes["v"]
    width, to_q = program.input_size("q") + rest, _map_of(program, rest)
    entries = _entries(tangent.jacobian)
    known, of_first = _collect(
        ((row, c), number, column) for row, k, number in entries for c, column in to_q.columns[k]
    )
    middle, of_middle = _collect(
        ((row, c), number, column) for row, k, number in _entries(tangent.hessian) for c, column in to_q.columns[k]
    )
    there = {column for _, column, _ in entries} & {i for i, *_ in to_q.bends}
    slots = {i: k for k, i in enumerate(sorted(there))}
    of_second = [((c, k), number, column) for (row, k), number in middle.items() for c, column in to_q.columns[row]]
    bent = [((a, b), slots[i], entry) for i, a, b, entry in to_q.bends if i in slots]
    lower = sorted({entry for entry, *_ in [*of_second, *bent] if entry[0] >= entry[1]})
    targets = {entry: k for k, entry in enumerate(lower)}
    tables = {
        "first": of_first,
        "middle": of_middle,
        "second": [(targets[entry], a, b) for entry, a, b in of_second if entry in targets],
        "bent": [(targets[entry], slot, b) for entry, slot, b in bent],
        "gradient": [(slots[column], number, row) for row, column, number in entries if column in slots],
    }
    counts = {"J": len(known), "H": len(lower), "of_J": tangent.first, "of_H": tangent.work - tangent.first}
    counts |= {"T": to_q.first, "S": to_q.second, "gradient": len(slots), "middle": len(middle)}
    places = dict(zip(counts, np.cumsum([0, *counts.values()]).tolist(), strict=False))
    low, across = np.array(list(known), np.int64).reshape(-1, 2).T
    return replace(
        tangent,
        sizes={**tangent.sizes, "q": program.input_size("q")},
        jacobian=column_order((tangent.output[1], width), low, across, np.arange(len(known))),
        hessian=symmetric(width, *np.array(lower, np.int64).reshape(-1, 2).T),
        first=len(known),
        work=sum(counts.values()),
        components={"counts": counts, "places": places, "tables": tables, "factors": to_q.factors},
    )


def _collect(
    products: Iterable[tuple[tuple[int, int], int, int]],
) -> tuple[dict[tuple[int, int], int], list[tuple[int, int, int]]]:
    """Return numbers for the distinct (row, column) of products, by first use, and (number, left, right) for each
    product. A product is given as ((row, column), left, right)."""
    known: dict[tuple[int, int], int] = {}
    return known, [(known.setdefault(entry, len(known)), left, right) for entry, left, right in products]


def _columns(program: Program, sizes: Mapping[str, int]) -> Places:
    """Return for each direction of all arguments in the order of ``ARGUMENTS`` its column among the arguments in
    `sizes`, -1 for arguments that are not there. q has as many directions as v."""
    every = {block: 1 if block == "t" else program.input_size({"q": "v"}.get(block, block)) for block in ARGUMENTS}
    start, column, places = 0, 0, np.full(sum(every.values()), -1)
    for block, size in every.items():
        if block in sizes:
            places[start : start + size] = np.arange(column, column + size)
            column += size
        start += size
    return places


@dataclass(frozen=True)
class Part:
    """Rows of equations that are one function of the model, or of a rotation or pose.

    Attributes
    ----------
    function : with derivatives
    row : first row
    sign : 1, or -1 of the negative function after a rate
    columns : column of each direction of the function, -1 of other directions
    group : of a rotation or pose: the function, and the first components of q and of v
    """

    function: Exported
    row: int
    sign: int
    columns: Places
    group: tuple[GroupFunction, int, int] | None = None

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.function.output[1]


class Equations:
    """Rates of q, and further rows that are functions of the model, with derivatives.

    Numbers of the Jacobian are the nonzeros of the functions one after another, then 1 and -1.

    Parameters
    ----------
    program : Program
    sizes : numbers of each argument in which the rows are differentiated, in order, x first
    functions : (function, first row, sign) of each function
    places : first column of each of q, v, a, z, lam, u, p and t in which the rows are differentiated
    implicit : whether rows of rates are xdot less the rate, xdot in the columns after x

    Attributes
    ----------
    parts : rows that are one function
    jacobian, lower : patterns of the Jacobian, and of the Hessian's lower triangle
    """

    def __init__(
        self,
        program: Program,
        sizes: Mapping[str, int],
        functions: Sequence[tuple[Exported, int, int]],
        places: Mapping[str, int],
        *,
        implicit: bool = False,
    ) -> None:
        """Collect the rows of all functions and the patterns of both derivatives."""
        self.nq, self.nv, self.nz = program.input_size("q"), program.sizes["v"], program.sizes["z"]
        self.nx = self.nq + self.nv + self.nz
        self.sizes = dict(sizes)
        self.width = sum(sizes.values())
        sign, linear = -1 if implicit else 1, list[tuple[int, int, int]]()
        self.parts: list[Part] = []
        #: First components of q and of v, and number, of coordinates that are plain numbers.
        self.plain: list[tuple[int, int, int]] = []
        for factor in program.factors:
            q, v, size = int(factor["q_start"]), int(factor["v_start"]), int(factor["v_size"])
            if factor["group"] == "R":
                self.plain.append((q, v, size))
                linear += [(q + k, places["v"] + v + k, sign) for k in range(size)]
                continue
            rate = group_function("configuration_rate", str(factor["group"]))
            columns = np.concatenate([np.arange(rate.size) + q, np.arange(size) + places["v"] + v])
            self.parts.append(Part(exported_group_function(rate), q, sign, columns, (rate, q, v)))
        if implicit:
            rows = [*range(self.nq), *range(self.nq + self.nv, self.nx)]
            linear += [(row, self.nx + row, 1) for row in rows]
        for function, row, sign_of_rows in functions:
            known = [
                np.arange(size) + places[name] if name in places else np.full(size, -1)
                for name, size in function.sizes.items()
            ]
            self.parts.append(Part(function, row, sign_of_rows, np.concatenate(known).astype(np.int64)))
        self.height = max([part.row + part.size for part in self.parts], default=0)
        self.count = sum(part.function.first for part in self.parts)
        self.hessian_count = sum(part.function.work_of_hessian for part in self.parts)
        #: Further numbers that functions of rotations take.
        self.scratch = max((part.function.work for part in self.parts if part.function.components), default=0)
        self.jacobian, self.lower = self._jacobian(linear), self._lower()

    def _jacobian(self, linear: Sequence[tuple[int, int, int]]) -> Pattern:
        """Return the pattern of the Jacobian of all rows. `linear` has (row, column, sign) of rates that are single
        arguments."""
        first, places = 0, list[tuple[Any, ...]]()
        for part in self.parts:
            jacobian = part.function.jacobian
            places.append((jacobian.rows + part.row, part.columns[jacobian.columns], jacobian.places + first))
            first += part.function.first
        signs = [(row, column, first + (sign < 0)) for row, column, sign in linear]
        places.append(tuple(np.array(signs, np.int64).reshape(-1, 3).T))
        return _gather((self.height, self.width), places)

    def _lower(self) -> Pattern:
        """Return the lower triangle of the Hessian of weighted rows as a pattern, in the arguments of
        differentiation."""
        first, places = 0, list[tuple[Any, ...]]()
        for part in self.parts:
            hessian = part.function.lower
            row_columns, second = part.columns[hessian.rows], part.columns[hessian.columns]
            column = np.where((row_columns >= 0) & (second >= 0), np.minimum(row_columns, second), -1)
            places.append((np.maximum(row_columns, second), column, hessian.places + first))
            first += part.function.work_of_hessian
        return _gather((self.width, self.width), places)

    @property
    def groups(self) -> list[GroupFunction]:
        """Functions of rotations and poses, each once."""
        return list({part.group[0].name: part.group[0] for part in self.parts if part.group is not None}.values())

    @property
    def takes_time(self) -> bool:
        """Whether a function takes the time."""
        return any("t" in part.function.sizes for part in self.parts)

    @property
    def firsts(self) -> dict[str, int]:
        """First column of each argument."""
        return dict(zip(self.sizes, np.cumsum([0, *self.sizes.values()]).tolist(), strict=False))

    def block(self, name: str) -> Pattern:
        """Return the Jacobian in one argument."""
        first = self.firsts[name]
        return self.jacobian.block(slice(0, self.height), slice(first, first + self.sizes[name]))


def _gather(shape: tuple[int, int], parts: Sequence[tuple[Any, ...]]) -> Pattern:
    """Return the pattern of rows, columns and places side by side, without negative columns."""
    rows, columns, places = (np.concatenate([np.zeros(0, np.int64), *arrays]) for arrays in zip(*parts, strict=True))
    kept = columns >= 0
    return column_order(shape, rows[kept], columns[kept], places[kept])


def rates(program: Program, functions: Sequence[Exported]) -> Equations | None:
    """Return the rates of x = (q, v, z) as equations in x and u; None without the functions of the model, with
    derivatives, that are needed."""
    nq, nv, nz = program.input_size("q"), program.sizes["v"], program.sizes["z"]
    by_name = {function.name: function for function in functions}
    if "forward_dynamics" not in by_name or (nz and "internal_rate" not in by_name):
        return None
    parts = [(by_name["forward_dynamics"], nq, 1)]
    parts += [(by_name["internal_rate"], nq + nv, 1)] if nz else []
    places = {"q": 0, "v": nq, "z": nq + nv, "u": nq + nv + nz}
    return Equations(program, {"x": nq + nv + nz, "u": program.sizes["u"]}, parts, places)


def exported_group_function(function: GroupFunction) -> Exported:
    """Return a function of rotations or poses in the form of the model's functions, with patterns of derivatives."""
    width = sum(function.sizes.values())
    rows, columns = np.array(function.jacobian).T
    low, left = np.array(function.hessian).T
    jacobian = column_order((function.size, width), rows, columns, np.arange(len(rows)))
    output, work = ("out", function.size), len(rows) + len(low)
    return Exported(function.name, function.sizes, output, jacobian, symmetric(width, low, left), len(rows), work)


def dense_pattern(nonzero: NDArray[np.bool_], width: int) -> Pattern:
    """Return the pattern of nonzeros that are computed row by row in a whole matrix."""
    columns, rows = np.nonzero(nonzero.T)
    return Pattern((nonzero.shape[0], nonzero.shape[1]), rows, columns, rows * width + columns)


def lower_pattern(nonzero: NDArray[np.bool_]) -> Pattern:
    """Return the pattern of a symmetric matrix, of which the lower triangle is computed row by row."""
    pattern = dense_pattern(nonzero, len(nonzero))
    high, low = np.maximum(pattern.rows, pattern.columns), np.minimum(pattern.rows, pattern.columns)
    return replace(pattern, places=high * len(nonzero) + low)
