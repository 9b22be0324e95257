"""Linear model of a scene about any state, by forward differentiation of recorded terms.

    M0 da + C0 dv + K0 dq + Rz dz = B0 du + E0 dw - B^T dlam         dzdot = Fq dq + Fv dv + Fz dz + Fu du + Fw dw

(Lieh 1994). dq is left-trivialised; u are inputs that a controller or a caller drives, w the given inputs and
the accelerations of the base. Time, parameters and the motion of the base are frozen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from eomgen.mechanics.constraints.joint_velocities import joint_velocities
from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.describe import base_disturbances
from eomgen.mechanics.kinematics.directions import Seeds, configuration_directions
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO
from eomgen.system.system import BASE_LAYOUT, Block

#: Groups of columns: the letter of their blocks, and the quantities of the columns.
_OF_STATE = (("q", "dq, left-trivialised"), ("v", "dv"), ("a", "da"), ("z", "dz"), ("lam", "dlam"))


def linearization(derivation: Derivation) -> list[Block]:
    """Return the nonempty ones of M0, C0, K0, B0, E0 and the matrices of internal states."""
    tape, scene = derivation.tape, derivation.scene
    K, C, M = derivation.partials()
    blocks = [
        replace(M, name="M0", description="M: inertia matrix"),
        replace(C, name="C0", description="d(h + b - Q)/dv"),
        replace(K, name="K0", description="d(M a + h + b - Q + B^T lam)/dq, left-trivialised, a and lam held"),
    ]
    columns = Columns(derivation)
    with tape.block("influence of inputs and disturbances"):
        inertial = derivation.base_motion()[0].refs if base_disturbances(scene) else (ZERO,) * derivation.tree.nv
        forces = [x - Scalar(tape, b) for x, b in zip(derivation.applied(), inertial, strict=True)]
        blocks += columns.of(forces, "B0", "E0", "d(Q - b)")
    blocks += derivation.internal_partials()
    with tape.block("influence of inputs and disturbances on internal states"):
        return blocks + columns.of(derivation.internal.rates(), "Fu", "Fw", "d zdot")


def output_partials(derivation: Derivation) -> list[Block]:
    """Return the nonempty partials of the named outputs among Yq, Yv, Ya, Yz, Ylam, Yu, Yw."""
    tape, tree = derivation.tape, derivation.tree
    values = [Scalar(tape, ref) for ref in derivation.outputs()[0].refs]
    multipliers = 0 if derivation.constraints is None else len(derivation.constraints.tangents)
    sizes = {"q": tree.nv, "v": tree.nv, "a": tree.nv, "z": len(derivation.scene.states), "lam": multipliers}
    blocks = []
    for block, differential in _OF_STATE:
        plain: Seeds = {InputSymbol(block, k): {k: ONE} for k in range(sizes[block])}
        seeds = configuration_directions(tree) if block == "q" else plain
        with tape.block(f"partials of outputs in {block}"):
            blocks += _matrix(derivation, values, seeds, sizes[block], f"Y{block}", f"d outputs / {differential}")
    with tape.block("partials of outputs in inputs and disturbances"):
        return blocks + Columns(derivation).of(values, "Yu", "Yw", "d outputs")


def acceleration_partials(derivation: Derivation) -> list[Block]:
    """Return Aq (left-trivialised) and Av, partials of constraint accelerations B a + g, g the ``constraint_bias``."""
    (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
    rows = constraint_accelerations(derivation, B, g)
    with derivation.tape.block("partials of the constraints' accelerations"):
        return _by_state(derivation, rows, ("Aq", "Av"), "d(B a + g)", "left-trivialised, a held")


def joint_velocity_partials(derivation: Derivation) -> list[Block]:
    """Return joint velocities and accelerations of absolute bodies, and their partials Pv, Pq, Pav, Paq."""
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
    """Return B a + g."""
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
    """Return the partials of values in q and in v."""
    nv = derivation.tree.nv
    by_v: Seeds = {InputSymbol("v", k): {k: ONE} for k in range(nv)}
    by_q = _matrix(
        derivation, values, configuration_directions(derivation.tree), nv, names[0], f"{numerator}/dq, {held}"
    )
    return by_q + _matrix(derivation, values, by_v, nv, names[1], f"{numerator}/dv")


class Columns:
    """Inputs and disturbances of a scene as directions of differentiation."""

    def __init__(self, derivation: Derivation) -> None:
        scene = derivation.scene
        self.derivation = derivation
        inputs = list(enumerate(scene.inputs))
        driven, given = ([number for number, item in inputs if item.given == is_given] for is_given in (False, True))
        of_base = base_disturbances(scene)
        self.driven: Seeds = {InputSymbol("u", number): {k: ONE} for k, number in enumerate(driven)}
        self.disturbances: Seeds = {InputSymbol("u", number): {k: ONE} for k, number in enumerate(given)}
        accelerations = _accelerations_of_base()[-len(of_base) :] if of_base else []
        for k, component in enumerate(accelerations):
            self.disturbances[InputSymbol("base", component)] = {len(given) + k: ONE}
        self.driven_names = ", ".join(scene.inputs[number].name for number in driven)
        self.disturbance_names = ", ".join((*(scene.inputs[number].name for number in given), *of_base))

    def of(self, values: Sequence[Scalar], of_inputs: str, of_disturbances: str, numerator: str) -> list[Block]:
        """Return the partials of values in inputs and in disturbances, as two named blocks."""
        driven = f"{numerator}/du, u: {self.driven_names}"
        disturbed = f"{numerator}/dw, w: {self.disturbance_names}"
        return [
            *_matrix(self.derivation, values, self.driven, len(self.driven), of_inputs, driven),
            *_matrix(self.derivation, values, self.disturbances, len(self.disturbances), of_disturbances, disturbed),
        ]


def _accelerations_of_base() -> list[int]:
    """Return the offsets of the angular and then the linear acceleration in the base struct."""
    components, start = {}, 0
    for name, size, _ in BASE_LAYOUT:
        components[name], start = range(start, start + size), start + size
    return [*components["omega_dot"], *components["velocity_dot"]]


def _matrix(
    derivation: Derivation, values: Sequence[Scalar], seeds: Seeds, columns: int, name: str, description: str
) -> list[Block]:
    """Return the partials of values along the directions of seeds as one block; none if it would be empty."""
    if not values or not columns:
        return []
    tangents = forward_partials(derivation.tape, [value.ref for value in values], seeds)
    refs = tuple(tangent.get(column, ZERO) for tangent in tangents for column in range(columns))
    return [Block(name, (len(values), columns), refs, description)]
