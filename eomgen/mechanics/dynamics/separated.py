"""Separated terms M, h, Q (gravity) and b by virtual work along the tree; stiffness, damping and geometric stiffness of
beams; and inverse dynamics in formulas: ``gravity.elbow``, ``tau.elbow(servo)``.

Each is the virtual work of the links' acceleration fields projected on the joints' motion subspaces, which is J^T
(..) with the Jacobian expanded along the tree (Lieh 1994). M comes from composite bodies: unit accelerations of one
joint move its whole subtree.

With shortening -eta^T H(x) eta / 2, an axial force N(x) adds int N phi' phi'^T dx to the stiffness; N follows from the
forces needed by the masses and bodies further out. In beam axes

    K_geo = -A_x G0 + (omega_y^2 + omega_z^2) G1 - sum_c F_c,x H(x_c)

with A the acceleration of the frame minus gravity, omega its angular velocity, F_c the inertia force of a body at x_c
minus its applied force. It holds for any motion of the frame, to first order in the elastic coordinates (Kane, Ryan
and Banerjee 1987).

``tau`` is M a + h + b and gravity's part, of the tree as it would move with the reference's coordinates, velocities and
accelerations in place of its own; no force element, stop or constraint is in it, so it never depends on itself.
``gravity`` is tau of the tree at rest in its position.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.applied import stiffness_and_damping
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import (
    LinkField,
    Wrench,
    base_fields,
    carry,
    pair_minus,
    pair_plus,
    project,
    total_fields,
)
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.beam_body import ElasticBody, RelativeMotion
from eomgen.mechanics.tree.build import build_tree, group_inertias
from eomgen.mechanics.tree.inertia import AddedMass, RecordedInertia, wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.scene.control.model import Reference
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, plus, scaled

#: Quantities of coordinates, one value per column of a link, by link.
Rows = dict[int, list[Scalar]]


def net_wrenches(tree: Tree, fields: Sequence[LinkField], loads: Sequence[Wrench | None]) -> list[Wrench]:
    """Return for each link the inertia wrench of its acceleration field less the applied wrench, moment first. Wrenches
    are in link axes about the link's origin; ``loads`` holds the applied wrenches, None for links without one."""
    demanded = field_wrenches(tree, fields)
    for link, (moment, force) in zip(tree.links, demanded, strict=True):
        tree.algebra.named(f"M_{link.name}", moment)
        tree.algebra.named(f"F_{link.name}", force)
    return [
        load if applied is None else pair_minus(load, applied) for load, applied in zip(demanded, loads, strict=True)
    ]


def zero_base(tree: Tree) -> BaseMotion:
    """Return a base at rest without gravity."""
    zero = tree.algebra.zero_vector
    return BaseMotion(zero, zero, zero, zero)


def generalized_force(tree: Tree, loads: Sequence[Wrench], label: str, rows: Rows | None = None) -> list[Scalar]:
    """Return the generalized forces, (nv,), of one wrench per link: inward recursion, projected on joint columns.
    ``loads`` are in link axes about the link's origin. ``rows`` holds generalized forces of elastic links, by link,
    which take the place of the projection. ``label`` names the operations."""
    total = carried_loads(tree, loads, label)
    projected = {index: project(link, total[index]) for index, link in enumerate(tree.links)}
    return tree.by_dof(projected if rows is None else projected | rows)


def inertial(tree: Tree, fields: Sequence[LinkField], label: str) -> list[Scalar]:
    """Return the generalized inertia forces, (nv,), of the links with the given acceleration fields, elastic
    coordinates included. ``label`` names the operations."""
    return generalized_force(tree, field_wrenches(tree, fields), label, elastic_rows(tree, fields))


def carried_loads(tree: Tree, loads: Sequence[Wrench], label: str) -> list[Wrench]:
    """Return for each link the sum of the wrenches on the link and on all outward links, which its joint transmits.
    Wrenches are in link axes about the link's origin, moment first. ``label`` names the operations."""
    total = list(loads)
    for index, link in tree.inward():
        with tree.algebra.tape.block(f"{label} at joint {link.joint.name}"):
            total[link.parent] = pair_plus(total[link.parent], carry(link, total[index]))
    return total


def field_wrenches(tree: Tree, fields: Sequence[LinkField]) -> list[Wrench]:
    """Return each link's wrench for its acceleration field, moment first, in link axes about the link's origin."""
    loads = []
    for link, field in zip(tree.links, fields, strict=True):
        with tree.algebra.tape.block(f"inertia forces of link {link.name}"):
            load = wrench(tree.algebra, link.inertia, field.origin, field.alpha, field.symmetric)
            if link.elastic is not None:
                load = pair_plus(load, link.elastic.wrench(field.spin, link.elastic.relative_motion(**field.relative)))
            loads.append(load)
    return loads


def elastic_rows(tree: Tree, fields: Sequence[LinkField]) -> Rows:
    """Return the generalized inertia forces of the elastic coordinates as lists by number of the elastic link."""
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
    """Return the generalized forces, (nv,), of inertia, rotor inertia and gravity less ``loads``, in one recursion.

    These are M a + h + b - Q for velocity and acceleration inputs of the tree.

    Parameters
    ----------
    base : motion of the base, with gravity
    loads : applied wrench per link about the link's origin in link axes, or None
    """
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    efforts = generalized_force(tree, net_wrenches(tree, fields, loads), "inverse dynamics", elastic_rows(tree, fields))
    of_rotors = {
        index: [rotor * rate for rotor, rate in zip(link.rotor_inertias, link.accelerations, strict=True)]
        for index, link in enumerate(tree.links)
    }
    return [x + y for x, y in zip(efforts, tree.by_dof(of_rotors), strict=True)]


def composites(tree: Tree) -> list[RecordedInertia]:
    """Return for each link the composite rigid-body inertia (mass, first and second moments, added masses) of the link
    and all outward links, in link axes about the link's origin."""
    total = [link.inertia for link in tree.links]
    for index, link in tree.inward():
        with tree.algebra.tape.block(f"composite body of link {tree.links[link.parent].name}"):
            first, second = link.rotation.rotate(total[index].first), link.rotation.congruence(total[index].second)
            added = tuple(
                AddedMass(link.rotation.rotate(item.position), link.rotation.congruence(item.matrix))
                for item in total[index].added
            )
            turned = RecordedInertia(total[index].mass, first, second, added)
            total[link.parent] = total[link.parent] + turned.shift(link.position)
    return total


def mass_matrix(tree: Tree, bodies: Sequence[RecordedInertia] | None = None) -> list[list[Scalar]]:
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


def mass_rows(tree: Tree, bodies: Sequence[RecordedInertia] | None = None) -> list[dict[int, Scalar]]:
    """Return the lower triangle of M(q), a mapping from column to value for each row, without structural zeros.

    The diagonal is always present, rotor inertias included.

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
                load, diagonal = unit_acceleration(link, bodies[index], k)
                for column in range(k):
                    _couple(M, link.dofs[column], dof, ratio * ratio * diagonal[column])
                M[dof][dof] = M[dof][dof] + ratio * ratio * (diagonal[k] + link.rotor_inertias[k])
                below = index
                while tree.links[below].parent != ROOT:
                    load = carry(tree.links[below], load)
                    below = tree.links[below].parent
                    above = tree.links[below]
                    for column, value in zip(above.dofs, project(above, load), strict=True):
                        _couple(M, column, dof, above.coordinates.ratio * ratio * value)
    return M


def unit_acceleration(link: Link, body: RecordedInertia, k: int) -> tuple[Wrench, list[Scalar]]:
    """Return the wrench for a unit acceleration of column ``k`` of a joint, and its virtual work along all columns of
    the link. ``body`` is the composite inertia of the link, in link axes about the link's origin; elastic links use
    their own mass."""
    if link.elastic is None:
        algebra, column = link.coordinates.algebra, link.columns[k]
        load = wrench(algebra, body, column.linear, column.angular)
        return load, project(link, load)
    still, motion = link.elastic.algebra.zero_vector, link.elastic.unit_acceleration(k)
    return link.elastic.wrench(still, motion), _rows_of(link.elastic, still, motion)


def _rows_of(body: ElasticBody, origin: Vector, motion: RelativeMotion) -> list[Scalar]:
    """Return the inertia forces along the coordinates of an elastic body whose frame does not rotate and has the same
    acceleration everywhere."""
    still = body.algebra.zero_vector
    return [body.row(k, origin, (still, still, still), still, motion) for k in range(body.size)]


def _couple(M: list[dict[int, Scalar]], row: int, column: int, value: Scalar) -> None:
    """Add ``value`` to M[row, column] of the lower triangle, in place; to a diagonal entry twice. Two columns belong to
    one component if a joint follows another joint."""
    if value.is_zero:
        return
    along, below = M[max(row, column)], min(row, column)
    along[below] = along[below] + value if below in along else value
    if row == column:
        along[below] = along[below] + value


def gravity_force(tree: Tree, gravity: Vector, bodies: Sequence[RecordedInertia] | None = None) -> list[Scalar]:
    """Return the generalized forces of gravity, (nv,), from the weight of each subtree at the subtree's centre of mass.

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


Square = list[list[Scalar]]


def _square(tree: Tree) -> Square:
    return [[tree.algebra.zero] * tree.nv for _ in range(tree.nv)]


def structural(tree: Tree, quantities: Quantities) -> tuple[Square, Square]:
    """Return stiffness K and damping D of elastic bodies, (nv, nv) each; zero outside of elastic coordinates."""
    K, D = _square(tree), _square(tree)
    for link in tree.links:
        if link.elastic is not None:
            with tree.algebra.tape.block(f"stiffness and damping of {link.name}"):
                for total, block in zip((K, D), stiffness_and_damping(link.elastic, quantities), strict=True):
                    _add(total, link.dofs, block)
    return K, D


def geometric(tree: Tree, base: BaseMotion, loads: Sequence[Wrench | None]) -> Square:
    """Return the geometric stiffness K_geo of elastic bodies for the present motion, (nv, nv).

    Parameters
    ----------
    base : motion of the base, with gravity
    loads : applied wrenches by link, in link axes, or None
    """
    total = _square(tree)
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    transmitted = carried_loads(tree, net_wrenches(tree, fields, loads), "transmitted wrench")
    for link, field, (_, force) in zip(tree.links, fields, transmitted, strict=True):
        with tree.algebra.tape.block(f"geometric stiffness of {link.name}"):
            if link.elastic is not None:
                _add(total, link.dofs, link.elastic.geometric_stiffness(field.origin[0], field.gradient[0][0]))
            elif link.station is not None:
                axial = link.rotation.rotate(force)[0]
                _add(total, link.dofs, [[-(axial * entry) for entry in row] for row in link.station.shortening])
    return total


def _add(total: Square, dofs: Sequence[int], block: Sequence[Sequence[Scalar]]) -> None:
    for row, values in zip(dofs, block, strict=True):
        for column, value in zip(dofs, values, strict=True):
            total[row][column] = total[row][column] + value


_BLOCKS = (("position", "q"), ("velocity", "v"), ("acceleration", "a"))


class ReferenceEfforts:
    """Values of the symbols ``tau`` and ``gravity`` in formulas: efforts of inverse dynamics on joints.

    The recursion of each reference motion is recorded at the first use.

    Parameters
    ----------
    tree : of the scene, inertias grouped
    base : motion of the base, with gravity in base axes
    quantities : for the formulas of references
    """

    def __init__(self, scene: Scene, tree: Tree, base: BaseMotion, quantities: Quantities) -> None:
        self.scene = scene
        self.tree = tree
        self.base = base
        self.quantities = quantities
        self.references = {item.name: item for item in scene.references}
        self._efforts: dict[str, list[Scalar]] = {}

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return the effort on a component of a joint, N m or N, for the symbol's reference motion.

        Without a reference, at rest, it is the effort against gravity.

        Raises
        ------
        ModelError
            The joint follows another joint, so it has no equation of motion.
        """
        coordinates = self.tree.coordinates[symbol.name]
        if any(joint.name == symbol.name and joint.mimic is not None for joint in self.scene.joints):
            fault = f"the joint {symbol.name} follows another and has no equation of its own [E0498]"
            raise ModelError(Problem(f"{symbol.kind}.{symbol.name}", fault, "the joint that it follows"))
        if symbol.reference not in self._efforts:
            self._efforts[symbol.reference] = self._record(symbol.reference)
        return self._efforts[symbol.reference][coordinates.dofs[symbol.index]]

    def _record(self, reference: str) -> list[Scalar]:
        """Return the efforts, (nv,), for the named reference motion; for an empty name the efforts against gravity at
        rest. Added masses of water are left out."""
        if not reference:
            return [-force for force in gravity_force(self.tree.without_water(), self.base.gravity)]
        algebra = self.tree.algebra
        values = {("a", dof): algebra.zero for dof in range(self.tree.nv)}
        values |= self._reference_coordinates(self.references[reference])
        moved = group_inertias(build_tree(algebra, self.scene, values=values)).without_water()
        with algebra.tape.block(f"inverse dynamics of reference {reference}"):
            return inverse_dynamics(moved, self.base, [None] * len(moved.links))

    def _reference_coordinates(self, reference: Reference) -> dict[tuple[str, int], Scalar]:
        result: dict[tuple[str, int], Scalar] = {}
        for part, block in _BLOCKS:
            for joint, formula in getattr(reference, part):
                coordinates = self.tree.coordinates[joint]
                number = (coordinates.components if block == "q" else coordinates.dofs)[0]
                result[block, number] = self.quantities.formula(formula)
        return result
