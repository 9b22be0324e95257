"""Claims on the regressor, and on partials in inputs, disturbances, states and tunable parameters, for equations,
outputs and constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Second,
    Space,
    along_motion,
    column,
    constant_directions,
    jacobian,
)
from eomgen.system.description import component_names
from eomgen.system.system import BASE_SIZE, System

_RESIDUAL, _RATE, _OUTPUTS = (
    ClaimOutput("residual", "r"),
    ClaimOutput("internal_rate", "zdot"),
    ClaimOutput("outputs", "y"),
)
#: Terms with matrices of partials: the function and the block of each.
_STATES: Mapping[str, Mapping[str, tuple[ClaimOutput, str]]] = {
    "linearization": {
        **{"M0": (_RESIDUAL, "a"), "C0": (_RESIDUAL, "v"), "K0": (_RESIDUAL, "q"), "Rz": (_RESIDUAL, "z")},
        **{f"F{block}": (_RATE, block) for block in "qvz"},
    },
    "output_partials": {f"Y{block}": (_OUTPUTS, block) for block in ("q", "v", "a", "z", "lam")},
}
#: The same in free inputs (u) and in disturbances (w): the function and the sign of each.
_DRIVES: Mapping[str, Mapping[str, tuple[ClaimOutput, str, float]]] = {
    "linearization": {
        **{"B0": (_RESIDUAL, "u", -1.0), "Fu": (_RATE, "u", 1.0)},
        **{"E0": (_RESIDUAL, "w", -1.0), "Fw": (_RATE, "w", 1.0)},
    },
    "output_partials": {"Yu": (_OUTPUTS, "u", 1.0), "Yw": (_OUTPUTS, "w", 1.0)},
}


def linear_claims(space: Space) -> list[Claim]:
    """Return the claims on partials of residual, outputs, constraint accelerations and joint velocities in states and
    inputs. Claims belong to terms that the model has."""
    claims: list[Claim] = []
    if space.has("linearization"):
        claims += _state_claims(space, "linearization") + _input_claims(space, "linearization")
    if space.has("acceleration_partials"):
        claims += [
            _acceleration_claim(space, "acceleration_partials", name, block)
            for name, block in (("Aq", "q"), ("Av", "v"))
            if name in _output_names(space.system, "acceleration_partials")
        ]
    if space.has("joint_velocities"):
        claims += _joint_velocities(space)
    if space.has("output_partials"):
        claims += _state_claims(space, "output_partials") + _input_claims(space, "output_partials")
    return claims


def _output_names(system: System, function: str) -> set[str]:
    return {block.name for block in system.functions[function].outputs if block.refs}


def _rows(space: Space, function: str) -> tuple[str, ...]:
    if function == "outputs":
        outputs = space.system.outputs
        return tuple(f"{y.name}[{k}]" if y.size > 1 else y.name for y in outputs for k in range(y.size))
    return space.rows["z" if function == "internal_rate" else "v"]


def _state_claims(space: Space, term: str) -> list[Claim]:
    there = _output_names(space.system, term)
    return [
        jacobian(space, ClaimOutput(term, name), source, block, _rows(space, source.function))
        for name, (source, block) in _STATES[term].items()
        if name in there
    ]


def _input_claims(space: Space, term: str) -> list[Claim]:
    """Return the claims on partials of a term in free inputs, and in disturbances: given inputs and base
    accelerations."""
    description, nu = space.description, space.system.nu
    prescribed = [number for number, item in enumerate(description.inputs) if item.given]
    free = [number for number, item in enumerate(description.inputs) if not item.given]
    of_base = len(description.base)
    outside, accelerations = np.zeros((len(prescribed) + of_base, nu)), np.zeros((len(prescribed) + of_base, BASE_SIZE))
    outside[np.arange(len(prescribed)), prescribed] = 1.0
    accelerations[len(prescribed) :, BASE_SIZE - of_base :] = np.eye(of_base)
    disturbances: dict[str, Array] = {"u": outside} if nu and prescribed else {}
    disturbances |= {"base": accelerations} if of_base else {}
    rates = {"u": {"u": np.eye(nu)[free]} if free else {}, "w": disturbances}
    columns = {"u": description.driven, "w": description.disturbances}
    there = _output_names(space.system, term)
    return [
        Claim(
            f"{term}.{name}",
            f"{'-' if sign < 0 else ''}d {source.entry} / d{kind}",
            ClaimOutput(term, name),
            source=sign * source,
            directions=constant_directions(rates[kind]),
            rows=_rows(space, source.function),
            columns=columns[kind],
        )
        for name, (source, kind, sign) in _DRIVES[term].items()
        if name in there
    ]


def _joint_velocities(space: Space) -> list[Claim]:
    """Return the claims on velocities of joints between absolute bodies: partials, accelerations, partials of these."""
    term, joints = "joint_velocities", space.description.joints
    names = tuple(name for f in joints for name in component_names("", f.name, f.v_size))
    v, a = ClaimOutput(term, "joint_v"), ClaimOutput(term, "joint_a")
    there = _output_names(space.system, term)

    def speed(_: Engine, state: Blocks) -> Array:
        """Return the rounding of partials that cancel, for any remainder."""
        return np.asarray(np.max(np.abs(state["v"]), axis=-1))

    def turning(_: Engine, state: Blocks) -> Array:
        return np.asarray(np.max(np.abs(state["a"]), axis=-1) + np.max(np.abs(state["v"]), axis=-1) ** 2)

    partials = (("Pv", v, "v", None), ("Pq", v, "q", speed), ("Pav", a, "v", speed), ("Paq", a, "q", turning))
    motion = along_motion(space.engine, "q", "v")
    return [
        *(
            jacobian(space, ClaimOutput(term, name), source, block, names, size=scale)
            for name, source, block, scale in partials
            if name in there
        ),
        Claim(f"{term}.joint_a", "d joint_v / dt", a.column, source=v, directions=motion, rows=names),
    ]


#: Endings of columns that dissipate.
_FRICTION = (".damping", ".coulomb", ".static")


def parameter_claims(space: Space) -> list[Claim]:
    """Return the claims on partials in tunable parameters, on constraint forces, on laws of inputs and on the
    regressor. Claims belong to terms that the model has."""
    claims: list[Claim] = []
    rows, system = space.rows, space.system
    if space.has("parameter_partials"):
        term, sources = (
            "parameter_partials",
            {
                "Rp": (_RESIDUAL, rows["v"]),
                "Fp": (_RATE, rows["z"]),
                "Phip": (ClaimOutput("constraint", "Phi"), rows["lam"][: system.holonomic]),
                "Zp": (ClaimOutput("constraint_velocity", "w"), rows["lam"]),
            },
        )
        for name in (block.name for block in system.functions[term].outputs):
            claims.append(
                _acceleration_claim(space, term, name, "p")
                if name == "Ap"
                else jacobian(space, ClaimOutput(term, name), sources[name][0], "p", sources[name][1])
            )
    for block in system.functions["reaction_partials"].outputs if space.has("reaction_partials") else ():
        argument = "q" if block.name == "N" else "p"
        claims.append(
            jacobian(
                space,
                ClaimOutput("reaction_partials", block.name),
                _constraint_forces,
                argument,
                rows["v"],
                meaning=f"d (B^T lam) / d{argument}",
                functions=("constraint_jacobian",),
            )
        )
    if space.has("input_derivatives"):
        claims.append(_input_jacobian(space))
    if space.has("regressor", "regressor_parameters"):
        claims.append(_regressor_claim(rows["v"]))
        if not space.has("base"):
            claims.append(_power(space))
    if space.has("output_parameter_partials"):
        term, y = "output_parameter_partials", _OUTPUTS
        claims.append(jacobian(space, ClaimOutput(term, "Yp"), y, "p", _rows(space, y.function)))
    return claims


def _regressor_claim(rows: tuple[str, ...]) -> Claim:
    """Return the claim that Y pi + tau0 equals the generalized forces of inverse dynamics."""

    def sum_with(engine: Engine, state: Blocks, part: Callable[[Array], Array]) -> Array:
        result, pi = engine("regressor", state), engine("regressor_parameters", state)["pi"]
        return np.asarray(part(result["Y"]) @ part(column(pi)) + part(column(result["tau0"])))

    return Claim(
        "regressor.Y",
        "Y pi + tau0 = tau",
        lambda engine, state: sum_with(engine, state, np.asarray),
        second=Second("inverse dynamics", ClaimOutput("inverse_dynamics", "tau").column),
        # summands of tau are larger than the sum
        size=lambda engine, state: np.max(sum_with(engine, state, np.abs), axis=(-2, -1)),
        rows=rows,
    )


def _power(space: Space) -> Claim:
    """Return the claim that the power of each regressor column is the rate of its share of kinetic energy, with the
    base at rest."""
    result = [
        (k, item.name)
        for k, item in enumerate(space.description.linear_parameters)
        if not item.name.partition("[")[0].endswith(_FRICTION)
    ]
    columns = [k for k, _ in result]

    def inertial(engine: Engine, state: Blocks, v: Array, a: Array) -> Array:
        """Return Y of a motion minus Y at rest, which is gravity's part."""
        moving, resting = ({**state, "v": v, "a": a}, {**state, "v": 0.0 * v, "a": 0.0 * a})
        return np.asarray((engine("regressor", moving)["Y"] - engine("regressor", resting)["Y"])[..., columns])

    def energy(engine: Engine, state: Blocks) -> Array:
        v = state["v"]
        return np.asarray(0.5 * np.einsum("...i,...ip->...p", v, inertial(engine, state, 0.0 * v, v)))

    def power(engine: Engine, state: Blocks) -> Array:
        v = state["v"]
        return column(np.einsum("...i,...ip->...p", v, inertial(engine, state, v, state["a"])))

    return Claim(
        "regressor.Y, power",
        "v Y = d (v Y(q, 0, v) / 2) / dt, without gravity",
        power,
        source=energy,
        directions=along_motion(space.engine, "q", "v"),
        rows=tuple(name for _, name in result),
        functions=("regressor",),
    )


def _input_jacobian(space: Space) -> Claim:
    """Return the claim that ``input_derivatives`` is the Jacobian of the inputs' laws in parameters and time, (nu, np +
    1)."""
    along, term, system = space.along["p"], "input_derivatives", space.system
    matrix = np.pad(along.matrix, ((0, 1), (0, 1)))
    matrix[-1, -1] = 1.0

    def value(engine: Engine, state: Blocks) -> Array:
        values = engine(term, state)[term]
        full = np.zeros((*values.shape[:-1], len(system.inputs), len(matrix)), values.dtype)
        full[(..., *np.transpose(system.patterns[term]))] = values
        return np.asarray(full @ matrix)

    return Claim(
        f"{term}.{term}",
        "d u / d(p, t)",
        value,
        source=ClaimOutput("inputs", "u"),
        directions=lambda state: {  # a scene without parameters has no block p
            block: by for block, by in (("p", matrix.T[:, :-1]), ("t", matrix.T[:, -1:])) if block in state
        },
        rows=tuple(item.name for item in system.inputs),
        columns=(*along.names, "t"),
    )


def _constraint_forces(engine: Engine, state: Blocks) -> Array:
    """Return B^T lam, the generalized forces of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((np.swapaxes(B, -1, -2) @ state["lam"][..., np.newaxis])[..., 0])


def _acceleration_claim(space: Space, term: str, name: str, block: str) -> Claim:
    """Return the claim that output `name` of a term has the partials of B a + g, the constraints' accelerations, in a
    block."""
    return jacobian(
        space,
        ClaimOutput(term, name),
        _accelerations,
        block,
        space.rows["lam"],
        meaning=f"d (B a + g) / d{block}",
        functions=("constraint_jacobian", "constraint_bias"),
    )


def _accelerations(engine: Engine, state: Blocks) -> Array:
    """Return B a + g, the accelerations of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((B @ state["a"][..., np.newaxis])[..., 0] + engine("constraint_bias", state)["g"])
