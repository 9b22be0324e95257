"""Chains of rods that start along x and fall: scenes of any length, and what one of them costs, measured in a process
of its own.

    python -m benchmarks.chains {joint,absolute} {hinge,mixed,skew,ball,tree} LINKS

prints JSON: CPU and wall seconds of the build, memory, CPU time per step. ``mixed``: hinges about coordinate axes of
both senses in no order; ``skew``: about any axes. ``tree`` is a binary tree of LINKS degrees of
freedom on skew hinges, every fifth joint a ball.
"""

from __future__ import annotations

import json
import random
import resource
import sys
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.loops import timed
from eomgen.integrators.families.register import terms_of

Array = NDArray[np.float64]
LENGTH, MASS = 0.5, 1.0
INERTIA = np.array([0.0005, MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12])
#: Of chains of hinges at 0.5 s: MuJoCo's RK4 and EXUDYN's RK44 agree to 1e-13.
TIPS = {10: (4.55618084975222, 0.0, -1.22630291183717)}
STEP, STEPS = 1e-3, 200


def tip_at_the_end(links: int) -> Array:
    """Return the tip of a chain of hinges after 0.5 s, in m."""
    return np.array(TIPS[links])


def scene(coordinates: str, kind: str, links: int, terms: Sequence[str] = ()) -> eomgen.Scene:
    """Return a chain of rods on hinges about y, or on ball joints with the first rod spun by 1 rad/s about z, or a
    tree."""
    if kind == "tree":
        return _tree(coordinates, links, terms)
    source = random.Random(1)
    builder = eomgen.SceneBuilder("chain", coordinates=coordinates, terms=terms)
    for k in range(links):
        builder.body(f"rod{k}", MASS, center_of_mass=[LENGTH / 2, 0, 0], inertia=INERTIA.tolist())
        position = [LENGTH if k else 0.0, 0, 0]
        parent = f"rod{k - 1}" if k else "base"
        if kind in ("hinge", "mixed", "skew"):
            axis = _axis(kind, source)
            builder.joint(f"joint{k}", "revolute", parent, f"rod{k}", axis=axis, position=position)
        else:
            spin = {"velocity": [0, 0, 0.0 if k else 1.0]}
            builder.joint(f"joint{k}", "spherical", parent, f"rod{k}", position=position, initial=spin)
    return builder.simulation(step=STEP, duration=0.5, rho_inf=0.8).build()


def _axis(kind: str, source: random.Random) -> list[float]:
    """Return the axis of the next hinge."""
    if kind == "skew":
        return [source.uniform(-1, 1) for _ in range(3)]
    place, sense = (source.randrange(3), source.choice([-1.0, 1.0])) if kind == "mixed" else (1, 1.0)
    return [sense if k == place else 0.0 for k in range(3)]


def _tree(coordinates: str, freedoms: int, terms: Sequence[str]) -> eomgen.Scene:
    source = random.Random(1)
    builder = eomgen.SceneBuilder("tree", coordinates=coordinates, terms=terms)
    count = k = 0
    while count < freedoms:
        parent = f"body{(k - 1) // 2}" if k else "base"
        builder.body(f"body{k}", 1.0 + 0.01 * k, center_of_mass=[0.1, 0.02, -0.1], inertia=[0.02, 0.03, 0.025])
        position = [0.2 * (-1) ** k, 0.1, -0.2]
        if k % 5 == 0 and count + 3 <= freedoms:
            builder.joint(f"joint{k}", "spherical", parent, f"body{k}", position=position)
            count += 3
        else:
            axis = [source.uniform(-1, 1) for _ in range(3)]
            builder.joint(f"joint{k}", "revolute", parent, f"body{k}", axis=axis, position=position)
            count += 1
        k += 1
    return builder.simulation(step=STEP, duration=0.5, rho_inf=0.8).build()


def size(coordinates: str, kind: str, links: int) -> dict[str, float]:
    """Return what a chain costs: CPU seconds of the build, MB of memory here and in the compiler, us per step."""
    before, began = _seconds(), time.perf_counter()
    method = "generalized_alpha"
    # all that pays, for trees of this length
    terms = terms_of(method, constrained=True) if coordinates == "absolute" else None
    model = eomgen.build(scene(coordinates, kind, links), terms=terms, method=method)
    building, waited = _seconds() - before, time.perf_counter() - began
    loop = timed(model, method, STEPS * STEP, STEPS, rho_inf=0.8, repeats=5, at_least=0.05)
    if loop.failure:
        raise RuntimeError(loop.failure)
    return {
        "links": links,
        "build_seconds": building,
        "build_wall_seconds": waited,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "compiler_megabytes": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024,
        "microseconds": loop.microseconds,
        "spread": loop.spread,
        "newton_iterations": loop.per_step("newton_iterations"),
        "factorizations": loop.per_step("factorizations"),
    }


def _seconds() -> float:
    return time.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


if __name__ == "__main__":
    print(json.dumps(size(sys.argv[1], sys.argv[2], int(sys.argv[3]))))
