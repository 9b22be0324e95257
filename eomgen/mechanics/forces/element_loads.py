"""Wrenches on the halves of elements of geometrically exact beams: distributed loads, weight and inertia forces.

Elements transmit one wrench from node to node, and loads along elements are lumped at the nodes. The section wrench at
a node is the wrench at the element's end plus the loads on half of the element. It is of second order in the element's
length, and equals the reaction at a clamp exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.mechanics.forces.node_loads import wrenches_per_length
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import Field
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.tree.inertia import inertia_about_center, wrench
from eomgen.mechanics.tree.links import Mount
from eomgen.scene.bodies.cosserat import BeamSection, Cosserat
from eomgen.scene.forces.distributed_loads import DistributedLoad
from eomgen.symbolic.scalar import Scalar, apply, multiply, transpose

#: Map from a link's index to its field of accelerations minus gravity; negative indices denote the carrier of the tree.
Fields = Callable[[int], Field]


def loads_on_halves(quantities: Quantities, beam: Cosserat, fields: Fields) -> list[list[Scalar]]:
    """Return for each element the wrenches on its first and on its second half, (12,), each about the node there.

    Moments, N m, before forces, N, in the axes of the node.
    """
    mounts = [quantities.tree.mounts[name] for name in beam.nodes]
    halves = [[quantities.algebra.zero] * 12 for _ in beam.parts]
    for element, part in enumerate(beam.parts):
        for end in (0, 1):
            inertia = _inertia_force(quantities, part.section, mounts[element + end], fields)
            half = 0.5 * float(part.length)
            _add(halves[element], end, [-half * entry for entry in (*inertia[0], *inertia[1])])
    loads = (item for item in quantities.scene.elements if isinstance(item, DistributedLoad))
    for item in loads:
        if item.beam == beam.name:
            for number, per_length in enumerate(wrenches_per_length(item, quantities)):
                before, beyond = item.nodes[number].halves
                if number > 0:
                    _add(halves[number - 1], 1, [before * entry for entry in per_length])
                if number < beam.elements:
                    _add(halves[number], 0, [beyond * entry for entry in per_length])
    return halves


def _add(halves: list[Scalar], end: int, load: Sequence[Scalar]) -> None:
    for place, entry in enumerate(load, 6 * end):
        halves[place] = halves[place] + entry


def _inertia_force(quantities: Quantities, section: BeamSection, mount: Mount, fields: Fields) -> Wrench:
    """Return the inertia wrench minus the weight of a section per metre, in the node's axes; N and N/m."""
    algebra, field, axes = quantities.algebra, fields(mount.link), mount.orientation
    back = transpose(axes)
    tensor = tuple(quantities.formula(entry) for entry in (*section.rotary_inertia, *section.products))
    y, z = (quantities.formula(entry) for entry in section.center_of_mass)
    mass = quantities.formula(section.mass_per_length)
    inertia = inertia_about_center(algebra, mass, (algebra.zero, y, z), tensor)
    symmetric = multiply(multiply(back, field.symmetric), axes)
    return wrench(algebra, inertia, apply(back, field.at(mount.position)), apply(back, field.alpha), symmetric)
