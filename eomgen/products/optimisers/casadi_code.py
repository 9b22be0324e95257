"""The target ``casadi``: C with the interface of CasADi's external functions, values, Jacobians and Hessians.

Of a function NAME with inputs i and one output, CasADi looks for ``jac_NAME`` (of the inputs, and the output: a block
for each input), ``adj1_NAME`` (inputs, output, weights: a gradient for each input) and ``jac_adj1_NAME`` (inputs,
output, weights, gradients: the blocks of the Hessian, of the weights, and empty ones). Sparsity is by compressed
columns.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import chain
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import nearest, shown
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import fingerprint, generate_files
from eomgen.codegen.targets.c.templates import environment
from eomgen.codegen.targets.target import Target
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.register import method_named
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS, DIFFERENTIATED

Places = NDArray[np.int64]
#: Terms that are written by name alone.
_BY_NAME = ("constraint_acceleration", "frame_poses")
#: Method of the function ``step``.
METHOD = "rk4"


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
        """Return the block of some rows and columns."""
        inside = (rows.start <= self.rows) & (self.rows < rows.stop)
        inside &= (columns.start <= self.columns) & (self.columns < columns.stop)
        shape = rows.stop - rows.start, columns.stop - columns.start
        return Pattern(shape, self.rows[inside] - rows.start, self.columns[inside] - columns.start, self.places[inside])

    @property
    def transposed(self) -> Pattern:
        """The transposed matrix."""
        return ordered(self.shape[::-1], self.columns, self.rows, self.places)

    @property
    def compressed(self) -> tuple[int, ...]:
        """Rows, columns, starts of the columns and rows of the nonzeros, in the form of CasADi."""
        height, width = self.shape
        if len(self.rows) == height * width and width:
            return height, width, 1
        starts = np.cumsum(np.bincount(self.columns, minlength=width))
        return (height, width, 0, *starts.tolist(), *self.rows.tolist())


def ordered(shape: tuple[int, int], rows: Places, columns: Places, places: Places) -> Pattern:
    """Return a pattern in the order of compressed columns."""
    order = np.lexsort((rows, columns))
    return Pattern(shape, rows[order], columns[order], places[order])


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

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Columns of each input."""
        result, start = dict[str, slice](), 0
        for name, size in self.sizes.items():
            result[name], start = slice(start, start + size), start + size
        return result


def plain(program: Program, name: str) -> Exported:
    """Return a function of the model, whose derivatives are functions of the model."""
    function = program.function(name)
    terms = [term for term in (name, f"{name}_derivatives", f"{name}_hessian") if term in program.function_names]
    taken = {block for term in terms for block in program.function(term).inputs}
    taken |= {"t"} if "base" in taken else set()
    sizes = {block: program.input_size(block) for block in ARGUMENTS if block in taken and block != "base"}
    sizes = {block: size for block, size in sizes.items() if size}
    if "q" in sizes:
        sizes["q"] = program.sizes["v"]
    columns, height, width = _columns(program, sizes), function.outputs[0].size, sum(sizes.values())
    rows, across = unpacked_places(program.patterns[f"{name}_derivatives"])
    low, left = (columns[places] for places in unpacked_places(program.patterns[f"{name}_hessian"]))
    numbers, off = np.arange(len(low)), low != left
    both = ordered(
        (width, width),
        np.concatenate([low, left[off]]),
        np.concatenate([left, low[off]]),
        np.concatenate([numbers, numbers[off]]),
    )
    jacobian = ordered((height, width), rows, columns[across], np.arange(len(rows)))
    output, first = (function.outputs[0].name, height), len(rows)
    result = Exported(name, sizes, output, jacobian, both, first, first + len(numbers))
    return in_components(program, result) if turning(program) and "q" in sizes else result


def turning(program: Program) -> list[str]:
    """Return the parts of the configuration with a turn: rotations, poses, angles over all turns."""
    return [*(str(factor["name"]) for factor in program.factors if factor["group"] != "R"), *program.angles]


#: Numbers of the maps from changes of the components of a rotation or a pose to left-trivialised tangents: of the first
#: order, and of the second order (lower triangles).
_FIRST, _SECOND = {"SO3": 12, "SE3": 21}, {"SO3": 30, "SE3": 66}


@dataclass(frozen=True)
class _Map:
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
    """Return the map of a configuration, and of ``rest`` further arguments."""
    result = _Map({}, [], [], 1, 0)
    for factor in program.factors:
        q, v, group = int(factor["q_start"]), int(factor["v_start"]), str(factor["group"])
        if group == "R":
            result.columns.update({v + k: [(q + k, 0)] for k in range(int(factor["v_size"]))})
            continue
        first, second, pose = result.first, result.second, group == "SE3"
        result.factors.append({"q": q, "first": first, "second": second, "pose": pose})
        pairs = [(a, b) for a in range(4) for b in range(a + 1)]
        for i in range(3):
            result.columns[v + i] = [(q + a, first + 4 * i + a) for a in range(4)]
            result.bends.extend((v + i, q + a, q + b, second + 10 * i + k) for k, (a, b) in enumerate(pairs))
        for i in range(3) if pose else ():
            result.columns[v + 3 + i] = [(q + 4 + j, first + 12 + 3 * i + j) for j in range(3)]
            mixed = [(q + 4 + j, q + a, second + 30 + 12 * i + 3 * a + j) for a in range(4) for j in range(3)]
            result.bends.extend((v + 3 + i, *places) for places in mixed)
        result = replace(result, first=first + _FIRST[group], second=second + _SECOND[group])
    nq, nv = program.input_size("q"), program.sizes["v"]
    result.columns.update({nv + k: [(nq + k, 0)] for k in range(rest)})
    return result


def _entries(pattern: Pattern) -> list[tuple[int, int, int]]:
    """Return row, column and place of each nonzero."""
    return list(zip(pattern.rows.tolist(), pattern.columns.tolist(), pattern.places.tolist(), strict=True))


def in_components(program: Program, tangent: Exported) -> Exported:
    """Return a function with derivatives in the components of q, from derivatives in left-trivialised directions.

    Near q, f(q + dq) = f(q exp(d)) with d_i = T_i dq + 1/2 dq^T S_i dq + ..., so that the Jacobian is J T, and the
    Hessian of weights . f is T^T H T + sum_i (J^T weights)_i S_i. Changes of the length of a quaternion do not count.
    """
    rest = sum(tangent.sizes.values()) - program.sizes["v"]
    width, to_q = program.input_size("q") + rest, _map_of(program, rest)
    entries = _entries(tangent.jacobian)
    known, of_first = _collected(
        ((row, c), number, place) for row, k, number in entries for c, place in to_q.columns[k]
    )
    middle, of_middle = _collected(
        ((row, c), number, place) for row, k, number in _entries(tangent.hessian) for c, place in to_q.columns[k]
    )
    there = {column for _, column, _ in entries} & {i for i, *_ in to_q.bends}
    slots = {i: k for k, i in enumerate(sorted(there))}
    of_second = [((c, k), number, place) for (row, k), number in middle.items() for c, place in to_q.columns[row]]
    bent = [((a, b), slots[i], place) for i, a, b, place in to_q.bends if i in slots]
    lower = sorted({place for place, *_ in [*of_second, *bent] if place[0] >= place[1]})
    targets = {place: k for k, place in enumerate(lower)}
    tables = {
        "first": of_first,
        "middle": of_middle,
        "second": [(targets[place], a, b) for place, a, b in of_second if place in targets],
        "bent": [(targets[place], slot, b) for place, slot, b in bent],
        "gradient": [(slots[column], number, row) for row, column, number in entries if column in slots],
    }
    counts = {"J": len(known), "H": len(lower), "of_J": tangent.first, "of_H": tangent.work - tangent.first}
    counts |= {"T": to_q.first, "S": to_q.second, "gradient": len(slots), "middle": len(middle)}
    places = dict(zip(counts, np.cumsum([0, *counts.values()]).tolist(), strict=False))
    low, across = np.array(list(known), np.int64).reshape(-1, 2).T
    rows, columns = np.array(lower, np.int64).reshape(-1, 2).T
    numbers, off = np.arange(len(lower)), rows != columns
    both = np.concatenate([rows, columns[off]]), np.concatenate([columns, rows[off]])
    return Exported(
        tangent.name,
        {**tangent.sizes, "q": program.input_size("q")},
        tangent.output,
        ordered((tangent.output[1], width), low, across, np.arange(len(known))),
        ordered((width, width), both[0], both[1], np.concatenate([numbers, numbers[off]])),
        len(known),
        sum(counts.values()),
        {"counts": counts, "places": places, "tables": tables, "factors": to_q.factors},
    )


def _collected(
    products: Iterable[tuple[tuple[int, int], int, int]],
) -> tuple[dict[tuple[int, int], int], list[tuple[int, int, int]]]:
    """Return the numbers of the places of a matrix, and (number, factor, factor) of each product that is added."""
    known: dict[tuple[int, int], int] = {}
    return known, [(known.setdefault(place, len(known)), one, other) for place, one, other in products]


def _columns(program: Program, sizes: Mapping[str, int]) -> Places:
    """Return the column of each direction of ``ARGUMENTS``, -1 for none."""
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
    """Rows of equations that are one function of the model.

    Attributes
    ----------
    function : with derivatives
    row : first row
    sign : 1 or -1
    columns : column of each direction of the function, -1 of other directions
    """

    function: Exported
    row: int
    sign: int
    columns: Places

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.function.output[1]


class Equations:
    """Rows that are functions of the model, or differences of single arguments, with derivatives.

    Numbers of the Jacobian are the nonzeros of the functions one after another, then 1 and -1.

    Parameters
    ----------
    program : Program
    sizes : numbers of each argument in which the rows are differentiated, in order
    functions : (function, first row, sign) of each function
    places : first column of each of q, v, a, z, lam, u, p and t in which the rows are differentiated
    linear : (row, column, sign) of the rows without function
    """

    def __init__(
        self,
        program: Program,
        sizes: Mapping[str, int],
        functions: Sequence[tuple[Exported, int, int]],
        places: Mapping[str, int],
        linear: Sequence[tuple[int, int, int]],
    ) -> None:
        self.nv, self.nz = program.sizes["v"], program.sizes["z"]
        self.nx = 2 * self.nv + self.nz
        self.sizes = dict(sizes)
        self.width = sum(sizes.values())
        self.parts = []
        for function, row, sign in functions:
            columns = [
                np.arange(size) + places[name] if name in places else np.full(size, -1)
                for name, size in function.sizes.items()
            ]
            self.parts.append(Part(function, row, sign, np.concatenate(columns).astype(np.int64)))
        self.height = max([part.row + part.size for part in self.parts], default=0)
        self.count = sum(part.function.first for part in self.parts)
        self.hessian_count = sum(part.function.work - part.function.first for part in self.parts)
        rows, across, numbers, first = [], [], [], 0
        for part in self.parts:
            jacobian = part.function.jacobian
            rows.append(jacobian.rows + part.row)
            across.append(part.columns[jacobian.columns])
            numbers.append(jacobian.places + first)
            first += part.function.first
        rows.append(np.array([row for row, _, _ in linear], np.int64))
        across.append(np.array([column for _, column, _ in linear], np.int64))
        numbers.append(np.array([first + (sign < 0) for _, _, sign in linear], np.int64))
        r, c, k = (np.concatenate(parts) for parts in (rows, across, numbers))
        self.jacobian = ordered((self.height, self.width), r[c >= 0], c[c >= 0], k[c >= 0])
        low, left, numbers, first = [], [], [], 0
        for part in self.parts:
            hessian = part.function.hessian
            lower = hessian.rows >= hessian.columns
            one, other = part.columns[hessian.rows[lower]], part.columns[hessian.columns[lower]]
            low.append(np.maximum(one, other))
            left.append(np.minimum(one, other))
            numbers.append(hessian.places[lower] + first)
            first += part.function.work - part.function.first
        r, c, k = (np.concatenate(parts) if parts else np.zeros(0, np.int64) for parts in (low, left, numbers))
        self.lower = ordered((self.width, self.width), r[c >= 0], c[c >= 0], k[c >= 0])

    @property
    def timed(self) -> bool:
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


def rates(program: Program, functions: Sequence[Exported], along: Sequence[str]) -> Equations | None:
    """Return the rates of x = (q, v, z), (v, vdot, zdot), None of a model without forward dynamics.

    Parameters
    ----------
    along : arguments in which rates are differentiated in addition to x, among u, p and t
    """
    nv, nz = program.sizes["v"], program.sizes["z"]
    by_name = {function.name: function for function in functions}
    if program.sampled or "forward_dynamics" not in by_name or (nz and "internal_rate" not in by_name):
        return None
    parts = [(by_name["forward_dynamics"], nv, 1)]
    parts += [(by_name["internal_rate"], 2 * nv, 1)] if nz else []
    taken = dict[str, int]()
    for part, _, _ in parts:
        taken |= part.sizes
    sizes: dict[str, int] = {"x": 2 * nv + nz}
    sizes |= {name: taken[name] for name in ("u", "p", "t") if name in taken and name in along}
    places: dict[str, int] = {"q": 0, "v": nv, "z": 2 * nv}
    first = 0
    for name, size in sizes.items():
        places[name], first = first, first + size
    return Equations(program, sizes, parts, places, [(k, nv + k, 1) for k in range(nv)])


class Step:
    """One explicit Runge-Kutta step of x = (q, v, z), made of rates with derivatives.

    Parameters
    ----------
    rates : the rates, with derivatives in all arguments of the step but the length
    of_length : whether the step is differentiated in the length, too
    """

    def __init__(self, rates: Equations, *, of_length: bool = True) -> None:
        method = cast("Any", method_named(METHOD))
        self.method = METHOD
        self.rates = rates
        self.nx = rates.nx
        self.A = [[float(entry) for entry in row] for row in method.A]
        self.b, self.c = [float(entry) for entry in method.b], [float(entry) for entry in method.c]
        self.of_length = of_length
        self.of_time = "t" in rates.sizes
        self.timed = rates.timed
        self.sizes = {**rates.sizes, **({"h": 1} if of_length else {})}
        self.ny, self.nz = sum(self.sizes.values()), rates.width

    @property
    def inputs(self) -> list[dict[str, Any]]:
        return [{"name": name, "size": size} for name, size in self.sizes.items()]

    @cached_property
    def first(self) -> dict[str, int]:
        """Places of the parts of the memory; ``work``: the size of the memory."""
        nx, ny, nz, stages = self.nx, self.ny, self.nz, len(self.b)
        numbers = self.rates.count + 2
        parts = {"x": nx * stages, "k": nx * stages, "end": nx, "J": numbers * stages, "dZ": nz * ny * stages}
        parts |= {"dk": nx * ny * stages, "kt": nx, "of_X": nx * stages, "H": self.rates.hessian_count}
        parts["product"] = nz * ny
        result, place = dict[str, int](), nx * ny + ny * ny
        for name, size in parts.items():
            result[name], place = place, place + size
        return {**result, "work": place}

    def exported(self) -> Exported:
        """Return the function with the patterns of both derivatives, by the chain rule on structural nonzeros."""
        nx, ny, nz = self.nx, self.ny, self.nz
        of_rate = np.zeros((nx, nz), bool)
        of_rate[self.rates.jacobian.rows, self.rates.jacobian.columns] = True
        second = np.zeros((nz, nz), bool)
        lower = self.rates.lower
        second[lower.rows, lower.columns] = second[lower.columns, lower.rows] = True
        along: list[NDArray[np.bool_]] = []
        start = np.eye(nz, ny, dtype=bool)
        hessian = np.zeros((ny, ny), bool)
        for row, c in zip(self.A, self.c, strict=True):
            here = start.copy()
            for weight, earlier in zip(row, along, strict=False):
                if weight:
                    here[:nx] |= earlier
                    here[:nx, -1] = True
            if self.of_time and c:
                here[-1, -1] = True
            hessian |= here.T @ second @ here
            along.append(of_rate @ here)
        jacobian = start[:nx].copy()
        jacobian[:, -1] = True
        for weight, of_stage in zip(self.b, along, strict=True):
            if weight:
                jacobian |= of_stage
            hessian[-1] |= of_stage.any(axis=0)
        hessian[:, -1] |= hessian[-1]
        return Exported(
            "step",
            self.sizes,
            ("x_next", nx),
            of_dense(jacobian, jacobian.shape[1]),
            _of_lower(hessian),
            nx * ny,
            self.first["work"],
        )


def of_dense(nonzero: NDArray[np.bool_], width: int) -> Pattern:
    """Return the pattern of nonzeros that are computed row by row in a whole matrix."""
    columns, rows = np.nonzero(nonzero.T)
    return Pattern((nonzero.shape[0], nonzero.shape[1]), rows, columns, rows * width + columns)


def _of_lower(nonzero: NDArray[np.bool_]) -> Pattern:
    """Return the pattern of a symmetric matrix, of which the lower triangle is computed row by row."""
    pattern = of_dense(nonzero, len(nonzero))
    high, low = np.maximum(pattern.rows, pattern.columns), np.minimum(pattern.rows, pattern.columns)
    return replace(pattern, places=high * len(nonzero) + low)


@dataclass
class Texts:
    """Patterns and tables that the C declares, each once."""

    patterns: list[tuple[int, ...]] = field(default_factory=list)
    tables: list[tuple[int, ...]] = field(default_factory=list)

    def pattern(self, pattern: Pattern) -> int:
        """Return the number of a pattern."""
        return _number(self.patterns, pattern.compressed)

    def table(self, numbers: Iterable[int]) -> int:
        """Return the number of a table."""
        return _number(self.tables, tuple(int(number) for number in numbers))

    def argument(self, name: str, pattern: Pattern) -> dict[str, Any]:
        """Return an input or output of a function of CasADi."""
        return {"name": name, "sparsity": self.pattern(pattern)}


def _number(known: list[tuple[int, ...]], item: tuple[int, ...]) -> int:
    if item not in known:
        known.append(item)
    return known.index(item)


def symbol_of(program: Program, name: str) -> str:
    """Return the name of a function in CasADi."""
    return f"{program.prefix}_casadi_{name}"


def _functions_of(program: Program, exported: Exported, texts: Texts) -> list[dict[str, Any]]:
    """Return the functions of CasADi of one function: value, Jacobian, gradient, Hessian."""
    symbol, (output, rows) = symbol_of(program, exported.name), exported.output
    is_step = exported.name == "step"
    inputs = []
    for name, size in exported.sizes.items():
        block = exported.jacobian.block(slice(0, rows), exported.slices[name])
        tables = {"columns": block.columns, "rows": block.rows, "gathered": block.places}
        numbers = {key: texts.table(table) if len(table) else 0 for key, table in tables.items()}
        inputs.append({"name": name, "size": size, "count": len(block.rows), **numbers})
    components = exported.components
    function = {"name": exported.name, "inputs": inputs, "step": is_step, "first": exported.first}
    function["components"] = None
    if components is not None:
        numbered: dict[str, tuple[int, int]] = {}
        for name, table in components["tables"].items():
            if table:
                numbered[name] = texts.table(chain(*table)), len(table)
        function["components"] = {**components, "tables": numbered}
    own = [texts.argument(name, dense(size)) for name, size in exported.sizes.items()]
    result = texts.argument(output, dense(rows))
    after, weights = texts.argument(f"out_{output}", empty(rows, 1)), texts.argument(f"adj_{output}", dense(rows))
    gradients = [texts.argument(f"adj_{name}", dense(size)) for name, size in exported.sizes.items()]
    unused = [texts.argument(f"out_adj_{name}", empty(size, 1)) for name, size in exported.sizes.items()]

    def entry(start: str, kind: str, given: Sequence[Any], outputs: Sequence[Any], **more: Any) -> dict[str, Any]:
        work = exported.work if kind in ("hessian", "step") or is_step else exported.first
        work = exported.work if exported.components else work
        work = 0 if kind == "value" else work
        made = {"symbol": f"{start}{symbol}", "kind": kind, "inputs": given, "outputs": outputs, "work": work}
        return {**made, "function": function, "first_blocks": [], "second_blocks": [], **more}

    of_jacobian = {name: exported.jacobian.block(slice(0, rows), s) for name, s in exported.slices.items()}
    first, second = _Blocks(texts), _Blocks(texts)
    for name, block in of_jacobian.items():
        first.add(f"jac_{output}_{name}", block, "J")
    for name, of_rows in exported.slices.items():
        for other, of_columns in exported.slices.items():
            second.add(f"jac_adj_{name}_{other}", exported.hessian.block(of_rows, of_columns), "H")
        size = exported.sizes[name]
        second.add(f"jac_adj_{name}_out_{output}", empty(size, rows), "")
        second.add(f"jac_adj_{name}_adj_{output}", of_jacobian[name].transposed, "J")
    any_gradient = [f"res[{k}] != NULL" for k, item in enumerate(inputs) if item["count"]]
    return [
        entry("", "step" if is_step else "value", own, [result]),
        entry("jac_", "jacobian", [*own, after], first.outputs, blocks=first.blocks, first_blocks=first.asked("J")),
        entry("adj1_", "adjoint", [*own, after, weights], gradients, first_blocks=any_gradient),
        entry(
            "jac_adj1_",
            "hessian",
            [*own, after, weights, *unused],
            second.outputs,
            blocks=second.blocks,
            first_blocks=second.asked("J"),
            second_blocks=second.asked("H"),
        ),
    ]


class _Blocks:
    """Blocks of a function's derivatives, in order."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts
        self.outputs: list[dict[str, Any]] = []
        self.blocks: list[dict[str, Any]] = []

    def add(self, name: str, pattern: Pattern, source: str) -> None:
        """Add a block whose nonzeros are among the numbers ``source``."""
        count = len(pattern.rows)
        table = self.texts.table(pattern.places) if count else 0
        self.blocks.append({"number": len(self.outputs), "count": count, "table": table, "source": source})
        self.outputs.append(self.texts.argument(name, pattern))

    def asked(self, source: str) -> list[str]:
        """Return the conditions, in C, that a block of these numbers is asked for."""
        return [f"res[{b['number']}] != NULL" for b in self.blocks if b["count"] and b["source"] == source]


def exported_functions(program: Program) -> tuple[list[Exported], Step | None]:
    """Return the functions of a model with derivatives, and the step if the model has one."""
    known = program.function_names
    there = [name for name in DIFFERENTIATED if name in known and f"{name}_derivatives" in known]
    functions = [plain(program, name) for name in there if program.function(name).outputs]
    of_state = None if turning(program) else rates(program, functions, ("u", "p", "t"))
    return functions, None if of_state is None else Step(of_state)


def files_of(program: Program) -> dict[str, str]:
    """Return the folder of a Program: the model's C, ``<prefix>_casadi.c``, README.md and the manifest."""
    functions, step = exported_functions(program)
    whole = generate_files(replace(program, uniform=True))
    files = {name: text for name, text in whole.items() if name not in ("main.c", "README.md", MANIFEST)}
    exported = [*functions, *([] if step is None else [step.exported()])]
    texts = Texts()
    entries = [entry for item in exported for entry in _functions_of(program, item, texts)]
    longest = max(1, *(size for item in exported for size in item.sizes.values()), *(i.output[1] for i in exported))
    names: dict[str, Any] = {"program": program, "prefix": program.prefix, "functions": []}
    for item in functions:
        own = [entry for entry in entries if entry["function"]["name"] == item.name]
        names["functions"].append({**own[0]["function"], "output": item.output[0]})
    names |= {"entries": entries, "sparsities": texts.patterns, "tables": texts.tables, "longest": longest}
    names |= {"step": step}
    name = f"{program.prefix}_casadi.c"
    files[name] = environment().get_template("optimisers/casadi.c.jinja").render(**names)
    sources = sorted(file for file in files if file.endswith(".c"))
    library = f"lib{program.prefix}_casadi.so"
    command = f"cc -std=c99 -O2 -ffp-contract=off -fPIC -shared {' '.join(sources)} -o {library} -lm"
    signatures = [
        {
            "symbol": symbol_of(program, item.name),
            "inputs": dict(item.sizes),
            "output": dict([item.output]),
            "jacobian": len(item.jacobian.rows),
            "hessian": len(item.hessian.rows),
        }
        for item in exported
    ]
    texts_of_readme = {"command": command, "library": library, "signatures": signatures}
    readme = environment().get_template("optimisers/README.md.jinja").render(**names, **texts_of_readme)
    files["README.md"] = readme
    mark = fingerprint(files)
    files[MANIFEST] = manifest(program, files, fingerprint=mark, compile=command, casadi=signatures)
    return files


def needed_terms(terms: Sequence[str] | None) -> list[str]:
    """Return the terms that the folder needs: of the named functions, all that there are by default.

    Raises
    ------
    UsageError
        A term without derivatives in all arguments.
    """
    chosen = [name for name in DIFFERENTIATED if name not in _BY_NAME] if terms is None else list(terms)
    for name in chosen:
        if name not in DIFFERENTIATED:
            fault = f"the target casadi writes functions with derivatives, and {shown(str(name))} has none"
            raise UsageError(Problem("terms", fault, nearest(str(name), DIFFERENTIATED)))
    return [term for name in chosen for term in (name, f"{name}_derivatives", f"{name}_hessian")]


CASADI = Target("casadi", "C for CasADi", NAMES, files_of, terms=needed_terms)
