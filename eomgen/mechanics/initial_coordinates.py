"""Initial q and v of a scene, in joint or in absolute coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, groupby
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.formula.nodes import ZERO_VECTOR, Number, Symbol
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor, difference
from eomgen.mechanics.constraints.joints import counted_angles
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.absolute import DEFAULT_GROUP, build_absolute_tree
from eomgen.mechanics.tree.base import base_law
from eomgen.mechanics.tree.links import WORLD_NAME, Tree
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.bodies.model import Beam
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.rotations import quaternion_of_matrix
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.description import BASE

_SAME = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def joint_start(
    derivation: Derivation, longer: Scene | None = None, factors: Sequence[Mapping[str, Any]] = ()
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return q, (nq,), and v, (nv,), of the initial state in joint coordinates.

    Nodes of geometrically exact beams are placed in the shape without load, moving with the first node as a rigid body.

    Parameters
    ----------
    longer : the scene with more elements of beams than were derived, no element being carried by a node of a beam
    factors : data of the factors of the configuration of ``longer``, if any
    """
    scene = derivation.scene if longer is None else longer
    every = derivation.tree.factors if longer is None else [Factor(**factor) for factor in factors]
    starts = {joint.name: (joint.initial_position, joint.initial_velocity) for joint in scene.joints}
    starts |= {body.name: _initial_deflection(body.beam) for body in scene.bodies if body.beam is not None}
    ordered = [starts[factor.name] for factor in every]
    q, v = (np.array([value for start in ordered for value in start[part]], dtype=float) for part in (0, 1))
    by_name = {factor.name: factor for factor in every}
    order = {body.name: number for number, body in enumerate(scene.bodies)}
    beams = [element.beam for element in scene.elements if isinstance(element, CosseratBeam)]
    derived = [(q, v)] * len(beams) if longer is None else [joint_start(derivation)] * len(beams)
    beams.sort(key=lambda beam: order[beam.name])  # one may be carried by another
    for beam, (of_derived_q, of_derived_v) in zip(beams, derived, strict=True):
        first, twist = _first_node(derivation, beam, np.asarray(of_derived_q), np.asarray(of_derived_v))
        from_first = _from_first(beam)
        poses = numeric.compose(SE3, first, from_first)
        twists = numeric.adjoint(SE3, numeric.inverse(SE3, from_first)) @ twist
        for name, pose, node_twist in zip(beam.nodes[1:], poses, twists, strict=True):
            q[by_name[name].q], v[by_name[name].v] = pose, node_twist
    return tuple(q.tolist()), tuple(v.tolist())


def _first_node(
    derivation: Derivation, beam: Cosserat, q: NDArray[np.float64], v: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pose, (7,), and the twist, (6,), of the first section of a beam at the initial q and v, relative to
    the base."""
    kinematics, mount = derivation.kinematics, derivation.tree.mounts[beam.name]
    R, p = kinematics.pose(mount.link)
    omega, velocity = kinematics.twist(mount.link)
    values = [*chain.from_iterable(R), *p, *omega, *velocity, *chain.from_iterable(mount.orientation), *mount.position]
    inputs = _defaults(derivation.scene) | {"t": np.zeros(1), "q": q, "v": v}
    if derivation.scene.base is not None:
        law = base_law(derivation.algebra, derivation.scene.base, derivation.tree.parameters)
        inputs["base"] = np.array(evaluate(derivation.tape, [value.ref for value in law], inputs))
    numbers = np.array(evaluate(derivation.tape, [value.ref for value in values], inputs), dtype=float)
    link, turned, offset = numbers[:9].reshape(3, 3), numbers[18:27].reshape(3, 3), numbers[27:]
    axes, origin = link @ turned, numbers[9:12] + link @ offset
    first = np.concatenate([quaternion_of_matrix(axes), origin])
    twist = np.concatenate([turned.T @ numbers[12:15], turned.T @ (numbers[15:18] + np.cross(numbers[12:15], offset))])
    return first, twist


def _from_first(beam: Cosserat) -> NDArray[np.float64]:
    """Return the pose, (elements, 7), of each node but the first in the frame of the first node, in the shape without
    load. Along alike elements the nodes are on one helix."""
    before, poses = np.array([1.0, *(0.0,) * 6]), []
    for twist, alike in groupby(part.twist for part in beam.parts):
        numbers = np.arange(1.0, len(list(alike)) + 1.0)[:, np.newaxis]
        poses.append(numeric.compose(SE3, before, numeric.exp(SE3, numbers * np.array(twist))))
        before = poses[-1][-1]
    return np.concatenate(poses)


def _initial_deflection(beam: Beam) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the initial elastic coordinates of a beam and their rates, zero unless the scene gives them."""
    q: list[float] = []
    v: list[float] = []
    for item in beam.deformations:
        q += item.initial_position or (0.0,) * item.modes
        v += item.initial_velocity or (0.0,) * item.modes
    return tuple(q), tuple(v)


def free_start(scene: Scene) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Return q and v of a scene whose joints all are free joints at the origin of a base at rest, without equations.
    Bodies have absolute coordinates at their centres of mass. None if the scene has other joints, a base motion, or
    centres of mass by formulas."""
    q: list[Array] = []
    v: list[Array] = []
    groups = scene.groups
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        apart = joint.parent not in (BASE, WORLD_NAME) or joint.position != ZERO_VECTOR or joint.orientation != _SAME
        if scene.base is not None or joint.type != "free" or apart:
            return None
        if not all(isinstance(item, Number) for item in body.center_of_mass):
            return None
        pose = np.array(joint.initial_position or (1.0, *(0.0,) * 6))
        twist = np.array(joint.initial_velocity or (0.0,) * 6)
        center = np.array([cast("Number", item).value for item in body.center_of_mass])
        if center.any() or twist.any():
            R = numeric.rotation_matrix(pose[:4])
            pose[4:] += R @ center
            twist[3:] += np.cross(twist[:3], center)
            if groups.get(body.name, DEFAULT_GROUP) != "SE3":
                twist[3:] = R @ twist[3:]
        q.append(pose)
        v.append(twist)
    return tuple(np.concatenate(q).tolist()), tuple(np.concatenate(v).tolist())


def absolute_start(derivation: Derivation) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return q, (nq,), and v, (nv,), of the absolute bodies at the joints' initial state and the base's pose at t = 0.

    The references of counted angles follow the poses in q.
    """
    return AbsoluteStartEquations(derivation.scene, derivation.tree).at({})


class AbsoluteStartEquations:
    """Initial q and v of absolute bodies on tapes that serve all values of the tunable parameters.

    Parameters
    ----------
    scene : with absolute coordinates
    tree : of the bodies; recorded on a tape of its own by default
    """

    def __init__(self, scene: Scene, tree: Tree | None = None) -> None:
        self._scene = scene
        self._tree = build_absolute_tree(Algebra(Tape()), scene, scene.groups) if tree is None else tree
        # nodes of beams are placed in numbers
        with_beams = any(isinstance(element, CosseratBeam) for element in scene.elements)
        self._bodies = None if with_beams else BodiesAtStart(scene)

    def at(self, parameters: Mapping[str, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return q, (nq,), and v, (nv,), for values of parameters by name; other parameters have the scene's values."""
        scene = _with_parameters(self._scene, parameters)
        q, v = _absolute_start(self._tree, self._bodies or BodiesAtStart(scene), _defaults(scene))
        return tuple(map(float, q)), tuple(map(float, v))

    def slopes(
        self, parameters: Mapping[str, float], names: Sequence[str]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the partials of q (left-trivialised) and v in the named parameters, (nv, names) each, by complex
        steps. None with nodes of geometrically exact beams, which are placed in real numbers."""
        if self._bodies is None:
            return None
        scene, factors = _with_parameters(self._scene, parameters), self._tree.factors
        tunable = [parameter.name for parameter in scene.parameters if parameter.tunable]
        values = _defaults(scene)["p"]
        slopes = np.zeros((2, self._tree.nv, len(names)))
        inputs = self._tree.algebra.tape.depends_on(_places(self._tree)) | self._bodies.depends_on()
        numbers = {symbol.index for symbol in inputs if symbol.block == "p"}  # masses do not move the bodies
        moving = [(column, number) for column, name in enumerate(names) if (number := tunable.index(name)) in numbers]
        q = np.array(_absolute_start(self._tree, self._bodies, {"p": values})[0]) if moving else slopes[0]
        step = 1e-100  # its square is below rounding: exact derivatives (Squire and Trapp 1998)
        for column, number in moving:
            moved = values.astype(complex)
            moved[number] += 1j * step
            at, v = _absolute_start(self._tree, self._bodies, {"p": moved})
            slopes[0, :, column], slopes[1, :, column] = difference(factors, q, at).imag / step, v.imag / step
        return slopes[0], slopes[1]


def _with_parameters(scene: Scene, parameters: Mapping[str, float]) -> Scene:
    """Return a scene with other values of parameters."""
    changed = tuple(replace(item, value=parameters.get(item.name, item.value)) for item in scene.parameters)
    return replace(scene, parameters=changed)


def _absolute_start(
    tree: Tree, bodies: BodiesAtStart, p: Mapping[str, NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return q, (nq,), and v, (nv,), of the absolute bodies for real or complex parameters ``p`` (``{"p": values}``).
    ``bodies`` gives poses and twists of the bodies at the joints' initial state."""
    poses, twists, angles = bodies(p)
    numbers = {body.name: number for number, body in enumerate(bodies.scene.bodies)}
    offsets = -evaluate(tree.algebra.tape, _places(tree), p).reshape(-1, 3)
    nq = sum(factor.q_size for factor in tree.factors)
    q, v = np.concatenate([np.zeros(nq), angles]), np.zeros(tree.nv, dtype=angles.dtype)
    for link, factor, offset in zip(tree.links, tree.factors, offsets, strict=True):
        pose, twist = poses[numbers[link.name]], twists[numbers[link.name]]
        R = numeric.rotation_matrix(pose[:4])
        velocity = twist[3:] + np.cross(twist[:3], offset)
        position, speed = slice(factor.q_start, None), slice(factor.v_start, None)
        match factor.group:
            case "SE3":
                q[position][:7] = np.concatenate([pose[:4], pose[4:] + R @ offset])
                v[speed][:6] = np.concatenate([twist[:3], velocity])
            case "SO3":
                q[position][:4], v[speed][:3] = pose[:4], twist[:3]
            case _:
                q[position][:3], v[speed][:3] = pose[4:] + R @ offset, R @ velocity
    return q, v


def _places(tree: Tree) -> list[Ref]:
    """Return the positions of the links' mounts, three numbers each."""
    return [part.ref for link in tree.links for part in tree.mounts[link.name].position]


def _defaults(scene: Scene) -> dict[str, NDArray[np.float64]]:
    return {"p": np.array([parameter.value for parameter in scene.parameters if parameter.tunable])}


class BodiesAtStart:
    """Poses and twists of all bodies at the joints' initial state and t = 0, on one tape for all values of the
    parameters."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        beams = tuple(element for element in scene.elements if isinstance(element, CosseratBeam))
        bare = replace(scene, constraints=(), states=(), controllers=(), elements=beams)
        tree = Derivation(replace(bare, coordinates="joint"))
        initial_q, initial_v = joint_start(tree)
        self._tape, self._still = tree.tape, {"q": np.array(initial_q), "v": np.array(initial_v), "t": np.zeros(1)}
        (pose,), (twist,) = tree.poses(), tree.twists()
        angles = [tree.quantities(Symbol("q", *angle)).ref for angle in counted_angles(scene)]
        self._parts = list(pose.refs), list(twist.refs), angles
        self._base = None
        if scene.base is not None:
            self._base = [value.ref for value in base_law(tree.algebra, scene.base, tree.tree.parameters)]

    def depends_on(self) -> set[InputSymbol]:
        """Return the inputs on which poses, twists and angles depend."""
        return self._tape.depends_on([ref for part in (*self._parts, self._base or ()) for ref in part])

    def __call__(self, p: Mapping[str, NDArray[Any]]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return poses (bodies, 7), twists (bodies, 6) and counted angles, rad, for real or complex parameters ``{"p":
        values}``."""
        inputs: dict[str, NDArray[Any]] = {**p, **self._still}
        if self._base is not None:
            inputs["base"] = evaluate(self._tape, self._base, inputs)
        poses, twists, angles = (evaluate(self._tape, part, inputs) for part in self._parts)
        return poses.reshape(-1, 7), twists.reshape(-1, 6), angles.reshape(-1)
