"""Grouping of inertial parameters: mass indistinguishable through a joint is moved to the parent.

Mass on the axis of a revolute joint (its amount, first and second moment along the axis) moves as the parent does, so
it may be counted there; for a prismatic joint the whole second moment may, for a helical one the second moment along
its axis, for a spherical joint the mass at its centre. Torques do not change (Gautier & Khalil 1990 give the same for
Denavit-Hartenberg frames); joint reactions, per-body energies and base terms would, so only functions that give
generalized forces use the grouped tree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from eomgen.mechanics.tree.inertia import Inertia
from eomgen.mechanics.tree.links import ROOT, Link, Tree, cleaned
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, minus


def grouped(tree: Tree) -> Tree:
    """Return the tree with constant inertial parameters grouped from the tips to the root."""
    algebra = tree.algebra
    inertias = [link.inertia for link in tree.links]
    for index in reversed(range(len(tree.links))):
        link = tree.links[index]
        movable = _movable(algebra, link, inertias[index])
        if not _constant([movable.mass, *movable.first, *(entry for row in movable.second for entry in row)]):
            continue
        if link.parent != ROOT and not _constant(link.neutral_position):
            continue
        inertias[index] = _without(algebra, inertias[index], movable)
        if link.parent != ROOT:
            moved = movable.moved(link.orientation, link.neutral_position)
            inertias[link.parent] = cleaned(algebra, inertias[link.parent] + moved)
    links = tuple(replace(link, inertia=inertia) for link, inertia in zip(tree.links, inertias, strict=True))
    return replace(tree, links=links)


def _movable(algebra: Algebra, link: Link, inertia: Inertia) -> Inertia:
    zero, nothing = algebra.zero, algebra.matrix([[0, 0, 0]] * 3)
    if link.turn is not None:
        k = link.turn.place
        along = inertia.second[k][k] + _of_rotor(algebra, inertia, k)
        second = algebra.matrix([[along if i == j == k else zero for j in range(3)] for i in range(3)])
        if link.kind != "turn":
            return Inertia(zero, algebra.zero_vector, second)
        return Inertia(inertia.mass, _unit(algebra, k, inertia.first[k]), second)
    match link.kind:
        case "travel":
            return Inertia(zero, algebra.zero_vector, inertia.second)
        case "ball":
            return Inertia(inertia.mass, algebra.zero_vector, nothing)
        case _:
            return Inertia(zero, algebra.zero_vector, nothing)


def _of_rotor(algebra: Algebra, inertia: Inertia, k: int) -> Scalar:
    """Return the second moment along axis k that leaves a body of revolution no inertia but that about its axis, else
    zero.

    Such a link needs no angular acceleration across its axis.
    """
    i, j = (k + 1) % 3, (k + 2) % 3
    S = inertia.second
    across, other = S[i][i].constant, S[j][j].constant
    if across is None or other is None or not (S[i][j].is_zero and S[i][k].is_zero and S[j][k].is_zero):
        return algebra.zero
    return S[i][i] if across == other else algebra.zero


def _unit(algebra: Algebra, k: int, value: Scalar) -> Vector:
    return algebra.vector([value if i == k else algebra.zero for i in range(3)])


def _without(algebra: Algebra, inertia: Inertia, movable: Inertia) -> Inertia:
    rows = zip(inertia.second, movable.second, strict=True)
    return Inertia(
        inertia.mass - movable.mass,
        minus(inertia.first, movable.first),
        algebra.matrix([minus(present, moved) for present, moved in rows]),
        inertia.added,
    )


def _constant(values: Sequence[Scalar]) -> bool:
    return all(value.constant is not None for value in values)
