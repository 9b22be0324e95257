"""The geometrically exact beams of a compiled model, as assembly takes them; states with their nodes in place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, Self

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.functions import Functions
from eomgen.lie.product import Factor
from eomgen.solvers.beams import Beams, beams_of
from eomgen.solvers.rigid_beams import RigidBeams
from eomgen.system.description import Description


class ModelWithBeams(Protocol):
    """A ``CompiledModel``: see there."""

    description: Description

    @property
    def functions(self) -> Functions: ...
    @property
    def bodies(self) -> Sequence[str]: ...
    @property
    def factors(self) -> tuple[Factor, ...]: ...
    @property
    def v_units(self) -> Sequence[str]: ...
    @property
    def parameters(self) -> Mapping[str, float]: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def evaluate(self) -> Callable[..., Mapping[str, Array]]: ...

    def parameter_array(self) -> Array: ...

    def having(self, terms: Sequence[str]) -> Self: ...


def beams_at(model: ModelWithBeams, t: float, p: Array) -> Beams | None:
    """Return the beams at parameters (np,); None if the model has no beams, or no term ``poses``."""
    description = model.description
    if not description.element_stiffness:
        return None
    able = model.having(("poses",))
    if "poses" not in able.functions:
        return None
    return beams_of(
        description.element_stiffness,
        description.values(dict(zip(model.parameters, p.tolist(), strict=True))),
        model.bodies,
        model.factors,
        lambda q: np.asarray(able.evaluate("poses", q, t=t, parameters=p)["pose"]),
        absolute=bool(description.joints),
    )


def placed_nodes(
    model: ModelWithBeams, before: tuple[Array, Array], after: tuple[Array, Array], p: Array, given: Sequence[str]
) -> tuple[Array, Array]:
    """Return q and v with the nodes of beams placed, and moving, rigidly with their first nodes.

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
