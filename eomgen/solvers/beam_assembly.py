"""Loops with geometrically exact beams: joints and rigid motions of the beams close a loop before anything strains.

The nodes of a beam have coordinates of their own, and their masses are small, so corrections of least kinetic size put
a whole gap into one element. Here nodes first follow the first one of their beam as a rigid body does, and the unknowns
are the other coordinates alone. A loop that does not close so is closed with the least strain energy, by steps of
Gauss and Newton in the metric of the elements' stiffness (equality-constrained least squares: J. Nocedal and S. Wright,
Numerical Optimization, 2006, section 18.3), as a sparse system.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from eomgen.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor, difference, update
from eomgen.solvers.consistency import STRAINED
from eomgen.solvers.constraint_rows import Constrained

#: Step of differences, rad, and as a part of the longest beam.
_STEP = 1e-6
#: Step of derivatives by complex arguments.
_TINY = 1e-30
#: Weight of the kinetic metric beside the stiffest strain: it decides about what strains nothing.
_KINETIC = 1e-12
#: What multipliers of redundant rows are held by, in the scale of the system's diagonal.
_HELD = 1e-12
#: Configurations whose poses are evaluated together.
_TOGETHER = 512
#: Passes that place nodes of beams carried by beams.
_PASSES = 100


@dataclass(frozen=True)
class Beams:
    """The geometrically exact beams of a constrained system at fixed parameters.

    Attributes
    ----------
    names : of the beams
    nodes : of each beam, by their numbers among the poses
    own : for each node, the factors that move it alone; none of a node that another body carries
    poses(q (n, nq)) -> (n, bodies, 7)
    absolute : whether coordinates of nodes are poses in the world, not against the base
    stiffness : (elements, 6, 6) of the elements of all beams, section forces by the change of the logarithm of the
        relative pose: N m/rad, N/m
    length : m, of the longest beam
    """

    names: Sequence[str]
    nodes: Sequence[Sequence[int]]
    own: Sequence[Sequence[Sequence[Factor]]]
    poses: Callable[[Array], Array]
    absolute: bool
    stiffness: Array
    length: float

    @cached_property
    def followers(self) -> list[tuple[int, int, Sequence[Factor]]]:
        """The first node of the beam, the node and its factors, of each node that can follow the first one."""
        return [
            (nodes[0], node, factors)
            for nodes, own in zip(self.nodes, self.own, strict=True)
            for node, factors in zip(nodes[1:], own[1:], strict=True)
            if factors
        ]

    def holds(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """Return which rows are strains that a beam does not have, by the rows' names."""
        of_strains = tuple(f"{name}: no " for name in self.names)
        return np.array([name.startswith(of_strains) for name in names], dtype=bool)

    def steps(self, angular: NDArray[np.bool_]) -> Array:
        """Return steps of differences by velocity component, (nv,), rad or m."""
        return np.where(angular, _STEP, _STEP * self.length)

    def many_poses(self, q: Array) -> Array:
        """Return the poses at any number of configurations (n, nq)."""
        starts = range(0, len(q), _TOGETHER)
        return np.concatenate([self.poses(q[start : start + _TOGETHER]) for start in starts])


class Elements(Protocol):
    """Elements of a beam: see ``system.description.ElementStiffness``."""

    @property
    def nodes(self) -> tuple[str, ...]: ...

    @property
    def lengths(self) -> tuple[float, ...]: ...

    def matrices(self, values: Mapping[str, float]) -> Array: ...


def beams_of(
    beams: Sequence[Elements],
    values: Mapping[str, float],
    bodies: Sequence[str],
    factors: Sequence[Factor],
    poses: Callable[[Array], Array],
    *,
    absolute: bool,
) -> Beams:
    """Return the beams of a system at values of its parameters; ``bodies``: by their numbers among the poses."""
    number = {name: index for index, name in enumerate(bodies)}
    known = {factor.name: factor for factor in factors}

    def own(node: str) -> Sequence[Factor]:
        names = (node,) if node in known else (f"{node}.orientation", f"{node}.position")
        found = [known[name] for name in names if name in known]
        return found if sum(factor.v_size for factor in found) == 6 else ()

    return Beams(
        names=[beam.nodes[0] for beam in beams],
        nodes=[[number[node] for node in beam.nodes] for beam in beams],
        own=[[own(node) for node in beam.nodes] for beam in beams],
        poses=poses,
        absolute=absolute,
        stiffness=np.concatenate([beam.matrices(values) for beam in beams]),
        length=max(sum(beam.lengths) for beam in beams),
    )


class RigidBeams:
    """Configurations in which the beams have the shapes of a given one.

    Parameters
    ----------
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
        following = [factor for _, _, own in beams.followers for factor in own]
        self.free: NDArray[np.bool_] = np.ones(len(angular), dtype=bool)
        for factor in following:
            self.free[factor.v] = False

    def of(self, beams: Beams) -> RigidBeams:
        """Return the same shapes at other parameters."""
        other = copy(self)
        other.beams = beams
        return other

    def _first(self, q: Array) -> list[Array]:
        """Return for each follower the pose of its beam's first node, (n, 7), in the axes of its own coordinates."""
        poses, followers = self.beams.many_poses(q), self.beams.followers
        if not self.beams.absolute and followers:
            # the world's poses by those against the base, of any node
            _, node, factors = followers[0]
            to_base = numeric.compose(SE3, _pose(q, factors), numeric.inverse(SE3, poses[:, node]))
            return [numeric.compose(SE3, to_base, poses[:, first]) for first, _, _ in followers]
        return [poses[:, first] for first, _, _ in followers]

    def placed(self, q: Array) -> Array:
        """Return configurations (..., nq) with the nodes put where the first one of their beam has them."""
        found = np.array(q, dtype=float).reshape(-1, q.shape[-1])
        for _ in range(_PASSES):  # a beam may be carried by another one
            before = found.copy()
            for pose, relative, (_, _, factors) in zip(
                self._first(found), self._from_first, self.beams.followers, strict=True
            ):
                _put_pose(found, factors, numeric.compose(SE3, pose, relative))
            if np.max(np.abs(found - before), initial=0.0) <= 1e-14 * max(1.0, np.max(np.abs(found), initial=0.0)):
                break
        return found.reshape(q.shape)

    def velocities(self, q: Array, along: Array) -> Array:
        """Return velocities (n, nv) of beams that keep their shapes, by those of the other coordinates.

        Parameters
        ----------
        q : (nq,) with the nodes in place
        along : (n, nv), of which components of following nodes are not read
        """
        if not len(along):  # nothing but nodes can move
            return along
        steps = self.beams.steps(self.angular)
        along = np.where(self.free, along, 0.0)
        sizes = np.max(np.abs(along) / steps, axis=1, keepdims=True)
        scale = np.where(sizes > 0.0, sizes, 1.0)
        less, more = (
            self.placed(update(self.factors, np.broadcast_to(q, (len(along), len(q))), sign * along / scale))
            for sign in (-1.0, 1.0)
        )
        found = 0.5 * scale * difference(self.factors, less, more)
        return np.where(self.free, along, found)

    def moved(self, q: Array, step: Array) -> Array:
        """Return q moved by a step (free,) of the other coordinates, the nodes behind."""
        whole = np.zeros(len(self.angular))
        whole[self.free] = step
        return self.placed(update(self.factors, q, whole))

    def reduced(self, system: Constrained) -> Constrained:
        """Return the system with the free coordinates as unknowns, and without the rows of strains."""
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
            move=self.moved,
            beams=None,
        )


@dataclass(frozen=True)
class StrainedStart:
    """How much a loop strains its beams that does not close without.

    Attributes
    ----------
    energy : J, by the change of strains from the guess
    force : N, largest section force that the change makes
    beam, element : where; elements count from 1
    """

    energy: float
    force: float
    beam: str
    element: int

    def __str__(self) -> str:
        return (
            f"{STRAINED}: strain energy {self.energy:.3g} J, largest section force"
            f" {self.force:.3g} N in element {self.element} of the beam {self.beam}"
        )


class Strains:
    """Changes of the strains of all elements from those of a configuration, and steps of least strain energy."""

    def __init__(self, beams: Beams, system: Constrained, q: Array) -> None:
        self.beams, self.system = beams, system
        self._first = np.array([node for nodes in beams.nodes for node in nodes[:-1]], dtype=int)
        self._second = np.array([node for nodes in beams.nodes for node in nodes[1:]], dtype=int)
        self._rest = self._values(q)

    def _values(self, q: Array) -> Array:
        """Return the logarithms of the relative poses, (elements, 6)."""
        poses = self.beams.poses(q[np.newaxis])[0]
        relative = numeric.compose(SE3, numeric.inverse(SE3, poses[self._first]), poses[self._second])
        relative[relative[:, 0] < 0.0, :4] *= -1.0
        return numeric.log(SE3, relative)

    def changes(self, q: Array) -> Array:
        """Return the changes from the guess, (elements, 6), rotations first, rad and m."""
        return self._values(q) - self._rest

    def energy(self, changes: Array) -> float:
        """Return the strain energy of changes, J."""
        return 0.5 * float(np.einsum("ei,eij,ej->", changes, self.beams.stiffness, changes))

    def step(self, q: Array, t: float, violation: Array, *, geometric: bool) -> tuple[Array, Array]:
        """Return the change of q, (nv,), that meets the rows linearly with the least strain energy, and the
        multipliers of the rows at position level.

        Parameters
        ----------
        geometric : whether the stiffness by the present section forces counts, too, as in Newton's method
        """
        d, twists = self._values(q), self._twists(q)
        D = csr_array(_block_diagonal(_along_twists(d)) @ twists)
        forces = np.einsum("eij,ej->ei", self.beams.stiffness, d - self._rest)
        H = csc_array(D.T @ _block_diagonal(self.beams.stiffness) @ D)
        diagonal = np.array(H.diagonal())
        if geometric:
            of_forces = csc_array(twists.T @ (_block_diagonal(_geometric(d, forces)) @ D))
            H = H + csc_array(0.5 * (of_forces + of_forces.T))
        masses = np.diag(self.system.mass(q))
        masses = np.where(masses > 0.0, masses, np.min(masses[masses > 0.0], initial=1.0))
        kinetic = _KINETIC * np.max(diagonal / masses) * masses
        scale = 1.0 / np.sqrt(diagonal + kinetic)
        B = self.system.jacobian(q, t)[: len(violation)] * scale
        lengths = np.linalg.norm(B, axis=1)
        weights = 1.0 / np.where(lengths > 0.0, lengths, 1.0)
        rows = csc_array(B * weights[:, np.newaxis])
        scaled = csc_array(diags_array(scale) @ (H + diags_array(kinetic)) @ diags_array(scale))
        held = csc_array(-_HELD * eye_array(len(violation)))
        whole = csc_array(block_array([[scaled, csc_array(rows.T)], [rows, held]]))
        found = splu(whole).solve(np.concatenate([-scale * (D.T @ forces.ravel()), -weights * violation]))
        return found[: len(scale)] * scale, found[len(scale) :] * weights

    def _twists(self, q: Array) -> csr_array:
        """Return the body twists of both nodes of each element by v, sparse (12 elements, nv), by differences."""
        nv, steps = len(self.system.angular), self.beams.steps(self.system.angular)
        less, more = (
            self.beams.many_poses(update(self.system.factors, np.tile(q, (nv, 1)), sign * np.diag(steps)))
            for sign in (-1.0, 1.0)
        )
        rows, columns, entries = [], [], []
        for start, nodes in ((0, self._first), (6, self._second)):
            column, element = np.nonzero(np.any(less[:, nodes] != more[:, nodes], axis=-1))
            first, second = (poses[column, nodes[element]] for poses in (less, more))
            between = numeric.compose(SE3, numeric.inverse(SE3, first), second)
            between[between[:, 0] < 0.0, :4] *= -1.0
            rows.append((12 * element[:, np.newaxis] + start + np.arange(6)).ravel())
            columns.append(np.repeat(column, 6))
            entries.append((numeric.log(SE3, between) / (2.0 * steps[column])[:, np.newaxis]).ravel())
        places = (np.concatenate(rows), np.concatenate(columns))
        return csr_array((np.concatenate(entries), places), shape=(12 * len(self._first), nv))

    def strained(self, q: Array, multipliers: Array) -> StrainedStart:
        """Return how much the beams are strained; ``multipliers`` of the rows at position level, N of strains."""
        changes = self.changes(q)
        forces = np.einsum("eij,ej->ei", self.beams.stiffness, changes)[:, 3:]
        squares = np.sum(forces**2, axis=1)
        ends = accumulate(len(nodes) - 1 for nodes in self.beams.nodes)
        starts = dict(zip(self.beams.names, [0, *ends], strict=False))
        for name, multiplier in zip(self.system.names, multipliers, strict=False):
            beam, held, rest = name.partition(": no ")
            number = re.search(r"of element (\d+)$", rest)
            if held and number and beam in starts:
                squares[starts[beam] + int(number[1]) - 1] += multiplier**2
        worst = int(np.argmax(squares))
        beam = max((name for name in starts if starts[name] <= worst), key=lambda name: starts[name])
        return StrainedStart(self.energy(changes), float(np.sqrt(squares[worst])), beam, worst - starts[beam] + 1)


def _along_twists(d: Array) -> Array:
    """Return the derivatives of logarithms (elements, 6) along the twists of both nodes, (elements, 6, 12)."""
    first, second = (numeric.tangent_inverse(SE3, sign * d) for sign in (-1.0, 1.0))
    return np.concatenate([-first, second], axis=2)


def _geometric(d: Array, forces: Array) -> Array:
    """Return the derivatives of forces on both nodes by d at held section forces (elements, 6), (elements, 12, 6)."""
    found = []
    for k in range(6):
        moved = d.astype(complex)
        moved[:, k] += 1j * _TINY
        found.append(np.einsum("eij,ei->ej", _along_twists(moved), forces).imag / _TINY)
    return np.stack(found, axis=2)


def _block_diagonal(blocks: Array) -> csr_array:
    """Return blocks (n, rows, columns) as a sparse matrix."""
    count, height, width = blocks.shape
    rows = np.repeat(np.arange(count * height), width)
    columns = np.broadcast_to((width * np.arange(count))[:, None, None] + np.arange(width), blocks.shape).ravel()
    return csr_array((blocks.ravel(), (rows, columns)), shape=(count * height, count * width))


def _pose(q: Array, factors: Sequence[Factor]) -> Array:
    """Return the pose, (n, 7), that the factors of a node hold."""
    return np.concatenate([q[:, factor.q] for factor in factors], axis=1)


def _put_pose(q: Array, factors: Sequence[Factor], pose: Array) -> None:
    start = 0
    for factor in factors:
        q[:, factor.q] = pose[:, start : start + factor.q_size]
        start += factor.q_size
