"""Scenes of geometrically exact beams, their loads by parameters, and their rest by load steps on the tape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.lie import product
from eomgen.system.system import System
from tests.oracles.evaluation import Array, tape_evaluator

ROLL_UP: dict[str, float] = {
    "stretch": 1e4, "shear_y": 1e4, "shear_z": 1e4, "torsion": 500.0, "bending_y": 500.0, "bending_z": 500.0,
}  # fmt: skip  # a table


def beam_scene(elements: int, tip: Mapping[str, Any], beam: Mapping[str, Any] = {}, **joint: Any) -> dict[str, Any]:
    """Return a beam of 10 m on the base with a load at its end, without gravity; ``joint``: its carrier's keys."""
    rope = {
        "model": "cosserat",
        "length": 10.0,
        "elements": elements,
        "mass_per_length": 1.0,
        "rotary_inertia": [10.0, 10.0, 10.0],
        "stiffness": ROLL_UP,
        **beam,
    }
    length = rope["length"]
    return {
        "format": 1,
        "name": "exact_beam",
        "gravity": [0.0, 0.0, 0.0],
        "parameters": {"load": {"value": 1.0, "tunable": True}},
        "beams": {"rope": rope},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "rope", **joint}},
        "forces": {"tip": {"body": "rope", "point": [length, 0.0, 0.0], **tip}},
    }


def rest(system: System, steps: int) -> Array:
    """Return the configuration at rest under the parameter load = 1, by Newton's method in so many load steps."""
    evaluate = tape_evaluator(system)
    q, still = np.array(system.initial_q), np.zeros(system.nv)
    for step in range(1, steps + 1):
        for _ in range(40):
            state = {"q": q, "v": still, "a": still, "p": np.array([step / steps])}
            partials, residual = evaluate("partials", state), evaluate("residual", state)["r"]
            change = -np.linalg.solve(partials["K"], residual)
            q = product.update(system.factors, q, change)
            if np.max(np.abs(change)) < 1e-7:  # what is left of it is rounding
                break
        else:
            raise AssertionError(f"load step {step} of {steps} does not converge")
    return q


def pose_of_last(system: System, q: Array) -> Array:
    """Return the pose of the last node, (7,)."""
    pose: Array = tape_evaluator(system)("poses", {"q": q})["pose"][list(system.bodies).index(_last(system.bodies))]
    return pose


def _last(bodies: Sequence[str]) -> str:
    return max((name for name in bodies if name.startswith("rope.")), key=lambda name: int(name.partition(".")[2]))
