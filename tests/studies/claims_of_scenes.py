"""Claims of scenes on the tape, without compiled code, and random states of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import eomgen
from eomgen.compiled.coordinates import coordinate_names
from eomgen.lie.product import update
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.products.studies.verification.claims.claim import (
    FEW,
    Array,
    Engine,
    Space,
    base_block,
    directions,
    on_tape,
)
from eomgen.system.system import System


def space_of(scene: eomgen.Scene, terms: Sequence[str], scale: float = 1.0) -> Space:
    """Return the space of a scene on the tape; ``scale`` is the scale of each component."""
    system, rng = derive(scene, terms), np.random.default_rng(7)
    rows = {
        "v": tuple(coordinate_names(system.factors)[1]),
        "z": tuple(state.name for state in system.states),
        "lam": tuple(system.multipliers),
    }
    along = {name: directions(names, np.full(len(names), scale), rng) for name, names in rows.items()}
    values = np.array([parameter.value for parameter in system.parameters])
    names = [parameter.name for parameter in system.parameters]
    along["p"] = directions(names, np.where(values != 0.0, 0.5 * np.abs(values), 1.0), rng)
    few = directions(rows["v"], np.full(system.nv, scale), rng, FEW)
    along |= {"a": along["v"], "q": along["v"]}
    return Space(system, on_tape(system), scene, describe(scene), along, few, rows)


def states_of(system: System, engine: Engine, count: int, reach: float = 0.02) -> dict[str, Array]:
    """Return random states, ``reach`` rad and m from the initial one, without empty blocks."""
    rng = np.random.default_rng(11)

    def drawn(size: int, reach: float = 1.0) -> Array:
        return rng.uniform(-reach, reach, (count, size))

    parameters = np.array([parameter.value for parameter in system.parameters])
    state: dict[str, Any] = {
        "q": update(system.factors, np.tile(system.initial_q, (count, 1)), drawn(system.nv, reach)),
        **{name: drawn(system.nv) for name in ("v", "a", "j", "s")},
        "z": drawn(system.nz),
        "t": rng.uniform(0.1, 0.9, (count, 1)),
        **{name: drawn(system.nu) for name in ("u", "u_dot", "u_ddot")},
        "lam": drawn(len(system.multipliers)),
        "p": np.broadcast_to(parameters, (count, len(parameters))),
        **{name: drawn(size) for name, size in system.second_sizes.items()},
    }
    for name in ("base", "base_rates"):
        if name in engine:
            state[name] = base_block(engine, name, state)
    return {name: block for name, block in state.items() if block.shape[-1]}
