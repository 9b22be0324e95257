"""Partials of joints' velocities that cancel: zero to fifty digits, in doubles rounded by the size of the motion.

By these sizes ``check`` judges them: a top that spins at 150 rad/s has partials of 1e-14 rad/s where they are zero.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import mpmath
import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.pipeline.documents import load
from eomgen.pipeline.initial_assembly import with_initial_assembly
from eomgen.symbolic.evaluate import evaluate
from tests.oracles.fifty_digits import evaluate_mpmath

EXAMPLES = Path(__file__).parents[2] / "examples"
EPSILON = float(np.finfo(float).eps)


@pytest.mark.parametrize("formulation", ["se3", "r3xso3"])
def test_those_of_a_spinning_top_are_rounding(formulation: str, rng: np.random.Generator) -> None:
    scene = load(EXAMPLES / "heavy_top" / f"{formulation}.toml")
    system = with_initial_assembly(partial(derive, scene), ("mass", "joint_velocities"))
    entries = {block.name: block.refs for block in system.functions["joint_velocities"].outputs}
    with mpmath.workdps(50):
        orientation = [mpmath.mpf(x) for x in rng.standard_normal(4).tolist()]
        # to fifty digits: a quaternion off by 1e-16 is no rotation
        length = mpmath.sqrt(sum(x * x for x in orientation))
        q = [*(x / length for x in orientation), *rng.standard_normal(3).tolist()]
        v, a = (150.0 * rng.standard_normal(6)).tolist(), (1e3 * rng.standard_normal(6)).tolist()
        speed, turning = np.abs(v).max(), np.abs(a).max() + np.abs(v).max() ** 2
        doubles = {"q": np.array(q, dtype=float), "v": np.array(v), "a": np.array(a), "t": np.zeros(1)}
        for name, size in (("Pq", speed), ("Pav", speed), ("Paq", turning)):
            exact = evaluate_mpmath(system.tape, entries[name], {"q": q, "v": v, "a": a, "t": [0]})
            assert max(abs(x) for x in exact) < 1e-40 * size
            rounded = np.abs(evaluate(system.tape, entries[name], doubles)).max()
            assert 0.0 < rounded < 10.0 * EPSILON * size
