"""Claims of linear models: partials in inputs, disturbances and states, of outputs and constraint accelerations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.products.studies.verification.claims.claim import (
    Claim,
    Directions,
    Space,
    Value,
    along_motion,
    column,
    fixed,
    jacobian,
    output,
)
from eomgen.products.studies.verification.engines import Array, Blocks, Engine
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
    """Return the claims of partials in driven inputs, and in given inputs with the base's accelerations."""
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
    """Return the claims of the velocities of joints: their partials, their rates, and the partials of these."""
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
