"""Loops whose geometrically exact beams keep their shapes: the nodes follow the first one, and joints are the unknowns.

The nodes of a beam have coordinates of their own, and their masses are small, so corrections of least kinetic size put
a whole gap into one element. Here nodes follow the first node of the beam as parts of a rigid body, and the unknowns
are the remaining coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor, difference, update
from eomgen.solvers.beams import Beams
from eomgen.solvers.constraint_rows import ConstrainedSystem


class RigidBeams:
    """Configurations in which geometrically exact beams have the shapes of a given configuration.

    Nodes after the first node of a beam (followers) move with the first node as a rigid body; ``free`` marks the other
    velocity components.

    Parameters
    ----------
    beams, factors, angular : beams, factors of the configuration, and whether each velocity component is angular
    q : (nq,) with the shapes
    """

    def __init__(self, beams: Beams, factors: Sequence[Factor], angular: NDArray[np.bool_], q: Array) -> None:
        self.beams, self.factors, self.angular = beams, factors, angular
        q = q[np.newaxis]
        first = self._first(q)
        self._from_first = [
            numeric.compose(SE3, numeric.inverse(SE3, pose), _pose(q, factors))
            for pose, (_, _, factors) in zip(first, beams.followers, strict=True)
        ]
        following = [factor for _, _, factors in beams.followers for factor in factors]
        self.free: NDArray[np.bool_] = np.ones(len(angular), dtype=bool)
        self._positions: NDArray[np.bool_] = np.zeros(q.shape[1], dtype=bool)  # of nodes, after their quaternions
        for factor in following:
            self.free[factor.v] = False
            turned = 0 if factor.group == "R" else 4
            self._positions[factor.q_start + turned : factor.q_start + factor.q_size] = True

    def of(self, beams: Beams) -> RigidBeams:
        """Return rigid beams of these shapes at other parameters."""
        result = copy(self)
        result.beams = beams
        return result

    def _first(self, q: Array) -> list[Array]:
        """Return for each follower node the pose of its beam's first node, (n, 7), in the axes of the node's
        coordinates. The configurations ``q`` have the shape (n, nq)."""
        poses, followers = self.beams.many_poses(q), self.beams.followers
        if not self.beams.absolute and followers:
            # Pose of the base by any node: the pose in the coordinates' axes compared with the pose in the world.
            _, node, factors = followers[0]
            to_base = numeric.compose(SE3, _pose(q, factors), numeric.inverse(SE3, poses[:, node]))
            return [numeric.compose(SE3, to_base, poses[:, first]) for first, _, _ in followers]
        return [poses[:, first] for first, _, _ in followers]

    def place(self, q: Array) -> Array:
        """Return configurations (..., nq) with the nodes of each beam placed rigidly relative to its first node."""
        result = np.array(q, dtype=float).reshape(-1, q.shape[-1])
        for _ in range(100):  # a beam may be carried by another one
            before = result.copy()
            for pose, relative, (_, _, factors) in zip(
                self._first(result), self._from_first, self.beams.followers, strict=True
            ):
                places = np.concatenate([np.r_[factor.q] for factor in factors])
                result[:, places] = numeric.compose(SE3, pose, relative)
            lengths = np.where(self._positions, np.abs(result).max(axis=0, initial=0.0), 0.0).max()
            if np.all(np.abs(result - before) <= 1e-14 * np.where(self._positions, lengths, 1.0)):
                break
        return result.reshape(q.shape)

    def velocities(self, q: Array, along: Array) -> Array:
        """Return velocities (n, nv) with beams moving rigidly, given the velocities of the free coordinates, by
        differences.

        Parameters
        ----------
        q : (nq,) with the nodes in place
        along : (n, nv); components of follower nodes are ignored
        """
        along = np.where(self.free, along, 0.0)
        if not along.any():  # at rest, or all coordinates belong to follower nodes
            return along
        steps = self.beams.steps(self.angular)
        sizes = np.max(np.abs(along) / steps, axis=1, keepdims=True)
        scale = np.where(sizes > 0.0, sizes, 1.0)
        less, more = (
            self.place(update(self.factors, np.broadcast_to(q, (len(along), len(q))), sign * along / scale))
            for sign in (-1.0, 1.0)
        )
        result = 0.5 * scale * difference(self.factors, less, more)
        return np.where(self.free, along, result)

    def move(self, q: Array, step: Array) -> Array:
        """Return q after a step (free,) of the free coordinates, with follower nodes placed rigidly."""
        whole = np.zeros(len(self.angular))
        whole[self.free] = step
        return self.place(update(self.factors, q, whole))

    def reduce(self, system: ConstrainedSystem) -> ConstrainedSystem:
        """Return the constrained system whose unknowns are the free coordinates, without the rows of constrained
        strains. Nodes after the first follow in all of its functions."""
        last: list[tuple[bytes, Array]] = []

        def basis(q: Array) -> Array:
            if not last or last[0][0] != q.tobytes():
                last[:] = [(q.tobytes(), self.velocities(q, np.eye(len(self.angular))[self.free]).T)]
            return last[0][1]

        def mass(q: Array) -> Array:
            T = basis(q)
            return np.asarray(T.T @ system.mass(q) @ T)

        return replace(
            system.without(np.flatnonzero(self.beams.holds(system.names)).tolist()),
            angular=self.angular[self.free],
            jacobian=lambda q, t: system.jacobian(q, t)[~self.beams.holds(system.names)] @ basis(q),
            mass=mass,
            move=self.move,
            beams=None,
        )


def _pose(q: Array, factors: Sequence[Factor]) -> Array:
    """Return the pose, (n, 7), that the factors of a node hold."""
    return np.concatenate([q[:, factor.q] for factor in factors], axis=1)
