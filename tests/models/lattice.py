"""A front end of another distribution: a chain of equal cells between two walls, given by its Hamiltonian."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from eomgen.formula.nodes import Number
from eomgen.lie.product import Factor
from eomgen.pipeline.front_end import FrontEnd
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, ZERO, Tape
from eomgen.system.description import Coordinates, Description, Drawing, Solid
from eomgen.system.system import Block, Facts, Function, System
from eomgen.system.terms import TERMS

Potential = Callable[[Algebra, Scalar], Scalar]
#: V(s) of the stretch s between neighbours.
POTENTIALS: dict[str, Potential] = {
    "fput": lambda _, s: 0.5 * s * s + 0.25 / 3.0 * s * s * s,
    "pendulums": lambda algebra, s: 1.0 - algebra.call(Op.COS, s),
}


@dataclass(frozen=True)
class Lattice:
    """H = sum p^2 / 2 + V(q[k + 1] - q[k]), both ends held, from rest at ``displacements``."""

    name: str
    potential: str
    displacements: tuple[float, ...]

    @property
    def content(self) -> bytes:
        return repr(self).encode()


def describe(lattice: Lattice) -> Description:
    cells = [f"cell{k}" for k in range(len(lattice.displacements))]
    solids = tuple(Solid(cell, Number(1.0), inertia=(Number(0.01),) * 3 + (Number(0.0),) * 3) for cell in cells)
    return Description(
        lattice.name, coordinates=tuple(Coordinates(cell, ("m",)) for cell in cells), drawing=Drawing(solids)
    )


def derive(lattice: Lattice, terms: Sequence[str] | None) -> System:
    tape, n = Tape(), len(lattice.displacements)
    algebra, cells = Algebra(tape), range(n)
    q, v, a = (algebra.block(block, n) for block in "qva")
    places = (algebra.zero, *q, algebra.zero)
    steps = [after - before for before, after in pairwise(places)]
    potential = sum((POTENTIALS[lattice.potential](algebra, s) for s in steps), algebra.zero)
    kinetic = sum((0.5 * x * x for x in v), algebra.zero)
    refs = [x.ref for x in q]
    force = [-ref for ref in gradient(tape, potential.ref, refs)]
    residual = [tape.sub(x.ref, ref) for x, ref in zip(a, force, strict=True)]
    unit = tuple(ONE if row == column else ZERO for row in cells for column in cells)
    stiffness = tuple(ref for row in residual for ref in gradient(tape, row, refs))
    poses = tuple(ref for k, x in enumerate(q) for ref in (ONE, *[ZERO] * 3, (x + float(k)).ref, ZERO, ZERO))
    outputs = {
        "mass": [Block("M", (n, n), unit)],
        "residual": [Block("r", (n,), tuple(residual))],
        "partials": [Block("K", (n, n), stiffness), Block("C", (n, n), (ZERO,) * n * n), Block("M", (n, n), unit)],
        "forward_dynamics": [Block("vdot", (n,), tuple(force))],
        "poses": [Block("pose", (n, 7), poses)],
        "energy": [Block("energy", (4,), (kinetic.ref, potential.ref, ZERO, ZERO))],
    }
    functions = {
        name: Function(
            name, TERMS[name].description, tuple(x for x in TERMS[name].inputs if x in ("q", "v", "a")), tuple(blocks)
        )
        for name, blocks in outputs.items()
        if terms is None or name in terms
    }
    names = tuple(f"cell{k}" for k in cells)
    return System(
        lattice.name,
        tape,
        tuple(Factor("R", name, k, 1, k, 1) for k, name in enumerate(names)),
        functions,
        (),
        (),
        (),
        names,
        lattice.displacements,
        (0.0,) * n,
        tuple(range(-1, n - 1)),
        angular=(False,) * n,
        facts=Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False, conservative=True),
    )


LATTICES = FrontEnd("lattices", Lattice, describe, derive)
