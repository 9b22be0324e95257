"""Bodies on rails: what tests of runs push by formulas."""

from __future__ import annotations

from typing import Any

import eomgen


def on_rail(effort: str = "", joint: str = "x", *, name: str = "rail", mass: float = 1.0, **keys: Any) -> Any:
    """Return a builder of a body b on a rail along x without gravity, pushed by a formula; ``keys`` are of the joint,
    of which ``position`` and ``velocity`` are initial values."""
    start = {key: keys.pop(key) for key in ("position", "velocity") if key in keys}
    builder = eomgen.SceneBuilder(name, gravity=[0, 0, -keys.pop("gravity", 0.0)]).body("b", mass)
    given = {"axis": [1, 0, 0], **({"initial": start} if start else {}), **keys}
    builder.joint(joint, "prismatic", "base", "b", **given)
    return builder.effort("push", joint, effort) if effort else builder


def built(builder: Any, **options: Any) -> eomgen.Model:
    """Build the scene of a builder with the compiler's first level of optimisation."""
    return eomgen.build(builder.build(), profile="quick", **options)
