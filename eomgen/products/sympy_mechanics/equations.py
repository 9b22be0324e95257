"""Equations M(q) vdot + h(q, v, t) + B^T lam = Q(q, v, t, u) with constraints on a tape as a document: description,
System and front end.

The velocities are the rates of the coordinates. Partials are recorded operation by operation, and accelerations without
constraints by Cholesky's elimination without roots, M = L D L^T.
"""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from eomgen.base.data import dataclass, field, replace
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import ZERO as NO_FORMULA
from eomgen.formula.nodes import Symbol
from eomgen.lie.product import Factor
from eomgen.pipeline.front_end import FrontEnd
from eomgen.products.sympy_mechanics.rows import KaneRows
from eomgen.symbolic.calculus.partials import Seeds, forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.description import Coordinates, Description, Drawing
from eomgen.system.signals import Input, Output, Parameter, State
from eomgen.system.system import INPUT_BLOCKS, Block, Facts, Function, Quantity, System
from eomgen.system.terms import TERMS

#: Most coordinates for which partials of the residual are recorded without a request.
_SMALL = 40
_NON_SMOOTH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT})


@dataclass(frozen=True)
class Observations:
    """Quantities of a SymPy system besides equations, recorded on the tape of the equations.

    Attributes
    ----------
    bodies : tuple of str
        Bodies that move.
    poses, twists : tuples of references
        Of each body: quaternion and place, 7; angular and linear velocity in body axes, 6.
    energy : tuple of references
        Kinetic and potential energy, J, non-conservative power, power of drivers, W; empty if unknown.
    angular : (n,) tuple of bool
        Which coordinates are angles.
    drawing : Drawing
    notes : tuple of str
    """

    bodies: tuple[str, ...] = ()
    poses: tuple[Ref, ...] = field(default=(), repr=False)
    twists: tuple[Ref, ...] = field(default=(), repr=False)
    energy: tuple[Ref, ...] = field(default=(), repr=False)
    angular: tuple[bool, ...] = ()
    drawing: Drawing = field(default_factory=Drawing, repr=False)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FirstOrderStates:
    """States of muscles and of other first-order equations, zdot = Z(q, v, z, t, u).

    Attributes
    ----------
    names : tuple of str
    initial : (nz,) tuple of float
    rates : tuple of references
    """

    names: tuple[str, ...] = ()
    initial: tuple[float, ...] = ()
    rates: tuple[Ref, ...] = field(default=(), repr=False)


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
        On the constraints.
    tape : Tape
    mass, coupling, force : tuples of references
        M row by row, h and Q.
    outputs : tuple of references
        Of the speeds.
    rows : KaneRows
        Constraints, kept by multipliers.
    observed : Observations
    states : FirstOrderStates
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
    rows: KaneRows = field(default_factory=KaneRows)
    observed: Observations = field(default_factory=Observations)
    states: FirstOrderStates = field(default_factory=FirstOrderStates)

    @cached_property
    def content(self) -> bytes:
        """All data that determine the equations, for the key of the cache."""
        tape, rows, observed = self.tape, self.rows, self.observed
        data = (
            *(rows.names, rows.positions, rows.velocities, rows.sizes, rows.extents, rows.left_out),
            *(observed.bodies, observed.poses, observed.twists, observed.energy, observed.angular, observed.notes),
            *(self.states.names, self.states.initial, self.states.rates),
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
    """Return the Description of equations from SymPy: parameters, states, inputs, outputs, drawing."""
    return Description(
        document.name,
        parameters=tuple(
            Parameter(name, value, tunable=True)
            for name, value in zip(document.parameters, document.values, strict=True)
        ),
        states=tuple(
            State(name, NO_FORMULA, value)
            for name, value in zip(document.states.names, document.states.initial, strict=True)
        ),
        inputs=tuple(Input(name) for name in document.inputs),
        outputs=tuple(Output(name, (Symbol("output", name),)) for name in document.speeds),
        coordinates=tuple(Coordinates(name, ("",)) for name in document.coordinates),
        drawing=document.observed.drawing,
    )


def derive(document: SymbolicEquations, terms: Sequence[str] | None) -> System:
    """Return the System of equations from SymPy with the wanted terms; None: all terms that a run may need. Terms that
    the system cannot have are left out."""
    recorder = _TermRecorder(document)
    blocks = {name: tuple(_TERMS[name](recorder)) for name in _wanted(document, recorder, terms)}
    tape = recorder.tape
    read = tape.blocks_read({name: [ref for block in parts for ref in block.refs] for name, parts in blocks.items()})
    absent = {
        "base",
        *(() if document.states.names else ("z",)),
        *(() if document.parameters else ("p",)),
        *(() if document.inputs else ("u",)),
        *(() if any("t" in used for used in read.values()) else ("t",)),
        *(() if document.rows.names else ("lam",)),
    }
    functions: dict[str, Function] = {}
    for name, outputs in blocks.items():
        term = TERMS[name]
        unread = {block for block in ("a", "lam") if term.of_motion and block not in read[name]}
        # if time moves places, terms take time that take none of scenes
        argument_blocks = ({*term.inputs} | read[name]) - absent - unread
        inputs = tuple(block for block in INPUT_BLOCKS if block in argument_blocks)
        functions[name] = Function(name, term.description, inputs, outputs)
    return _system(document, recorder, functions)


def _wanted(document: SymbolicEquations, recorder: _TermRecorder, terms: Sequence[str] | None) -> list[str]:
    """Return the terms to be recorded, in order: existing ones of ``terms``, None: all but terms on request."""
    rows, observed = document.rows, document.observed
    holds = {
        "constraints": rows.names,
        "unconstrained": not rows.names,
        "outputs": document.speeds,
        "tunable_outputs": document.speeds,
        "tunable": document.parameters,
        "states": document.states.names,
    }
    facts = {fact for fact, there in holds.items() if there}
    small = recorder.count <= _SMALL or bool(rows.names or document.states.names)
    missing = {
        *(() if observed.bodies else ("poses", "twists")),
        *(() if observed.energy else ("energy",)),
    }
    missing |= set() if document.parameters else {"parameter_partials", "output_parameter_partials"}
    existing = [name for name in _TERMS if TERMS[name].exists_with(facts) and name not in missing]
    if terms is not None:
        return [name for name in existing if name in terms]
    return [name for name in existing if not TERMS[name].on_request and (name != "partials" or small)]


def _system(document: SymbolicEquations, recorder: _TermRecorder, made: Mapping[str, Function]) -> System:
    """Return the System of a document from the functions ``made``, by name, with facts, names and the initial state."""
    tape, count, rows, observed = recorder.tape, recorder.count, document.rows, document.observed
    of_mass = {symbol.block for symbol in tape.depends_on(document.mass)}
    of_force = {symbol.block for symbol in tape.depends_on(document.force)}
    every = [*document.mass, *document.coupling, *document.force]
    facts = Facts(
        constant_mass="q" not in of_mass and "t" not in of_mass,
        velocity_forces="v" in of_force,
        smooth=all(tape.op[node] not in _NON_SMOOTH for node in tape.live(every)),
        moving_base=False,
        constraints=bool(rows.names),
        velocity_constraints=bool(rows.velocities),
        internal_states=bool(document.states.names),
        conservative="energy" in made and observed.energy[2:] == (ZERO, ZERO),
    )
    return System(
        document.name,
        tape,
        tuple(Factor("R", name, k, 1, k, 1) for k, name in enumerate(document.coordinates)),
        made,
        tuple(Quantity(name, value) for name, value in zip(document.parameters, document.values, strict=True)),
        tuple(Quantity(name) for name in document.inputs),
        tuple(Quantity(name) for name in document.speeds),
        observed.bodies,
        document.initial_q,
        document.initial_v,
        tuple(range(-1, count - 1)),
        angular=observed.angular or (False,) * count,
        facts=facts,
        states=tuple(map(Quantity, document.states.names, document.states.initial)),
        multipliers=rows.names,
        row_units=tuple("m" if k < len(rows.positions) else "m/s" for k in range(len(rows.names))),
        holonomic=len(rows.positions),
        patterns=dict(recorder.patterns),
        left_out=rows.left_out,
        notes=observed.notes,
    )


def solved(matrix: Sequence[Scalar], sides: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
    """Return the solutions for several right-hand sides (n,) of a symmetric matrix, row by row, recorded by L D L^T."""
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


class _TermRecorder:
    """Records the terms of a document on a copy of its tape; methods return the blocks of a term. ``patterns`` collects
    the positions of the nonzeros by block."""

    def __init__(self, document: SymbolicEquations) -> None:
        self.document, self.count = document, len(document.coordinates)
        self.tape = copy.deepcopy(document.tape)
        self.algebra = Algebra(self.tape)
        self.q, self.v, self.a = (self.algebra.block(block, self.count) for block in "qva")
        self.lam = self.algebra.block("lam", len(document.rows.names))
        self.mass, self.coupling, self.force = (
            [Scalar(self.tape, ref) for ref in refs] for refs in (document.mass, document.coupling, document.force)
        )
        self.patterns: dict[str, tuple[tuple[int, int], ...]] = {}

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

    @cached_property
    def residual(self) -> list[Scalar]:
        """M a + h - Q + B^T lam."""
        return self._with_reactions(self.inverse_dynamics)

    def _with_reactions(self, values: Sequence[Scalar]) -> list[Scalar]:
        """Return values + B^T lam."""
        result = list(values)
        for multiplier, tangent in zip(self.lam, self.slopes, strict=True):
            for column, ref in tangent.items():
                result[column] = result[column] + Scalar(self.tape, ref) * multiplier
        return result

    @cached_property
    def slopes(self) -> list[dict[int, Ref]]:
        """Rows of B, each as references of nonzeros by column: partials of positions in q, velocities in v."""
        rows = self.document.rows
        result: list[dict[int, Ref]] = []
        for refs, block in ((rows.positions, self.q), (rows.velocities, self.v)):
            seeds: Seeds = {item.ref: {column: ONE} for column, item in enumerate(block)}
            result += [dict(row) for row in forward_partials(self.tape, refs, seeds)]
        return result

    @property
    def _along(self) -> dict[Ref | InputSymbol, Ref]:
        along: dict[Ref | InputSymbol, Ref] = {entry.ref: rate.ref for entry, rate in zip(self.q, self.v, strict=True)}
        along[InputSymbol("t", 0)] = ONE
        return along

    @cached_property
    def row_rates(self) -> list[Ref]:
        """Rates of the positions, then the rows of velocities."""
        return [*jacobian_vector(self.tape, self.document.rows.positions, self._along), *self.document.rows.velocities]

    @cached_property
    def row_biases(self) -> list[Ref]:
        """References of the accelerations of the rows at vdot = 0, g, (rows,)."""
        return jacobian_vector(self.tape, self.row_rates, self._along)

    @cached_property
    def row_accelerations(self) -> list[Ref]:
        """References of the accelerations of the rows, B a + g, (rows,)."""
        result = []
        for tangent, bias in zip(self.slopes, self.row_biases, strict=True):
            total = Scalar(self.tape, bias)
            for column, ref in tangent.items():
                total = total + Scalar(self.tape, ref) * self.a[column]
            result.append(total.ref)
        return result

    def block(self, name: str, shape: tuple[int, ...], values: Sequence[Scalar], text: str = "") -> list[Block]:
        return [Block(name, shape, tuple(value.ref for value in values), text)]

    def vector(self, name: str, refs: Sequence[Ref], text: str) -> Block:
        return Block(name, (len(refs),), tuple(refs), text)

    def forward_dynamics(self) -> list[Block]:
        """Return the block of accelerations, M^-1 (Q - h). Raises ModelError for a coordinate with a zero row of M."""
        balance = [force - bias for force, bias in zip(self.force, self.coupling, strict=True)]
        for index, name in enumerate(self.document.coordinates):
            row = self.mass[index * self.count : (index + 1) * self.count]
            if all(item.is_zero for item in row):
                fault = f"no mass moves with the coordinate {name}, so the mass matrix has no inverse [E2175]"
                hint = 'a mass, or terms without accelerations, as eomgen.derive(document, ["mass", "force"])'
                raise ModelError(Problem(self.document.name, fault, hint))
        (solution,) = solved(self.mass, [balance])
        return self.block("vdot", (self.count,), solution)

    def in_block(self, name: str, values: Sequence[Ref], block: Sequence[Scalar], text: str) -> Block:
        """Return the block ``name`` of partials of values in the numbers of ``block``, (values, numbers) row by row."""
        rows = forward_partials(self.tape, values, {item.ref: {index: ONE} for index, item in enumerate(block)})
        refs = tuple(row.get(index, ZERO) for row in rows for index in range(len(block)))
        return Block(name, (len(values), len(block)), refs, text)

    @cached_property
    def matrices(self) -> tuple[Block, Block, Block]:
        """Partials of the residual in q, v and a."""
        residual = [item.ref for item in self.residual]
        return (
            self.in_block("K", residual, self.q, "in q"),
            self.in_block("C", residual, self.v, "in v"),
            Block("M", (self.count, self.count), self.document.mass, "in a"),
        )

    def linearization(self) -> list[Block]:
        """Partials of the residual, and of the forces in inputs."""
        forces = [(force - bias).ref for force, bias in zip(self.force, self.coupling, strict=True)]
        inputs = self.algebra.block("u", len(self.document.inputs))
        blocks = [replace(block, name=f"{block.name}0") for block in self.matrices]
        blocks += [self.in_block("B0", forces, inputs, "dQ/du")] if inputs else []
        blocks += self.internal_partials()
        rates = self.document.states.rates
        return blocks + ([self.in_block("Fu", rates, inputs, "d zdot/du")] if rates and inputs else [])

    def output_partials(self) -> list[Block]:
        """Partials of the speeds in q and v."""
        speeds = self.document.outputs
        return [self.in_block("Yq", speeds, self.q, "in q"), self.in_block("Yv", speeds, self.v, "in v")]

    # -- internal states ----------------------------------------------------------------------------------------------

    def internal_rate(self) -> list[Block]:
        """Rates of the internal states."""
        return [self.vector("zdot", self.document.states.rates, "rates of the internal states")]

    def internal_partials(self) -> list[Block]:
        """Partials of the residual in z, and of the rates in q, v and z."""
        rates = self.document.states.rates
        if not rates:
            return []
        z = self.algebra.block("z", len(rates))
        return [
            self.in_block("Rz", [item.ref for item in self.residual], z, "d residual / dz"),
            self.in_block("Fq", rates, self.q, "d zdot / dq"),
            self.in_block("Fv", rates, self.v, "d zdot / dv"),
            self.in_block("Fz", rates, z, "d zdot / dz"),
        ]

    # -- constraints --------------------------------------------------------------------------------------------------

    def positions(self) -> Block:
        """Phi."""
        return self.vector("Phi", self.document.rows.positions, "holonomic constraints")

    def velocities(self) -> Block:
        """Rates of the positions, then the rows of velocities."""
        return self.vector("w", self.row_rates, "rates of the positions, then constraints of velocities")

    @cached_property
    def jacobian(self) -> Block:
        """B."""
        refs = tuple(row.get(column, ZERO) for row in self.slopes for column in range(self.count))
        return Block("B", (len(self.slopes), self.count), refs, "constraint Jacobian")

    @cached_property
    def velocity_partials(self) -> Block:
        """Z."""
        return self.in_block("Z", self.row_rates, self.q, "partials in q of the velocity rows")

    def sizes(self) -> list[Block]:
        """Scales of the rows."""
        rows = self.document.rows
        return [
            self.vector("size", rows.sizes, "sum of the magnitudes of the summands of each row"),
            self.vector("extent", rows.extents, "change of each row per radian"),
        ]

    def equations(self) -> list[Block]:
        """Residual, positions with rates, and rates of internal states."""
        blocks = self.block("r", (self.count,), self.residual)
        blocks += [self.positions(), self.velocities()] if self.document.rows.names else []
        return blocks + (self.internal_rate() if self.document.states.names else [])

    def nonzeros(self, block: Block) -> Block:
        """Return a block with the entries of a matrix not zero by structure; note the positions in ``patterns``."""
        columns = block.shape[1]
        self.patterns[block.name] = tuple(divmod(k, columns) for k, ref in enumerate(block.refs) if ref != ZERO)
        return self.vector(block.name, [ref for ref in block.refs if ref != ZERO], f"nonzeros of {block.name}")

    def iteration(self) -> list[Block]:
        """Nonzeros of all partials of an implicit step."""
        matrices = list(self.matrices)
        matrices += [self.jacobian, self.velocity_partials] if self.document.rows.names else []
        blocks = [self.nonzeros(block) for block in matrices]
        return blocks + [packed for block in self.internal_partials() if (packed := self.nonzeros(block)).refs]

    def acceleration_partials(self) -> list[Block]:
        """Partials of B a + g in q and v."""
        rows = self.row_accelerations
        return [self.in_block("Aq", rows, self.q, "a held"), self.in_block("Av", rows, self.v, "a held")]

    def reaction_partials(self) -> list[Block]:
        """Partials of B^T lam in q and in the parameters."""
        forces = [item.ref for item in self._with_reactions([Scalar(self.tape, ZERO)] * self.count)]
        p = self.algebra.block("p", len(self.document.parameters))
        blocks = [self.in_block("N", forces, self.q, "d(B^T lam) / dq")]
        return [*blocks, self.in_block("Np", forces, p, "d(B^T lam) / dp")] if p else blocks

    # -- parameters ---------------------------------------------------------------------------------------------------

    def parameter_partials(self) -> list[Block]:
        """Partials of residual and constraints in the parameters."""
        p = self.algebra.block("p", len(self.document.parameters))
        blocks = [self.in_block("Rp", [item.ref for item in self.residual], p, "d residual / dp")]
        if self.document.states.names:
            blocks.append(self.in_block("Fp", self.document.states.rates, p, "d zdot / dp"))
        if self.document.rows.names:
            blocks += [
                self.in_block("Phip", self.document.rows.positions, p, "d Phi / dp"),
                self.in_block("Zp", self.row_rates, p, "d w / dp"),
                self.in_block("Ap", self.row_accelerations, p, "d(B a + g) / dp"),
            ]
        return blocks

    def output_parameter_partials(self) -> list[Block]:
        """Partials of the speeds in the parameters."""
        p = self.algebra.block("p", len(self.document.parameters))
        return [self.in_block("Yp", self.document.outputs, p, "d outputs / dp")]


_TERMS: Mapping[str, Callable[[_TermRecorder], list[Block]]] = {
    "mass": lambda made: made.block("M", (made.count, made.count), made.mass),
    "coupling": lambda made: made.block("h", (made.count,), made.coupling),
    "force": lambda made: made.block("Q", (made.count,), made.force),
    "inverse_dynamics": lambda made: made.block("tau", (made.count,), made.inverse_dynamics),
    "forward_dynamics": _TermRecorder.forward_dynamics,
    "residual": lambda made: made.block("r", (made.count,), made.residual),
    "partials": lambda made: [*made.matrices],
    "internal_rate": _TermRecorder.internal_rate,
    "internal_partials": _TermRecorder.internal_partials,
    "constraint": lambda made: [made.positions()],
    "constraint_velocity": lambda made: [made.velocities()],
    "constraint_bias": lambda made: [made.vector("g", made.row_biases, "rates of the velocity rows at vdot = 0")],
    "constraint_acceleration": lambda made: [made.vector("w_dot", made.row_accelerations, "B a + g")],
    "constraint_jacobian": lambda made: [made.jacobian],
    "constraint_size": _TermRecorder.sizes,
    "velocity_partials": lambda made: [made.velocity_partials],
    "equations": _TermRecorder.equations,
    "iteration": _TermRecorder.iteration,
    "jacobian_values": lambda made: [made.nonzeros(made.jacobian)],
    "poses": lambda made: [Block("pose", (len(made.document.observed.bodies), 7), made.document.observed.poses)],
    "twists": lambda made: [Block("twist", (len(made.document.observed.bodies), 6), made.document.observed.twists)],
    "outputs": lambda made: [Block("y", (len(made.document.speeds),), made.document.outputs)],
    "linearization": _TermRecorder.linearization,
    "acceleration_partials": _TermRecorder.acceleration_partials,
    "reaction_partials": _TermRecorder.reaction_partials,
    "output_partials": _TermRecorder.output_partials,
    "parameter_partials": _TermRecorder.parameter_partials,
    "output_parameter_partials": _TermRecorder.output_parameter_partials,
    "energy": lambda made: [Block("energy", (4,), made.document.observed.energy)],
}
EQUATIONS = FrontEnd("sympy", SymbolicEquations, describe, derive)
