"""Claims of partials in the tunable parameters: of the equations, of constraints, of outputs; and of the regressor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eomgen.studies.verification.claims.claim import Claim, Space, jacobian
from eomgen.studies.verification.engines import Array, Blocks, Engine
from eomgen.system.system import System

FAMILY = "parameters"


def parameter_claims(space: Space, engine: Engine, system: System) -> list[Claim]:
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
    if "output_parameter_partials" in engine:
        names = tuple(f"{y.name}[{k}]" if y.size > 1 else y.name for y in system.outputs for k in range(y.size))
        claims.append(jacobian(space, FAMILY, "output_parameter_partials", "Yp", ("outputs", "y"), "p", names))
    return claims


def _accelerations(engine: Engine, state: Blocks) -> Array:
    """Return B a + g, the accelerations of the constraints."""
    B = engine("constraint_jacobian", state)["B"]
    return np.asarray((B @ state["a"][..., np.newaxis])[..., 0] + engine("constraint_bias", state)["g"])
