"""Inverse dynamics, mass matrix and two Coriolis matrices with first and second time derivatives, in closed form.

    V = A (X v + E V_B),   M = J^T M J,   C = J^T (M J' - b^T M J),   C_skew = C + J^T M b J

C is Mueller and Kumar's (2021), with J' in full so that it holds for joints of several degrees of freedom. b V = 0, so
both give C v = h; M' - 2 C_skew is skew because M J' enters M' twice and M b - b^T M is skew. See ``system_matrices``
for the rules.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from eomgen.mechanics.rates.system_matrices import (
    Columns,
    Image,
    Pair,
    SystemMatrices,
    bracket,
    bracket_transposed,
    by_link,
    combined,
    moved,
    pair_minus,
)
from eomgen.mechanics.tree.links import ROOT
from eomgen.symbolic.scalar import Scalar, Vector
from eomgen.symbolic.scalar import skew as skew_of
from eomgen.symbolic.tape import ZERO

Rows = list[list[Scalar]]


def matrix_path(system: SystemMatrices, name: str, order: int) -> tuple[str, tuple[int, ...], str, list[list[Scalar]]]:
    """Return symbol, shape, meaning, and all entries of a closed-form matrix per derivative, from 0 to ``order``."""
    nv, links = system.tree.nv, len(system.tree.links)
    rows = ", ".join(link.name for link in system.tree.links)
    match name:
        case "system_jacobian":
            values = [_six_rows(system.jacobian(k)) for k in range(order + 1)]
            return "J", (6 * links, nv), f"six rows for each link, angular first, in its axes: {rows}", values
        case "adjoints":
            A = system.adjoints()
            values = [_six_rows(A.derivative(k)) for k in range(order + 1)]
            return "A", (6 * links, 6 * links), f"six rows and columns for each link: {rows}", values
        case "joint_brackets" | "link_brackets":
            twists = system.joint_twists if name == "joint_brackets" else system.twists
            values = [[entry for twist in twists(k) for entry in _bracket_matrix(twist)] for k in range(order + 1)]
            return f"ad_{name.removesuffix('_brackets')}s", (links, 6, 6), f"one matrix for each link: {rows}", values
        case "mass":
            return "M", (nv, nv), "inertia matrix", [_flat(M) for M in mass_path(system, order)]
        case _:
            skew = name == "coriolis_skew"
            meaning = "Coriolis matrix" + (", M' - 2 C skew" if skew else "")
            return "C", (nv, nv), meaning, [_flat(C) for C in coriolis_path(system, order, skew)]


def _flat(rows: Rows) -> list[Scalar]:
    return [value for row in rows for value in row]


def _six_rows(columns: Columns) -> list[Scalar]:
    """Return the entries of a matrix of twists, row by row."""
    return [pair[part][k] for row in columns for part in (0, 1) for k in range(3) for pair in row]


def _bracket_matrix(twist: Pair) -> list[Scalar]:
    """Return the entries of ad(twist), row by row."""
    zero = Scalar(twist[0][0].tape, ZERO)
    turning, passing = skew_of(twist[0]), skew_of(twist[1])
    above = [entry for row in turning for entry in (*row, zero, zero, zero)]
    return above + [entry for row, other in zip(passing, turning, strict=True) for entry in (*row, *other)]


def mass_path(system: SystemMatrices, order: int) -> list[Rows]:
    """Return M, (nv, nv), and its time derivatives up to order 2; rotor inertias are constant."""
    path = [
        system.projected(z)
        for z in system.with_transpose([system.inertia(system.jacobian(k)) for k in range(order + 1)])
    ]
    for link in system.tree.links:
        for dof, rotor in zip(link.dofs, link.rotor_inertias, strict=True):
            ratio = link.coordinates.ratio
            path[0][dof][dof] = path[0][dof][dof] + ratio * ratio * rotor
    return path


def coriolis_path(system: SystemMatrices, order: int, skew: bool) -> list[Rows]:
    """Return C, (nv, nv), and its time derivatives up to order 2; with ``skew`` the C for which M' - 2 C is skew."""
    paths: list[Columns] = []
    for n in range(order + 1):
        total = system.inertia(system.jacobian(n + 1))
        for k in range(n + 1):
            b = system.twists(n - k)
            momentum = system.inertia(system.jacobian(k))
            total = combined(total, by_link(b, momentum, bracket_transposed, math.comb(n, k)), pair_minus)
            if skew:
                total = combined(total, system.inertia(by_link(b, system.jacobian(k), bracket, math.comb(n, k))))
        paths.append(total)
    return [system.projected(z) for z in system.with_transpose(paths)]


def inverse_dynamics_closed(
    system: SystemMatrices,
    base_twist: Sequence[Pair],
    fall: Sequence[Vector],
    loads: Sequence[Sequence[Pair] | None],
    order: int,
) -> list[list[Scalar]]:
    """Return tau and its derivatives up to the second, without efforts.

    Parameters
    ----------
    base_twist : path of the base's twist in its axes, up to order + 1
    fall : path of gravity in base axes
    loads : path of the applied wrench by link; None for links without one
    """
    zero = system.tree.algebra.zero_vector
    joints = [[[pair] for pair in system.joint_twists(k)] for k in range(order + 2)]
    V = _carried(system, base_twist, joints)
    falling = _carried(system, [(zero, value) for value in fall], [])
    momenta = [system.inertia(value) for value in V]
    paths: list[Columns] = []
    for n in range(order + 1):
        total = combined(momenta[n + 1], system.inertia(falling[n]), pair_minus)
        for k in range(n + 1):
            operators = [row[0] for row in V[n - k]]
            total = combined(total, by_link(operators, momenta[k], bracket_transposed, math.comb(n, k)), pair_minus)
        paths.append(
            [row if load is None else [pair_minus(row[0], load[n])] for row, load in zip(total, loads, strict=True)]
        )
    tau = [[row[0] for row in system.projected(z)] for z in system.with_transpose(paths)]
    for link in system.tree.links:
        for dof, rotor in zip(link.dofs, link.rotor_inertias, strict=True):
            ratio = link.coordinates.ratio
            for n in range(order + 1):
                tau[n][dof] = tau[n][dof] + ratio * ratio * rotor * system.velocities[dof][n + 1]
    return tau


def _carried(system: SystemMatrices, path: Sequence[Pair], joints: Sequence[Columns]) -> list[Columns]:
    """Return the derivatives of A (x + E w), E' = -a E: twists of all links, given twists of the joints, x, and of the
    base, w."""
    tree, sources = system.tree, dict[tuple[int, int], Columns]()
    for k, twist in enumerate(path):
        sources[k, 0] = [[moved(link, twist) if link.parent == ROOT else system.zero] for link in tree.links]

    def entering(k: int, m: int) -> Columns:
        """Return the m-th derivative of E w^(k)."""
        if (k, m) not in sources:
            total = entering(k + 1, m - 1)
            for i in range(m):
                factor = math.comb(m - 1, i)
                total = combined(
                    total, by_link(system.joint_twists(i), entering(k, m - 1 - i), bracket, factor), pair_minus
                )
            sources[k, m] = total
        return sources[k, m]

    def both(order: int) -> Columns:
        return combined(entering(0, order), joints[order]) if joints else entering(0, order)

    image = Image(system, both(0), both)
    return [image.derivative(n) for n in range(len(path))]
