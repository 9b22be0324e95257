"""The geometrically exact beams of a compiled model, as assembly takes them; states with their nodes in place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.arrays import Array

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.solvers.beam_assembly import Beams


def beams_at(model: CompiledModel, t: float, p: Array) -> Beams | None:
    """Return the beams at parameters (np,); None where the model has none, or no term ``poses``."""
    description = model.description
    if not description.element_stiffness:
        return None
    able = model.having(("poses",))
    if "poses" not in able.functions:
        return None
    from eomgen.solvers.beam_assembly import beams_of  # noqa: PLC0415  # SciPy comes with it

    return beams_of(
        description.element_stiffness,
        description.values(dict(zip(model.parameters, p.tolist(), strict=True))),
        model.bodies,
        model.factors,
        lambda q: np.asarray(able.evaluate("poses", q, t=t, parameters=p)["pose"]),
        absolute=bool(description.joints),
    )


def placed_nodes(
    model: CompiledModel, before: tuple[Array, Array], after: tuple[Array, Array], p: Array, given: Sequence[str]
) -> tuple[Array, Array]:
    """Return q and v with the nodes of beams put where the first ones have them, and moving with these.

    Parameters
    ----------
    before : q, (nq,), with the shapes of the beams at the default parameters, and v, (nv,), of rigid motions
    after : q and v of the other coordinates
    p : (np,) parameters
    given : bodies that keep their coordinates
    """
    shapes, beams = beams_at(model, 0.0, model.parameter_array()), beams_at(model, 0.0, p)
    if shapes is None or beams is None:
        return after
    from eomgen.solvers.beam_assembly import RigidBeams  # noqa: PLC0415  # SciPy comes with it

    rigid = RigidBeams(shapes, model.factors, np.array([unit == "rad/s" for unit in model.v_units]), before[0])
    at_start = rigid.velocities(before[0], before[1][np.newaxis])[0]
    rigid = rigid.of(beams)
    kept_q, kept_v = (np.zeros(size, dtype=bool) for size in (model.nq, model.nv))
    for factor in model.factors:
        if factor.name in given:
            kept_q[factor.q], kept_v[factor.v] = True, True
    q = np.where(kept_q, after[0], rigid.placed(after[0]))
    along = rigid.velocities(q, after[1][np.newaxis])[0]
    return q, np.where(kept_v | rigid.free, after[1], before[1] - at_start + along)
