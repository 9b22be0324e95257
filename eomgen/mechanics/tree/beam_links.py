"""Links of a beam: the beam itself, and a massless link per station to which something is attached."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula
from eomgen.mechanics.tree.beam_body import elastic_body
from eomgen.mechanics.tree.beam_stations import moves, station_motion
from eomgen.mechanics.tree.inertia import inertia_about_center
from eomgen.mechanics.tree.joints import Column
from eomgen.mechanics.tree.links import Link, Mount, Tree, cleaned, no_inertia
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.rotation import MatrixFactor, Rotation
from eomgen.symbolic.scalar import Scalar, minus


def add_beam(tree: Tree, scene: Scene, body: Body, joint: Joint, number: Callable[[Formula], Scalar]) -> Tree:
    """Return the tree with the links of a beam, whose joint is in the tree already.

    The beam's link does not move relative to its parent: its columns are zero, its coordinates deform it. So its frame,
    and with it the shape integrals, are the body's own for any axes of the joint.
    """
    if body.beam is None:
        return tree
    from eomgen.mechanics.shape_functions.integrals import shape_integrals  # noqa: PLC0415  # imports SciPy

    algebra, mount = tree.algebra, tree.mounts[body.name]
    integrals, coordinates = shape_integrals(body.beam), tree.coordinates[body.name]
    center = algebra.vector([number(item) for item in body.center_of_mass])
    inertia = inertia_about_center(algebra, number(body.mass), center, tuple(number(entry) for entry in body.inertia))
    still = Column(algebra.zero_vector, algebra.zero_vector)
    beam = Link(
        name=body.name,
        joint=joint,
        kind="elastic",
        parent=mount.link,
        rotation=Rotation((MatrixFactor(mount.orientation),)),
        orientation=mount.orientation,
        neutral_position=mount.position,
        travel=algebra.zero_vector,
        position=mount.position,
        columns=(still,) * body.beam.size,
        coordinates=coordinates,
        velocities=coordinates.v,
        accelerations=coordinates.a,
        inertia=cleaned(algebra, inertia),
        rotor_inertias=(algebra.zero,) * body.beam.size,
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
    """Return the distinct positions x along a beam's axis to which the scene attaches something, sorted, m."""
    positions: list[float] = []
    for label, formula in attached_along(scene, body):
        x = number(formula).constant
        if x is None:
            reason = f"it is attached to beam {body} at a place along its axis that is a tunable parameter"
            raise ModelError(
                Problem(label, reason, "a fixed number: shape functions are evaluated when the model is derived")
            )
        if x not in positions:
            positions.append(x)
    return sorted(positions)


def attached_along(scene: Scene, body: str) -> Iterable[tuple[str, Formula]]:
    """Yield a label of everything attached to a body, with its x in the body's frame."""
    for joint in scene.joints:
        if joint.parent == body:
            yield f"joint {joint.name}", joint.position[0]
    for point in scene.points:
        if point.body == body:
            yield f"point {point.name}", point.position[0]
    for element in scene.elements:
        yield from ((element.label, position[0]) for _, held, position in element.places() if held == body)
    for constraint in scene.constraints:
        for frame in (constraint.first, constraint.second):
            if frame.body == body:
                yield f"constraint {constraint.name}", frame.position[0]
