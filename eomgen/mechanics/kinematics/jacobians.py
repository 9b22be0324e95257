"""Body Jacobians: the twist that each velocity component gives each body against the base, in the body's own axes.

Columns are carried from link to link outwards, as twists are (Featherstone 2008, chapter 4); other columns are zero by structure.
"""

from __future__ import annotations

from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, plus, scaled, transpose

#: Angular and linear part for each velocity component that moves a link.
Columns = dict[int, tuple[Vector, Vector]]


def body_jacobians(scene: Scene, tree: Tree) -> list[Scalar]:
    """Return the Jacobian of each body of the scene, 6 rows (angular first) of nv numbers each."""
    of_links: list[Columns] = []
    for link in tree.links:
        carried: Columns = {}
        with tree.algebra.tape.block(f"Jacobian of link {link.name}"):
            for k, (angular, linear) in (of_links[link.parent] if link.parent != ROOT else {}).items():
                moved = plus(linear, cross(angular, link.position))
                carried[k] = (link.rotation.rotate_back(angular), link.rotation.rotate_back(moved))
        ratio, still = link.coordinates.ratio, (tree.algebra.zero_vector, tree.algebra.zero_vector)
        for k, column in zip(link.dofs, link.columns, strict=True):
            angular, linear = carried.get(k, still)
            carried[k] = (plus(angular, scaled(ratio, column.angular)), plus(linear, scaled(ratio, column.linear)))
        of_links.append(carried)
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        rows = [[tree.algebra.zero] * tree.nv for _ in range(6)]
        back = transpose(mount.orientation)
        for k, (angular, linear) in (of_links[mount.link] if mount.link >= 0 else {}).items():
            moved = plus(linear, cross(angular, mount.position))
            for row, value in enumerate((*apply(back, angular), *apply(back, moved))):
                rows[row][k] = value
        values += [value for row in rows for value in row]
    return values
