"""Internal states z: rates f(q, v, z, t, u), and partials of rates and applied forces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.directions import block_directions, motion_directions
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ZERO, Ref
from eomgen.system.system import Block


def state_formulas(scene: Scene) -> Iterator[Formula]:
    """Yield the formulas in rates of internal states, controller outputs and force elements, without constraints,
    events and outputs."""
    yield from (state.rate for state in scene.states)
    yield from (controller.output for controller in scene.controllers)
    yield from (formula for element in scene.elements for formula, _ in element.formulas())


@dataclass
class InternalStates:
    """Internal states of a scene: rates and partials on the tape. All results are empty without states."""

    scene: Scene
    tree: Tree
    quantities: Quantities

    @property
    def count(self) -> int:
        return len(self.scene.states)

    @cached_property
    def rates(self) -> list[Scalar]:
        """The rates zdot = f(q, v, z, t, u), (nz,), recorded at the first use."""
        result = []
        for item in self.scene.states:
            with self.tree.algebra.tape.block(f"rate of state {item.name}"):
                result.append(self.quantities.formula(item.rate))
        return result

    def partials(self, applied: Sequence[Scalar]) -> list[Block]:
        """Return the blocks of the partials ``Rz``, ``Fq``, ``Fv`` and ``Fz``.

        Rz are the partials of the residual in z, the others of zdot in q (left-trivialised), v and z.

        Parameters
        ----------
        applied : (nv,)
            Applied generalized forces: all of the residual that may depend on z.
        """
        tape, nv, nz = self.tree.algebra.tape, self.tree.nv, self.count
        with tape.block("partials of applied forces in the internal states"):
            forces = forward_partials(tape, [value.ref for value in applied], block_directions("z", nz))
        seeds = motion_directions(self.tree, "v") | block_directions("z", nz, 2 * nv)
        with tape.block("partials of the rates of internal states"):
            rates = forward_partials(tape, [value.ref for value in self.rates], seeds)

        def block(first: int, columns: int) -> tuple[Ref, ...]:
            return tuple(tangent.get(first + k, ZERO) for tangent in rates for k in range(columns))

        by_state = tuple(-tangent[k] if k in tangent else ZERO for tangent in forces for k in range(nz))
        return [
            Block("Rz", (nv, nz), by_state, "d residual / dz"),
            Block("Fq", (nz, nv), block(0, nv), "d zdot / dq, left-trivialised"),
            Block("Fv", (nz, nv), block(nv, nv), "d zdot / dv"),
            Block("Fz", (nz, nz), block(2 * nv, nz), "d zdot / dz"),
        ]
