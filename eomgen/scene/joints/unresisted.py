"""Joints whose motion meets no inertia because of the bodies they carry, such as a free massless root link.

A joint that carries no inertia is refused by ``moved_inertia``. Here the joint carries mass, but joints beyond can
compensate the motion, so that no mass moves: the inertia matrix is singular in every position. Elimination by
articulated bodies (Featherstone 1983), on numbers and at one arbitrary position, finds that joint by joint.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import listed
from eomgen.base.rounding import COMPUTED
from eomgen.scene.inertia import Inertia
from eomgen.scene.joint_types import GROUPS
from eomgen.scene.joints.model import Joint
from eomgen.scene.joints.moved_inertia import coupled_by_mimic
from eomgen.scene.joints.tree import joint_displacement, twist_transform
from eomgen.scene.reading.values import Values

#: An inertia counts as zero below this part of its value with the outer joints held.
_NOTHING = 1e-11


@np.errstate(over="ignore", invalid="ignore")  # masses near the largest double are refused elsewhere
def unresisted_motions(
    joints: Sequence[Joint],
    inertias: Mapping[str, Inertia],
    sections: Mapping[str, str],
    values: Values,
    light: Sequence[str] = (),
) -> list[str]:
    """Return a note on each joint that can move without moving any mass, together with joints beyond it.

    Mimic joints and their leaders count as held: a massless motion without these joints exists in either case.

    Parameters
    ----------
    joints : parents first
    inertias : of each body, in the body frame; a body missing here, and a beam, counts as one that resists every motion
    sections : the section of each body, ``bodies`` or ``beams``
    light : further joints that move no inertia; all such joints share one note
    """
    arbitrary = random.Random(1)
    fixed_joints = coupled_by_mimic(joints, values)
    places = [np.array([values.value(entry) for entry in joint.position]) for joint in joints]
    size = _size([*places, *(inertia.center for inertia in inertias.values())])
    spans = _own(inertias, sections, size)
    articulated = {body: inertia.copy() for body, inertia in spans.items()}
    together = {body: inertia.copy() for body, inertia in spans.items()}  # with all joints beyond held
    notes: list[str] = []
    bare = list(light)
    solid = _solid(joints, spans)
    for joint, offset in zip(reversed(joints), reversed(places), strict=True):
        if joint.child in solid:
            continue
        rotation, shift, S = _arbitrary_displacement(joint, values, arbitrary)
        S = S / np.array([1.0, 1.0, 1.0, size, size, size])[:, np.newaxis]
        position = offset / size + np.array(joint.orientation) @ shift
        inertia, body = articulated[joint.child], joint.child
        X = twist_transform(np.array(joint.orientation) @ rotation, position)
        if not (np.all(np.isfinite(X)) and np.all(np.isfinite(inertia))):
            return []  # said elsewhere
        if S.shape[1] and joint.name not in fixed_joints:
            rotors = np.diag([values.value(formula) / size**2 for formula in joint.each(joint.rotor_inertia)])
            whole = np.diag(S.T @ together[body] @ S + rotors)
            scale = np.sqrt(np.where(whole > 0.0, whole, 1.0))
            resisted, directions = np.linalg.eigh((S.T @ inertia @ S + rotors) / np.outer(scale, scale))
            moved = S @ (directions[:, resisted <= _NOTHING] / scale[:, np.newaxis])
            if any(_is_still(twist, together[body]) for twist in moved.T):
                bare.append(joint.name)
            elif any(_is_still(twist, spans[body]) for twist in moved.T):
                notes.append(_note(joint, joints, inertias))
            free_directions = directions[:, resisted > _NOTHING] / scale[:, np.newaxis]
            along = inertia @ S @ free_directions
            inertia = inertia - (along / resisted[resisted > _NOTHING]) @ along.T
        if joint.parent in articulated:
            articulated[joint.parent] += X.T @ inertia @ X
            together[joint.parent] += X.T @ together[body] @ X
    if bare:
        notes.append(_note_of_bare({joint.name: joint.child for joint in joints}, bare))
    return notes[::-1]


def _is_still(moved: Array, inertia: Array) -> bool:
    """Return whether a twist (6,) has no kinetic energy beyond rounding with a spatial inertia (6, 6)."""
    return bool(moved @ inertia @ moved <= _NOTHING * (np.abs(moved) @ np.abs(inertia) @ np.abs(moved)))


def _own(inertias: Mapping[str, Inertia], sections: Mapping[str, str], size: float) -> dict[str, Array]:
    """Return the (6, 6) spatial inertia of each body, with lengths in multiples of ``size``, m; the unit matrix for a
    body of unknown inertia and for a beam, which resist every motion."""
    alike = {id(inertia): inertia for inertia in inertias.values()}  # nodes of a beam share one
    spatial = {number: inertia.spatial(size) for number, inertia in alike.items()}
    return {
        body: np.eye(6) if section == "beams" or body not in inertias else spatial[id(inertias[body])]
        for body, section in sections.items()
    }


def _note(joint: Joint, joints: Sequence[Joint], inertias: Mapping[str, Inertia]) -> str:
    """Return the note that a joint and joints on its body move together without moving mass, with the body whose mass
    would stop that."""
    carried = [outer.name for outer in joints if outer.parent == joint.child]
    together = f" together with {'some of ' * (len(carried) > 1)}{listed(carried)}" if carried else ""
    light = inertias.get(joint.child)
    missing = "mass and inertia" if light is None or not light.mass else "inertia"
    return (
        f"no inertia resists the {joint.type} joint {joint.name}{together}: they can move without moving any mass, so"
        f" the inertia matrix is singular and forward dynamics has no answer; try: {missing} for the body"
        f" {joint.child}, or a fixed joint in place of one of them (of other formats: root or lock) [W0134]"
    )


def _solid(joints: Sequence[Joint], spans: Mapping[str, Array]) -> set[str]:
    """Return the outermost bodies, carried by the base alone, whose own inertia resists every motion; ``spans`` are the
    spatial inertias (6, 6) by body."""
    carriers = {joint.parent for joint in joints}
    outermost = [joint.child for joint in joints if joint.parent not in spans and joint.child not in carriers]
    outermost = [body for body in outermost if np.isfinite(spans[body]).all()]
    resisted = np.linalg.eigvalsh(np.array([spans[body] for body in outermost]).reshape(-1, 6, 6))
    least, largest = resisted[:, 0], resisted[:, -1]
    return set(itertools.compress(outermost, (least > COMPUTED * largest).tolist()))


def _note_of_bare(carried: Mapping[str, str], names: Collection[str]) -> str:
    """Return a note on joints that no mass or inertia resists, in the order of ``carried``, the bodies by joint."""
    why = "no body beyond has mass or inertia in their motion, so the inertia matrix is singular"
    ordered = [name for name in carried if name in names]
    remedy = f"mass or inertia there, lock={ordered!r}, or terms=['poses', 'inverse_dynamics']"
    named = ", ".join(f"{name} (body {carried[name]})" for name in ordered)
    return f"no inertia resists {named}: {why}; try: {remedy} [W0269]"


def _size(vectors: Sequence[Array]) -> float:
    """Return the largest length of vectors, m; 1 if all are zero or one is not finite."""
    largest = max((float(np.linalg.norm(vector)) for vector in vectors), default=0.0)
    return largest if 0.0 < largest < np.inf else 1.0


def _arbitrary_displacement(joint: Joint, values: Values, arbitrary: random.Random) -> tuple[Array, Array, Array]:
    """Return rotation (3, 3), shift (3,) and motion subspace (6, nv) of a joint at an arbitrary position; the shift is
    in m."""
    q = np.array([arbitrary.uniform(0.3, 1.2) for _ in range(joint.kind.q_size)])
    if joint.kind.group in GROUPS.values():
        q[:4] /= np.linalg.norm(q[:4])
    return joint_displacement(joint.kind, joint.axis, joint.second_axis, q, values.value(joint.pitch))
