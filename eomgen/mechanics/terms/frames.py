"""Terms of frames: poses, Jacobians with rates and drifts in three references, inverse operational-space inertias."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics.elimination import factored, half_solved
from eomgen.mechanics.dynamics.separated import mass_rows
from eomgen.mechanics.kinematics.bodies import Orientations
from eomgen.mechanics.kinematics.frames import FrameMotion
from eomgen.mechanics.tree.base import quaternion_product
from eomgen.mechanics.tree.links import Mount
from eomgen.symbolic.scalar import Scalar, apply, multiply, plus
from eomgen.system.description import FixedFrame
from eomgen.system.system import Block
from eomgen.system.terms import REFERENCES


def frame_mount(derivation: Derivation, frame: FixedFrame) -> Mount:
    """Return the mount of a frame on its link; on a beam, on the station at the frame's origin."""
    position = derivation.quantities.vector(frame.position)
    mount = derivation.tree.mount_at(frame.body, position)
    orientation = multiply(mount.orientation, derivation.algebra.matrix(frame.orientation))
    return Mount(mount.link, orientation, plus(mount.position, apply(mount.orientation, position)))


def frame_poses(derivation: Derivation) -> list[Block]:
    """Return quaternion (w, x, y, z; to world axes) and world position, m, of each frame, (frames, 7)."""
    orientations = Orientations(derivation.scene, derivation.tree, derivation.kinematics)
    values: list[Scalar] = []
    for frame in derivation.scene.frames_of_terms():
        turned = [derivation.algebra.scalar(part) for part in frame.quaternion]
        position = derivation.quantities.vector(frame.position)
        values += quaternion_product(orientations.at(frame.body, position), turned)
        values += derivation.kinematics.position(frame.body, position)
    return [_block(derivation, "frame_pose", (7,), values, "quaternion (w, x, y, z) and position")]


def frame_jacobians(derivation: Derivation, reference: str) -> list[Block]:
    """Return J of each frame, (frames, 6, nv)."""
    motion = FrameMotion(derivation.kinematics, reference)
    return [_recorded(derivation, "J", (6, derivation.tree.nv), motion.jacobian, "twist per unit of v")]


def frame_jacobian_rates(derivation: Derivation, reference: str) -> list[Block]:
    """Return dJ/dt of each frame, (frames, 6, nv)."""
    motion = FrameMotion(derivation.kinematics, reference)
    return [_recorded(derivation, "J_dot", (6, derivation.tree.nv), motion.jacobian_rate, "dJ/dt")]


def frame_drifts(derivation: Derivation, reference: str) -> list[Block]:
    """Return dJ/dt v of each frame, (frames, 6)."""
    motion = FrameMotion(derivation.kinematics, reference)
    return [_recorded(derivation, "drift", (6,), motion.drift, "dJ/dt v")]


def frame_mobilities(derivation: Derivation) -> list[Block]:
    """Return J M^-1 J^T of each frame, (frames, 6, 6), J in world axes about its origin, angular first."""
    nv = derivation.tree.nv
    (J,) = frame_jacobians(derivation, "local_world_aligned")
    rows = mass_rows(derivation.grouped, derivation.composites)
    values: list[Scalar] = []
    with derivation.tape.block("inverse operational-space inertias: M = L^T D L, halves L^-T J^T"):
        factors, inverse = factored(rows, derivation.tree.dof_parents())
        for start in range(0, len(J.refs), 6 * nv):
            refs = [J.refs[start + nv * k : start + nv * (k + 1)] for k in range(6)]
            halves = [half_solved(factors, [Scalar(derivation.tape, ref) for ref in row]) for row in refs]
            weighted = [[x * d for x, d in zip(half, inverse, strict=True)] for half in halves]
            upper = {(i, j): _dot(derivation, weighted[i], halves[j]) for i in range(6) for j in range(i, 6)}
            values += [upper[min(i, j), max(i, j)] for i in range(6) for j in range(6)]
    return [_block(derivation, "mobility", (6, 6), values, "J M^-1 J^T")]


def _dot(derivation: Derivation, x: list[Scalar], y: list[Scalar]) -> Scalar:
    total = derivation.algebra.zero
    for first, second in zip(x, y, strict=True):
        total = total + first * second
    return total


def _recorded(
    derivation: Derivation, name: str, shape: tuple[int, ...], of: Callable[[Mount], list[Scalar]], description: str
) -> Block:
    values: list[Scalar] = []
    for frame in derivation.scene.frames_of_terms():
        mount = frame_mount(derivation, frame)
        with derivation.tape.block(f"{description} of frame {frame.name}"):
            values += of(mount)
    return _block(derivation, name, shape, values, description)


def _block(derivation: Derivation, name: str, shape: tuple[int, ...], values: list[Scalar], description: str) -> Block:
    names = [frame.name for frame in derivation.scene.frames_of_terms()]
    return derivation.block(name, (len(names), *shape), values, f"{description} of {', '.join(names)}")


def _by_reference(record: Callable[..., list[Block]], name: str) -> dict[str, Callable[[Derivation], list[Block]]]:
    return {f"{name}{ending}": partial(record, reference=reference) for reference, (ending, _) in REFERENCES.items()}


FRAME_RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "frame_poses": frame_poses,
    **_by_reference(frame_jacobians, "frame_jacobians"),
    **_by_reference(frame_jacobian_rates, "frame_jacobian_rates"),
    **_by_reference(frame_drifts, "frame_drifts"),
    "frame_mobilities": frame_mobilities,
}
