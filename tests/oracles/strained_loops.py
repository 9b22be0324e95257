"""Equilibria of loops of elastic bars, by the strains of their elements and the angles of their hinges.

Bars are chains of elements of constant strain, hinges turn about axes of the frame before them; the potential is a sum
of squares of strains, and what closes the loop is that the product of all these motions is the one of the base.
Newton's iterations take derivatives from central differences of each motion: no code and no formula is that of eomgen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.oracles.evaluation import Array

_STEP = 1e-3


@dataclass(frozen=True)
class Bar:
    """A bar along x of so many elements; stiffness by GJ, EI about y and z, EA, GA along y and z. SI units."""

    length: float
    elements: int
    stiffness: Sequence[float]


@dataclass(frozen=True)
class Hinge:
    """A hinge about an axis of the frame before it, after a rotation by a vector that does not change."""

    axis: Sequence[float]
    before: Sequence[float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shift:
    """A rigid motion by a rotation vector, then a translation in the turned axes."""

    rotation: Sequence[float]
    translation: Sequence[float]


def motion(twist: Array) -> Array:
    """Return exp of twists (..., 6), rotation first, as matrices (..., 4, 4): the series of sine and cosine."""
    turn, along = twist[..., :3], twist[..., 3:]
    angle = np.linalg.norm(turn, axis=-1)[..., None, None]
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0 - angle**2 / 6.0 + angle**4 / 120.0, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24.0 + angle**4 / 720.0, (1.0 - np.cos(safe)) / safe**2)
    c = np.where(small, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    W = np.zeros((*turn.shape[:-1], 3, 3))
    W[..., 0, 1], W[..., 0, 2], W[..., 1, 2] = -turn[..., 2], turn[..., 1], -turn[..., 0]
    W -= np.swapaxes(W, -1, -2)
    found = np.zeros((*turn.shape[:-1], 4, 4))
    found[..., :3, :3] = np.eye(3) + a * W + b * W @ W
    found[..., :3, 3] = ((np.eye(3) + b * W + c * W @ W) @ along[..., None])[..., 0]
    found[..., 3, 3] = 1.0
    return found


class Loop:
    """A closed loop of bars, hinges and shifts, the first hinge of which is driven.

    Attributes
    ----------
    strains : of all elements, (6 n,)
    angles : of the hinges, rad
    multipliers : of the gap, translations first
    """

    def __init__(self, members: Sequence[Bar | Hinge | Shift]) -> None:
        self.members = members
        self.weights = np.concatenate(
            [np.tile(np.array(m.stiffness) * m.length / m.elements, m.elements) for m in members if isinstance(m, Bar)]
        )
        self.hinges = sum(isinstance(member, Hinge) for member in members)
        self.strains = np.zeros(self.weights.size)
        self.angles = np.zeros(self.hinges)
        self.multipliers = np.zeros(6)

    def turn(self, angle: float) -> float:
        """Turn the first hinge to an angle, find the rest nearest to the last one, and return the torque that holds
        it, N m."""
        unknowns = np.concatenate([self.strains, [angle], self.angles[1:]])
        free = np.delete(np.arange(unknowns.size), self.weights.size)
        weights = np.concatenate([self.weights, np.zeros(self.hinges)])
        for _ in range(40):
            gap, J, bend = self._derivatives(unknowns)
            C = J[:, free]
            H = (np.diag(weights) + bend)[np.ix_(free, free)]
            system = np.block([[H, C.T], [C, np.zeros((6, 6))]])
            rest = np.concatenate([(weights * unknowns)[free] + C.T @ self.multipliers, gap])
            change = np.linalg.solve(system, -rest)
            unknowns[free] += change[: free.size]
            self.multipliers = self.multipliers + change[free.size :]
            if np.abs(change[: free.size]).max() < 1e-9:
                break
        else:
            raise RuntimeError("no rest is found")
        self.strains, self.angles = unknowns[: self.weights.size], unknowns[self.weights.size :]
        torque: float = J[:, self.weights.size] @ self.multipliers
        return torque

    def _derivatives(self, unknowns: Array) -> tuple[Array, Array, Array]:
        """Return the gap, its derivatives (6, n), and second derivatives (n, n) of its product with the multipliers.

        With each motion's derivative carried to the base, A_i, those of the product of all are A_i pose and, for i
        before j, A_i A_j pose.
        """
        pose = np.eye(4)
        carried = np.zeros((unknowns.size, 4, 4))
        second = np.zeros((unknowns.size, unknowns.size, 4, 4))
        order: list[int] = []
        strain, hinge = 0, self.weights.size
        for member in self.members:
            for _ in range(member.elements if isinstance(member, Bar) else 1):
                if isinstance(member, Bar):
                    places = list(range(strain, strain + 6))
                    strain += 6
                else:
                    places = [hinge] if isinstance(member, Hinge) else []
                    hinge += len(places)
                M, D, DD = _expanded(member, unknowns[places])
                after = np.linalg.inv(pose @ M)
                if places:
                    carried[places] = pose @ D @ after
                    second[np.ix_(places, places)] = pose @ DD @ after
                    both = carried[order][:, None] @ carried[places]
                    second[np.ix_(order, places)] = both
                    second[np.ix_(places, order)] = np.swapaxes(both, 0, 1)
                order += places
                pose = pose @ M
        by_pose = _opening(second @ pose)
        return _opening(pose), _opening(carried @ pose).T, by_pose @ self.multipliers


def _member(member: Bar | Hinge | Shift, values: Array) -> Array:
    """Return the motion along a member, an element of it for bars, (..., 4, 4), by strains or angle (..., k)."""
    if isinstance(member, Bar):
        straight = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
        return motion((straight + values) * (member.length / member.elements))
    if isinstance(member, Hinge):
        turn = values * np.array(member.axis) / np.linalg.norm(member.axis)
        return _turned(member.before) @ motion(np.concatenate([turn, np.zeros_like(turn)], axis=-1))
    return _turned(member.rotation) @ motion(np.array([0.0, 0.0, 0.0, *member.translation]))


def _turned(vector: Sequence[float]) -> Array:
    return motion(np.array([*vector, 0.0, 0.0, 0.0]))


def _expanded(member: Bar | Hinge | Shift, values: Array) -> tuple[Array, Array, Array]:
    """Return a member's motion with first and second derivatives, by central differences of the fourth order."""
    M = _member(member, values)
    if isinstance(member, Shift):
        return M, np.zeros((0, 4, 4)), np.zeros((0, 0, 4, 4))
    steps = _STEP * np.eye(values.size)
    weights = {1: 8.0, -1: -8.0, 2: -1.0, -2: 1.0}
    D = sum(w * _member(member, values + k * steps) for k, w in weights.items()) / (12.0 * _STEP)
    pairs = steps[:, None] + steps[None]
    unlike = steps[:, None] - steps[None]
    both = _member(member, values + pairs) + _member(member, values - pairs)
    DD = (both - _member(member, values + unlike) - _member(member, values - unlike)) / (4.0 * _STEP**2)
    return M, np.asarray(D), DD


def _opening(pose: Array) -> Array:
    """Return by how much matrices (..., 4, 4) open a loop, (..., 6): a linear function of theirs."""
    R, x = pose[..., :3, :3], pose[..., :3, 3]
    turned = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    return np.concatenate([x, turned / 2.0], axis=-1)
