"""Random chains of masses that strike stops, in Siconos: times of impacts and the last state."""

from __future__ import annotations

import json
import subprocess
from functools import cache
from pathlib import Path

import numpy as np

import eomgen
from eomgen.pipeline.model import Model

MASSES, SECONDS = 3, 2.0
#: The Python of Debian, for which the package python3-siconos is.
PYTHON = "/usr/bin/python3"


def motion(seed: int) -> dict[str, float]:
    """Compare a chain on springs and dampers between two stops, which its last mass strikes, with restitution."""
    rng = np.random.default_rng(seed)
    masses, stiffness, damping = rng.uniform([[0.5], [50.0], [0.0]], [[2.0], [300.0], [0.3]], (3, MASSES))
    velocity = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 3.0, MASSES)
    below, above, restitution = rng.uniform((0.05, 0.05, 0.7), (0.15, 0.15, 0.95)).tolist()
    A = np.eye(MASSES) - np.eye(MASSES, k=-1)  # from places to lengths of springs, the first of which holds the wall
    data = {
        "mass": np.diag(masses).tolist(), "damping": (A.T @ np.diag(damping) @ A).tolist(),
        "stiffness": (A.T @ np.diag(stiffness) @ A).tolist(), "q": [0.0] * MASSES, "v": velocity.tolist(),
        "stops": [[MASSES - 1, 1.0, below], [MASSES - 1, -1.0, above]], "restitution": restitution,
        "seconds": SECONDS, "tolerance": 1e-13,
    }  # fmt: skip  # a table
    words = [PYTHON, str(Path(__file__).with_name("chain_in_siconos.py"))]
    output = subprocess.run(words, input=json.dumps(data), capture_output=True, text=True, check=True).stdout
    theirs = json.loads(output)
    parameters = {"below": below, "above": above, "restitution": restitution}
    for word, row in (("m", masses), ("k", stiffness), ("c", damping)):
        parameters |= {f"{word}{k}": float(value) for k, value in enumerate(row)}
    solution = _chain().simulate(
        SECONDS,
        0.005,
        method="taylor",
        parameters=parameters,
        initial={"q": [0.0] * MASSES, "v": (A @ velocity).tolist()},
        error_estimate=False,
    )
    assert solution.success, solution.message
    times, q, v = solution.events.t, np.linalg.solve(A, solution.q[-1]), np.linalg.solve(A, solution.v[-1])
    assert len(times) == len(theirs["impacts"]) > 0, f"{len(times)} impacts, {len(theirs['impacts'])} in Siconos"
    return {
        "times of impacts": float(np.max(np.abs(times - theirs["impacts"])) / SECONDS),
        "last places": float(np.linalg.norm(q - theirs["q"]) / np.linalg.norm(q)),
        "last velocities": float(np.linalg.norm(v - theirs["v"]) / np.linalg.norm(v)),
    }


@cache
def _chain() -> Model:
    """Return eomgen's chain, whose coordinates are the lengths of its springs, with a parameter for each number."""
    builder = eomgen.SceneBuilder("chain", gravity=[0, 0, 0])
    for name in ("below", "above", "restitution", *(f"{word}{k}" for word in "mkc" for k in range(MASSES))):
        builder.parameter(name, 0.5, tunable=True)
    for k in range(MASSES):
        builder.body(f"body{k}", f"m{k}")
        parent = f"body{k - 1}" if k else "base"
        builder.joint(f"s{k}", "prismatic", parent, f"body{k}", axis=[1, 0, 0], stiffness=f"k{k}", damping=f"c{k}")
    place = " + ".join(f"q.s{k}" for k in range(MASSES))
    for name, gap in (("low", f"below + {place}"), ("high", f"above - ({place})")):
        builder.event(name, gap, direction="falling", action="impact", restitution="restitution")
    return eomgen.build(builder.build(), profile="quick")
