"""Random states of two machines in the coordinates of each, and the equations of motion at these states."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import block_diag

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3, SO3
from eomgen.products.comparison.differences import Pairing
from eomgen.products.comparison.machine import Forces, MachineLink, MachineMotion, Placement
from eomgen.products.comparison.report import Difference
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.rotations import quaternion_of_matrix
from eomgen.system.description import component_names

#: How far random coordinates without limits go, by unit.
_REACH = {"rad": 1.5, "m": 0.5}


def motions(pairing: Pairing, count: int, random: np.random.Generator) -> tuple[MachineMotion, MachineMotion]:
    """Return ``count`` equal random states in the coordinates of both machines, with equal random inputs."""
    first, second = pairing.first, pairing.second
    empty = np.zeros((count, 0))
    q, v = [empty] * len(first.links), [empty] * len(first.links)
    their_q, their_v = [empty] * len(second.links), [empty] * len(second.links)
    for i, j in pairing.pairs:
        link, partner = first.links[i], second.links[j]
        if link.held:
            continue
        q[i], v[i] = _drawn(link, partner, count, random)
        their_q[j], their_v[j] = _as_second(pairing, i, q[i], v[i])
    inputs = {name: random.normal(size=count) for name in first.inputs if name in second.inputs}
    return MachineMotion(q, v, inputs), MachineMotion(their_q, their_v, inputs)


def _drawn(link: MachineLink, partner: MachineLink, count: int, random: np.random.Generator) -> tuple[Array, Array]:
    """Return random coordinates (count, size) of a joint, within the limits of both descriptions, and random
    velocities."""
    kind = JOINTS[link.type]
    v = random.normal(size=(count, kind.v_size))
    if kind.group == "SO3":
        return numeric.exp(SO3, random.normal(size=(count, 3))), v
    if kind.group == "SE3":
        return numeric.exp(SE3, random.normal(size=(count, 6))), v
    ends = []
    for index, unit in enumerate(kind.units):
        name = "" if kind.v_size == 1 else f"[{index}]"
        low, high = -_REACH[unit], _REACH[unit]
        for side in (link, partner):
            lower, upper = side.numbers.get(f"lower{name}", -math.inf), side.numbers.get(f"upper{name}", math.inf)
            if isinstance(lower, float) and isinstance(upper, float) and max(low, lower) < min(high, upper):
                low, high = max(low, lower), min(high, upper)
        ends.append((low, high))
    lows, highs = np.array(ends).reshape(-1, 2).T
    return random.uniform(lows, highs, size=(count, len(ends))), v


def _as_second(pairing: Pairing, number: int, q: Array, v: Array) -> tuple[Array, Array]:
    """Return coordinates q (n, size) and velocities v of a link of the first machine in the frames of the second, on
    which they depend for balls and free bodies. With X and X_p the second's frames of link and parent in the first's,
    and P the poses at zero, P q = X_p P' q' X^-1."""
    link, partner = pairing.first.links[number], pairing.second.links[pairing.partner[number]]
    group = {"SO3": SO3, "SE3": SE3}.get(JOINTS[link.type].group)
    if group is None:
        return q, v
    zero = link.pose.inverse().then(pairing.aligned[link.parent]).then(partner.pose)
    of_link, of_zero = (_element(placement, q.shape) for placement in (pairing.aligned[number], zero))
    moved = numeric.compose(group, numeric.compose(group, numeric.inverse(group, of_zero), q), of_link)
    back = numeric.adjoint(group, numeric.inverse(group, of_link))
    return moved, np.einsum("nij,nj->ni", back, v)


def _element(placement: Placement, shape: tuple[int, ...]) -> Array:
    """Return a place as elements of the group with these many numbers, (n, 4) or (n, 7)."""
    quaternion = np.array(quaternion_of_matrix(placement.axes.tolist()))
    return np.broadcast_to(np.concatenate([quaternion, placement.origin])[: shape[1]], shape)


def errors_of(pairing: Pairing, first: Forces, second: Forces) -> tuple[dict[str, float], list[Difference]]:
    """Return the largest relative difference of each term (``mass matrix``, ``bias`` and ``force``, or ``sum``) over
    all states, and the entry of each that differs most, as a difference. The second machine's terms are transformed
    into the coordinates of the first."""
    names, columns, transform = _order(pairing)
    placed = transform[np.newaxis]
    mass = np.transpose(placed, (0, 2, 1)) @ second.mass[:, columns[:, np.newaxis], columns] @ placed
    errors: dict[str, float] = {}
    worst: list[Difference] = []
    if not names:
        return errors, worst
    root = np.sqrt(np.abs(np.einsum("nii->ni", first.mass)))
    terms = [("mass matrix", first.mass, mass, root[:, :, np.newaxis] * root[:, np.newaxis])]
    separate = [("bias", first.bias, second.bias), ("force", first.force, second.force)]
    together = first.bias is None or second.bias is None
    for name, mine, theirs in [("sum", first.total, second.total)] if together else separate:
        assert mine is not None and theirs is not None  # bias and force are given together
        moved = theirs[:, columns] @ transform
        size = np.abs(first.total).max(axis=0) + np.abs(mine).max(axis=0)
        size = np.maximum(size, 1e-9 * max(float(size.max()), float(np.abs(moved).max())))
        terms.append((name, mine, moved, size))
    for name, mine, theirs, size in terms:
        apart = np.abs(theirs - mine) / np.where(size > 0.0, size, 1.0)
        index = np.unravel_index(np.argmax(apart), apart.shape)
        errors[name] = float(apart[index])
        entry = ", ".join(names[k] for k in index[1:])
        element = f"M[{entry}]" if name == "mass matrix" else f"v.{entry}"
        worst.append(Difference(element, name, float(mine[index]), float(theirs[index])))
    return errors, worst


def _order(pairing: Pairing) -> tuple[list[str], Array, Array]:
    """Return the names of the first machine's velocities, the second's columns in this order (nv,), and the matrix (nv,
    nv) from the first's velocities to the second's."""
    starts, start = {}, 0
    for j, link in enumerate(pairing.second.links):
        starts[j] = start
        start += 0 if link.held else JOINTS[link.type].v_size
    names: list[str] = []
    columns: list[int] = []
    blocks: list[Array] = []
    for i, j in pairing.pairs:
        link = pairing.first.links[i]
        if link.held:
            continue
        size = JOINTS[link.type].v_size
        names += component_names("", link.joint, size)
        columns += range(starts[j], starts[j] + size)
        blocks.append(_velocities(pairing, i, size))
    transform = block_diag(*blocks) if blocks else np.zeros((0, 0))
    return names, np.array(columns, dtype=int), transform


def _velocities(pairing: Pairing, number: int, size: int) -> Array:
    """Return the matrix from a link's velocities in the first machine to velocities in the second."""
    kind = JOINTS[pairing.first.links[number].type]
    neutral = np.eye(1, kind.q_size) if kind.group != "R" else np.zeros((1, kind.q_size))
    return np.array([_as_second(pairing, number, neutral, unit[np.newaxis])[1][0] for unit in np.eye(size)]).T
