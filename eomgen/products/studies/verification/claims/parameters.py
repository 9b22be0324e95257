"""Claims of partials in the tunable parameters: of the equations, of constraints, of outputs; and of the regressor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim, Space, along_motion, column, jacobian
from eomgen.products.studies.verification.engines import Array, Blocks, Engine
from eomgen.system.description import Description
from eomgen.system.system import System

FAMILY = "parameters"
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
            claim = jacobian(space, FAMILY, "parameter_partials", block.name, source, "p", names)
            if block.name == "Ap":
                functions = ("constraint_jacobian", "constraint_bias")
                claim = replace(claim, meaning="d (B a + g) / dp", source=_accelerations, functions=functions)
            claims.append(claim)
    if "regressor" in engine and "regressor_parameters" in engine:
        claims.append(_of_regressor(rows["v"]))
        if "base" not in engine:
            claims.append(_power(description))
    if "output_parameter_partials" in engine:
        names = tuple(f"{y.name}[{k}]" if y.size > 1 else y.name for y in system.outputs for k in range(y.size))
        claims.append(jacobian(space, FAMILY, "output_parameter_partials", "Yp", ("outputs", "y"), "p", names))
    return claims


def _of_regressor(rows: tuple[str, ...]) -> Claim:
    def tau(engine: Engine, state: Blocks) -> Array:
        result, pi = engine("regressor", state), engine("regressor_parameters", state)["pi"]
        return np.asarray(result["Y"] @ pi[..., np.newaxis] + column(result["tau0"]))

    def size(engine: Engine, state: Blocks) -> Array:
        """Return the scale of cancellation: summands of tau are larger than their sum."""
        result, pi = engine("regressor", state), engine("regressor_parameters", state)["pi"]
        summands = np.abs(result["Y"]) @ np.abs(pi[..., np.newaxis]) + np.abs(column(result["tau0"]))
        return np.asarray(np.max(summands, axis=(-2, -1)))

    return Claim(
        "regressor.Y",
        "Y pi + tau0 = tau",
        FAMILY,
        tau,
        second=lambda engine, state: column(engine("inverse_dynamics", state)["tau"]),
        second_name="inverse dynamics",
        size=size,
        rows=rows,
    )


def _power(description: Description) -> Claim:
    """Return the claim of each column alone: its power is the rate of its share of kinetic energy, base at rest."""
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
        "v Y = d (v Y(q, 0, v) / 2) / dt, gravity apart",
        FAMILY,
        power,
        source=energy,
        directions=along_motion(("q", "v"), ("v", "a")),
        rows=tuple(name for _, name in result),
        functions=("regressor",),
    )


def _accelerations(engine: Engine, state: Blocks) -> Array:
    """Return B a + g, the accelerations of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((B @ state["a"][..., np.newaxis])[..., 0] + engine("constraint_bias", state)["g"])
