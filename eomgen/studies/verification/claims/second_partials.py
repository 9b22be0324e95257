"""Claim of the second derivatives: the gradient of the weighted equations and outputs, made of first partials, changes
along the state's direction by Hd."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from eomgen.studies.verification.claims.claim import Claim, Space, column
from eomgen.studies.verification.engines import Array, Blocks, Engine
from eomgen.system.system import System

#: Terms that the gradient takes where they are there.
_FIRST = (
    *("partials", "internal_partials", "constraint_jacobian", "velocity_partials", "acceleration_partials"),
    *("output_partials", "parameter_partials", "output_parameter_partials"),
)


def second_claims(space: Space, engine: Engine, system: System) -> list[Claim]:
    """Return the claim, where the engine has first partials of all."""
    if "second_partials" not in engine or "partials" not in engine:
        return []
    rows = space.rows
    sizes = {"q": system.nv, "v": system.nv, "a": system.nv, "z": system.nz, "lam": len(system.multipliers)}
    sizes["p"] = len(system.parameters)

    def gradient(engine: Engine, state: Blocks) -> Array:
        """Return the gradient in q (left-trivialised), v, a, z, lam and p, (..., components)."""
        found = {name: array for term in _FIRST if term in engine for name, array in engine(term, state).items()}
        ends = np.cumsum([system.nv, system.nz, system.holonomic, len(system.multipliers), len(system.multipliers)])
        of = dict(zip(("r", "zdot", "Phi", "w", "wdot", "y"), np.split(state["weights"], ends, axis=-1), strict=True))
        batch = state["weights"].shape[:-1]
        parts = []
        for block, size in sizes.items():
            total = np.zeros((*batch, size))
            for weight, matrix in _rows(block, found, system.holonomic):
                total = total + (of[weight][..., np.newaxis, :] @ matrix)[..., 0, :]
            parts.append(total)
        return np.concatenate(parts, axis=-1)

    def direction(state: Blocks) -> dict[str, Array]:
        parts = np.split(state["direction"], np.cumsum(list(sizes.values()))[:-1], axis=-1)
        return {block: part[..., np.newaxis, :] for block, part in zip(sizes, parts, strict=True) if sizes[block]}

    of_state = [f"{block} {name}" for block in ("q", "v", "a") for name in rows["v"]]
    names = (*of_state, *rows.get("z", ()), *rows.get("lam", ()), *(item.name for item in system.parameters))
    return [
        Claim(
            "second_partials.Hd",
            "d gradient / d direction",
            "parameters",
            lambda engine, state: column(engine("second_partials", state)["Hd"]),
            source=gradient,
            directions=direction,
            rows=names,
            functions=("partials",),
            sided=True,
        )
    ]


def _rows(block: str, found: Blocks, holonomic: int) -> Iterator[tuple[str, Array]]:
    """Yield what is weighted, and its partials in a block."""
    places = {
        "q": {"r": "K", "zdot": "Fq", "w": "Z", "wdot": "Aq", "y": "Yq"},
        "v": {"r": "C", "zdot": "Fv", "w": "B", "wdot": "Av", "y": "Yv"},
        "a": {"r": "M", "wdot": "B", "y": "Ya"},
        "z": {"r": "Rz", "zdot": "Fz", "y": "Yz"},
        "lam": {"y": "Ylam"},
        "p": {"r": "Rp", "zdot": "Fp", "Phi": "Phip", "w": "Zp", "wdot": "Ap", "y": "Yp"},
    }
    for weight, name in places[block].items():
        if name in found:
            yield weight, found[name]
    if "B" in found and block == "q":
        yield "Phi", found["B"][..., :holonomic, :]
    if "B" in found and block == "lam":
        yield "r", np.swapaxes(found["B"], -1, -2)
