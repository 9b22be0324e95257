"""Loops that strain their geometrically exact beams: steps of least strain energy on the constraints.

Equality-constrained least squares in the metric of the elements' stiffness, as a sparse system: J. Nocedal and S.
Wright, Numerical Optimization, 2006, section 18.3.
"""

from __future__ import annotations

import re
from itertools import accumulate

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from eomgen.base.arrays import Array
from eomgen.base.rounding import SUMMED
from eomgen.lie import numeric
from eomgen.lie.few_poses import slopes
from eomgen.lie.groups import SE3
from eomgen.lie.product import update
from eomgen.solvers.beams import Beams, StrainedStart
from eomgen.solvers.constraint_rows import ConstrainedSystem


class Strains:
    """Strain changes of all elements relative to a reference configuration, and steps of least strain energy."""

    def __init__(self, beams: Beams, system: ConstrainedSystem, q: Array) -> None:
        self.beams, self.system = beams, system
        self._first = np.array([node for nodes in beams.nodes for node in nodes[:-1]], dtype=int)
        self._second = np.array([node for nodes in beams.nodes for node in nodes[1:]], dtype=int)
        self._rest = self._values(q)

    def _values(self, q: Array) -> Array:
        """Return the logarithms of the relative poses, (elements, 6)."""
        poses = self.beams.poses(q[np.newaxis])[0]
        return numeric.difference(SE3, poses[self._first], poses[self._second])

    def changes(self, q: Array) -> Array:
        """Return the changes from the guess, (elements, 6), rotations first, rad and m."""
        return self._values(q) - self._rest

    def energy(self, changes: Array) -> float:
        """Return the strain energy of changes, J."""
        return 0.5 * float(np.einsum("ei,eij,ej->", changes, self.beams.stiffness, changes))

    def step(self, q: Array, t: float, violation: Array, *, geometric: bool) -> tuple[Array, Array]:
        """Return the change of q, (nv,), that satisfies the rows linearly with the least strain energy, and the
        multipliers of these rows, (rows,), N or N m: the gradient of the energy plus B^T multipliers is 0.

        Parameters
        ----------
        t : s
        violation : (rows,) values of the position-level constraints at q, which come first in the Jacobian; the step
            cancels these values
        geometric : whether the stiffness by the present section forces counts, too, as in Newton's method

        Raises
        ------
        RuntimeError
            The equations are singular.
        """
        d, twists = self._values(q), self._twists(q)
        along, changes = slopes(d)
        D = csr_array(_block_diagonal(along) @ twists)
        forces = np.einsum("eij,ej->ei", self.beams.stiffness, d - self._rest)
        H = csc_array(D.T @ _block_diagonal(self.beams.stiffness) @ D)
        diagonal = np.array(H.diagonal())
        if geometric:
            of_nodes = np.einsum("keij,ei->ejk", changes, forces)  # by d, at constant section forces
            of_forces = csc_array(twists.T @ (_block_diagonal(of_nodes) @ D))
            H = H + csc_array(0.5 * (of_forces + of_forces.T))
        masses = np.diag(self.system.mass(q))
        masses = np.where(masses > 0.0, masses, np.min(masses[masses > 0.0], initial=1.0))
        # a weight below rounding determines motions without strain
        kinetic = SUMMED * np.max(diagonal / masses) * masses
        scale = 1.0 / np.sqrt(diagonal + kinetic)
        B = self.system.jacobian(q, t)[: len(violation)] * scale
        lengths = np.linalg.norm(B, axis=1)
        weights = 1.0 / np.where(lengths > 0.0, lengths, 1.0)
        rows = csc_array(B * weights[:, np.newaxis])
        scaled = csc_array(diags_array(scale) @ (H + diags_array(kinetic)) @ diags_array(scale))
        # likewise the multipliers of redundant rows
        held = csc_array(-SUMMED * eye_array(len(violation)))
        whole = csc_array(block_array([[scaled, csc_array(rows.T)], [rows, held]]))
        result = splu(whole).solve(np.concatenate([-scale * (D.T @ forces.ravel()), -weights * violation]))
        return result[: len(scale)] * scale, result[len(scale) :] * weights

    def _twists(self, q: Array) -> csr_array:
        """Return the partials of the body twists of both nodes of each element in v, sparse (12 elements, nv), by
        differences."""
        nv, steps = len(self.system.angular), self.beams.steps(self.system.angular)
        less, more = (
            self.beams.many_poses(update(self.system.factors, np.tile(q, (nv, 1)), sign * np.diag(steps)))
            for sign in (-1.0, 1.0)
        )
        rows, columns, entries = [], [], []
        for start, nodes in ((0, self._first), (6, self._second)):
            column, element = np.nonzero(np.any(less[:, nodes] != more[:, nodes], axis=-1))
            first, second = (poses[column, nodes[element]] for poses in (less, more))
            rows.append((12 * element[:, np.newaxis] + start + np.arange(6)).ravel())
            columns.append(np.repeat(column, 6))
            entries.append((numeric.difference(SE3, first, second) / (2.0 * steps[column])[:, np.newaxis]).ravel())
        places = (np.concatenate(rows), np.concatenate(columns))
        return csr_array((np.concatenate(entries), places), shape=(12 * len(self._first), nv))

    def at_start(self, q: Array, multipliers: Array) -> StrainedStart:
        """Return the strain energy at q, and the largest section force with the location of its element.
        ``multipliers`` are of the position-level rows, N; of constrained strains they are section forces. May be
        empty."""
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


def _block_diagonal(blocks: Array) -> csr_array:
    """Return the sparse block diagonal matrix, (n rows, n columns), of blocks (n, rows, columns)."""
    count, height, width = blocks.shape
    rows = np.repeat(np.arange(count * height), width)
    columns = np.broadcast_to((width * np.arange(count))[:, None, None] + np.arange(width), blocks.shape).ravel()
    return csr_array((blocks.ravel(), (rows, columns)), shape=(count * height, count * width))
