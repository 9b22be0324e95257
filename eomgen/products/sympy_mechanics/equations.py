"""Equations M(q) vdot + h(q, v, t) = Q(q, v, t, u) on a tape as a document: description, System and front end.

The velocities are the rates of the coordinates. Partials are recorded operation by operation, and accelerations by
Cholesky's elimination without roots, M = L D L^T.
"""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from eomgen.base.data import dataclass, field
from eomgen.formula.nodes import Symbol
from eomgen.lie.product import Factor
from eomgen.pipeline.front_end import FrontEnd
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.description import Coordinates, Description
from eomgen.system.signals import Input, Output, Parameter
from eomgen.system.system import Block, Facts, Function, Quantity, System
from eomgen.system.terms import TERMS

#: Most coordinates for which partials of the residual are recorded without a request.
_SMALL = 40
_NON_SMOOTH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT})


@dataclass(frozen=True)
class SymbolicEquations:
    """Equations of motion recorded from SymPy.

    Attributes
    ----------
    name : str
        Prefix of the C functions.
    coordinates : tuple of str
        Names of q; the rates have the same names.
    parameters, inputs, speeds : tuples of str
        Names of the free symbols, of functions of time besides coordinates, and of the user's speeds, the outputs.
    values : (np,) tuple
        Values of the parameters.
    initial_q, initial_v : (n,) tuples
    tape : Tape
    mass, coupling, force : tuples of references
        M row by row, h and Q.
    outputs : tuple of references
        Of the speeds.
    """

    name: str
    coordinates: tuple[str, ...]
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    speeds: tuple[str, ...]
    values: tuple[float, ...]
    initial_q: tuple[float, ...]
    initial_v: tuple[float, ...]
    tape: Tape = field(repr=False)
    mass: tuple[Ref, ...] = field(repr=False)
    coupling: tuple[Ref, ...] = field(repr=False)
    force: tuple[Ref, ...] = field(repr=False)
    outputs: tuple[Ref, ...] = field(repr=False)

    @cached_property
    def content(self) -> bytes:
        """All data that determine the equations, for the key of the cache."""
        tape = self.tape
        data = (
            *(self.name, self.coordinates, self.parameters, self.inputs, self.speeds, self.values),
            *(self.initial_q, self.initial_v, list(map(int, tape.op)), tape.a, tape.b, tape.constants),
            *(tape.inputs, self.mass, self.coupling, self.force, self.outputs),
        )
        return hashlib.sha256(repr(data).encode()).digest()

    @property
    def front_end(self) -> FrontEnd:
        """The front end of such documents."""
        return EQUATIONS


def describe(document: SymbolicEquations) -> Description:
    """Return names and values besides the equations."""
    return Description(
        document.name,
        parameters=tuple(
            Parameter(name, value, tunable=True)
            for name, value in zip(document.parameters, document.values, strict=True)
        ),
        inputs=tuple(Input(name) for name in document.inputs),
        outputs=tuple(Output(name, (Symbol("output", name),)) for name in document.speeds),
        coordinates=tuple(Coordinates(name, ("",)) for name in document.coordinates),
    )


def derive(document: SymbolicEquations, terms: Sequence[str] | None) -> System:
    """Return the System with the wanted terms, all that a run may need by default."""
    recorder = _Recorder(document)
    made: dict[str, Function] = {}
    usual = [name for name in _TERMS if not TERMS[name].on_request and (name != "partials" or recorder.count <= _SMALL)]
    for name in usual if terms is None else [name for name in _TERMS if name in terms]:
        if name.startswith("output") and not document.speeds:
            continue
        blocks = tuple(_TERMS[name](recorder))
        refs = [ref for block in blocks for ref in block.refs]
        read = {symbol.block for symbol in recorder.tape.depends_on(refs)}
        inputs = tuple(block for block in TERMS[name].inputs if block in read)
        made[name] = Function(name, TERMS[name].description, inputs, blocks)
    return _system(document, recorder, made)


def _system(document: SymbolicEquations, recorder: _Recorder, made: Mapping[str, Function]) -> System:
    tape, count = recorder.tape, recorder.count
    of_mass = {symbol.block for symbol in tape.depends_on(document.mass)}
    of_force = {symbol.block for symbol in tape.depends_on(document.force)}
    every = [*document.mass, *document.coupling, *document.force]
    facts = Facts(
        constant_mass="q" not in of_mass and "t" not in of_mass,
        velocity_forces="v" in of_force,
        smooth=all(tape.op[node] not in _NON_SMOOTH for node in tape.live(every)),
        moving_base=False,
    )
    return System(
        document.name,
        tape,
        tuple(Factor("R", name, k, 1, k, 1) for k, name in enumerate(document.coordinates)),
        made,
        tuple(Quantity(name, value) for name, value in zip(document.parameters, document.values, strict=True)),
        tuple(Quantity(name) for name in document.inputs),
        tuple(Quantity(name) for name in document.speeds),
        (),
        document.initial_q,
        document.initial_v,
        tuple(range(-1, count - 1)),
        angular=(False,) * count,
        facts=facts,
    )


def solved(matrix: Sequence[Scalar], sides: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
    """Return the solutions of a symmetric matrix, row by row, for several right-hand sides, by L D L^T."""
    n = len(sides[0])
    lower: dict[tuple[int, int], Scalar] = {}
    pivots: list[Scalar] = []
    for i in range(n):
        partial: list[Scalar] = []
        for j in range(i):
            entry = matrix[i * n + j]
            for k in range(j):
                entry = entry - partial[k] * lower[j, k]
            partial.append(entry)
            lower[i, j] = entry if entry.is_zero else entry / pivots[j]
        pivot = matrix[i * n + i]
        for k in range(i):
            pivot = pivot - partial[k] * lower[i, k]
        pivots.append(pivot)
    results = []
    for side in sides:
        solution = list(side)
        for i in range(n):
            for k in range(i):
                solution[i] = solution[i] - lower[i, k] * solution[k]
        solution = [value if value.is_zero else value / pivot for value, pivot in zip(solution, pivots, strict=True)]
        for i in reversed(range(n)):
            for k in range(i + 1, n):
                solution[i] = solution[i] - lower[k, i] * solution[k]
        results.append(solution)
    return results


class _Recorder:
    """Terms of a document, on a copy of the tape."""

    def __init__(self, document: SymbolicEquations) -> None:
        self.document, self.count = document, len(document.coordinates)
        self.tape = copy.deepcopy(document.tape)
        self.algebra = Algebra(self.tape)
        self.q, self.v, self.a = (self.algebra.block(block, self.count) for block in "qva")
        self.mass, self.coupling, self.force = (
            [Scalar(self.tape, ref) for ref in refs] for refs in (document.mass, document.coupling, document.force)
        )

    @cached_property
    def inverse_dynamics(self) -> list[Scalar]:
        """M a + h - Q."""
        result = []
        for row in range(self.count):
            total = self.coupling[row] - self.force[row]
            for column, a in enumerate(self.a):
                total = total + self.mass[row * self.count + column] * a
            result.append(total)
        return result

    def block(self, name: str, shape: tuple[int, ...], values: Sequence[Scalar], text: str = "") -> list[Block]:
        return [Block(name, shape, tuple(value.ref for value in values), text)]

    def forward_dynamics(self) -> list[Block]:
        """M^-1 (Q - h)."""
        balance = [force - bias for force, bias in zip(self.force, self.coupling, strict=True)]
        (solution,) = solved(self.mass, [balance])
        return self.block("vdot", (self.count,), solution)

    def in_block(self, name: str, values: Sequence[Ref], block: Sequence[Scalar], text: str) -> Block:
        """Return partials in the numbers of a block, row by row."""
        rows = forward_partials(self.tape, values, {item.ref: {place: ONE} for place, item in enumerate(block)})
        refs = tuple(row.get(place, ZERO) for row in rows for place in range(len(block)))
        return Block(name, (len(values), len(block)), refs, text)

    def partials(self, ending: str = "") -> list[Block]:
        """Partials of the residual in q, v and a; ``ending``: of the names of the matrices."""
        residual = [item.ref for item in self.inverse_dynamics]
        return [
            self.in_block(f"K{ending}", residual, self.q, "in q"),
            self.in_block(f"C{ending}", residual, self.v, "in v"),
            Block(f"M{ending}", (self.count, self.count), self.document.mass, "in a"),
        ]

    def linearization(self) -> list[Block]:
        """Partials of the residual, and of the forces in inputs."""
        forces = [(force - bias).ref for force, bias in zip(self.force, self.coupling, strict=True)]
        inputs = self.algebra.block("u", len(self.document.inputs))
        return [*self.partials("0"), *([self.in_block("B0", forces, inputs, "dQ/du")] if inputs else [])]

    def output_partials(self) -> list[Block]:
        """Partials of the speeds in q and v."""
        speeds = self.document.outputs
        return [self.in_block("Yq", speeds, self.q, "in q"), self.in_block("Yv", speeds, self.v, "in v")]


_TERMS: Mapping[str, Callable[[_Recorder], list[Block]]] = {
    "mass": lambda made: made.block("M", (made.count, made.count), made.mass),
    "coupling": lambda made: made.block("h", (made.count,), made.coupling),
    "force": lambda made: made.block("Q", (made.count,), made.force),
    "inverse_dynamics": lambda made: made.block("tau", (made.count,), made.inverse_dynamics),
    "forward_dynamics": _Recorder.forward_dynamics,
    "residual": lambda made: made.block("r", (made.count,), made.inverse_dynamics),
    "partials": _Recorder.partials,
    "outputs": lambda made: [Block("y", (len(made.document.speeds),), made.document.outputs)],
    "linearization": _Recorder.linearization,
    "output_partials": _Recorder.output_partials,
}
EQUATIONS = FrontEnd("sympy", SymbolicEquations, describe, derive)
