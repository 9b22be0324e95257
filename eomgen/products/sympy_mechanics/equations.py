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

from eomgen.base.data import dataclass, field, fields, replace
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
class SymbolicEquations:
    """Equations of motion recorded from SymPy.

    Attributes
    ----------
    name : str
        Prefix of the C functions.
    coordinates : tuple of str
        Names of q; the rates have the same names.
    parameters : mapping
        Values of the free symbols by name.
    inputs, speeds : tuples of str
        Names of functions of time besides coordinates, and of the user's speeds, the outputs.
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
    states : mapping
        Initial values of the states of muscles and of other first-order equations, zdot = Z(q, v, z, t, u), by name.
    rates : tuple of references
        zdot.
    """

    name: str
    coordinates: tuple[str, ...]
    parameters: Mapping[str, float]
    inputs: tuple[str, ...]
    speeds: tuple[str, ...]
    initial_q: tuple[float, ...]
    initial_v: tuple[float, ...]
    tape: Tape = field(repr=False)
    mass: tuple[Ref, ...] = field(repr=False)
    coupling: tuple[Ref, ...] = field(repr=False)
    force: tuple[Ref, ...] = field(repr=False)
    outputs: tuple[Ref, ...] = field(repr=False)
    rows: KaneRows = field(default_factory=KaneRows)
    observed: Observations = field(default_factory=Observations)
    states: Mapping[str, float] = field(default_factory=dict)
    rates: tuple[Ref, ...] = field(default=(), repr=False)

    @cached_property
    def content(self) -> bytes:
        """All data that determine the equations, for the key of the cache."""
        tape, parts = self.tape, (self.rows, self.observed)
        data: list[object] = [list(map(int, tape.op)), tape.a, tape.b, tape.constants, tape.inputs]
        for part in (self, *parts):
            values = [getattr(part, item.name) for item in fields(part)]
            data += [value for value in values if value is not tape and value not in parts]
        return hashlib.sha256(repr(data).encode()).digest()

    @property
    def front_end(self) -> FrontEnd:
        """The front end of such documents."""
        return EQUATIONS


def describe(document: SymbolicEquations) -> Description:
    """Return the Description of equations from SymPy: parameters, states, inputs, outputs, drawing."""
    return Description(
        document.name,
        parameters=tuple(Parameter(name, value, tunable=True) for name, value in document.parameters.items()),
        states=tuple(State(name, NO_FORMULA, value) for name, value in document.states.items()),
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
        *(() if document.states else ("z",)),
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
        "states": document.states,
    }
    facts = {fact for fact, there in holds.items() if there}
    # partials of the residual of more coordinates take long to record
    small = recorder.count <= 40 or bool(rows.names or document.states)
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
        internal_states=bool(document.states),
        conservative="energy" in made and observed.energy[2:] == (ZERO, ZERO),
    )
    return System(
        document.name,
        tape,
        tuple(Factor("R", name, k, 1, k, 1) for k, name in enumerate(document.coordinates)),
        made,
        tuple(Quantity(name, value) for name, value in document.parameters.items()),
        tuple(Quantity(name) for name in document.inputs),
        tuple(Quantity(name) for name in document.speeds),
        observed.bodies,
        document.initial_q,
        document.initial_v,
        tuple(range(-1, count - 1)),
        angular=observed.angular or (False,) * count,
        facts=facts,
        states=tuple(Quantity(name, value) for name, value in document.states.items()),
        multipliers=rows.names,
        row_units=tuple("m" if k < len(rows.positions) else "m/s" for k in range(len(rows.names))),
        holonomic=len(rows.positions),
        patterns=dict(recorder.patterns),
        left_out=rows.left_out,
        notes=observed.notes,
    )


def solve_symmetric(matrix: Sequence[Scalar], side: Sequence[Scalar]) -> list[Scalar]:
    """Return the solution (n,) of a symmetric matrix, row by row, and a right side (n,), recorded by L D L^T."""
    n = len(side)
    lower: dict[tuple[int, int], Scalar] = {}
    pivots: list[Scalar] = []
    for i in range(n):
        row: list[Scalar] = []
        for j in range(i + 1):
            entry = matrix[i * n + j]
            for k in range(j):
                entry = entry - row[k] * lower[j, k]
            row.append(entry)
            if j < i:
                lower[i, j] = entry if entry.is_zero else entry / pivots[j]
        pivots.append(row[i])
    solution = list(side)
    for i in range(n):
        for k in range(i):
            solution[i] = solution[i] - lower[i, k] * solution[k]
    solution = [value if value.is_zero else value / pivot for value, pivot in zip(solution, pivots, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            solution[i] = solution[i] - lower[k, i] * solution[k]
    return solution


class _TermRecorder:
    """Records the terms of a document on a copy of its tape. ``patterns`` collects the positions of the nonzeros by
    block. Properties are quantities of the equations as references on the tape."""

    def __init__(self, document: SymbolicEquations) -> None:
        self.document, self.count = document, len(document.coordinates)
        self.tape = copy.deepcopy(document.tape)
        self.algebra = Algebra(self.tape)
        self.positions, self.velocities = document.rows.positions, document.rows.velocities
        self.outputs, self.rates = document.outputs, document.rates
        sizes = {**dict.fromkeys("qva", self.count), "lam": len(document.rows.names), "z": len(self.rates)}
        sizes |= {"p": len(document.parameters), "u": len(document.inputs)}
        #: Numbers of the input blocks.
        self.blocks = {name: self.algebra.block(name, size) for name, size in sizes.items()}
        self.mass, self.coupling, self.force = map(self._scalars, (document.mass, document.coupling, document.force))
        self.patterns: dict[str, tuple[tuple[int, int], ...]] = {}

    def _scalars(self, refs: Sequence[Ref]) -> list[Scalar]:
        return [Scalar(self.tape, ref) for ref in refs]

    @cached_property
    def forces(self) -> list[Ref]:
        """Q - h."""
        return [(force - bias).ref for force, bias in zip(self.force, self.coupling, strict=True)]

    @cached_property
    def inverse_dynamics(self) -> list[Ref]:
        """M a + h - Q."""
        result = []
        for row in range(self.count):
            total = self.coupling[row] - self.force[row]
            for column, a in enumerate(self.blocks["a"]):
                total = total + self.mass[row * self.count + column] * a
            result.append(total.ref)
        return result

    @cached_property
    def residual(self) -> list[Ref]:
        """M a + h - Q + B^T lam."""
        return self._with_reactions(self.inverse_dynamics)

    @cached_property
    def reactions(self) -> list[Ref]:
        """B^T lam."""
        return self._with_reactions([ZERO] * self.count)

    def _with_reactions(self, values: Sequence[Ref]) -> list[Ref]:
        """Return values + B^T lam."""
        result = self._scalars(values)
        for multiplier, tangent in zip(self.blocks["lam"], self.slopes, strict=True):
            for column, ref in tangent.items():
                result[column] = result[column] + Scalar(self.tape, ref) * multiplier
        return [item.ref for item in result]

    @cached_property
    def slopes(self) -> list[Mapping[int, Ref]]:
        """Rows of B, each as references of nonzeros by column: partials of positions in q, velocities in v."""
        return [*self._rows_in(self.positions, "q"), *self._rows_in(self.velocities, "v")]

    @property
    def _along(self) -> dict[Ref | InputSymbol, Ref]:
        pairs = zip(self.blocks["q"], self.blocks["v"], strict=True)
        along: dict[Ref | InputSymbol, Ref] = {item.ref: rate.ref for item, rate in pairs}
        return along | {InputSymbol("t", 0): ONE}

    @cached_property
    def row_rates(self) -> list[Ref]:
        """Rates of the positions, then the rows of velocities."""
        return [*jacobian_vector(self.tape, self.positions, self._along), *self.velocities]

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
                total = total + Scalar(self.tape, ref) * self.blocks["a"][column]
            result.append(total.ref)
        return result

    @cached_property
    def forward_dynamics(self) -> list[Ref]:
        """Accelerations, M^-1 (Q - h). Raises ModelError for a coordinate with a zero row of M."""
        for index, name in enumerate(self.document.coordinates):
            if all(item.is_zero for item in self.mass[index * self.count : (index + 1) * self.count]):
                fault = f"no mass moves with the coordinate {name}, so the mass matrix has no inverse [E2175]"
                hint = 'a mass, or terms without accelerations, as eomgen.derive(document, ["mass", "force"])'
                raise ModelError(Problem(self.document.name, fault, hint))
        return [item.ref for item in solve_symmetric(self.mass, self._scalars(self.forces))]

    def _rows_in(self, values: Sequence[Ref], argument: str) -> Sequence[Mapping[int, Ref]]:
        """Return the partials of each value in the numbers of an input block, nonzeros by column."""
        seeds: Seeds = {item.ref: {index: ONE} for index, item in enumerate(self.blocks[argument])}
        return forward_partials(self.tape, values, seeds)

    def vector(self, name: str, refs: Sequence[Ref], text: str = "") -> list[Block]:
        """Return a block of numbers."""
        return [Block(name, (len(refs),), tuple(refs), text)]

    def matrix(self, name: str, rows: Sequence[Mapping[int, Ref]], columns: int, text: str) -> Block:
        """Return a block of rows of nonzeros by column, row by row."""
        refs = tuple(row.get(column, ZERO) for row in rows for column in range(columns))
        return Block(name, (len(rows), columns), refs, text)

    def partials(self, term: str) -> list[Block]:
        """Return the blocks of partials of a term. Blocks without arguments, and of quantities of internal states or
        constraints that are not there, are left out."""
        absent = {"rates"} if not self.rates else set[str]()
        absent |= set() if self.document.rows.names else {"positions", "row_rates", "row_accelerations", "reactions"}
        return [
            self.matrix(name, self._rows_in(getattr(self, quantity), argument), len(self.blocks[argument]), text)
            for name, quantity, argument, text in _PARTIALS[term]
            if self.blocks[argument] and quantity not in absent
        ]

    @cached_property
    def matrices(self) -> list[Block]:
        """Partials of the residual in q, v and a."""
        return [*self.partials("partials"), Block("M", (self.count, self.count), self.document.mass, "in a")]

    def linearization(self) -> list[Block]:
        """Partials of the residual, and of the forces in inputs."""
        blocks = [replace(block, name=f"{block.name}0") for block in self.matrices]
        return blocks + self.partials("linearization")

    @cached_property
    def jacobian(self) -> Block:
        """B."""
        return self.matrix("B", self.slopes, self.count, "constraint Jacobian")

    def constraint_size(self) -> list[Block]:
        """Scales of the rows."""
        rows = self.document.rows
        return [
            *self.vector("size", rows.sizes, "sum of the magnitudes of the summands of each row"),
            *self.vector("extent", rows.extents, "change of each row per radian"),
        ]

    def equations(self) -> list[Block]:
        """Residual, positions with rates, and rates of internal states."""
        names = ["constraint", "constraint_velocity"] if self.document.rows.names else []
        names += ["internal_rate"] if self.rates else []
        return [block for name in ("residual", *names) for block in _TERMS[name](self)]

    def nonzeros(self, block: Block) -> list[Block]:
        """Return a block with the entries of a matrix not zero by structure; note the positions in ``patterns``."""
        columns = block.shape[1]
        self.patterns[block.name] = tuple(divmod(k, columns) for k, ref in enumerate(block.refs) if ref != ZERO)
        return self.vector(block.name, [ref for ref in block.refs if ref != ZERO], f"nonzeros of {block.name}")

    def iteration(self) -> list[Block]:
        """Nonzeros of all partials of an implicit step."""
        matrices = list(self.matrices)
        matrices += [self.jacobian, *self.partials("velocity_partials")] if self.document.rows.names else []
        blocks = [part for block in matrices for part in self.nonzeros(block)]
        internal = self.partials("internal_partials")
        return blocks + [part for block in internal for part in self.nonzeros(block) if part.refs]


_OF_STATES = (
    ("Rz", "residual", "z", "d residual / dz"),
    ("Fq", "rates", "q", "d zdot / dq"),
    ("Fv", "rates", "v", "d zdot / dv"),
    ("Fz", "rates", "z", "d zdot / dz"),
)
#: Partials of terms: name of the block, quantity of the recorder, block of the arguments, and text.
_PARTIALS: Mapping[str, tuple[tuple[str, str, str, str], ...]] = {
    "partials": (("K", "residual", "q", "in q"), ("C", "residual", "v", "in v")),
    "internal_partials": _OF_STATES,
    "linearization": (("B0", "forces", "u", "dQ/du"), *_OF_STATES, ("Fu", "rates", "u", "d zdot/du")),
    "velocity_partials": (("Z", "row_rates", "q", "partials in q of the velocity rows"),),
    "acceleration_partials": (("Aq", "row_accelerations", "q", "a held"), ("Av", "row_accelerations", "v", "a held")),
    "reaction_partials": (("N", "reactions", "q", "d(B^T lam) / dq"), ("Np", "reactions", "p", "d(B^T lam) / dp")),
    "output_partials": (("Yq", "outputs", "q", "in q"), ("Yv", "outputs", "v", "in v")),
    "parameter_partials": (
        ("Rp", "residual", "p", "d residual / dp"),
        ("Fp", "rates", "p", "d zdot / dp"),
        ("Phip", "positions", "p", "d Phi / dp"),
        ("Zp", "row_rates", "p", "d w / dp"),
        ("Ap", "row_accelerations", "p", "d(B a + g) / dp"),
    ),
    "output_parameter_partials": (("Yp", "outputs", "p", "d outputs / dp"),),
}
_TERMS: Mapping[str, Callable[[_TermRecorder], list[Block]]] = {
    "mass": lambda made: [Block("M", (made.count, made.count), made.document.mass)],
    "coupling": lambda made: made.vector("h", made.document.coupling),
    "force": lambda made: made.vector("Q", made.document.force),
    "inverse_dynamics": lambda made: made.vector("tau", made.inverse_dynamics),
    "forward_dynamics": lambda made: made.vector("vdot", made.forward_dynamics),
    "residual": lambda made: made.vector("r", made.residual),
    "partials": lambda made: made.matrices,
    "internal_rate": lambda made: made.vector("zdot", made.rates, "rates of the internal states"),
    "internal_partials": lambda made: made.partials("internal_partials"),
    "constraint": lambda made: made.vector("Phi", made.positions, "holonomic constraints"),
    "constraint_velocity": lambda made: made.vector(
        "w", made.row_rates, "rates of the positions, then constraints of velocities"
    ),
    "constraint_bias": lambda made: made.vector("g", made.row_biases, "rates of the velocity rows at vdot = 0"),
    "constraint_acceleration": lambda made: made.vector("w_dot", made.row_accelerations, "B a + g"),
    "constraint_jacobian": lambda made: [made.jacobian],
    "constraint_size": _TermRecorder.constraint_size,
    "velocity_partials": lambda made: made.partials("velocity_partials"),
    "equations": _TermRecorder.equations,
    "iteration": _TermRecorder.iteration,
    "jacobian_values": lambda made: made.nonzeros(made.jacobian),
    "poses": lambda made: [Block("pose", (len(made.document.observed.bodies), 7), made.document.observed.poses)],
    "twists": lambda made: [Block("twist", (len(made.document.observed.bodies), 6), made.document.observed.twists)],
    "outputs": lambda made: made.vector("y", made.outputs),
    "linearization": _TermRecorder.linearization,
    "acceleration_partials": lambda made: made.partials("acceleration_partials"),
    "reaction_partials": lambda made: made.partials("reaction_partials"),
    "output_partials": lambda made: made.partials("output_partials"),
    "parameter_partials": lambda made: made.partials("parameter_partials"),
    "output_parameter_partials": lambda made: made.partials("output_parameter_partials"),
    "energy": lambda made: made.vector("energy", made.document.observed.energy),
}
EQUATIONS = FrontEnd("sympy", SymbolicEquations, describe, derive)
