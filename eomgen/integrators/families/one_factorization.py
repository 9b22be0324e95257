"""Common part of families with steps of one factorization: equations linearised about the start of the step, and the
guard against growth that they cannot follow.

Their matrix represents (I - gain J) d = right side in forces, (M + gain C + gain^2 K) d_v, with internal states last;
increments are about none, so pivots are chosen ``at_start`` and M may be singular if the matrix is not. Constraints
border it by B^T of the start and B of the end of a step.

The guard: ``newton/growth.c.jinja`` looks at the pivots (``newton.signs``); a step calls ``_note_growth`` after a
factorization, with ``stop_at_growth`` in its workspace.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, replace
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    EXCHANGES,
    NOT_FINITE,
    SINGULAR_ADVICE,
    SMALLER_STEP,
    Bound,
    Family,
    Field,
    Setting,
    Sizes,
    Status,
    velocities,
)

if TYPE_CHECKING:
    from eomgen.integrators.newton.matrix import Packing, Unknowns
    from eomgen.system.system import System


STOP_AT_GROWTH = Setting(
    "stop_at_growth", 1, "0: growth that a step cannot follow is only counted; 1: it ends the run", (0, 1)
)
UNFOLLOWED_GROWTH = Field(
    "unfollowed_growth", "number of matrices with growth so fast that the step would damp it", kind="long"
)
GROWTH_STATUS = Status(
    10,
    "UNFOLLOWED_GROWTH",
    "something grows by itself so fast that a step would damp it, as with a force that pushes away",
    f"{SMALLER_STEP}, or stop_at_growth = 0 if the growth does not matter",
)
#: The same status for matrices bordered by constraints, since rows of constraints may change a sign too.
GROWTH_OR_SINGULAR_STATUS = replace(
    GROWTH_STATUS,
    text="something grows by itself so fast that a step would damp it, or the constraints are singular within the step",
)


#: Reason for which steps of one factorization follow no tolerance, and methods that do.
FIXED_STEPS = (
    "its steps are the same operations every time, without an estimate of errors",
    "generalized_alpha, or rk45",
)


@dataclass(frozen=True)
class OneFactorization(Family):
    """A family with steps of one factorization, for equations without constraints unless a subclass allows
    constraints."""

    implicit = True

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics", *(("equations", "iteration") if internal else ("residual", "partials")))

    def calls(self, system: System) -> set[str]:
        forces = {"equations" if system.facts.internal_states else "residual", "relative_forces"}
        return (forces & set(system.functions)) | matrix_functions(system)

    def prepared(self, system: System) -> System:
        from eomgen.integrators.newton.row_sums import with_row_sums  # noqa: PLC0415

        return with_row_sums(system)

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        unit = Field(
            "unit", "units of velocities, 1/sqrt(M_ii) at the start, in which pivots are compared", sizes.v + sizes.z
        )
        of_sums = (("q", sizes.q), ("v", sizes.v), ("z", sizes.z))
        remainders = [Field(f"{name}_remainder", f"rounding lost by sums of {name}", size) for name, size in of_sums]
        return (unit, *(item for item in remainders if item.size))

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        return (Bound("step", "finite"), Bound("step", ">", 0.0))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (EXCHANGES,)

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        singular = Status(2, "SINGULAR", "the matrix of a step is singular", SINGULAR_ADVICE)
        return (singular, NOT_FINITE, BAD_ARGUMENT)


def matrix_functions(system: System) -> set[str]:
    """Return the functions that give the numbers of a step's matrix."""
    matrix = "iteration" if "iteration" in system.functions else "partials"
    return {matrix, *({"row_sums"} & set(system.functions))}


def linear_system(
    system: System, gain: float, samples: Any, *, guarded: bool = False, turned: bool = False
) -> dict[str, Any]:
    """Return the linear system of a step as data of the templates: unknowns, solver, pivots, products, hooks and right
    sides.

    Parameters
    ----------
    gain : gamma times the step, s
    samples : of the matrix; None: taken here
    guarded : whether signs of pivots show growth, see ``newton.signs``
    turned : whether increments of rotations are multiplied by T(gain v)
    """
    from eomgen.integrators.newton.matrix import Unknowns  # noqa: PLC0415
    from eomgen.integrators.newton.sample_matrices import at_both_ends, samples_of  # noqa: PLC0415
    from eomgen.integrators.newton.signs import pivot_signs  # noqa: PLC0415
    from eomgen.integrators.newton.solver import make_solver, solver_data, sources_on_links  # noqa: PLC0415

    owners, groups, rows = system.inner_owners, system.relative, len(system.multipliers)
    unknowns = Unknowns(velocities(system.factors), rows, rows, False, len(owners), len(system.initial_z))
    known = samples if samples is not None else samples_of(system)
    known = at_both_ends(known) if rows else known
    weights = (1.0, gain, gain * gain, 1.0, 1.0, 1.0, gain)
    sample = system.sample
    solver = make_solver(
        unknowns, system.factors, known, weights, gain, owners, groups, at_start=True, turned=turned, sample=sample
    )
    links = system.links if sources_on_links(solver, system.links) else ()
    return {
        "hooks": {"row": "accelerations_of_row"},
        "unknowns": unknowns.data,
        "solver": solver_data(solver, system.factors, links, plain=True),
        **({"pivots": pivot_signs(solver, known, gain)} if guarded else {}),
        "products": _products(unknowns, known.packing, groups, links),
        "rights": unknowns.matrix_size + len(links),
        "links": [list(pair) for pair in links],
    }


def _products(
    unknowns: Unknowns, packing: Packing, groups: Sequence[Sequence[int]], links: Sequence[tuple[int, int]]
) -> list[dict[str, Any]]:
    """Return the terms of each row in the product of M with one vector and of K with another, as one mapping for each
    row. Keys: ``row``, and ``M`` and ``K`` with terms [number, column, None], number the index among the nonzeros.
    Within a `groups` element a term is [number, column, row], which multiplies the difference of two components, and
    the row sum of K stands in place of its diagonal. Terms of `links` occur once, in an additional row of the link."""
    by_row: dict[int, dict[str, list[list[int | None]]]] = {}
    group_of = {k: number for number, group in enumerate(groups) for k in group}

    def add(row: int, name: str, number: int, column: int, second_column: int | None = None) -> None:
        by_row.setdefault(row, {"M": [], "K": []})[name].append([number, column, second_column])

    for (row, column), number in packing.nonzeros["M"].items():
        add(unknowns.equation(row), "M", number, column)
    for (row, column), number in packing.nonzeros.get("K_sum", {}).items():
        add(row, "K", number, column)
    for (row, column), number in packing.nonzeros["K"].items():
        if row not in group_of or group_of[row] != group_of.get(column):
            add(unknowns.equation(row), "K", number, column)
        elif (row, column) in links:
            add(unknowns.matrix_size + links.index((row, column)), "K", number, column, row)
        elif row != column and (column, row) not in links:
            add(row, "K", number, column, row)
    for (state, column), number in packing.nonzeros["Fq"].items():
        add(unknowns.first_z + state, "K", number, column)
    return [{"row": row, **terms} for row, terms in sorted(by_row.items())]
