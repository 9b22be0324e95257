"""Claim of the second derivatives: the gradient of the weighted equations and outputs, made of first partials, changes
along the state's direction by Hd."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim, Space, column
from eomgen.products.studies.verification.engines import Array, Blocks, Engine
from eomgen.system.description import Description
from eomgen.system.system import System

#: Terms that the gradient takes if they are there.
FIRST = (
    *("partials", "internal_partials", "constraint_jacobian", "velocity_partials", "acceleration_partials"),
    *("output_partials", "parameter_partials", "output_parameter_partials", "linearization"),
)


def second_claims(space: Space, engine: Engine, system: System, description: Description) -> list[Claim]:
    """Return the claim, if the engine has first partials of all."""
    if "second_partials" not in engine or "partials" not in engine:
        return []
    rows = space.rows
    blocks = system.second_blocks
    sizes, of_weights = blocks.direction, blocks.places("weights")
    given = [item.given for item in description.inputs]

    def gradient(engine: Engine, state: Blocks) -> Array:
        """Return the gradient in q (left-trivialised), v, a, z, lam, p and u, (..., components)."""
        found = {name: array for term in FIRST if term in engine for name, array in engine(term, state).items()}
        found |= _by_inputs(found, given)
        of = {name: state["weights"][..., place] for name, place in of_weights.items()}
        batch = state["weights"].shape[:-1]
        parts = []
        for block, size in sizes.items():
            total = np.zeros((*batch, size))
            for weight, matrix in _rows(block, found, system.holonomic):
                total = total + (of[weight][..., np.newaxis, :] @ matrix)[..., 0, :]
            parts.append(total)
        return np.concatenate(parts, axis=-1)

    def direction(state: Blocks) -> dict[str, Array]:
        parts = {block: state["direction"][..., place] for block, place in blocks.places("direction").items()}
        return {block: part[..., np.newaxis, :] for block, part in parts.items() if sizes[block]}

    of_state = [f"{block} {name}" for block in ("q", "v", "a") for name in rows["v"]]
    names = (
        *of_state,
        *rows.get("z", ()),
        *rows.get("lam", ()),
        *(item.name for item in (*system.parameters, *system.inputs)),
    )
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


def _by_inputs(found: Blocks, given: Sequence[bool]) -> dict[str, Array]:
    """Return partials in all inputs, in their order, from partials in driven and in given ones."""
    made = {}
    for name, driven_name, given_name, sign in (
        ("Ru", "B0", "E0", -1.0),
        ("Zu", "Fu", "Fw", 1.0),
        ("Uy", "Yu", "Yw", 1.0),
    ):
        parts = {False: found.get(driven_name), True: found.get(given_name)}
        there = [part for part in parts.values() if part is not None]
        if not there or not given:
            continue
        shape = np.broadcast_shapes(*(part.shape[:-1] for part in there))
        matrix = np.zeros((*shape, len(given)), dtype=np.result_type(*there))
        for kind, part in parts.items():
            places = [number for number, is_given in enumerate(given) if is_given is kind]
            if part is not None and places:
                matrix[..., places] = sign * part[..., : len(places)]
        made[name] = matrix
    return made


def _rows(block: str, found: Blocks, holonomic: int) -> Iterator[tuple[str, Array]]:
    """Yield the weighted quantities, and their partials in a block."""
    places = {
        "q": {"r": "K", "zdot": "Fq", "w": "Z", "wdot": "Aq", "y": "Yq"},
        "v": {"r": "C", "zdot": "Fv", "w": "B", "wdot": "Av", "y": "Yv"},
        "a": {"r": "M", "wdot": "B", "y": "Ya"},
        "z": {"r": "Rz", "zdot": "Fz", "y": "Yz"},
        "lam": {"y": "Ylam"},
        "u": {"r": "Ru", "zdot": "Zu", "y": "Uy"},
        "p": {"r": "Rp", "zdot": "Fp", "Phi": "Phip", "w": "Zp", "wdot": "Ap", "y": "Yp"},
    }
    for weight, name in places[block].items():
        if name in found:
            yield weight, found[name]
    if "B" in found and block == "q":
        yield "Phi", found["B"][..., :holonomic, :]
    if "B" in found and block == "lam":
        yield "r", np.swapaxes(found["B"], -1, -2)
