"""Derive the System of a scene: only the terms that are asked for, each from its own virtual work."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.errors import ModelError
from eomgen.mechanics import terms as separated
from eomgen.mechanics.articulated import articulated_forward
from eomgen.mechanics.base import base_law, base_state
from eomgen.mechanics.bodies import poses, twists
from eomgen.mechanics.energy import energies
from eomgen.mechanics.forces import Loads, applied_loads
from eomgen.mechanics.formulas import record
from eomgen.mechanics.forward import solve_tree
from eomgen.mechanics.grouping import grouped
from eomgen.mechanics.inputs import input_signal
from eomgen.mechanics.kinematics import Kinematics
from eomgen.mechanics.motion import total_fields
from eomgen.mechanics.partials import inertial_partials
from eomgen.mechanics.quantities import Quantities
from eomgen.mechanics.summary import kept_and_dropped
from eomgen.mechanics.tree import Tree, build_tree
from eomgen.scene.formula_nodes import Formula
from eomgen.scene.scene import Scene
from eomgen.symbolic.configuration import tangent_seeds
from eomgen.symbolic.derivatives import Tangent, forward_partials
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, ZERO, InputSymbol, Op, Ref, Tape
from eomgen.system import BASE_LAYOUT, INPUT_BLOCKS, Block, Facts, Function, Quantity, System

#: All terms, with the input blocks each may depend on and what it is.
TERMS: dict[str, tuple[tuple[str, ...], str]] = {
    "mass": (("p", "q"), "inertia matrix M(q), symmetric, full"),
    "coupling": (("p", "q", "v"), "nonlinear coupling vector h(q, v): inertia terms quadratic in v, base at rest"),
    "force": (("p", "t", "q", "v", "u", "base"), "generalized force Q: gravity, springs, dampers, actuators, formulas"),
    "base_motion": (("p", "q", "v", "base"), "base-motion terms b: inertia terms that vanish when the base is at rest"),
    "inverse_dynamics": (("p", "t", "q", "v", "a", "u", "base"), "tau = M a + h + b - Q in one recursion"),
    "forward_dynamics": (("p", "t", "q", "v", "u", "base"), "vdot = M^-1 (Q - h - b)"),
    "residual": (("p", "t", "q", "v", "a", "u", "base"), "residual r = M a + h + b - Q of an implicit step"),
    "partials": (("p", "t", "q", "v", "a", "u", "base"), "partials of the residual: K in q (left-trivialised), C in v, M in a"),
    "poses": (("p", "q", "base"), "quaternion (body to world) and position of every body"),
    "twists": (("p", "q", "v", "base"), "inertial twist of every body in body axes, angular first"),
    "outputs": (("p", "t", "q", "v", "a", "u", "base"), "the scene's named outputs"),
    "energy": (("p", "t", "q", "v", "a", "u", "base"), "kinetic and potential energy, non-conservative power, power of the base"),
}

#: Trees with a larger sum of squared depths are not even tried with a factored mass matrix: articulated bodies have long won.
LONG_TREE = 20_000

_ROUGH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT})


def derive(scene: Scene, terms: Sequence[str] | None = None) -> System:
    """Derive the separated equations of motion of a scene.

    Parameters
    ----------
    terms : sequence of str, optional
        Names from ``TERMS``; the scene's own list, or all that the scene can use, when omitted.

    Raises
    ------
    ModelError
        For an unknown term, or one that the scene cannot have.
    """
    return _Derivation(scene).system(_chosen(scene, terms))


def _chosen(scene: Scene, terms: Sequence[str] | None) -> list[str]:
    asked = list(terms) if terms is not None else list(scene.terms)
    unknown = [name for name in asked if name not in TERMS]
    if unknown:
        raise ModelError(f"no term is called {', '.join(map(repr, unknown))}", f"one of {', '.join(TERMS)}")
    if asked:
        return [name for name in TERMS if name in asked and _present(scene, name)]
    return [name for name in TERMS if _present(scene, name)]


def _present(scene: Scene, name: str) -> bool:
    return not (name == "base_motion" and scene.base is None) and not (name == "outputs" and not scene.outputs)


class _Derivation:
    """One derivation: shared trees and loads, each recorded at its first use."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.tape = Tape()
        self.algebra = Algebra(self.tape)
        self.tree = build_tree(self.algebra, scene)
        if not self.tree.links:
            raise ModelError(f"scene {scene.name!r} has no moving joint", "add a revolute, prismatic, spherical or free joint")
        self.grouped: Tree = grouped(self.tree)
        gravity = self.algebra.vector([self._constant(item) for item in scene.gravity])
        self.base = base_state(self.algebra, scene, gravity)
        self.motion = self.base.motion()
        self.kinematics = Kinematics(self.tree, self.base)
        self.quantities = Quantities(scene, self.tree, self.kinematics)
        self.loads: Loads = applied_loads(scene, self.tree, self.quantities)
        self._energies: dict[str, Scalar] | None = None
        self.composites = separated.composites(self.grouped)

    def _constant(self, formula: Formula) -> Scalar:
        return record(self.algebra, formula, lambda symbol: self.tree.parameters[symbol.name])

    # -- terms ------------------------------------------------------------------------------------------------------

    def mass(self) -> list[Block]:
        M = separated.mass_matrix(self.grouped, self.composites)
        return [self._matrix("M", M, "inertia matrix")]

    def coupling(self) -> list[Block]:
        return [self._vector("h", separated.coupling(self.grouped), "nonlinear coupling vector")]

    def applied(self) -> list[Scalar]:
        """Return the generalized forces of everything that is applied, gravity excepted."""
        zero = (self.algebra.zero_vector, self.algebra.zero_vector)
        wrenches = [load if load is not None else zero for load in self.loads.wrenches]
        projected = separated.generalized(self.tree, wrenches, "applied forces")
        return [x + y for x, y in zip(projected, self.loads.efforts, strict=True)]

    def force(self) -> list[Block]:
        weight = separated.gravity_force(self.grouped, self.motion.gravity, self.composites)
        Q = [x + y for x, y in zip(weight, self.applied(), strict=True)]
        return [self._vector("Q", Q, "generalized force")]

    def base_motion(self) -> list[Block]:
        return [self._vector("b", separated.base_motion(self.grouped, self.motion), "base-motion terms")]

    def inverse_dynamics(self) -> list[Block]:
        return [self._vector("tau", self._inverse(), "generalized force that the motion a needs")]

    def residual(self) -> list[Block]:
        return [self._vector("r", self._inverse(), "residual")]

    def _inverse(self) -> list[Scalar]:
        tau = separated.inverse_dynamics(self.grouped, self.motion, self.loads.wrenches)
        return [x - y for x, y in zip(tau, self.loads.efforts, strict=True)]

    def forward_dynamics(self) -> list[Block]:
        ways = [articulated_forward(self.grouped, self.motion, self.loads.wrenches, self.loads.efforts)]
        if sum(depth * depth for depth in self._depths()) < LONG_TREE:
            ways.append(self._forward_by_mass_matrix())
        vdot = min(ways, key=lambda values: self.tape.counts([value.ref for value in values]).weight)
        return [self._vector("vdot", vdot, "time derivative of v")]

    def _depths(self) -> list[int]:
        """Return for each velocity component how many there are from the root to it."""
        depths: list[int] = []
        for parent in self.tree.dof_parents():
            depths.append(1 + (depths[parent] if parent >= 0 else 0))
        return depths

    def _forward_by_mass_matrix(self) -> list[Scalar]:
        fields = total_fields(self.grouped, self.motion, accelerations=False, gravity=True)
        inertial = separated.field_wrenches(self.grouped, fields)
        net = [
            load if applied is None else separated.difference(load, applied)
            for load, applied in zip(inertial, self.loads.wrenches, strict=True)
        ]
        bias = separated.generalized(self.grouped, net, "bias force")
        right = [effort - load for effort, load in zip(self.loads.efforts, bias, strict=True)]
        M = separated.mass_matrix(self.grouped, self.composites)
        with self.tape.block("elimination of the mass matrix from the tips to the root"):
            return solve_tree(M, right, self.tree.dof_parents())

    def partials(self) -> list[Block]:
        nv = self.tree.nv
        K, C, M = inertial_partials(self.grouped, self.motion)
        seeds: dict[Ref | InputSymbol, Tangent] = {}
        for link in self.tree.links:
            factor = link.factor
            q = [self.tape.input("q", factor.q_start + k) for k in range(factor.q_size)]
            seeds |= tangent_seeds(self.tape, factor.group, q, factor.v_start)
        for k in range(nv):
            seeds[InputSymbol("v", k)] = {nv + k: ONE}
        applied = self.applied()
        with self.tape.block("partials of applied forces"):
            tangents = forward_partials(self.tape, [value.ref for value in applied], seeds)
        for row, tangent in enumerate(tangents):
            for direction, ref in tangent.items():
                block, column = (K, direction) if direction < nv else (C, direction - nv)
                block[row][column] = block[row][column] - Scalar(self.tape, ref)
        return [
            self._matrix("K", K, "d residual / dq, left-trivialised"),
            self._matrix("C", C, "d residual / dv"),
            self._matrix("M", M, "d residual / da"),
        ]

    def poses(self) -> list[Block]:
        values = poses(self.scene, self.tree, self.kinematics, self.base)
        return [self._block("pose", (len(self.scene.bodies), 7), values, "quaternion (w, x, y, z) and position of each body")]

    def twists(self) -> list[Block]:
        values = twists(self.scene, self.tree, self.kinematics, self.base)
        return [self._block("twist", (len(self.scene.bodies), 6), values, "angular and linear velocity of each body")]

    def energies(self) -> dict[str, Scalar]:
        if self._energies is None:
            self._energies = energies(self.tree, self.kinematics, self.base, self.loads)
            self.quantities.energies = {"base_power": self.algebra.zero, **self._energies}
        return self._energies

    def energy(self) -> list[Block]:
        found = self.energies()
        zero = self.algebra.zero
        values = [found["kinetic"], found["potential"], found["power"], found.get("base_power", zero)]
        return [self._block("energy", (4,), values, "kinetic, potential (J), non-conservative power, base power (W)")]

    def outputs(self) -> list[Block]:
        self.energies()
        values = []
        for output in self.scene.outputs:
            with self.tape.block(f"output {output.name}"):
                values += [self.quantities.formula(formula) for formula in output.values]
        return [self._block("y", (len(values),), values, "named outputs, in order")]

    # -- assembly -----------------------------------------------------------------------------------------------------

    def system(self, terms: Sequence[str]) -> System:
        scene, makers = self.scene, {name: getattr(self, name) for name in TERMS}
        made = {name: self._function(name, makers[name]) for name in terms}
        timed = any(InputSymbol("t", 0) in self.tape.depends_on(function.refs) for function in made.values())
        functions = {name: self._pruned(function, timed) for name, function in made.items()}
        if scene.base is not None:
            law = base_law(self.algebra, scene.base, self.tree.parameters)
            size = sum(count for _, count, _ in BASE_LAYOUT)
            block = self._block("base", (size,), law, "base struct")
            functions["base"] = self._driver("base", "motion of the base at time t", block)
        if any(item.given for item in scene.inputs):
            values = [input_signal(self.quantities, item) for item in scene.inputs]
            block = self._block("u", (len(values),), values, "inputs")
            functions["inputs"] = self._driver("inputs", "inputs given by the scene", block)
        facts = self._facts()
        kept, dropped = kept_and_dropped(scene, self.tree, functions, facts)
        return System(
            name=scene.name, tape=self.tape, factors=tuple(link.factor for link in self.tree.links), functions=functions,
            parameters=tuple(Quantity(p.name, p.value, 1, p.unit, p.description) for p in scene.parameters if p.tunable),
            inputs=tuple(Quantity(i.name, 0.0, 1, i.unit, i.description) for i in scene.inputs),
            outputs=tuple(Quantity(o.name, 0.0, len(o.values), o.unit, o.description) for o in scene.outputs),
            bodies=tuple(body.name for body in scene.bodies),
            initial_q=tuple(value for link in self.tree.links for value in link.joint.initial_position),
            initial_v=tuple(value for link in self.tree.links for value in link.joint.initial_velocity),
            dof_parent=self.tree.dof_parents(), facts=facts, kept=kept, dropped=dropped, notes=scene.notes,
            description=scene.description, defaults=dict(vars(scene.simulation)),
        )  # fmt: skip

    def _facts(self) -> Facts:
        loads = [value.ref for value in self.applied()]
        live = self.tape.live(loads)
        mass = separated.mass_matrix(self.grouped, self.composites)
        return Facts(
            constant_mass=not any(s.block == "q" for s in self.tape.depends_on([e.ref for row in mass for e in row])),
            velocity_forces=any(symbol.block == "v" for symbol in self.tape.depends_on(loads)),
            smooth=not any(self.tape.op[node] in _ROUGH for node in live),
            moving_base=self.base.moving,
        )

    def _function(self, name: str, make: Callable[[], list[Block]]) -> Function:
        inputs, description = TERMS[name]
        return Function(name, description, inputs, tuple(make()))

    def _pruned(self, function: Function, timed: bool) -> Function:
        """Drop the input blocks that this scene does not have."""
        used = {symbol.block for symbol in self.tape.depends_on(function.refs)}
        absent = {
            "p": not any(parameter.tunable for parameter in self.scene.parameters),
            "t": not timed, "u": not self.scene.inputs, "base": not self.base.moving,
            "a": function.name in ("energy", "outputs") and "a" not in used,
        }  # fmt: skip
        inputs = tuple(block for block in INPUT_BLOCKS if block in function.inputs and not absent.get(block, False))
        return Function(function.name, function.description, inputs, function.outputs)

    def _driver(self, name: str, description: str, block: Block) -> Function:
        inputs = ("p", "t") if any(parameter.tunable for parameter in self.scene.parameters) else ("t",)
        return Function(name, description, inputs, (block,))

    def _vector(self, name: str, values: Sequence[Scalar], description: str) -> Block:
        return self._block(name, (len(values),), values, description)

    def _matrix(self, name: str, rows: Sequence[Sequence[Scalar]], description: str) -> Block:
        return self._block(name, (len(rows), len(rows)), [value for row in rows for value in row], description)

    def _block(self, name: str, shape: tuple[int, ...], values: Sequence[Scalar], description: str) -> Block:
        return Block(name, shape, tuple(ZERO if value.is_zero else value.ref for value in values), description)
