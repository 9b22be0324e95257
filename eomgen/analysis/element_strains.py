"""Strains of the elements of geometrically exact beams, for Newton steps that extrapolate section forces.

In a step of Newton's method strains change to second order beside their linear change, and a stiff section makes large
forces of that, which spoil the next tangent. With the section forces of the linear change in the geometric part of the
tangent instead, slender beams take as many steps as others: D. Magisano, L. Leonetti and G. Garcea, Comput. Methods
Appl. Mech. Engrg. 313 (2017) 986.

An element between frames A and B has d = log(H_A^-1 H_B), d' = T^-1(d) v_B - T^-1(-d) v_A, and its nodes take D^T s by
the section forces s, D being the derivative of d along both twists.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_array, csr_array

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import update
from eomgen.solvers.bordered_newton import WHOLE, Matrix
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Step of derivatives by complex arguments.
_STEP = 1e-30
#: Step of differences of poses, rad or m.
_SMALL = 1e-6
#: Turn of an element that is too near to half a turn, rad.
_HALF_TURN = 3.1


class ElementStrains:
    """All elements of a model's geometrically exact beams, at one set of parameters.

    Attributes
    ----------
    stiffness : (elements, 6, 6) section forces by change of d: stiffness by length
    """

    def __init__(self, model: CompiledModel, p: Array, given: dict[str, Any]) -> None:
        """Read the beams; ``given`` are t, parameters and base, as of ``model.evaluate``."""
        self._model, self._given = model, given
        beams = model.description.element_stiffness
        values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
        number = {name: index for index, name in enumerate(model.bodies)}
        pairs = [pair for beam in beams for pair in pairwise(beam.nodes)]
        self._first, self._second = (np.array([number[pair[end]] for pair in pairs], int) for end in (0, 1))
        self.stiffness = np.concatenate([np.zeros((0, 6, 6)), *(beam.matrices(values) for beam in beams)])
        self._own = {factor.name: factor.v_start for factor in model.factors if factor.group == "SE3"}
        self._nodes = sorted({*self._first.tolist(), *self._second.tolist()})
        self._held = _fixed_to_base(model)
        self._last: tuple[Array, Matrix] | None = None  # q and twists: a correction asks twice
        self._by_d: tuple[Array, Array, Array] | None = None  # d and derivatives along twists

    def __len__(self) -> int:
        return len(self.stiffness)

    def values(self, q: Array) -> Array:
        """Return d of all elements, (elements, 6), rotations first, rad and m."""
        pose = self._model.evaluate("poses", q, **self._given)["pose"]
        relative = numeric.compose(SE3, numeric.inverse(SE3, pose[self._first]), pose[self._second])
        relative[relative[:, 0] < 0.0, :4] *= -1.0
        return numeric.log(SE3, relative)

    def derivative(self, q: Array, d: Array) -> Matrix:
        """Return the derivative of all d by q (left-trivialised), (6 elements, nv)."""
        return self._times_twists(self._along(d)[0], q)

    def doubt(self, d: Array) -> str:
        """Return the element that turns by nearly half a turn, beyond which strains are ambiguous; empty if none
        does."""
        turns = np.linalg.norm(d[:, :3], axis=1)
        if not np.any(turns > _HALF_TURN):
            return ""
        worst = int(np.argmax(turns))
        first, second = (self._model.bodies[nodes[worst]] for nodes in (self._first, self._second))
        return f"the element between {first} and {second} turns by half a turn; more elements turn less each"

    def geometric(self, q: Array, d: Array, derivative: Matrix, forces: Array) -> Matrix:
        """Return the part of section forces (elements, 6) in the tangent, (nv, nv).

        ``derivative`` is the derivative of d by q; bodies that carry nodes without own unknowns are taken as fixed.
        """
        changes = np.einsum("keij,ei->ekj", self._along(d)[1], forces)
        turned = self._times_twists(changes, q)
        if isinstance(turned, np.ndarray):
            return np.asarray(turned.T @ derivative)
        return csc_array(turned.T @ derivative)

    def _along(self, d: Array) -> tuple[Array, Array]:
        """Return the derivatives of d along the twists of both nodes, (elements, 6, 12), and their derivatives by the
        components of d, (6, elements, 6, 12); both by complex arguments, which leave real parts as they are."""
        if self._by_d is None or not np.array_equal(self._by_d[0], d):
            moved = _along_twists(d.astype(complex) + 1j * _STEP * np.eye(6)[:, np.newaxis])
            self._by_d = np.array(d), moved[0].real.copy(), moved.imag / _STEP
        return self._by_d[1:]

    def _times_twists(self, blocks: Array, q: Array) -> Matrix:
        """Return blocks (elements, 6, 12) of the elements' two nodes times the twists of these, (6 elements, nv)."""
        twists = self._twists(q)
        if not isinstance(twists, np.ndarray):
            return csc_array(self._of_nodes(blocks) @ twists)
        of_nodes = twists.reshape(len(self._nodes), 6, -1)
        ends = [of_nodes[np.searchsorted(self._nodes, nodes)] for nodes in (self._first, self._second)]
        return np.asarray(blocks @ np.concatenate(ends, axis=1)).reshape(6 * len(self), -1)

    def _of_nodes(self, blocks: Array) -> csr_array:
        """Return blocks (elements, 6, 12) of the elements' two nodes as (6 elements, 6 nodes)."""
        rows = 6 * np.arange(len(self))[:, np.newaxis, np.newaxis] + np.arange(6)[:, np.newaxis]
        first, second = (6 * np.searchsorted(self._nodes, nodes) for nodes in (self._first, self._second))
        columns = np.concatenate([first[:, np.newaxis] + np.arange(6), second[:, np.newaxis] + np.arange(6)], axis=1)
        rows, columns = np.broadcast_arrays(rows, columns[:, np.newaxis, :])
        shape = (6 * len(self), 6 * len(self._nodes))
        return csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=shape)

    def _twists(self, q: Array) -> Matrix:
        """Return the body twists of all nodes by v, (6 nodes, nv): their own six components, or the joints'."""
        if self._last is None or not np.array_equal(self._last[0], q):
            self._last = np.array(q), self._twists_at(q)
        return self._last[1]

    def _twists_at(self, q: Array) -> Matrix:
        rows, columns = [np.zeros(0, int)], [np.zeros(0, int)]
        entries = [np.zeros(0)]
        carried = []
        for place, node in enumerate(self._nodes):
            start = self._own.get(self._model.bodies[node])
            if start is None:
                if self._model.bodies[node] not in self._held:
                    carried.append((place, node))
                continue
            rows.append(6 * place + np.arange(6))
            columns.append(start + np.arange(6))
            entries.append(np.ones(6))
        if carried and self._model.nv:
            twists = self._twists_of([node for _, node in carried], q)
            for number, (place, _) in enumerate(carried):
                column, row = np.nonzero(twists[:, number])
                rows.append(6 * place + row)
                columns.append(column)
                entries.append(twists[column, number, row])
        places, shape = (np.concatenate(rows), np.concatenate(columns)), (6 * len(self._nodes), self._model.nv)
        if self._model.nv > WHOLE:
            return csc_array((np.concatenate(entries), places), shape=shape)
        whole = np.zeros(shape)
        whole[places] = np.concatenate(entries)
        return whole

    def _twists_of(self, nodes: list[int], q: Array) -> Array:
        """Return the body twists of nodes for each component of v, (nv, nodes, 6); without the term ``twists`` by
        differences of poses."""
        nv, along = self._model.nv, np.eye(self._model.nv)
        if "twists" in self._model.functions:
            moving = self._model.evaluate("twists", q, along, **self._given)["twist"]
            still = self._model.evaluate("twists", q, np.zeros(nv), **self._given)["twist"]
            return np.asarray(moving[:, nodes] - still[nodes])
        ends = [update(self._model.factors, np.tile(q, (nv, 1)), sign * _SMALL * along) for sign in (-1.0, 1.0)]
        less, more = (self._model.evaluate("poses", end, **self._given)["pose"][:, nodes] for end in ends)
        between = numeric.compose(SE3, numeric.inverse(SE3, less), more)
        return numeric.log(SE3, between) / (2.0 * _SMALL)


def _along_twists(d: Array) -> Array:
    """Return the derivatives of d along the twists of both nodes, (..., elements, 6, 12).

    T^-1(-d) is T^-1(d) minus the bracket with d: of its series in brackets the first one alone is odd.
    """
    after = numeric.tangent_inverse(SE3, d)
    return np.concatenate([numeric.bracket_matrix(SE3, d) - after, after], axis=-1)


def _fixed_to_base(model: CompiledModel) -> set[str]:
    """Return the base and the bodies that fixed joints hold on it."""
    held = {BASE}
    for hinge in model.description.drawing.hinges:  # parents before their children
        if hinge.type == "fixed" and hinge.parent in held:
            held.add(hinge.child)
    return held
