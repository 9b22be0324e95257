"""Motions through random states, and time derivatives along them by complex step (Squire and Trapp 1998): no calculus
of ours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from eomgen.system.system import System
from tests.oracles.evaluation import Array, Evaluate
from tests.oracles.states import STEP, displaced, random_states

#: What each input block's time derivative is called.
NEXT = {"q": "v", "v": "a", "a": "j", "j": "s", "u": "u_dot", "u_dot": "u_ddot"}


def random_motions(system: System, evaluate: Evaluate, count: int, rng: np.random.Generator) -> dict[str, Array]:
    """Return states with derivatives of a (five of them) and u, and base and z where there are any."""
    state = random_states(system, count, rng)
    for block in ("j", "s"):
        state[block] = rng.uniform(-3.0, 3.0, size=(count, system.nv))
    state["a_higher"] = rng.uniform(-3.0, 3.0, size=(count, system.rate_sizes["a_higher"]))
    if system.nu:
        for block in ("u_dot", "u_ddot"):
            state[block] = rng.uniform(-1.0, 1.0, size=(count, system.nu))
        state["u_higher"] = rng.uniform(-1.0, 1.0, size=(count, system.rate_sizes["u_higher"]))
    if system.nz:
        state["z"] = rng.uniform(-1.0, 1.0, size=(count, system.nz))
    return with_drivers(system, evaluate, state)


def with_drivers(system: System, evaluate: Evaluate, state: Mapping[str, Array]) -> dict[str, Array]:
    """Return the state with what the scene says of its base at the state's times."""
    filled = dict(state)
    for driver in ("base", "base_rates"):
        if driver in system.functions:
            values = evaluate(driver, filled)[driver]
            filled[driver] = values.reshape(*values.shape[:1], -1)
    return filled


def along_motion(system: System, evaluate: Evaluate, function: str, state: Mapping[str, Array]) -> dict[str, Array]:
    """Return the time derivatives of a function's outputs along the motion that the state's derivatives describe."""
    moved: dict[str, Array] = dict(state)
    step = 1j * STEP
    for block, rate in NEXT.items():
        if block == "q":
            moved[block] = displaced(system.factors, state[block], step * state[rate])
        elif block in state:
            moved[block] = state[block] + step * state[rate]
    for higher, below, size in (("a_higher", "s", system.nv), ("u_higher", "u_ddot", system.nu)):
        rows = state.get(higher, np.zeros((1, 0)))
        if rows.shape[-1]:
            moved[below] = state[below] + step * rows[..., :size]
            shifted = np.concatenate([rows[..., size:], np.zeros_like(rows[..., :size])], axis=-1)
            moved[higher] = rows + step * shifted
    if "z" in state:
        moved["z"] = state["z"] + step * evaluate("internal_rate", state)["zdot"]
    moved["t"] = state["t"] + step
    moved = with_drivers(system, evaluate, moved)
    return {name: values.imag / STEP for name, values in evaluate(function, moved).items()}
