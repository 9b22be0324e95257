"""The tape of one scene: its terms, each recorded at its first use, and the facts that decide which terms are recorded:
large, deep, ill-scaled."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import cached_property, reduce
from sys import float_info

from eomgen.base.data import replace
from eomgen.errors import ModelError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.constraints.beam_strains import section_multipliers, strain_rows
from eomgen.mechanics.constraints.joints import (
    AbsoluteQuantities,
    counted_angles,
    driven_rows,
    following_rows,
    joint_constraint,
)
from eomgen.mechanics.constraints.loops import rows_of_loops
from eomgen.mechanics.constraints.rows import ConstraintCalculus, ConstraintRow, constraint_rows, forces_at_points
from eomgen.mechanics.describe import extent
from eomgen.mechanics.dynamics import separated
from eomgen.mechanics.dynamics.elimination import loses_digits
from eomgen.mechanics.dynamics.energy import energies
from eomgen.mechanics.dynamics.partials import differentiated_partials, inertial_partials
from eomgen.mechanics.dynamics.separated import ReferenceEfforts, geometric, structural
from eomgen.mechanics.forces.applied import applied_loads, offered_by
from eomgen.mechanics.forces.internal_states import InternalStates, state_formulas
from eomgen.mechanics.forces.loads import Loads
from eomgen.mechanics.forces.section_loads import Fields, RecordedSectionLoads
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.bodies import accelerations, body_jacobians, poses, twists
from eomgen.mechanics.kinematics.directions import motion_directions
from eomgen.mechanics.kinematics.fields import AccelerationField, Wrench, centripetal, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.reactions import Reactions, TransmittedWrenches
from eomgen.mechanics.tree.absolute import build_absolute_tree
from eomgen.mechanics.tree.alike import is_irregular, joints_along_z, made_alike
from eomgen.mechanics.tree.base import base_state, resting_base
from eomgen.mechanics.tree.build import build_tree, group_inertias
from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, plus, scaled
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block
from eomgen.system.terms import TERMS

#: Up to so large a mean of the squared depths a tree counts as flat: bodies on the base have 15.
FLAT = 48


class Derivation:
    """Trees, loads and constraints of one scene, recorded on one tape. Methods named as terms return their output
    blocks.

    Parameters
    ----------
    without_rows : numbers of constraint rows to leave out
    disturbed : whether accelerations of the base are disturbances, which may differ from the law of the base

    Attributes
    ----------
    tree, grouped : with the bodies' own inertias, and with inertias grouped for fewer operations
    absolute : whether the scene has absolute coordinates
    prescribed, base : the prescribed motion of the base, and of the frame that carries the tree (the world if absolute)
    constraints : calculus of all constraint rows; None without rows
    patterns : (row, column) of the nonzeros of terms of nonzeros, by name of the term
    """

    def __init__(self, scene: Scene, without_rows: Sequence[int] = (), *, disturbed: bool = False) -> None:
        """Record the tree, the base, the kinematics, constraints and applied loads of a scene on a new tape. Raises
        ModelError without a moving joint."""
        self.scene = scene
        self.without_rows = without_rows
        self.tape = Tape()
        self.algebra = Algebra(self.tape)
        self.absolute = scene.coordinates == "absolute"
        if self.absolute:
            self.tree = build_absolute_tree(self.algebra, scene, scene.groups)
        else:
            self.tree = build_tree(self.algebra, scene)
        if not self.tree.links:
            raise ModelError(
                f"scene {scene.name!r} has no moving joint [E0509]",
                "add a revolute, prismatic, spherical or free joint",
            )
        self.grouped: Tree = group_inertias(self.tree)
        if not self.absolute and is_irregular(self.tree, self.grouped):
            self.tree = build_tree(self.algebra, scene, along_z=joints_along_z(scene))
            self.tree, self.grouped = made_alike(self.tree, group_inertias(self.tree))
        gravity = self.algebra.vector([self.constant(item) for item in scene.gravity])
        self.prescribed = base_state(self.algebra, scene, gravity, disturbed=disturbed)
        self.base = resting_base(self.algebra, gravity) if self.absolute else self.prescribed
        self.motion = self.base.motion()
        self.kinematics = Kinematics(self.tree, self.base, self.prescribed if self.absolute else None)
        made = AbsoluteQuantities if self.absolute else Quantities
        self.quantities: Quantities = made(scene, self.tree, self.kinematics, offered_by(scene))
        if not self.absolute:
            self.quantities.dynamics = ReferenceEfforts(scene, self.grouped, self.motion, self.quantities)
        self.quantities.machine, _ = extent(scene, self.algebra, self.constant)
        self.section_loads = RecordedSectionLoads(scene, self.quantities, self._section_multipliers, self._fields)
        self.quantities.section_loads = self.section_loads
        self.constraints = self._constraint_calculus()
        self.quantities.energies = self._energies_without_formulas()
        self.loads: Loads = applied_loads(scene, self.tree, self.quantities)
        self._energies: dict[str, Scalar] | None = None
        self.internal = InternalStates(scene, self.tree, self.quantities)
        self.quantities.reactions = Reactions(scene, self._transmitted_wrenches)
        self.patterns: dict[str, tuple[tuple[int, int], ...]] = {}
        self.inner_owners: tuple[int, ...] = ()
        self.composites = separated.composites(self.grouped)
        #: q and v at the start, as soon as they are known.
        self.start: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    def _constraint_calculus(self) -> ConstraintCalculus | None:
        items = list(self.scene.constraints)
        if self.absolute:
            items = [
                as_constraint for joint in self.scene.joints if (as_constraint := joint_constraint(joint)) is not None
            ] + items
        alike = rows_of_loops(self.quantities, items, self._generalized_forces) if self.absolute else {}
        rows = constraint_rows(self.quantities, items, alike)
        rows.holonomic += [*driven_rows(self.quantities), *strain_rows(self.quantities, self._generalized_forces)]
        if isinstance(self.quantities, AbsoluteQuantities):
            rows.holonomic[:0] = following_rows(self.quantities)
        rows = rows.without(self.without_rows)
        return ConstraintCalculus(self.tree, rows, self.prescribed) if rows.all else None

    def _section_multipliers(self, beam: Cosserat) -> list[list[Scalar]]:
        rows = None if self.constraints is None else self.constraints.rows
        return section_multipliers(self.quantities, rows, beam)

    def _fields(self) -> Fields:
        """Return a function from the number of a link, negative for the tree's carrier, to its acceleration field minus
        gravity."""
        of_links = total_fields(self.tree, self.motion, accelerations=True, gravity=True)
        base = self.kinematics.carrier.motion()
        start = plus(base.acceleration, scaled(-1.0, base.gravity))
        carrier = AccelerationField(start, base.alpha, centripetal(base.omega))
        return lambda link: of_links[link] if link >= 0 else carrier

    def _energies_without_formulas(self) -> dict[str, Scalar]:
        """Return the energies by name that formulas of forces and rates of states may read; empty if none reads an
        energy. Force elements by formula are left out, since they have no potential."""
        if not any(symbol.kind == "energy" for formula in state_formulas(self.scene) for symbol in symbols(formula)):
            return {}
        passive = (element.passive() for element in self.scene.elements)
        bare = replace(self.scene, elements=tuple(element for element in passive if element is not None))
        return energies(self.tree, self.kinematics, applied_loads(bare, self.tree, self.quantities), self.algebra.zero)

    def _transmitted_wrenches(self, fixed: Collection[str]) -> TransmittedWrenches:
        """Return the wrenches transmitted by joints and constraints. ``fixed`` are names of fixed joints with a
        requested reaction, which then stay separate links."""
        rows = None if self.constraints is None else self.constraints.rows
        tree, quantities, loads = self.tree, self.quantities, self.loads
        if fixed and not self.absolute:
            tree = build_tree(self.algebra, self.scene, fixed)
            quantities = Quantities(self.scene, tree, Kinematics(tree, self.base), offered_by(self.scene))
            quantities.energies = self._energies_without_formulas()
            loads = applied_loads(self.scene, tree, quantities)
        return TransmittedWrenches(self.scene, tree, quantities, self.motion, loads, rows)

    def constant(self, formula: Formula) -> Scalar:
        """Return a formula of parameters as a scalar on the tape."""
        return record(self.algebra, formula, lambda symbol: self.tree.parameters[symbol.name])

    # -- terms ------------------------------------------------------------------------------------------------------

    def mass(self) -> list[Block]:
        """Return the inertia matrix M, (nv, nv), kg, kg m or kg m^2 by the coordinates of row and column."""
        M = separated.mass_matrix(self.grouped, self.composites)
        return [self._matrix("M", M, "inertia matrix")]

    @cached_property
    def mass_rows(self) -> list[dict[int, Scalar]]:
        """The lower triangle of M row by row, by column, without structural zeros."""
        return separated.mass_rows(self.grouped, self.composites)

    def coupling(self) -> list[Block]:
        """Return h(q, v), (nv,): inertia forces quadratic in v, base at rest; N, or N m of angles."""
        return [self._vector("h", separated.coupling(self.grouped), "nonlinear coupling vector")]

    def applied_forces(self) -> list[Scalar]:
        """Return the generalized forces of all applied loads, (nv,), without gravity."""
        projected = self._generalized_forces(self.loads.wrenches, "applied forces")
        return [x + y for x, y in zip(projected, self.loads.efforts, strict=True)]

    def _generalized_forces(self, wrenches: Sequence[Wrench | None], label: str) -> list[Scalar]:
        """Return the generalized forces, (nv,), of a wrench for each link."""
        zero = (self.algebra.zero_vector, self.algebra.zero_vector)
        return separated.generalized_force(self.tree, [load if load is not None else zero for load in wrenches], label)

    def force(self) -> list[Block]:
        """Return Q, (nv,): gravity and all applied loads; N, or N m of angles."""
        weight = separated.gravity_force(self.grouped, self.motion.gravity, self.composites)
        Q = [x + y for x, y in zip(weight, self.applied_forces(), strict=True)]
        return [self._vector("Q", Q, "generalized force")]

    def base_motion(self) -> list[Block]:
        """Return b, (nv,): inertia forces of the prescribed motion of the base; N, or N m of angles."""
        return [self._vector("b", separated.base_motion(self.grouped, self.motion), "base-motion terms")]

    def inverse_dynamics(self) -> list[Block]:
        """Return tau = M a + h + b - Q, (nv,)."""
        return [self._vector("tau", self.inverse, "generalized force that the motion a needs")]

    def residual(self) -> list[Block]:
        """Return r = M a + h + b - Q + B^T lam, (nv,)."""
        r = self.inverse
        if self.constraints is not None:
            reactions = self.constraints.forces()
            r = [x + y for x, y in zip(r, reactions, strict=True)]
        return [self._vector("r", r, "residual")]

    @cached_property
    def inverse(self) -> list[Scalar]:
        """M a + h + b - Q, (nv,): the generalized forces needed for a in addition to the applied forces."""
        tau = separated.inverse_dynamics(self.grouped, self.motion, self.loads.wrenches)
        return [x - y for x, y in zip(tau, self.loads.efforts, strict=True)]

    @property
    def free_columns(self) -> bool:
        """Whether articulated bodies can eliminate the columns of joints one by one: links are rigid, and no joint
        follows another joint."""
        return self.tree.rigid and not self.tree.following

    @cached_property
    def ill_scaled(self) -> bool:
        """Whether the elimination of M loses digits that articulated bodies keep, with the default parameters. False in
        absolute coordinates, with constraints, and for deep or elastic trees."""
        if self.absolute or self.has_constraints or self.tree.deep or not self.free_columns:
            return False
        M = self.mass_rows
        starts = {joint.name: joint.initial_position for joint in self.scene.joints}
        start: list[float] = []
        for factor in self.tree.factors:  # scenes made without a file may lack a start
            neutral = (float(factor.group != "R"), *(0.0,) * (factor.q_size - 1))
            start += starts[factor.name] or neutral
        parameters = [parameter.value for parameter in self.scene.parameters if parameter.tunable]
        return loses_digits(self.grouped, M, start, parameters)

    @property
    def sparse(self) -> bool:
        """Whether matrices of a large tree are recorded as nonzeros, and whole only on request: without constraints, or
        if some constraint rows are recorded as loops."""
        constraints = self.constraints
        return constraints is None or any(row.group is not None for row in constraints.rows.all)

    @property
    def whole_matrices(self) -> frozenset[str]:
        """The names of terms of whole (dense) matrices that are recorded without a request: all unless the tree is
        large."""
        every = frozenset(term.name for term in TERMS.values() if term.quadratic)
        if not self.tree.large or not self.sparse:
            return every
        of_rows = frozenset({"constraint_jacobian", "velocity_partials"} if self.has_constraints else ())
        if not self.absolute:
            return of_rows
        # runs of more bodies are checked by the nonzeros of M
        return of_rows | {"mass"} if of_rows and self.tree.nv <= 300 else frozenset()

    @property
    def flat(self) -> bool:
        """Whether few velocity components depend on earlier components."""
        depths = self.tree.depths()
        return sum(depth * depth for depth in depths) <= FLAT * len(depths)

    @property
    def has_constraints(self) -> bool:
        """Whether there are constraints."""
        return self.constraints is not None

    @property
    def has_carried_links(self) -> bool:
        """Whether links are carried by other links: then the recursion has additional unknowns."""
        return any(link.parent != ROOT for link in self.tree.links)

    def partials(self) -> list[Block]:
        """Return K, C, M, (nv, nv) each: partials of the residual in q (left-trivialised), v and a."""
        return [*self._partials]

    @cached_property
    def _partials(self) -> tuple[Block, ...]:
        """The blocks K, C and M, (nv, nv) each: partials of the residual in q (left-trivialised), v and a."""
        nv = self.tree.nv
        K, C, M = (inertial_partials if self.tree.rigid else differentiated_partials)(self.grouped, self.motion)
        seeds, applied = motion_directions(self.tree, "v"), self.applied_forces()
        with self.tape.block("partials of applied forces"):
            tangents = forward_partials(self.tape, [value.ref for value in applied], seeds)
        for row, tangent in enumerate(tangents):
            for direction, ref in tangent.items():
                block, column = (K, direction) if direction < nv else (C, direction - nv)
                block[row][column] = block[row][column] - Scalar(self.tape, ref)
        if self.constraints is not None:
            reactions = self.constraints.forces()
            with self.tape.block("partials of constraint forces"):
                for row, changes in enumerate(self.constraints.by_configuration(reactions)):
                    K[row] = [x if y.is_zero else x + y for x, y in zip(K[row], changes, strict=True)]
        return (
            self._matrix("K", K, "d residual / dq, left-trivialised"),
            self._matrix("C", C, "d residual / dv"),
            self._matrix("M", M, "d residual / da"),
        )

    def poses(self) -> list[Block]:
        """Return quaternion (body to world axes) and position in the world, m, of each body, (bodies, 7)."""
        values = poses(self.scene, self.tree, self.kinematics)
        return [self._body_block("pose", (7,), values, "quaternion (w, x, y, z) and position")]

    def twists(self) -> list[Block]:
        """Return the inertial twist of each body in body axes, angular first, (bodies, 6); rad/s, m/s."""
        values = twists(self.scene, self.tree, self.kinematics)
        return [self._body_block("twist", (6,), values, "angular and linear velocity")]

    def accelerations(self) -> list[Block]:
        """Return angular acceleration and acceleration of the origin of each body, in body axes, (bodies, 6)."""
        values = accelerations(self.scene, self.tree, self.kinematics)
        return [self._body_block("acceleration", (6,), values, "angular acceleration and acceleration of the origin")]

    def jacobians(self) -> list[Block]:
        """Return the twist of each body per unit of v, base at rest, in body axes, (bodies, 6, nv)."""
        values = body_jacobians(self.scene, self.tree)
        description = "twist against the base per unit of v, angular first,"
        return [self._body_block("J", (6, self.tree.nv), values, description)]

    def energies(self) -> dict[str, Scalar]:
        """Return the scalars ``kinetic``, ``potential``, ``total``, J, and ``power``, ``base_power``, W, of the
        inertial motion. Recorded at the first call; formulas of outputs and events read these energies from then on."""
        if self._energies is None:
            drivers = self.constraints.driving_power() if self.constraints is not None else self.algebra.zero
            moving = self.constraints is not None and self.kinematics.carrier.moving
            held = forces_at_points(self.quantities, self.calculus().rows) if moving else []
            self._energies = energies(self.tree, self.kinematics, self.loads, drivers, held)
            self.quantities.energies = self._energies
        return self._energies

    def energy(self) -> list[Block]:
        """Return the energies and powers as one block, (4,)."""
        energies_by_name = self.energies()
        values = [energies_by_name[name] for name in ("kinetic", "potential", "power", "base_power")]
        description = "kinetic, potential (J), non-conservative power, power of base and drivers (W)"
        return [self.block("energy", (4,), values, description)]

    def elastic(self) -> list[Block]:
        """Return the blocks K, D and K_geo, (nv, nv) each: structural stiffness and damping of elastic bodies, and
        geometric stiffness for the present motion."""
        K, D = structural(self.tree, self.quantities)
        geometric_stiffness = geometric(self.tree, self.motion, self.loads.wrenches)
        return [
            self._matrix("K", K, "structural stiffness"),
            self._matrix("D", D, "structural damping"),
            self._matrix("K_geo", geometric_stiffness, "geometric stiffness for the present motion"),
        ]

    def outputs(self) -> list[Block]:
        """Return the block y with the components of all outputs of the scene, in order and SI units."""
        self.energies()
        values = []
        for output in self.scene.outputs:
            with self.tape.block(f"output {output.name}"):
                values += [self.quantities.formula(formula) for formula in output.values]
        counts = (f"{o.name} [{len(o.values)}]" if len(o.values) > 1 else o.name for o in self.scene.outputs)
        return [self.block("y", (len(values),), values, ", ".join(counts))]

    def joint_angles(self) -> list[Block]:
        """Return the blocks of counted joint angles, rad, and of their rates, rad/s, (angles,) each."""
        angles, rates = (
            [self.quantities(Symbol(kind, *angle)) for angle in counted_angles(self.scene)] for kind in "qv"
        )
        return [
            self._vector("turned", angles, "over turns, within half a turn of the references in q, rad"),
            self._vector("turned_rate", rates, "rad/s"),
        ]

    # -- internal states ----------------------------------------------------------------------------------------------

    def internal_rate(self) -> list[Block]:
        """Return zdot, (nz,)."""
        return [self._vector("zdot", self.internal.rates, "rates of the internal states")]

    def internal_partials(self) -> list[Block]:
        """Return the blocks Rz, Fq, Fv, Fz: partials of the residual in z, and of zdot in q (left-trivialised), v and
        z. Empty without internal states."""
        return self.internal.partials(self.applied_forces()) if self.scene.states else []

    # -- constraints --------------------------------------------------------------------------------------------------

    def calculus(self) -> ConstraintCalculus:
        """Return the calculus of the constraints. Raises ModelError if there are none."""
        if self.constraints is None:
            raise ModelError(
                f"scene {self.scene.name!r} has no constraints [E0510]", "add one, or absolute coordinates"
            )
        return self.constraints

    def constraint(self) -> list[Block]:
        """Return Phi, (holonomic,), m or 1; zero on the constraints. Raises ModelError without constraints."""
        return [self._vector("Phi", [row.value for row in self.calculus().rows.holonomic], "holonomic constraints")]

    def constraint_velocity(self) -> list[Block]:
        """Return w = B v + Phi_t, then the rows at velocity level; m/s or 1/s."""
        return [self._vector("w", self.calculus().velocity(), "B v + Phi_t, then constraints at velocity level")]

    def constraint_bias(self) -> list[Block]:
        """Return g, (rows,), with d/dt w = B vdot + g."""
        return [self._vector("g", self.calculus().bias(), "rate of the velocity rows at vdot = 0")]

    def constraint_jacobian(self) -> list[Block]:
        """Return B, (rows, nv), left-trivialised."""
        return [self._matrix("B", self.calculus().jacobian(), "constraint Jacobian, left-trivialised")]

    def constraint_size(self) -> list[Block]:
        """Return the blocks ``size`` and ``extent``, (rows,) each: scales by which violations of constraint rows are
        judged. The size is the sum of the magnitudes of a row's summands, at least the extent for rows in m; the
        extent, m, is the largest displacement of the joined points per radian."""
        rows = self.calculus().rows.all
        extents = self._extents(rows)
        sizes = [
            # a body held at its origin has summands that are only rounding, and moves by rounding of the machine
            row.size if row.unit == "1" or scale is row.extent else self.algebra.call(Op.MAX, row.size, scale)
            for row, scale in zip(rows, extents, strict=True)
        ]
        return [
            self._vector(
                "size",
                sizes,
                "sum of the magnitudes of the summands of each row, in the unit of the row, no less than the extent of"
                " rows in m; m of m/s",
            ),
            self._vector("extent", extents, "largest displacement of the joined points of each row per radian, m"),
        ]

    def _extents(self, rows: Sequence[ConstraintRow]) -> list[Scalar]:
        """Return the extent of each equation, m. An extent of 0 or of rounding size is replaced by the largest extent
        among equations and bodies, or by the path length if all are 0."""
        machine = reduce(
            lambda first, second: self.algebra.call(Op.MAX, first, second),
            [row.extent for row in rows if not row.extent.is_zero],
            self.quantities.machine,
        )
        if machine.is_zero:
            return [row.path_length for row in rows]
        rounding = machine * math.sqrt(float_info.epsilon)
        extents = []
        for row in rows:
            there = self.algebra.call(Op.LT, rounding, row.extent)
            known = there.constant
            extents.append(
                self.algebra.select(there, row.extent, machine) if known is None else row.extent if known else machine
            )
        return extents

    def velocity_partials(self) -> list[Block]:
        """Return Z = dw/dq, (rows, nv), left-trivialised."""
        return [self._velocity_partials]

    @cached_property
    def _velocity_partials(self) -> Block:
        """Z, recorded once, as the partials are."""
        rows = self.calculus().by_configuration(self.calculus().velocity())
        return self._matrix("Z", rows, "left-trivialised partials in q of the velocity rows")

    def _vector(self, name: str, values: Sequence[Scalar], description: str) -> Block:
        return self.block(name, (len(values),), values, description)

    def _matrix(self, name: str, rows: Sequence[Sequence[Scalar]], description: str) -> Block:
        return self.block(name, (len(rows), self.tree.nv), [value for row in rows for value in row], description)

    def _body_block(self, name: str, shape: tuple[int, ...], values: Sequence[Scalar], description: str) -> Block:
        names = [body.name for body in self.scene.bodies]
        return self.block(name, (len(names), *shape), values, f"{description} of {', '.join(names)}")

    def block(self, name: str, shape: tuple[int, ...], values: Sequence[Scalar], description: str) -> Block:
        return Block(name, shape, tuple([value.ref for value in values]), description)
