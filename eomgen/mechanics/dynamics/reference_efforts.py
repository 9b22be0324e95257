"""Inverse dynamics in formulas: ``gravity.elbow``, and ``tau.elbow(servo)`` for a reference motion.

``tau`` is M a + h + b and gravity's part, of the tree as it would move with the reference's coordinates, velocities and
accelerations in place of its own; no force element, stop or constraint is in it, so it never depends on itself.
``gravity`` is tau of the tree at rest in its position.
"""

from __future__ import annotations

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.dynamics.separated import gravity_force, inverse_dynamics
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.build import build_tree
from eomgen.mechanics.tree.grouping import grouped
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.control.model import Reference
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar

_BLOCKS = (("position", "q"), ("velocity", "v"), ("acceleration", "a"))


class ReferenceEfforts:
    """Efforts of inverse dynamics by joint, each reference recorded once.

    Parameters
    ----------
    tree : of the scene, inertias grouped
    base : motion of the base, with gravity in its axes
    quantities : for the formulas of references
    """

    def __init__(self, scene: Scene, tree: Tree, base: BaseMotion, quantities: Quantities) -> None:
        self.scene = scene
        self.tree = tree
        self.base = base
        self.quantities = quantities
        self.references = {item.name: item for item in scene.references}
        self._efforts: dict[str, list[Scalar]] = {}

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return the effort on a component of a joint, N m or N.

        Raises
        ------
        ModelError
            The joint follows another, so it has no equation of its own.
        """
        coordinates = self.tree.coordinates[symbol.name]
        if any(joint.name == symbol.name and joint.mimic is not None for joint in self.scene.joints):
            fault = f"the joint {symbol.name} follows another and has no equation of its own"
            raise ModelError(Problem(f"{symbol.kind}.{symbol.name}", fault, "the joint that it follows"))
        if symbol.reference not in self._efforts:
            self._efforts[symbol.reference] = self._recorded(symbol.reference)
        return self._efforts[symbol.reference][coordinates.dofs[symbol.index]]

    def _recorded(self, reference: str) -> list[Scalar]:
        """Return the efforts for a reference by velocity component; without a name, those against gravity."""
        if not reference:
            return [-force for force in gravity_force(self.tree.without_water(), self.base.gravity)]
        algebra = self.tree.algebra
        given = {("a", dof): algebra.zero for dof in range(self.tree.nv)}
        given |= self._given(self.references[reference])
        moved = grouped(build_tree(algebra, self.scene, given=given)).without_water()
        with algebra.tape.block(f"inverse dynamics of reference {reference}"):
            return inverse_dynamics(moved, self.base, [None] * len(moved.links))

    def _given(self, reference: Reference) -> dict[tuple[str, int], Scalar]:
        result: dict[tuple[str, int], Scalar] = {}
        for part, block in _BLOCKS:
            for joint, formula in getattr(reference, part):
                coordinates = self.tree.coordinates[joint]
                number = (coordinates.components if block == "q" else coordinates.dofs)[0]
                result[block, number] = self.quantities.formula(formula)
        return result
