"""First and second derivatives of a term in all of its arguments, as nonzeros: Jacobian, and Hessian of a weighted sum.

With w the weights and f the values of the term, the Hessian is the symmetric matrix of second derivatives of w . f at
the origin of local coordinates: q exp(dq) in each factor of the configuration, and sums in v, a, z, lam, u, p and t. By
one reverse sweep, and forward sweeps over that (Griewank and Walther, Evaluating Derivatives (2008), section 5.4), or
for inertia and weight by composite bodies, if that takes fewer operations.

Derivatives X_i along the left-trivialised directions of a rotation or a pose do not commute, X_i X_j - X_j X_i = [X_i,
X_j]. In the coordinates of the exponential, f(q exp(d)) = f + d_i X_i f + 1/2 d_i d_j X_i X_j f + ..., so the Hessian
is the symmetric part, 1/2 (X_i X_j + X_j X_i) f. Directions of different factors, and of other arguments, commute.

Columns are in the order of ``ARGUMENTS``. A moving base follows its law in t and p; all inputs are independent, also
inputs that the scene gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.mechanics.dynamics.elimination import solve_tree
from eomgen.mechanics.dynamics.partials import Change, WorkHessian, base_change
from eomgen.mechanics.dynamics.separated import inverse_dynamics
from eomgen.mechanics.forces.symbols import input_signal
from eomgen.mechanics.kinematics.directions import Seeds, block_directions, configuration_directions
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.implicit_step import Entries, nonzeros
from eomgen.mechanics.tree.base import BaseMotion, base_law
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.calculus.partials import forward_partials, gradient_along
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar, minus
from eomgen.symbolic.tape import ZERO, Ref
from eomgen.symbolic.zeros import vanishing
from eomgen.system.system import Block
from eomgen.system.terms import ARGUMENTS, TERMS


def derivative_blocks(derivation: Derivation, name: str, blocks: Sequence[Block]) -> list[Block]:
    """Return the block of nonzeros of the term ``name``, the Jacobian or the Hessian of the values in ``blocks``.
    Nonzeros are column by column, rows ascending: the order of compressed columns. Their (row, column) are entered into
    ``derivation.patterns``. Of several ways to differentiate the one with the fewest operations is taken."""
    values, second = [ref for block in blocks for ref in block.refs], name.endswith("_hessian")
    arguments = Arguments(derivation)
    ways = []
    if TERMS[name].differentiated == "forward_dynamics" and _implicit(derivation):
        implicit = _ForwardDynamics(arguments, values)
        ways.append(implicit.hessian() if second else implicit.jacobian())
    if not ways or derivation.tree.nv <= 4:  # of few components both ways are tried
        ways.append(arguments.hessian(values) if second else arguments.jacobian(values))
    tape = derivation.tape
    entries = min(ways, key=lambda way: tape.counts(way.values()).weight)
    zero = vanishing(tape, entries.values())
    by_columns = {(column, row): ref for (row, column), ref in entries.items() if ref not in zero}
    block = nonzeros(derivation, name, by_columns, name)
    derivation.patterns[name] = tuple((row, column) for column, row in derivation.patterns[name])
    return [block]


def input_derivatives(derivation: Derivation) -> list[Block]:
    """Return the block of nonzeros of the Jacobian of the inputs that the scene gives, row by row. Columns are the
    tunable parameters, then the time."""
    tape, scene = derivation.tape, derivation.scene
    tunable = sum(item.tunable for item in scene.parameters)
    seeds = block_directions("p", tunable) | block_directions("t", 1, tunable)
    with tape.block("derivatives of the inputs that the scene gives"):
        values = [input_signal(derivation.quantities, item).ref for item in scene.inputs]
        tangents = forward_partials(tape, values, seeds)
    entries = {(row, column): ref for row, tangent in enumerate(tangents) for column, ref in tangent.items()}
    return [nonzeros(derivation, "input_derivatives", entries, "input_derivatives")]


def _implicit(derivation: Derivation) -> bool:
    """Return whether derivatives of forward dynamics follow from derivatives of inverse dynamics, by solving with M."""
    return not (derivation.ill_scaled or derivation.tree.deep or _loops(derivation))


def _loops(derivation: Derivation) -> bool:
    tape = derivation.tape
    return any(tape.op[node] is Op.MAP for node in tape.live([value.ref for value in derivation.inverse]))


class _ForwardDynamics:
    """Derivatives of vdot = f(x) by the equations G(x, f(x)) = 0 of inverse dynamics.

    First derivatives: M f_x = -G_x. Second ones, with mu = -M^-1 weights and E = (1, f_x): weights . f_xx = E^T (mu .
    G_..) E, in which a is vdot; G is linear in a. With B = M^-1 (mu . G_ax), mu . G_xa f_x = -B^T G_x: solves for the
    arguments that move M alone.

    Parameters
    ----------
    vdot : references of the accelerations
    """

    def __init__(self, arguments: Arguments, vdot: Sequence[Ref]) -> None:
        derivation, tape, nv = arguments.derivation, arguments.derivation.tape, arguments.derivation.tree.nv
        self.arguments, self.vdot = arguments, vdot
        self.accelerations = {tape.input("a", k): ref for k, ref in enumerate(vdot)}
        self.of_a = range(arguments.firsts["a"], arguments.firsts["a"] + nv)
        self.equations = [value.ref for value in derivation.inverse]
        partials = arguments.jacobian(self.equations)
        places = [entry for entry in partials if entry[1] not in self.of_a]
        refs = splice(tape, tape, [partials[entry] for entry in places], {}, known=self.accelerations)
        #: G_x by column and row.
        self.columns: dict[int, dict[int, Ref]] = {}
        for (row, column), ref in zip(places, refs, strict=True):
            self.columns.setdefault(column, {})[row] = ref

    def jacobian(self) -> Entries:
        """Return the nonzeros of the Jacobian of vdot in all arguments by (row, column), by a solution with M for each
        argument."""
        with self.arguments.derivation.tape.block("solves of the mass matrix for each argument"):
            return {
                (row, column): ref
                for column, right in sorted(self.columns.items())
                for row, ref in self.solve({row: -ref for row, ref in right.items()}).items()
            }

    def solve(self, right: Mapping[int, Ref]) -> dict[int, Ref]:
        """Return the nonzeros of M^-1 right by row; ``right`` holds the nonzeros of a vector, (nv,), by row."""
        derivation = self.arguments.derivation
        values = [Scalar(derivation.tape, right.get(row, ZERO)) for row in range(derivation.tree.nv)]
        solution = solve_tree(derivation.mass_rows, values, derivation.tree.dof_parents())
        return {row: value.ref for row, value in enumerate(solution) if not value.is_zero}

    def hessian(self) -> Entries:
        """Return the nonzeros of the lower triangle of the Hessian of weights . vdot by (row, column)."""
        tape, result = self.arguments.derivation.tape, dict[tuple[int, int], Ref]()
        weights = [tape.input("weights", k) for k in range(len(self.vdot))]
        with tape.block("weights of the equations"):
            multipliers = self.solve({row: -ref for row, ref in enumerate(weights)})
        whole = self.arguments.hessian(self.equations)
        new = {**self.accelerations, **{ref: multipliers.get(k, ZERO) for k, ref in enumerate(weights)}}
        refs = splice(tape, tape, list(whole.values()), {}, known=new)
        of_a: dict[int, dict[int, Ref]] = {}
        first = self.of_a.start
        for (row, column), ref in zip(whole, refs, strict=True):
            if row in self.of_a:
                of_a.setdefault(column, {})[row - first] = -ref
            elif column in self.of_a:
                of_a.setdefault(row, {})[column - first] = -ref
            else:
                result[row, column] = ref
        with tape.block("second derivatives through the accelerations"):
            for x, right in sorted(of_a.items()):
                solution = self.solve(right)
                for y, partials in sorted(self.columns.items()):
                    total = ZERO
                    for k, ref in solution.items():
                        if k in partials:
                            total = tape.add(total, tape.mul(ref, partials[k]))
                    entry = max(x, y), min(x, y)
                    twice = tape.mul(tape.constant(2.0), total) if x == y else total
                    result[entry] = tape.add(result.get(entry, ZERO), twice)
        return {entry: ref for entry, ref in result.items() if abs(ref) != ZERO}


class Arguments:
    """Directions of differentiation in all arguments, numbered in the order of ``ARGUMENTS``.

    Attributes
    ----------
    seeds : tangents of all quantities that the arguments move
    size : number of directions
    firsts : first direction of each argument
    """

    def __init__(self, derivation: Derivation) -> None:
        """Number the directions of all arguments, and seed them through the motion of the base."""
        tape, scene, tree = derivation.tape, derivation.scene, derivation.tree
        self.derivation = derivation
        rows = 0 if derivation.constraints is None else len(derivation.constraints.rows.all)
        tunable = sum(item.tunable for item in scene.parameters)
        sizes = {"q": tree.nv, "v": tree.nv, "a": tree.nv, "z": len(scene.states), "lam": rows}
        sizes |= {"u": len(scene.inputs), "p": tunable, "t": 1}
        self.seeds: Seeds = dict(configuration_directions(tree))
        self.firsts, self.size, law = {"q": 0}, tree.nv, dict[Ref | InputSymbol, Tangent]()
        for block in ARGUMENTS[1:]:
            seeds = block_directions(block, sizes[block], self.size)
            self.seeds |= seeds
            law |= seeds if block in ("p", "t") else {}
            self.firsts[block], self.size = self.size, self.size + sizes[block]
        if scene.base is not None:
            with tape.block("partials of the motion of the base"):
                values = [value.ref for value in base_law(derivation.algebra, scene.base, tree.parameters)]
                tangents = forward_partials(tape, values, law)
            self.seeds |= {InputSymbol("base", k): tangent for k, tangent in enumerate(tangents) if tangent}

    def jacobian(self, values: Sequence[Ref]) -> Entries:
        """Return the nonzeros of the Jacobian of values by (row, column). Partials of inverse dynamics in q, v and a
        come from recursion, if that takes fewer operations."""
        tape = self.derivation.tape
        with tape.block("Jacobian in all arguments"):
            tangents = forward_partials(tape, values, self.seeds)
        entries = {(row, column): ref for row, tangent in enumerate(tangents) for column, ref in tangent.items()}
        entries = {entry: ref for entry, ref in entries.items() if abs(ref) != ZERO}
        known = self._partials(values)
        ways = [entries, {entry: known.get(entry, ref) for entry, ref in entries.items()}]
        return min(ways, key=lambda way: tape.counts(way.values()).weight)

    def _partials(self, values: Sequence[Ref]) -> Entries:
        """Return the partials of inverse dynamics in q, v and a by recursion, as {(row, column): reference}. Empty if
        ``values`` are other values than inverse dynamics, with constraints, and for large trees."""
        derivation = self.derivation
        inverse = [value.ref for value in derivation.inverse]
        if list(values) != inverse or derivation.has_constraints or derivation.tree.large:
            return {}
        nv, entries = derivation.tree.nv, dict[tuple[int, int], Ref]()
        for block, name in zip(derivation.partials(), ("q", "v", "a"), strict=True):
            for index, ref in enumerate(block.refs):
                row, column = divmod(index, nv)
                entries[row, self.firsts[name] + column] = ref
        return entries

    def hessian(self, values: Sequence[Ref]) -> Entries:
        """Return the nonzeros of the lower triangle of the Hessian of weights . values by (row, column). Of
        differentiation operation by operation and by composite bodies, the way with fewer operations is taken."""
        tape, entries = self.derivation.tape, self.by_operations(values)
        known = self.by_composites(values)
        mixed = {entry: known.get(entry, ref) for entry, ref in entries.items()}
        ways = [entries, {entry: ref for entry, ref in mixed.items() if abs(ref) != ZERO}]
        return min(ways, key=lambda way: tape.counts(way.values()).weight)

    def by_composites(self, values: Sequence[Ref]) -> Entries:
        """Return the entries of the Hessian of inverse dynamics or the residual in q, v and a, by (row, column). Mixed
        entries with arguments that move the base alone are included. Inertia and weight are differentiated by composite
        bodies, all else operation by operation. Empty for other ``values``, and for large or elastic trees."""
        derivation, tape = self.derivation, self.derivation.tape
        if derivation.tree.large or not derivation.tree.rigid:
            return {}
        others = [-value for value in derivation.applied_forces()]
        if derivation.constraints is not None:
            others = [x + y for x, y in zip(others, derivation.constraints.forces(), strict=True)]
            if list(values) != list(derivation.residual()[0].refs):
                return {}
        elif list(values) != [value.ref for value in derivation.inverse]:
            return {}
        nv = derivation.tree.nv
        weights = [Scalar(tape, tape.input("weights", number)) for number in range(nv)]
        moving = self._base_changes()
        work = WorkHessian(derivation.grouped, derivation.motion, weights, moving)
        entries = dict(work.entries)
        for entry, ref in self.by_operations([value.ref for value in others]).items():
            entries[entry] = entries.get(entry, derivation.algebra.zero) + Scalar(tape, ref)
        rows = [*range(3 * nv), *moving]
        triangle = ((row, column) for row in rows for column in range(min(row + 1, 3 * nv)))
        return {entry: entries[entry].ref if entry in entries else ZERO for entry in triangle}

    def _base_changes(self) -> dict[int, Change]:
        """Return the changes of the base's motion by t and parameters, by number of the argument. Parameters on which
        inertia and geometry of the tree depend are left out."""
        derivation, tape, motion = self.derivation, self.derivation.tape, self.derivation.motion
        start = minus(motion.acceleration, motion.gravity)
        refs = [value.ref for vector in (motion.omega, motion.alpha, start) for value in vector]
        tangents = forward_partials(tape, refs, self.seeds)
        x = [Scalar(tape, tape.input("base", k)) for k in range(12)]
        any_base = BaseMotion(*((x[k], x[k + 1], x[k + 2]) for k in (0, 3, 6, 9)))
        tau = inverse_dynamics(derivation.grouped, any_base, [None] * len(derivation.grouped.links))
        numbers = set(tape.live([value.ref for value in tau]))
        known = {
            self.firsts["p"] + k for k in range(self.firsts["t"] - self.firsts["p"]) if tape.input("p", k) in numbers
        }
        changes: dict[int, Change] = {}
        for argument in sorted({argument for tangent in tangents for argument in tangent} - known):
            parts = [Scalar(tape, tangent.get(argument, ZERO)) for tangent in tangents]
            omega, alpha, acceleration = ((parts[k], parts[k + 1], parts[k + 2]) for k in (0, 3, 6))
            changes[argument] = base_change(motion, omega, alpha, acceleration)
        return changes

    def by_operations(self, values: Sequence[Ref]) -> Entries:
        """Return the nonzeros of the lower triangle of the Hessian of weights . values by (row, column). Each operation
        is differentiated. Within rotations and poses, both orders of differentiation are averaged."""
        tape, entries = self.derivation.tape, dict[tuple[int, int], Ref]()
        weights = [tape.input("weights", number) for number in range(len(values))]
        with tape.block("gradient of the weighted sum"):
            gradient = gradient_along(tape, values, weights, self.seeds, self.size)
        with tape.block("Hessian of the weighted sum"):
            changes = forward_partials(tape, gradient, self.seeds)
            for row, tangent in enumerate(changes):
                entries |= {(row, column): ref for column, ref in tangent.items() if column <= row}
            half = tape.constant(0.5)
            for factor in self.derivation.tree.factors:
                columns = range(factor.v_start, factor.v_start + factor.v_size)
                for row, column in ((i, j) for i in columns for j in columns if j < i and factor.group != "R"):
                    there, back = (changes[i].get(j, ZERO) for i, j in ((row, column), (column, row)))
                    entries[row, column] = tape.mul(half, tape.add(there, back))
        return {entry: ref for entry, ref in entries.items() if abs(ref) != ZERO}
