"""Claims of partials in inputs, disturbances, states and tunable parameters: of the equations, of outputs, of
constraints; and of the regressor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.base.data import replace
from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    Directions,
    Engine,
    Space,
    Value,
    along_motion,
    column,
    fixed,
    jacobian,
    output,
)
from eomgen.system.description import Description, component_names
from eomgen.system.system import BASE_SIZE, System

FAMILY = "linear model"


def linear_claims(space: Space, engine: Engine, system: System, description: Description) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    claims: list[Claim] = []
    residual, rate = ("residual", "r"), ("internal_rate", "zdot")
    if "linearization" in engine:
        of = {
            "M0": (residual, "a"),
            "C0": (residual, "v"),
            "K0": (residual, "q"),
            "Rz": (residual, "z"),
            "Fq": (rate, "q"),
            "Fv": (rate, "v"),
            "Fz": (rate, "z"),
        }
        claims += _of_states(space, system, "linearization", of)
        driven = {"B0": (residual, -1.0), "Fu": (rate, 1.0)}
        disturbed = {"E0": (residual, -1.0), "Fw": (rate, 1.0)}
        claims += _of_drives(space, system, description, "linearization", driven, disturbed)
    if "acceleration_partials" in engine:
        claims += _of_rows(space, system)
    if "joint_velocities" in engine:
        claims += _of_joints(space, system, description)
    if "output_partials" in engine:
        y = ("outputs", "y")
        of = {f"Y{block}": (y, block) for block in ("q", "v", "a", "z", "lam")}
        claims += _of_states(space, system, "output_partials", of)
        claims += _of_drives(space, system, description, "output_partials", {"Yu": (y, 1.0)}, {"Yw": (y, 1.0)})
    return claims


def _named(system: System, function: str) -> set[str]:
    return {block.name for block in system.functions[function].outputs if block.refs}


def _rows(space: Space, system: System, function: str) -> tuple[str, ...]:
    if function == "outputs":
        return tuple(f"{y.name}[{k}]" if y.size > 1 else y.name for y in system.outputs for k in range(y.size))
    return space.rows["z" if function == "internal_rate" else "v"]


def _of_states(space: Space, system: System, term: str, of: Mapping[str, tuple[tuple[str, str], str]]) -> list[Claim]:
    there = _named(system, term)
    return [
        jacobian(space, FAMILY, term, name, source, block, _rows(space, system, source[0]))
        for name, (source, block) in of.items()
        if name in there
    ]


def _of_drives(
    space: Space,
    system: System,
    description: Description,
    term: str,
    driven: Mapping[str, tuple[tuple[str, str], float]],
    disturbed: Mapping[str, tuple[tuple[str, str], float]],
) -> list[Claim]:
    """Return the claims about partials in inputs: free inputs, and disturbances (given inputs, base accelerations)."""
    there, nu = _named(system, term), system.nu
    given = [number for number, item in enumerate(description.inputs) if item.given]
    free = [number for number, item in enumerate(description.inputs) if not item.given]
    of_base, by_input = description.base, np.eye(nu)
    free_directions = {"u": by_input[free]} if free else {}
    outside = np.zeros((len(given) + len(of_base), nu))
    outside[np.arange(len(given)), given] = 1.0
    accelerations = np.zeros((len(outside), BASE_SIZE))
    last = accelerations.shape[1]
    accelerations[len(given) :, last - len(of_base) :] = np.eye(len(of_base))
    disturbances: dict[str, Array] = {"u": outside} if nu and given else {}
    disturbances |= {"base": accelerations} if of_base else {}
    claims = []
    for entries, rates, columns in (
        (driven, free_directions, description.driven),
        (disturbed, disturbances, description.disturbances),
    ):
        for name, (source, sign) in entries.items():
            if name in there:
                meaning = f"{'-' if sign < 0 else ''}d {source[1]} / d{'u' if entries is driven else 'w'}"
                claims.append(
                    Claim(
                        f"{term}.{name}",
                        meaning,
                        FAMILY,
                        output(term, name),
                        source=_times(sign, output(*source)),
                        directions=fixed(rates),
                        rows=_rows(space, system, source[0]),
                        columns=columns,
                        functions=(source[0],),
                    )
                )
    return claims


def _times(sign: float, of: Value) -> Value:
    return lambda engine, state: sign * of(engine, state)


def _of_rows(space: Space, system: System) -> list[Claim]:
    """Return Aq and Av, partials of B a + g, the accelerations of the constraints."""

    def rows(engine: Engine, state: Blocks) -> Array:
        B = engine("constraint_jacobian", state)["B"]
        return np.asarray((B @ state["a"][..., np.newaxis])[..., 0] + engine("constraint_bias", state)["g"])

    return [
        _of_accelerations(name, rows, block, space.along[block], space.rows["lam"])
        for name, block in (("Aq", "q"), ("Av", "v"))
        if name in _named(system, "acceleration_partials")
    ]


def _of_joints(space: Space, system: System, description: Description) -> list[Claim]:
    """Return the claims of the velocities of joints: partials, rates, and partials of rates."""
    term, names = (
        "joint_velocities",
        [name for f in description.joints for name in component_names("", f.name, f.v_size)],
    )
    v, a = (term, "joint_v"), (term, "joint_a")
    there = _named(system, term)

    def speed(_: Engine, state: Blocks) -> Array:
        """Return the rounding of partials that cancel, for any remainder."""
        return np.asarray(np.max(np.abs(state["v"]), axis=-1))

    def turning(_: Engine, state: Blocks) -> Array:
        return np.asarray(np.max(np.abs(state["a"]), axis=-1) + np.max(np.abs(state["v"]), axis=-1) ** 2)

    partials = (("Pv", v, "v", None), ("Pq", v, "q", speed), ("Pav", a, "v", speed), ("Paq", a, "q", turning))
    claims = [
        jacobian(space, FAMILY, term, name, source, block, names, size=scale)
        for name, source, block, scale in partials
        if name in there
    ]
    return [
        *claims,
        Claim(
            f"{term}.joint_a",
            "d joint_v / dt",
            FAMILY,
            lambda engine, state: column(engine(term, state)["joint_a"]),
            source=output(*v),
            directions=along_motion(("q", "v"), ("v", "a")),
            rows=tuple(names),
            functions=(term,),
        ),
    ]


def _of_accelerations(name: str, rows: Value, block: str, along: Directions, names: Sequence[str]) -> Claim:
    return Claim(
        f"acceleration_partials.{name}",
        f"d (B a + g) / d{block}",
        FAMILY,
        lambda engine, state: np.asarray(engine("acceleration_partials", state)[name] @ along.matrix),
        source=rows,
        directions=lambda _: {block: along.matrix.T},
        rows=tuple(names),
        columns=along.names,
        functions=("constraint_jacobian", "constraint_bias"),
    )


_PARAMETERS = "parameters"
#: Endings of columns that dissipate.
_FRICTION = (".damping", ".coulomb", ".static")


def parameter_claims(space: Space, engine: Engine, system: System, description: Description) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    claims: list[Claim] = []
    rows = space.rows
    if "parameter_partials" in engine:
        sources = {
            "Rp": (("residual", "r"), rows["v"]),
            "Fp": (("internal_rate", "zdot"), rows["z"]),
            "Phip": (("constraint", "Phi"), rows["lam"][: space.holonomic]),
            "Zp": (("constraint_velocity", "w"), rows["lam"]),
            "Ap": (("constraint_bias", "g"), rows["lam"]),
        }
        for block in system.functions["parameter_partials"].outputs:
            source, names = sources[block.name]
            claim = jacobian(space, _PARAMETERS, "parameter_partials", block.name, source, "p", names)
            if block.name == "Ap":
                functions = ("constraint_jacobian", "constraint_bias")
                claim = replace(claim, meaning="d (B a + g) / dp", source=_accelerations, functions=functions)
            claims.append(claim)
    for block in system.functions["reaction_partials"].outputs if "reaction_partials" in engine else ():
        argument = "q" if block.name == "N" else "p"
        claim = jacobian(space, _PARAMETERS, "reaction_partials", block.name, ("residual", "r"), argument, rows["v"])
        meaning = f"d (B^T lam) / d{argument}"
        claims.append(replace(claim, meaning=meaning, source=_constraint_forces, functions=("constraint_jacobian",)))
    if "input_derivatives" in engine:
        claims.append(_input_jacobian(space, system))
    if "regressor" in engine and "regressor_parameters" in engine:
        claims.append(_of_regressor(rows["v"]))
        if "base" not in engine:
            claims.append(_power(description))
    if "output_parameter_partials" in engine:
        names = tuple(f"{y.name}[{k}]" if y.size > 1 else y.name for y in system.outputs for k in range(y.size))
        claims.append(jacobian(space, _PARAMETERS, "output_parameter_partials", "Yp", ("outputs", "y"), "p", names))
    return claims


def _of_regressor(rows: tuple[str, ...]) -> Claim:
    def tau(engine: Engine, state: Blocks) -> Array:
        result, pi = engine("regressor", state), engine("regressor_parameters", state)["pi"]
        return np.asarray(result["Y"] @ pi[..., np.newaxis] + column(result["tau0"]))

    def size(engine: Engine, state: Blocks) -> Array:
        """Return the scale of cancellation: summands of tau are larger than the sum."""
        result, pi = engine("regressor", state), engine("regressor_parameters", state)["pi"]
        summands = np.abs(result["Y"]) @ np.abs(pi[..., np.newaxis]) + np.abs(column(result["tau0"]))
        return np.asarray(np.max(summands, axis=(-2, -1)))

    return Claim(
        "regressor.Y",
        "Y pi + tau0 = tau",
        _PARAMETERS,
        tau,
        second=lambda engine, state: column(engine("inverse_dynamics", state)["tau"]),
        second_name="inverse dynamics",
        size=size,
        rows=rows,
    )


def _power(description: Description) -> Claim:
    """Return the claim of each column alone: the power of a column is the rate of its share of kinetic energy, base at
    rest."""
    result = [
        (k, item.name)
        for k, item in enumerate(description.linear_parameters)
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
        _PARAMETERS,
        power,
        source=energy,
        directions=along_motion(("q", "v"), ("v", "a")),
        rows=tuple(name for _, name in result),
        functions=("regressor",),
    )


def _input_jacobian(space: Space, system: System) -> Claim:
    """Return the claim of the Jacobian of the inputs that the scene gives in its parameters and the time."""
    along, term = space.along["p"], "input_derivatives"
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
        _PARAMETERS,
        value,
        source=output("inputs", "u"),
        directions=lambda state: {  # a scene without parameters has no block p
            block: by for block, by in (("p", matrix.T[:, :-1]), ("t", matrix.T[:, -1:])) if block in state
        },
        rows=tuple(item.name for item in system.inputs),
        columns=(*along.names, "t"),
        functions=("inputs",),
    )


def _constraint_forces(engine: Engine, state: Blocks) -> Array:
    """Return B^T lam, the generalized forces of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((np.swapaxes(B, -1, -2) @ state["lam"][..., np.newaxis])[..., 0])


def _accelerations(engine: Engine, state: Blocks) -> Array:
    """Return B a + g, the accelerations of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((B @ state["a"][..., np.newaxis])[..., 0] + engine("constraint_bias", state)["g"])
