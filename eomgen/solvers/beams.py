"""The geometrically exact beams of a constrained system, as assembly takes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.lie.product import Factor


@dataclass(frozen=True)
class Beams:
    """The geometrically exact beams of a constrained system at fixed parameters.

    Attributes
    ----------
    names : of the beams
    nodes : of each beam, by indices among the poses
    own : for each node, the factors that move this node alone; none for a node on another body
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
        """Triples (first node of the beam, node, factors of the node) for each later node with own coordinates."""
        return [
            (nodes[0], node, factors)
            for nodes, factors_of_nodes in zip(self.nodes, self.own, strict=True)
            for node, factors in zip(nodes[1:], factors_of_nodes[1:], strict=True)
            if factors
        ]

    def holds(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """Return a mask (rows,) of the constraint rows that suppress strains of these beams, from the ``names`` of all
        rows."""
        of_strains = tuple(f"{name}: no " for name in self.names)
        return np.array([name.startswith(of_strains) for name in names], dtype=bool)

    def steps(self, angular: NDArray[np.bool_]) -> Array:
        """Return finite-difference steps of the velocity components, (nv,), rad or m."""
        return 1e-6 * np.where(angular, 1.0, self.length)

    def many_poses(self, q: Array) -> Array:
        """Return the poses at any number of configurations (n, nq)."""
        return np.concatenate([self.poses(q[start : start + 512]) for start in range(0, len(q), 512)])


class BeamElements(Protocol):
    """Elements of a beam: see ``system.description.ElementStiffness``."""

    @property
    def nodes(self) -> tuple[str, ...]: ...

    @property
    def lengths(self) -> tuple[float, ...]: ...

    def matrices(self, values: Mapping[str, float]) -> Array: ...


def beams_of(
    beams: Sequence[BeamElements],
    values: Mapping[str, float],
    bodies: Sequence[str],
    factors: Sequence[Factor],
    poses: Callable[[Array], Array],
    *,
    absolute: bool,
) -> Beams:
    """Return the geometrically exact beams of a system at parameter values, for assembly.

    Parameters
    ----------
    beams : sequence of BeamElements
        Nodes and section matrices of each beam.
    values : mapping
        Parameters by name, SI units.
    bodies : sequence of str
        Names in the order of the poses.
    factors : sequence of Factor
        Factors of the configuration.
    poses : callable
        Poses (n, bodies, 7) of configurations q (n, nq).
    absolute : bool
        Whether the coordinates of nodes are poses in the world, not relative to the base.
    """
    number = {name: index for index, name in enumerate(bodies)}
    known = {factor.name: factor for factor in factors}

    def own(node: str) -> Sequence[Factor]:
        names = (node,) if node in known else (f"{node}.orientation", f"{node}.position")
        result = [known[name] for name in names if name in known]
        return result if sum(factor.v_size for factor in result) == 6 else ()

    return Beams(
        names=[beam.nodes[0] for beam in beams],
        nodes=[[number[node] for node in beam.nodes] for beam in beams],
        own=[[own(node) for node in beam.nodes] for beam in beams],
        poses=poses,
        absolute=absolute,
        stiffness=np.concatenate([beam.matrices(values) for beam in beams]),
        length=max(sum(beam.lengths) for beam in beams),
    )


@dataclass(frozen=True)
class StrainedStart:
    """Strain of the beams of a loop that closes only with strained beams.

    Attributes
    ----------
    energy : J, by the change of strains from the guess
    force : N, largest section force that the change makes
    beam, element : location of the force; elements count from 1
    """

    energy: float
    force: float
    beam: str
    element: int

    def __str__(self) -> str:
        force = f"largest section force {self.force:.3g} N in element {self.element} of the beam {self.beam}"
        return f"the loop closes only with strained beams: strain energy {self.energy:.3g} J, {force}"
