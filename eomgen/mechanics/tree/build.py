"""Tree of links from a scene's joints: fixed joints merged, link frames aligned with joint axes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from eomgen.formula.nodes import Formula
from eomgen.formula.recording import record
from eomgen.mechanics.tree.beam_links import add_beam
from eomgen.mechanics.tree.coordinates import Coordinates, joint_coordinates
from eomgen.mechanics.tree.inertia import AddedMass, Inertia, added_masses, inertia_about_center
from eomgen.mechanics.tree.joints import Motion, columns_of, motions_of, name_rotation, pose_of
from eomgen.mechanics.tree.links import (
    ROOT,
    WORLD,
    WORLD_NAME,
    Link,
    Mount,
    Tree,
    cleaned,
    no_inertia,
    parameter_scalars,
)
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.rotation import MatrixFactor, Rotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, multiply, plus, transpose
from eomgen.system.description import BASE


def build_tree(
    algebra: Algebra,
    scene: Scene,
    apart: Collection[str] = (),
    given: Mapping[tuple[str, int], Scalar] | None = None,
    along_z: Collection[str] = (),
) -> Tree:
    """Return the tree of a scene in joint coordinates, recorded on the algebra's tape.

    Parameters
    ----------
    given : values in place of components of q, v and a, by block and number
    apart : fixed joints whose bodies keep links of their own, at rest relative to the links that carry them
    along_z : joints whose axis is the z of their links, although it may be another coordinate axis of the body

    Raises
    ------
    ModelError
        Something is attached to a beam at a position that is not a fixed number.
    """
    parameters = parameter_scalars(algebra, scene)

    def number(formula: Formula) -> Scalar:
        return record(algebra, formula, lambda symbol: parameters[symbol.name])

    elastic = {body.name: body.beam.size for body in scene.bodies if body.beam is not None}
    factors, coordinates = joint_coordinates(algebra, scene.joints, number, elastic, given or {})
    mounts = {
        BASE: Mount(ROOT, algebra.identity, algebra.zero_vector),
        WORLD_NAME: Mount(WORLD, algebra.identity, algebra.zero_vector),
    }
    tree, links = Tree(algebra, (), mounts, parameters, factors, coordinates), list[Link]()
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        merged, turned = joint.name not in apart, joint.name in along_z
        added = added_masses(algebra, scene, body.name, number)
        tree.mounts[body.name] = _add_body(tree, links, body, joint, number, added, merged=merged, along_z=turned)
        if body.beam is not None:
            tree = add_beam(replace(tree, links=tuple(links)), scene, body, joint, number)
            links = list(tree.links)
    complete = [
        replace(link, inertia=cleaned(algebra, link.inertia)) if link.elastic is None else link.deformed()
        for link in links
    ]
    return replace(tree, links=tuple(complete))


def _add_body(
    tree: Tree,
    links: list[Link],
    body: Body,
    joint: Joint,
    number: Callable[[Formula], Scalar],
    added: tuple[AddedMass, ...],
    *,
    merged: bool,
    along_z: bool,
) -> Mount:
    """Add a body to the links of a tree, and return its mount: on links of its own if its joint moves, else on the link
    that carries it.

    If it is not ``merged``, a body on a fixed joint has a link of its own, too.
    """
    algebra = tree.algebra

    def vector(formulas: Sequence[Formula]) -> Vector:
        return algebra.vector([number(formula) for formula in formulas])

    offset = vector(joint.position)
    mount = tree.mount_at(joint.parent, offset)
    orientation = multiply(mount.orientation, algebra.matrix(joint.orientation))
    position = plus(mount.position, apply(mount.orientation, offset))
    tensor = tuple(number(entry) for entry in body.inertia)
    inertia = inertia_about_center(algebra, number(body.mass), vector(body.center_of_mass), tensor)
    inertia = replace(inertia, added=added)
    if body.beam is not None:
        inertia = no_inertia(algebra)
    if not joint.kind.moves and not merged:
        links.append(_fixed_link(algebra, body.name, joint, mount.link, orientation, position, inertia))
        return Mount(len(links) - 1, algebra.identity, algebra.zero_vector)
    if not joint.kind.moves:
        if mount.link != ROOT:
            links[mount.link] = links[mount.link].carrying(inertia.moved(orientation, position))
        return Mount(mount.link, orientation, position)
    parent = mount.link
    turned, motions = motions_of(joint, along_z=along_z)
    axes = algebra.matrix(turned)
    orientation = multiply(orientation, axes)
    rotors = tuple(number(formula) for formula in joint.each(joint.rotor_inertia))
    for number_of_motion, motion in enumerate(motions):
        last = number_of_motion == len(motions) - 1
        name = body.name if last else f"{body.name}, part {number_of_motion + 1} of its joint"
        own = inertia.moved(transpose(axes), algebra.zero_vector) if last else no_inertia(algebra)
        links.append(
            _link(
                algebra,
                name,
                joint,
                motion,
                parent,
                orientation,
                position,
                number(joint.pitch),
                tree.coordinates[joint.name],
                rotors,
                own,
            )
        )
        parent, orientation, position = len(links) - 1, algebra.identity, algebra.zero_vector
    return Mount(parent, transpose(axes), algebra.zero_vector)


def _fixed_link(
    algebra: Algebra, name: str, joint: Joint, parent: int, orientation: Matrix, position: Vector, inertia: Inertia
) -> Link:
    """Return the link of a body on a fixed joint, which has no columns."""
    return Link(
        name=name,
        joint=joint,
        kind="fixed",
        parent=parent,
        rotation=Rotation((MatrixFactor(orientation),)),
        orientation=orientation,
        neutral_position=position,
        travel=algebra.zero_vector,
        position=position,
        columns=(),
        coordinates=Coordinates(algebra, (), (), algebra.one, algebra.zero),
        velocities=(),
        accelerations=(),
        inertia=inertia,
        rotor_inertias=(),
    )


def _link(
    algebra: Algebra,
    name: str,
    joint: Joint,
    motion: Motion,
    parent: int,
    orientation: Matrix,
    position: Vector,
    pitch: Scalar,
    coordinates: Coordinates,
    rotors: Sequence[Scalar],
    inertia: Inertia,
) -> Link:
    """Return the link that one elementary motion of a joint carries."""
    own = coordinates.of(motion)
    with algebra.tape.block(f"{'position' if motion.kind == 'travel' else 'rotation'} of link {name}"):
        rotation, moved_to = pose_of(algebra, motion, pitch, orientation, position, own.q)
        name_rotation(rotation, joint.name, f"R_{name}" if parent == ROOT else f"turn_{name}")
    _, travel = pose_of(algebra, motion, pitch, orientation, algebra.zero_vector, own.q)
    return Link(
        name=name,
        joint=joint,
        kind=motion.kind,
        parent=parent,
        rotation=rotation,
        orientation=orientation,
        neutral_position=position,
        travel=travel,
        position=moved_to,
        columns=columns_of(algebra, motion, pitch),
        coordinates=own,
        velocities=own.v,
        accelerations=own.a,
        inertia=inertia,
        rotor_inertias=tuple(rotors[k] for k in motion.components),
        turn=motion.turn,
        motion=motion,
        pitch=pitch,
    )
