"""Work of a step, counted: calls of the model's functions, and operations of the stepper itself.

Comparisons (tests of pivots are some), copies and changes of sign do not count. If a choice is a branch, as between
the series and the sines of a rotation, both sides count.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, replace
from eomgen.integrators.newton.matrix import WEIGHTS

if TYPE_CHECKING:
    from eomgen.system.system import System


@dataclass(frozen=True)
class Work:
    """Something that a step does a number of times.

    Attributes
    ----------
    what : name of a function of the model, or a description
    times : in one step
    of_model : whether the work is a function of the model, with operations known to the system
    additions, multiplications, divisions, functions : of one time
    """

    what: str
    times: int
    of_model: bool = False
    additions: int = 0
    multiplications: int = 0
    divisions: int = 0
    functions: int = 0


def work_of_system(solver: Mapping[str, Any], size: int) -> tuple[Work, ...]:
    """Return the work of assembling and of factoring one matrix, and of one substitution: three ``Work`` items.

    Parameters
    ----------
    solver : ``Program.method["solver"]``, as ``newton.solver.solver_data`` gives it
    size : number of unknowns
    """
    unit_weight = WEIGHTS.index("one")
    linear = [entry["linear"] for entry in solver["entries"]]
    weighed = sum(weight != unit_weight for terms in linear for weight, _ in terms)
    sums = sum(max(len(terms) - 1, 0) for terms in linear) + len(solver["rate_diagonal"])
    sums += sum(len(row) - 1 for row in solver["moved"])
    weighed += sum(len(row) for row in solver["moved"])
    assembly = Work("matrix from the partials", 1, additions=sums, multiplications=weighed)
    if "elimination" not in solver:
        half = size * (size - 1) // 2
        inner = (size - 1) * size * (2 * size - 1) // 6
        factors = Work("factors, with pivots by size", 1, False, inner, inner, half)
        return assembly, factors, Work("substitution", 1, False, 2 * half, 2 * half, size)
    data = solver["elimination"]
    pivots, stored = data["size"], data["factors"] - data["size"] - data.get("sums", 0)
    if "groups" in data:
        factors = Work("factors, without subtraction", 1, False, *_operations_of_groups(data), pivots)
    else:
        factors = Work("factors, in their order", 1, False, data["operations"], data["operations"] + stored, pivots)
    sums, products = _operations_of_sources(data)
    return assembly, factors, Work("substitution", 1, False, stored + sums, stored + pivots + products)


def work_of_matrix(
    system: System, method: Mapping[str, Any], *, drivers: int, inertia: int, stiffness: int, solutions: int
) -> tuple[Work, ...]:
    """Return the work of a step with its one matrix: calls for its numbers, assembly and factors, products of vectors
    with M and gain K, and substitutions. `drivers` is the number of calls of the functions of inputs and base,
    `inertia`, `stiffness` and `solutions` are numbers of products and substitutions."""
    solver = method["solver"]
    assembly, factors, substitution = work_of_system(solver, method["unknowns"]["size"])
    mass, stiff = work_of_products(method["products"])
    return (
        Work(solver["function"], 1, of_model=True),
        *(Work(name, 1, of_model=True) for name in ("row_sums",) if name in system.functions),
        *(Work(name, drivers, of_model=True) for name in ("inputs", "base") if name in system.functions),
        assembly,
        factors,
        replace(mass, times=inertia),
        replace(stiff, times=stiffness),
        replace(substitution, times=solutions),
    )


def _operations_of_groups(data: Mapping[str, Any]) -> tuple[int, int]:
    """Return additions and multiplications of the factorization without subtraction, from the data of the elimination.
    The data have either every row ("unrolled"), or tables of kinds of rows."""
    if "unrolled" in data:
        rows = data["unrolled"]
        updates = sum(len(taken["updates"]) for row in rows for taken in row["taken"])
        sums = sum(len(row.get("within", ())) + sum(len(of) - 1 for _, of in row["others"]) for row in rows)
        factors = sum(len(row["lower"]) + len(row["upper"]) + ("kept" in row) for row in rows)
        return updates + sums, updates + factors
    group, begin, left, distance = (data[name] for name in ("groups", "begin", "left", "distance"))
    sides = []  # columns to the left and to the right of the diagonal of each row
    for row, kind in enumerate(data["kind_of"]):
        across, diagonal = [row + step for step in distance[begin[kind] : begin[kind + 1]]], left[kind]
        sides.append((across[:diagonal], across[diagonal + 1 :]))
    additions = multiplications = 0
    for row, (lower, upper) in enumerate(sides):
        for earlier in lower:
            updated = sides[earlier][1]
            additions += len(updated) + sum(group[k] == group[row] for k in updated) + 1
            multiplications += len(updated) + 2
        additions += sum(group[k] == group[row] for k in upper) if group[row] >= 0 else 0
        multiplications += len(upper) + 1
    return additions, multiplications


def _operations_of_sources(data: Mapping[str, Any]) -> tuple[int, int]:
    """Return additions and multiplications that right sides given as forces on links add to one substitution."""
    additions = multiplications = 0
    for position, row in enumerate(data.get("unrolled", ())):
        for _, number, earlier in row.get("sources", ()):
            additions += 2 * len(earlier) - (not number) + 1
            multiplications += 2 * len(earlier)
        if "sources" in row and data["groups"][position] >= 0:
            beside = sum(data["groups"][k] == data["groups"][position] for _, k in row["lower"])
            additions, multiplications = additions + beside, multiplications + beside
    return additions, multiplications


def work_of_products(products: Sequence[Mapping[str, Any]]) -> tuple[Work, Work]:
    """Return the work of M times a vector, and of gain K times another vector, per step; `products` has the terms of
    each row."""
    mass, stiffness = ([len(row[name]) for row in products if row[name]] for name in ("M", "K"))
    differences = sum(second_column is not None for row in products for _, _, second_column in row["K"])
    return (
        Work("M a", 1, False, sum(mass), sum(mass)),
        Work("gain K d", 1, False, sum(stiffness) + differences, sum(stiffness) + len(stiffness)),
    )


def work_of_kernel(kernel: Mapping[str, Any], times: int) -> Work:
    """Return the work of calling a group function `times` times in a step, by counting the operations of its
    statements."""
    counts: Counter[str] = Counter()
    for expression in [value for _, value in kernel["statements"]] + list(kernel["results"]):
        counts.update(_operations(expression))
    return Work(
        kernel["name"],
        times,
        False,
        counts["ADD"] + counts["SUB"],
        counts["MUL"],
        counts["DIV"],
        sum(
            counts[name] for name in ("SQRT", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "EXP", "LOG", "POW")
        ),
    )


def work_of_groups(method: Mapping[str, Any], calls: Mapping[str, int]) -> tuple[Work, ...]:
    """Return the work of a step's group functions, and of updating coordinates that are numbers; items of 0 times are
    left out.

    Parameters
    ----------
    method : ``Program.method``
    calls : number of calls in a step by function, as ``update`` of the whole configuration or ``bracket``
    """
    runs = method["lie"]["runs"]
    result: list[Work] = []
    for kernel in method["lie"]["kernels"]:
        operation, _, group = kernel["name"].partition("_")
        members = [run for run in runs if run["group"].lower() == group]
        result.append(work_of_kernel(kernel, calls.get(operation, 0) * len(members)))
    plain = sum(run["size"] for run in runs if run["group"] == "R")
    turned = sum(run["size"] for run in runs if run["group"] != "R")
    result.append(Work("q, coordinate by coordinate", calls["update"], False, plain, plain + turned))
    return tuple(item for item in result if item.times)


def _operations(expression: Any) -> Iterable[str]:
    if isinstance(expression, Sequence) and expression and isinstance(expression[0], str):
        yield expression[0]
        for operand in expression[1:]:
            yield from _operations(operand)
