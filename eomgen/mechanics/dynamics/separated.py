"""Separated terms M, h, Q (gravity) and b, and inverse dynamics, by virtual work along the tree.

Each is the virtual work of the links' acceleration fields projected on the joints' motion subspaces, which is J^T
(..) with the Jacobian expanded along the tree (Lieh 1994). M comes from composite bodies: unit accelerations of one
joint move its whole subtree.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.kinematics.fields import LinkField, base_fields, total_fields
from eomgen.mechanics.kinematics.wrenches import Wrench, carry, difference, project, summed
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.beam_body import ElasticBody, RelativeMotion
from eomgen.mechanics.tree.inertia import AddedMass, Inertia, wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, plus, scaled

#: Quantities of coordinates, one value per column of a link, by link.
Rows = dict[int, list[Scalar]]


def net_wrenches(tree: Tree, fields: Sequence[LinkField], loads: Sequence[Wrench | None]) -> list[Wrench]:
    """Return per link the inertia wrench less the applied one, in link axes about the link's origin."""
    demanded = field_wrenches(tree, fields)
    for link, (moment, force) in zip(tree.links, demanded, strict=True):
        tree.algebra.named(f"M_{link.name}", moment)
        tree.algebra.named(f"F_{link.name}", force)
    return [
        load if applied is None else difference(load, applied) for load, applied in zip(demanded, loads, strict=True)
    ]


def zero_base(tree: Tree) -> BaseMotion:
    """Return a base at rest without gravity."""
    zero = tree.algebra.zero_vector
    return BaseMotion(zero, zero, zero, zero)


def generalized(tree: Tree, loads: Sequence[Wrench], label: str, rows: Rows | None = None) -> list[Scalar]:
    """Return the generalized forces, (nv,), of one wrench per link: inward recursion, projected on joint columns.

    ``rows`` holds additional generalized forces of elastic coordinates, by link.
    """
    total = carried_loads(tree, loads, label)
    projected = {index: project(link, total[index]) for index, link in enumerate(tree.links)}
    return tree.by_dof(projected if rows is None else projected | rows)


def inertial(tree: Tree, fields: Sequence[LinkField], label: str) -> list[Scalar]:
    """Return the generalized inertia forces, (nv,), of the links for given acceleration fields."""
    return generalized(tree, field_wrenches(tree, fields), label, elastic_rows(tree, fields))


def carried_loads(tree: Tree, loads: Sequence[Wrench], label: str) -> list[Wrench]:
    """Return per joint the transmitted wrench of the whole subtree, in link axes about the link's origin."""
    total = list(loads)
    for index in reversed(range(len(tree.links))):
        link = tree.links[index]
        if link.parent != ROOT:
            with tree.algebra.tape.block(f"{label} at joint {link.joint.name}"):
                moment, force = carry(link, total[index])
                total[link.parent] = (plus(total[link.parent][0], moment), plus(total[link.parent][1], force))
    return total


def field_wrenches(tree: Tree, fields: Sequence[LinkField]) -> list[Wrench]:
    """Return per link the inertia wrench of its acceleration field, in link axes about the link's origin."""
    loads = []
    for link, field in zip(tree.links, fields, strict=True):
        with tree.algebra.tape.block(f"inertia forces of link {link.name}"):
            load = wrench(tree.algebra, link.inertia, field.origin, field.alpha, field.symmetric)
            if link.elastic is not None:
                load = summed(load, link.elastic.wrench(field.spin, link.elastic.relative_motion(**field.relative)))
            loads.append(load)
    return loads


def elastic_rows(tree: Tree, fields: Sequence[LinkField]) -> Rows:
    """Return per link the generalized inertia forces of its elastic coordinates."""
    rows: Rows = {}
    for index, (link, field) in enumerate(zip(tree.links, fields, strict=True)):
        if link.elastic is not None:
            with tree.algebra.tape.block(f"elastic coordinates of {link.name}, order {link.elastic.beam.order}"):
                motion, body = link.elastic.relative_motion(**field.relative), link.elastic
                rows[index] = [body.row(k, field.origin, field.gradient, field.spin, motion) for k in range(body.size)]
    return rows


def coupling(tree: Tree) -> list[Scalar]:
    """Return h(q, v), (nv,): inertia terms quadratic in v, base at rest."""
    fields = total_fields(tree, zero_base(tree), accelerations=False, gravity=False)
    return inertial(tree, fields, "nonlinear coupling")


def base_motion(tree: Tree, base: BaseMotion) -> list[Scalar]:
    """Return b(q, v, t), (nv,): inertia terms that vanish when the base is at rest."""
    return inertial(tree, base_fields(tree, base), "base motion")


def inverse_dynamics(tree: Tree, base: BaseMotion, loads: Sequence[Wrench | None]) -> list[Scalar]:
    """Return M a + h + b - Q, (nv,), of inertia, gravity and ``loads`` in one recursion.

    Parameters
    ----------
    loads : applied wrench per link about its origin in link axes, or None
    """
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    efforts = generalized(tree, net_wrenches(tree, fields, loads), "inverse dynamics", elastic_rows(tree, fields))
    of_rotors = {
        index: [rotor * rate for rotor, rate in zip(link.rotor_inertias, link.accelerations, strict=True)]
        for index, link in enumerate(tree.links)
    }
    return [x + y for x, y in zip(efforts, tree.by_dof(of_rotors), strict=True)]


def composites(tree: Tree) -> list[Inertia]:
    """Return per link the shape integrals of its subtree, in link axes about the link's origin."""
    total = [link.inertia for link in tree.links]
    for index in reversed(range(len(tree.links))):
        link = tree.links[index]
        if link.parent != ROOT:
            with tree.algebra.tape.block(f"composite body of link {tree.links[link.parent].name}"):
                first, second = link.rotation.rotate(total[index].first), link.rotation.congruence(total[index].second)
                added = tuple(
                    AddedMass(link.rotation.rotate(item.position), link.rotation.congruence(item.matrix))
                    for item in total[index].added
                )
                turned = Inertia(total[index].mass, first, second, added)
                total[link.parent] = total[link.parent] + turned.shifted(link.position)
    return total


def mass_matrix(tree: Tree, bodies: Sequence[Inertia] | None = None) -> list[list[Scalar]]:
    """Return the symmetric M(q), (nv, nv), with structural zeros (composite-rigid-body algorithm).

    Parameters
    ----------
    bodies : subtree inertias of ``composites``, by default computed here
    """
    M = [[tree.algebra.zero] * tree.nv for _ in range(tree.nv)]
    for row, along in enumerate(mass_rows(tree, bodies)):
        for column, value in along.items():
            M[row][column] = M[column][row] = value
    return M


def mass_rows(tree: Tree, bodies: Sequence[Inertia] | None = None) -> list[dict[int, Scalar]]:
    """Return the lower triangle of M(q) row by row, by column, without structural zeros; the diagonal is always there.

    Parameters
    ----------
    bodies : subtree inertias of ``composites``, by default computed here
    """
    algebra = tree.algebra
    bodies = composites(tree) if bodies is None else bodies
    M: list[dict[int, Scalar]] = [{k: algebra.zero} for k in range(tree.nv)]
    for index, link in enumerate(tree.links):
        with algebra.tape.block(f"mass matrix, columns of joint {link.joint.name}"):
            for k, dof in enumerate(link.dofs):
                ratio = link.coordinates.ratio
                load, own = unit_acceleration(link, bodies[index], k)
                for other in range(k):
                    _couple(M, link.dofs[other], dof, ratio * ratio * own[other])
                M[dof][dof] = M[dof][dof] + ratio * ratio * (own[k] + link.rotor_inertias[k])
                below = index
                while tree.links[below].parent != ROOT:
                    load = carry(tree.links[below], load)
                    below = tree.links[below].parent
                    above = tree.links[below]
                    for other, value in zip(above.dofs, project(above, load), strict=True):
                        _couple(M, other, dof, above.coordinates.ratio * ratio * value)
    return M


def unit_acceleration(link: Link, body: Inertia, k: int) -> tuple[Wrench, list[Scalar]]:
    """Return the wrench that a unit acceleration of one column demands, and the virtual work along all columns of the
    link."""
    if link.elastic is None:
        algebra, column = link.coordinates.algebra, link.columns[k]
        load = wrench(algebra, body, column.linear, column.angular)
        return load, project(link, load)
    still, motion = link.elastic.algebra.zero_vector, link.elastic.unit_acceleration(k)
    return link.elastic.wrench(still, motion), _rows_of(link.elastic, still, motion)


def _rows_of(body: ElasticBody, origin: Vector, motion: RelativeMotion) -> list[Scalar]:
    """Return the inertia forces along the coordinates of an elastic body if all its frame has the same acceleration and
    does not rotate."""
    still = body.algebra.zero_vector
    return [body.row(k, origin, (still, still, still), still, motion) for k in range(body.size)]


def _couple(M: list[dict[int, Scalar]], row: int, column: int, value: Scalar) -> None:
    """Add the coupling of two columns of motion; both may belong to one component, if one joint follows the other."""
    if value.is_zero:
        return
    along, other = M[max(row, column)], min(row, column)
    along[other] = along[other] + value if other in along else value
    if row == column:
        along[other] = along[other] + value


def gravity_force(tree: Tree, gravity: Vector, bodies: Sequence[Inertia] | None = None) -> list[Scalar]:
    """Return the generalized forces of gravity, (nv,), from each subtree's weight at its centre of mass.

    Parameters
    ----------
    gravity : (3,), m/s^2, in base axes
    bodies : subtree inertias of ``composites``, by default computed here
    """
    bodies = composites(tree) if bodies is None else bodies
    downs: list[Vector] = []
    efforts: dict[int, list[Scalar]] = {}
    for index, link in enumerate(tree.links):
        with tree.algebra.tape.block(f"weight carried by joint {link.joint.name}"):
            down = link.rotation.rotate_back(gravity if link.parent == ROOT else downs[link.parent])
            downs.append(down)
            if link.elastic is None:
                moment, force = cross(bodies[index].first, down), scaled(bodies[index].mass, down)
                for item in bodies[index].added:
                    weight = apply(item.matrix, down)
                    moment, force = plus(moment, cross(item.position, weight)), plus(force, weight)
                efforts[index] = project(link, (moment, force))
            else:
                at_rest = link.elastic.relative_motion(rates=False, own_rates=False, accelerations=False)
                efforts[index] = _rows_of(link.elastic, down, at_rest)
    return tree.by_dof(efforts)
