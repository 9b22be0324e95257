"""Linear model of a scene about any state, partials in its tunable parameters, and second derivatives along a direction
for second-order adjoints, by forward differentiation of recorded terms.

The linear model:

    M0 da + C0 dv + K0 dq + Rz dz = B0 du + E0 dw - B^T dlam         dzdot = Fq dq + Fv dv + Fz dz + Fu du + Fw dw

(Lieh 1994). dq is left-trivialised; u are inputs that a controller or a caller drives, w the given inputs and
the accelerations of the base. Time, parameters and the motion of the base are frozen.

Partials in the tunable parameters:

    d(M a + h + b - Q + B^T lam) = Rp dp        d zdot = Fp dp        d outputs = Yp dp
    d Phi = Phip dp        d(B v + Phi_t) = Zp dp        d(B a + g) = Ap dp

Time, q, v, a, z and the multipliers are held, and so are inputs that a controller or a caller drives. Inputs that the
scene gives and the motion of the base follow their laws, in which parameters may be: heights of roads, amplitudes.

Second derivatives of a weighted sum of equations and outputs along one direction d:

    g = d (w . (M a + h + b - Q + B^T lam, zdot, Phi, B v + Phi_t, B a + g, outputs)) / d (q, v, a, z, lam, p, u),
    Hd = dg along d.

g by one reverse sweep, its change along d by one forward sweep over that (Griewank and Walther, Evaluating Derivatives
(2008), section 5.4), so the cost is a small multiple of the cost of the equations for any number of variables. In q
both are left-trivialised: first the gradient, then its change along d; on rotations the two do not commute. Time is
held; given inputs and the base follow their laws in p, and u adds to the given inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.base.data import replace
from eomgen.mechanics.constraints.joints import joint_velocities
from eomgen.mechanics.describe import base_disturbances
from eomgen.mechanics.forces.symbols import input_signal
from eomgen.mechanics.kinematics.directions import Seeds, block_directions, configuration_directions
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.base import base_law
from eomgen.symbolic.calculus.partials import forward_partials, gradient_along, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import Block, SecondBlocks, base_place, second_blocks

#: Groups of columns: the letter of their blocks, and the quantities of the columns.
_OF_STATE = (("q", "dq, left-trivialised"), ("v", "dv"), ("a", "da"), ("z", "dz"), ("lam", "dlam"))


def linearization(derivation: Derivation) -> list[Block]:
    """Return the blocks of the linear model about any state: M0, C0, K0, B0, E0, then Rz, Fq, Fv, Fz, Fu, Fw. Dense, in
    the notation of this module. Matrices without columns or rows are left out."""
    tape, scene = derivation.tape, derivation.scene
    K, C, M = derivation.partials()
    blocks = [
        replace(M, name="M0", description="M: inertia matrix"),
        replace(C, name="C0", description="d(h + b - Q)/dv"),
        replace(K, name="K0", description="d(M a + h + b - Q + B^T lam)/dq, left-trivialised, a and lam held"),
    ]
    columns = InputDirections(derivation)
    with tape.block("influence of inputs and disturbances"):
        inertial = derivation.base_motion()[0].refs if base_disturbances(scene) else (ZERO,) * derivation.tree.nv
        forces = [x - Scalar(tape, b) for x, b in zip(derivation.applied_forces(), inertial, strict=True)]
        blocks += columns.of(forces, "B0", "E0", "d(Q - b)")
    blocks += derivation.internal_partials()
    with tape.block("influence of inputs and disturbances on internal states"):
        return blocks + columns.of(derivation.internal.rates, "Fu", "Fw", "d zdot")


def output_partials(derivation: Derivation) -> list[Block]:
    """Return the partials of the named outputs as blocks Yq (left-trivialised), Yv, Ya, Yz, Ylam, Yu, Yw. Blocks
    without columns are left out. Yu is by driven inputs, Yw by given inputs and accelerations of the base."""
    tape, tree = derivation.tape, derivation.tree
    values = [Scalar(tape, ref) for ref in derivation.outputs()[0].refs]
    multipliers = 0 if derivation.constraints is None else len(derivation.constraints.tangents)
    sizes = {"q": tree.nv, "v": tree.nv, "a": tree.nv, "z": len(derivation.scene.states), "lam": multipliers}
    blocks = []
    for block, differential in _OF_STATE:
        seeds = configuration_directions(tree) if block == "q" else block_directions(block, sizes[block])
        with tape.block(f"partials of outputs in {block}"):
            blocks += _matrix(derivation, values, seeds, sizes[block], f"Y{block}", f"d outputs / {differential}")
    with tape.block("partials of outputs in inputs and disturbances"):
        return blocks + InputDirections(derivation).of(values, "Yu", "Yw", "d outputs")


def acceleration_partials(derivation: Derivation) -> list[Block]:
    """Return the blocks Aq (left-trivialised) and Av, (rows, nv) each: partials of constraint accelerations B a + g in
    q and v, with g the ``constraint_bias`` and a held."""
    (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
    rows = constraint_accelerations(derivation, B, g)
    with derivation.tape.block("partials of the constraints' accelerations"):
        return _by_state(derivation, rows, ("Aq", "Av"), "d(B a + g)", "left-trivialised, a held")


def reaction_partials(derivation: Derivation) -> list[Block]:
    """Return the block N, (nv, nv), left-trivialised partials of B^T lam in q; then Np, partials in the tunable
    parameters. Np is left out if B does not depend on parameters."""
    calculus, nv = derivation.calculus(), derivation.tree.nv
    forces = calculus.forces()
    with derivation.tape.block("partials of the constraint forces"):
        entries = [value for row in calculus.by_configuration(forces) for value in row]
    blocks = [derivation.block("N", (nv, nv), entries, "d(B^T lam)/dq, left-trivialised, lam held")]
    partials = ParameterDirections(derivation)
    of_parameters = partials.of([value.ref for value in forces], "Np", "d(B^T lam)")
    return [*blocks, of_parameters] if set(of_parameters.refs) - {ZERO} else blocks


def constraint_acceleration(derivation: Derivation) -> list[Block]:
    """Return the block of constraint accelerations B a + g, (rows,), m/s^2 or 1/s^2, with g the ``constraint_bias``."""
    (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
    rows = constraint_accelerations(derivation, B, g)
    return [derivation.block("w_dot", (len(rows),), rows, "B a + g, rate of the velocity rows")]


def joint_velocity_partials(derivation: Derivation) -> list[Block]:
    """Return velocities, accelerations and partials of joints between absolute bodies, as blocks. Pv and Pq are
    partials of the velocities in v and q, Pav and Paq of the accelerations with the accelerations of bodies held; q is
    left-trivialised."""
    calculus = joint_velocities(derivation.scene, derivation.tree, derivation.quantities)
    nv, count = derivation.tree.nv, len(calculus.level)
    refs = tuple(entry.ref for row in calculus.jacobian() for entry in row)
    P = Block("Pv", (count, nv), refs, "d joint_v / dv")
    g = Block("g", (count,), tuple(value.ref for value in calculus.bias()))
    velocities, accelerations = calculus.velocity(), constraint_accelerations(derivation, P, g)
    blocks = [
        Block("joint_v", (count,), tuple(value.ref for value in velocities), "velocities of the joints"),
        Block("joint_a", (count,), tuple(value.ref for value in accelerations), "their time derivatives"),
        P,
    ]
    with derivation.tape.block("partials of the velocities of joints"):
        by_q = configuration_directions(derivation.tree)
        blocks += _matrix(derivation, velocities, by_q, nv, "Pq", "d joint_v / dq, left-trivialised")
        return blocks + _by_state(derivation, accelerations, ("Paq", "Pav"), "d joint_a", "left-trivialised, a held")


def constraint_accelerations(derivation: Derivation, B: Block, g: Block) -> list[Scalar]:
    """Return B a + g, (rows,), for blocks B, (rows, nv), and g, (rows,), with the inputs a of the tape."""
    tape, nv = derivation.tape, derivation.tree.nv
    a = [Scalar(tape, tape.input("a", k)) for k in range(nv)]
    rows = []
    for number, bias in enumerate(g.refs):
        row = Scalar(tape, bias)
        for ref, component in zip(B.refs[number * nv : (number + 1) * nv], a, strict=True):
            row = row + Scalar(tape, ref) * component
        rows.append(row)
    return rows


def _by_state(
    derivation: Derivation, values: Sequence[Scalar], names: tuple[str, str], numerator: str, held: str
) -> list[Block]:
    """Return the partials of values in q (left-trivialised) and in v as two blocks with the given names. ``numerator``
    and ``held`` are parts of the descriptions."""
    nv = derivation.tree.nv
    by_v = block_directions("v", nv)
    by_q = _matrix(
        derivation, values, configuration_directions(derivation.tree), nv, names[0], f"{numerator}/dq, {held}"
    )
    return by_q + _matrix(derivation, values, by_v, nv, names[1], f"{numerator}/dv")


class InputDirections:
    """Inputs and disturbances of a scene as directions of differentiation. Inputs are driven by a controller or a
    caller. Disturbances are inputs that the scene gives, then accelerations of the base."""

    def __init__(self, derivation: Derivation) -> None:
        scene = derivation.scene
        self.derivation = derivation
        inputs = list(enumerate(scene.inputs))
        driven, fixed = ([number for number, item in inputs if item.given == is_given] for is_given in (False, True))
        of_base = base_disturbances(scene)
        self.driven: Seeds = {InputSymbol("u", number): {k: ONE} for k, number in enumerate(driven)}
        self.disturbances: Seeds = {InputSymbol("u", number): {k: ONE} for k, number in enumerate(fixed)}
        components = [base_place(part) + k for part in ("omega_dot", "velocity_dot") for k in range(3)]
        accelerations = components[-len(of_base) :] if of_base else []
        for k, component in enumerate(accelerations):
            self.disturbances[InputSymbol("base", component)] = {len(fixed) + k: ONE}
        self.driven_names = ", ".join(scene.inputs[number].name for number in driven)
        self.disturbance_names = ", ".join((*(scene.inputs[number].name for number in fixed), *of_base))

    def of(self, values: Sequence[Scalar], of_inputs: str, of_disturbances: str, numerator: str) -> list[Block]:
        """Return the partials of values in driven inputs and in disturbances, as two blocks with the given names. A
        block without rows or columns is left out. ``numerator`` begins the descriptions."""
        driven = f"{numerator}/du, u: {self.driven_names}"
        disturbed = f"{numerator}/dw, w: {self.disturbance_names}"
        return [
            *_matrix(self.derivation, values, self.driven, len(self.driven), of_inputs, driven),
            *_matrix(self.derivation, values, self.disturbances, len(self.disturbances), of_disturbances, disturbed),
        ]


def _matrix(
    derivation: Derivation, values: Sequence[Scalar], seeds: Seeds, columns: int, name: str, description: str
) -> list[Block]:
    """Return the partials of values along the directions of seeds as one block; no block if the matrix is empty."""
    if not values or not columns:
        return []
    tangents = forward_partials(derivation.tape, [value.ref for value in values], seeds)
    refs = tuple(tangent.get(column, ZERO) for tangent in tangents for column in range(columns))
    return [Block(name, (len(values), columns), refs, description)]


def parameter_partials(derivation: Derivation) -> list[Block]:
    """Return blocks of partials in the tunable parameters: Rp, then Fp if there are internal states, then Phip, Zp and
    Ap if there are constraints; in the notation of this module."""
    partials = ParameterDirections(derivation)
    (r,) = derivation.residual()
    blocks = [partials.of(r.refs, "Rp", "d(M a + h + b - Q + B^T lam)")]
    if derivation.scene.states:
        rates = [rate.ref for rate in derivation.internal.rates]
        blocks.append(partials.of(rates, "Fp", "d zdot"))
    if derivation.constraints is not None:
        (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
        accelerations = [row.ref for row in constraint_accelerations(derivation, B, g)]
        blocks += [
            partials.of(derivation.constraint()[0].refs, "Phip", "d Phi"),
            partials.of(derivation.constraint_velocity()[0].refs, "Zp", "d(B v + Phi_t)"),
            partials.of(accelerations, "Ap", "d(B a + g)"),
        ]
    return blocks


def output_parameter_partials(derivation: Derivation) -> list[Block]:
    """Return Yp, the partials of the named outputs."""
    return [ParameterDirections(derivation).of(derivation.outputs()[0].refs, "Yp", "d outputs")]


class ParameterDirections:
    """Directions of differentiation along the tunable parameters of a scene, in order.

    Attributes
    ----------
    seeds : derivatives in the parameters: of the parameters, of inputs that the scene gives, and of the base struct
    """

    def __init__(self, derivation: Derivation) -> None:
        self.derivation = derivation
        self.names = [item.name for item in derivation.scene.parameters if item.tunable]
        self.seeds = block_directions("p", len(self.names))
        scene, quantities = derivation.scene, derivation.quantities
        with derivation.tape.block("partials of prescribed motion in the parameters"):
            fixed = [(number, item) for number, item in enumerate(scene.inputs) if item.given]
            self._follow("u", [number for number, _ in fixed], [input_signal(quantities, item) for _, item in fixed])
            if scene.base is not None:
                law = base_law(derivation.algebra, scene.base, derivation.tree.parameters)
                self._follow("base", range(len(law)), law)

    def _follow(self, block: str, numbers: Sequence[int], laws: Sequence[Scalar]) -> None:
        """Add to ``seeds`` the derivatives of components of an input block that follow the laws, recorded on the
        tape."""
        tangents = forward_partials(self.derivation.tape, [law.ref for law in laws], self.seeds)
        self.seeds |= {
            InputSymbol(block, number): tangent for number, tangent in zip(numbers, tangents, strict=True) if tangent
        }

    def of(self, refs: Sequence[int], name: str, numerator: str) -> Block:
        """Return the partials of values in the tunable parameters, (values, np), as a block of this name. ``numerator``
        begins the description."""
        tape = self.derivation.tape
        with tape.block(f"partials in the parameters: {numerator}"):
            tangents = forward_partials(tape, refs, self.seeds)
        columns = range(len(self.names))
        entries = tuple(tangent.get(column, ZERO) for tangent in tangents for column in columns)
        return Block(name, (len(refs), len(columns)), entries, f"{numerator}/dp, p: {', '.join(self.names)}")


def second_partials(derivation: Derivation) -> list[Block]:
    """Return the block Hd: the change along a direction of the gradient of a weighted sum of equations and outputs.
    Weights and direction are the inputs "weights" and "direction"; parts are in the order of
    ``SecondBlocks.direction``."""
    tape = derivation.tape
    values_by_name = _values(derivation)
    blocks = _blocks(derivation, values_by_name)
    values = [ref for name in blocks.weights for ref in values_by_name[name]]
    seeds, size = _directions(derivation, blocks), sum(blocks.direction.values())
    weights = [tape.input("weights", number) for number in range(len(values))]
    with tape.block("gradient of the weighted equations and outputs"):
        gradient = gradient_along(tape, values, weights, seeds, size)
    with tape.block("its change along the direction"):
        changes = jacobian_vector(tape, gradient, {key: _along(tape, tangent) for key, tangent in seeds.items()})
    description = (
        "change along d of the gradient of w . (residual, zdot, Phi, rates and accelerations of constraints, outputs)"
    )
    return [Block("Hd", (size,), tuple(changes), description)]


def _values(derivation: Derivation) -> dict[str, Sequence[Ref]]:
    """Return the references of the weighted quantities (residual, rates, constraints, outputs) by their names in
    ``SecondBlocks.weights``; empty for quantities that the scene does not have."""
    (residual,) = derivation.residual()
    result: dict[str, Sequence[Ref]] = {"r": residual.refs, **dict.fromkeys(("zdot", "Phi", "w", "wdot", "y"), ())}
    if derivation.scene.states:
        result["zdot"] = derivation.internal_rate()[0].refs
    if derivation.constraints is not None:
        result["Phi"], result["w"] = derivation.constraint()[0].refs, derivation.constraint_velocity()[0].refs
        (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
        result["wdot"] = [row.ref for row in constraint_accelerations(derivation, B, g)]
    if derivation.scene.outputs:
        result["y"] = derivation.outputs()[0].refs
    return result


def _blocks(derivation: Derivation, values: Mapping[str, Sequence[Ref]]) -> SecondBlocks:
    scene = derivation.scene
    return second_blocks(
        nv=derivation.tree.nv,
        nz=len(scene.states),
        nu=len(scene.inputs),
        holonomic=len(values["Phi"]),
        rows=len(values["w"]),
        outputs=len(values["y"]),
        parameters=sum(item.tunable for item in scene.parameters),
    )


def _directions(derivation: Derivation, blocks: SecondBlocks) -> Seeds:
    """Return the tangents of all arguments of the equations, with directions numbered as the components of Hd."""
    places = blocks.places("direction")
    seeds: Seeds = dict(configuration_directions(derivation.tree))
    for block in ("v", "a", "z", "lam"):
        seeds |= block_directions(block, places[block].stop - places[block].start, places[block].start)
    of_parameters = places["p"].start
    for key, tangent in ParameterDirections(derivation).seeds.items():
        seeds[key] = {of_parameters + direction: ref for direction, ref in tangent.items()}
    for k, index in enumerate(range(places["u"].start, places["u"].stop)):
        seeds[InputSymbol("u", k)] = {**seeds.get(InputSymbol("u", k), {}), index: ONE}
    return seeds


def _along(tape: Tape, tangent: Mapping[int, Ref]) -> Ref:
    """Return the change of a quantity along the direction d."""
    total = ZERO
    for direction, ref in tangent.items():
        total = tape.add(total, tape.mul(ref, tape.input("direction", direction)))
    return total
