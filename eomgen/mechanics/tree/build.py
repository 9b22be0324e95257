"""Tree of links from a scene's joints and beams: fixed joints merged, link frames aligned with joint axes, inertial
parameters grouped.

Grouping of inertial parameters: mass indistinguishable through a joint is moved to the parent.

Mass on the axis of a revolute joint (its amount, first and second moment along the axis) moves as the parent does, so
it may be counted there; for a prismatic joint the whole second moment may, for a helical one the second moment along
its axis, for a spherical joint the mass at its centre. Torques do not change (Gautier & Khalil 1990 give the same for
Denavit-Hartenberg frames); joint reactions, per-body energies and base terms would, so only functions that give
generalized forces use the grouped tree.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from eomgen.base.data import replace
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula
from eomgen.formula.recording import record
from eomgen.mechanics.tree.beam_body import elastic_body
from eomgen.mechanics.tree.beam_fields import moves, station_motion
from eomgen.mechanics.tree.inertia import (
    AddedMass,
    RecordedInertia,
    added_masses,
    body_inertia,
    elements_with_mass,
    inertia_about_center,
)
from eomgen.mechanics.tree.joints import (
    JointCoordinates,
    JointMotion,
    SubspaceColumn,
    columns_of,
    joint_coordinates,
    motions_of,
    name_rotation,
    pose_of,
)
from eomgen.mechanics.tree.links import ROOT, WORLD, WORLD_NAME, Link, Mount, Tree, clean, no_inertia, parameter_scalars
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.rotation import FactoredRotation, MatrixFactor
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, apply, minus, multiply, plus, transpose
from eomgen.system.description import BASE


def add_beam(tree: Tree, scene: Scene, body: Body, joint: Joint, number: Callable[[Formula], Scalar]) -> Tree:
    """Return the tree with the links of an elastic body, whose joint is in the tree already.

    There is a link for the beam, and one for each station to which the scene attaches something and that deforms. The
    beam's link does not move relative to the parent: columns of the joint are zero, and elastic coordinates deform the
    beam. So the frame of the beam, and with it the shape integrals, are the frame and the integrals of the body for any
    axes of the joint.
    """
    from eomgen.mechanics.shape_functions.integrals import shape_integrals  # noqa: PLC0415  # imports SciPy

    assert body.beam is not None  # asked for by the caller
    algebra, mount = tree.algebra, tree.mounts[body.name]
    integrals, coordinates = shape_integrals(body.beam), tree.coordinates[body.name]
    center = algebra.vector([number(item) for item in body.center_of_mass])
    inertia = inertia_about_center(algebra, number(body.mass), center, tuple(number(entry) for entry in body.inertia))
    beam = replace(
        _still_link(body.name, joint, "elastic", mount, coordinates),
        inertia=clean(algebra, inertia),
        elastic=elastic_body(algebra, body.beam, integrals, coordinates, number),
    )
    links, first = [*tree.links, beam], len(tree.links)
    stations = dict(tree.stations)
    for x in _station_positions(scene, body.name, number):
        station = integrals.at(x)
        stations[body.name, x] = first
        if moves(station):
            stations[body.name, x] = len(links)
            motion = station_motion(algebra, integrals.kinds, station, x, coordinates, shortens=body.beam.stiffening)
            offset = algebra.vector([x, 0.0, 0.0])
            links.append(
                replace(
                    beam,
                    name=f"{body.name} at x = {x:g}",
                    kind="station",
                    parent=first,
                    rotation=motion.rotation,
                    orientation=algebra.identity,
                    neutral_position=offset,
                    travel=minus(motion.position, offset),
                    position=motion.position,
                    columns=motion.columns,
                    inertia=no_inertia(algebra),
                    elastic=None,
                    station=motion,
                )
            )
    mounts = {**tree.mounts, body.name: Mount(first, algebra.identity, algebra.zero_vector)}
    return replace(tree, links=tuple(links), mounts=mounts, stations=stations)


def _station_positions(scene: Scene, body: str, number: Callable[[Formula], Scalar]) -> list[float]:
    """Return the distinct positions x along a beam's axis to which the scene attaches something, sorted, m. Raises
    ModelError for a position that is a tunable parameter."""
    positions: list[float] = []
    for label, formula in attached_along(scene, body):
        x = number(formula).constant
        if x is None:
            reason = f"it is attached to beam {body} at a place along its axis that is a tunable parameter [E0516]"
            raise ModelError(
                Problem(label, reason, "a fixed number: shape functions are evaluated when the model is derived")
            )
        if x not in positions:
            positions.append(x)
    return sorted(positions)


def attached_along(scene: Scene, body: str) -> Iterable[tuple[str, Formula]]:
    """Yield (label, x) of every joint, point, force element and constraint frame on a body; x is a formula."""
    for joint in scene.joints:
        if joint.parent == body:
            yield f"joint {joint.name}", joint.position[0]
    for point in scene.points:
        if point.body == body:
            yield f"point {point.name}", point.position[0]
    for element in scene.elements:
        yield from ((element.label, position[0]) for _, held, position in element.places() if held == body)
    for constraint in scene.constraints:
        for frame in constraint.frames:
            if frame.body == body:
                yield f"constraint {constraint.name}", frame.position[0]


def build_tree(
    algebra: Algebra,
    scene: Scene,
    separate_joints: Collection[str] = (),
    values: Mapping[tuple[str, int], Scalar] | None = None,
    along_z: Collection[str] = (),
) -> Tree:
    """Return the tree of a scene in joint coordinates, recorded on the algebra's tape.

    Parameters
    ----------
    separate_joints : names of fixed joints whose bodies have separate links, at rest relative to the carrying links
    values : values in place of components of q, v and a, by block and number
    along_z : names of joints whose axis is the z axis of the joint's links, although it may be another coordinate axis
        of the body

    Raises
    ------
    ModelError
        Something is attached to a beam at a position that is not a fixed number.
    """
    parameters = parameter_scalars(algebra, scene)

    def number(formula: Formula) -> Scalar:
        return record(algebra, formula, lambda symbol: parameters[symbol.name])

    elastic = {body.name: body.beam.size for body in scene.bodies if body.beam is not None}
    factors, coordinates = joint_coordinates(algebra, scene.joints, number, elastic, values or {})
    mounts = {
        BASE: Mount(ROOT, algebra.identity, algebra.zero_vector),
        WORLD_NAME: Mount(WORLD, algebra.identity, algebra.zero_vector),
    }
    tree, links = Tree(algebra, (), mounts, parameters, factors, coordinates), list[Link]()
    with_mass = elements_with_mass(scene)
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        merged, turned = joint.name not in separate_joints, joint.name in along_z
        added = added_masses(algebra, with_mass.get(body.name, ()), number)
        tree.mounts[body.name] = _add_body(tree, links, body, joint, number, added, merged=merged, along_z=turned)
        if body.beam is not None:
            tree = add_beam(replace(tree, links=tuple(links)), scene, body, joint, number)
            links = list(tree.links)
    complete = [
        replace(link, inertia=clean(algebra, link.inertia)) if link.elastic is None else link.deform() for link in links
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
    """Add a body to the list ``links``, and return the body's mount: on new links if the joint moves, else on the
    carrying link.

    A moving joint adds a link for each elementary motion. On a fixed joint the inertia is added to the carrying link,
    but without ``merged`` the body has a separate link, too. ``added`` are masses that force elements add.
    """
    algebra = tree.algebra
    offset = algebra.vector([number(formula) for formula in joint.position])
    mount = tree.mount_at(joint.parent, offset)
    orientation = multiply(mount.orientation, algebra.matrix(joint.orientation))
    position = plus(mount.position, apply(mount.orientation, offset))
    inertia = replace(body_inertia(algebra, body, number), added=added)
    if body.beam is not None:
        inertia = no_inertia(algebra)
    if not joint.kind.moves and not merged:
        at_rest = JointCoordinates(algebra, (), (), algebra.one, algebra.zero)
        fixed = _still_link(body.name, joint, "fixed", Mount(mount.link, orientation, position), at_rest)
        links.append(replace(fixed, inertia=inertia))
        return Mount(len(links) - 1, algebra.identity, algebra.zero_vector)
    if not joint.kind.moves:
        if mount.link != ROOT:
            links[mount.link] = links[mount.link].carrying(inertia.transform(orientation, position))
        return Mount(mount.link, orientation, position)
    parent = mount.link
    turned, motions = motions_of(joint, along_z=along_z)
    axes = algebra.matrix(turned)
    orientation = multiply(orientation, axes)
    rotors = tuple(number(formula) for formula in joint.each(joint.rotor_inertia))
    for number_of_motion, motion in enumerate(motions):
        last = number_of_motion == len(motions) - 1
        name = body.name if last else f"{body.name}, part {number_of_motion + 1} of its joint"
        inner = inertia.transform(transpose(axes), algebra.zero_vector) if last else no_inertia(algebra)
        pose, coordinates = Mount(parent, orientation, position), tree.coordinates[joint.name].of(motion)
        link = moved_link(name, joint, motion, pose, coordinates, number(joint.pitch), "link")
        links.append(replace(link, inertia=inner, rotor_inertias=tuple(rotors[k] for k in motion.components)))
        parent, orientation, position = len(links) - 1, algebra.identity, algebra.zero_vector
    return Mount(parent, transpose(axes), algebra.zero_vector)


def _still_link(name: str, joint: Joint, kind: str, mount: Mount, coordinates: JointCoordinates) -> Link:
    """Return a link without inertia that does not move relative to its parent, at a pose in it. Its columns are zero,
    one for each of the given coordinates."""
    algebra, size = coordinates.algebra, len(coordinates.dofs)
    still = SubspaceColumn(algebra.zero_vector, algebra.zero_vector)
    return Link(
        name=name,
        joint=joint,
        kind=kind,
        parent=mount.link,
        rotation=FactoredRotation((MatrixFactor(mount.orientation),)),
        orientation=mount.orientation,
        neutral_position=mount.position,
        travel=algebra.zero_vector,
        position=mount.position,
        columns=(still,) * size,
        coordinates=coordinates,
        velocities=coordinates.v,
        accelerations=coordinates.a,
        inertia=no_inertia(algebra),
        rotor_inertias=(algebra.zero,) * size,
    )


def moved_link(
    name: str, joint: Joint, motion: JointMotion, mount: Mount, coordinates: JointCoordinates, pitch: Scalar, label: str
) -> Link:
    """Return the link, without inertias, that moves by one elementary motion of a joint. ``mount`` is the pose in the
    parent link at neutral coordinates, ``pitch`` is in m/rad, ``label`` begins the name of a matrix of rotation."""
    algebra = coordinates.algebra
    with algebra.tape.block(f"{'position' if motion.kind == 'travel' else 'rotation'} of {label} {name}"):
        rotation, position = pose_of(algebra, motion, pitch, mount.orientation, mount.position, coordinates.q)
        name_rotation(rotation, joint.name, f"R_{name}" if label == "body" or mount.link == ROOT else f"turn_{name}")
    _, travel = pose_of(algebra, motion, pitch, mount.orientation, algebra.zero_vector, coordinates.q)
    return Link(
        name=name,
        joint=joint,
        kind=motion.kind,
        parent=mount.link,
        rotation=rotation,
        orientation=mount.orientation,
        neutral_position=mount.position,
        travel=travel,
        position=position,
        columns=columns_of(algebra, motion, pitch),
        coordinates=coordinates,
        velocities=coordinates.v,
        accelerations=coordinates.a,
        inertia=no_inertia(algebra),
        rotor_inertias=(algebra.zero,) * len(coordinates.dofs),
        turn=motion.turn,
        motion=motion,
        pitch=pitch,
    )


def group_inertias(tree: Tree) -> Tree:
    """Return the tree with constant inertial parameters grouped from the tips to the root. Parts of a link's inertia
    that are indistinguishable through the joint are moved to the parent, or left out at the base."""
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
            moved = movable.transform(link.orientation, link.neutral_position)
            inertias[link.parent] = clean(algebra, inertias[link.parent] + moved)
    links = tuple(replace(link, inertia=inertia) for link, inertia in zip(tree.links, inertias, strict=True))
    return replace(tree, links=links)


def _movable(algebra: Algebra, link: Link, inertia: RecordedInertia) -> RecordedInertia:
    """Return the part of a link's inertia that may be assigned to the parent without a change of the equations."""
    zero, nothing = algebra.zero, algebra.matrix([[0, 0, 0]] * 3)
    if link.turn is not None:
        k = link.turn.place
        along = inertia.second[k][k] + _rotor_moment(algebra, inertia, k)
        second = algebra.matrix([[along if i == j == k else zero for j in range(3)] for i in range(3)])
        if link.kind != "turn":
            return RecordedInertia(zero, algebra.zero_vector, second)
        return RecordedInertia(inertia.mass, _unit(algebra, k, inertia.first[k]), second)
    match link.kind:
        case "travel":
            return RecordedInertia(zero, algebra.zero_vector, inertia.second)
        case "ball":
            return RecordedInertia(inertia.mass, algebra.zero_vector, nothing)
        case _:
            return RecordedInertia(zero, algebra.zero_vector, nothing)


def _rotor_moment(algebra: Algebra, inertia: RecordedInertia, k: int) -> Scalar:
    """Return the further second moment along axis k that can be removed from a body of revolution about this axis. Then
    only the moment of inertia about the axis is left, and the link needs no angular acceleration across the axis. Zero
    for other bodies, and for inertias that depend on parameters."""
    i, j = (k + 1) % 3, (k + 2) % 3
    S = inertia.second
    across, beside = S[i][i].constant, S[j][j].constant
    if across is None or beside is None or not (S[i][j].is_zero and S[i][k].is_zero and S[j][k].is_zero):
        return algebra.zero
    return S[i][i] if across == beside else algebra.zero


def _unit(algebra: Algebra, k: int, value: Scalar) -> Vector:
    return algebra.vector([value if i == k else algebra.zero for i in range(3)])


def _without(algebra: Algebra, inertia: RecordedInertia, movable: RecordedInertia) -> RecordedInertia:
    rows = zip(inertia.second, movable.second, strict=True)
    return RecordedInertia(
        inertia.mass - movable.mass,
        minus(inertia.first, movable.first),
        algebra.matrix([minus(present, moved) for present, moved in rows]),
        inertia.added,
    )


def _constant(values: Sequence[Scalar]) -> bool:
    return all(value.constant is not None for value in values)
