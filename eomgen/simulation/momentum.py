"""How far the momentum of a floating tree drifts where no external force changes it.

The rows of M v that belong to a free root are the momentum of all that it carries, and those of Q the external wrench
on it: internal forces do no work in a rigid motion. A component of the momentum in the world along which there is no
wrench in any row is kept (Marsden and Ratiu, Introduction to Mechanics and Symmetry (1999), section 11.4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.system.description import BASE, Factor

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.inputs import InputSignals

#: Drift, as a part of the momenta of the bodies, from which on it is reported.
REPORTED = 0.05
#: Wrenches below this part of the largest generalized force are rounding.
_ROUNDING = 1e-9
#: Rows that are looked at, spread over all of the run.
_MOST_ROWS = 50
_NAMES = (*(f"angular momentum about {axis}" for axis in "xyz"), *(f"momentum along {axis}" for axis in "xyz"))


def momentum_drift(
    model: CompiledModel, states: tuple[Array, Array, Array, Array], p: Array, signals: InputSignals | None = None
) -> str:
    """Return which momentum drifts though nothing changes it, and by how much; empty where none does, or is kept.

    Parameters
    ----------
    states : t (rows,) in s, q (rows, nq), v (rows, nv), z (rows, nz)
    p : (np,) parameters
    signals : what drives the inputs; None: the scene's formulas
    """
    root, (t, q, v, z) = _floating_root(model), states
    if root is None or len(t) < 2 or not {"mass", "force"} <= set(model.terms):
        return ""
    chosen = np.unique(np.linspace(0, len(t) - 1, min(len(t), _MOST_ROWS)).astype(int))
    t, q, v, z = t[chosen], q[chosen], v[chosen], z[chosen]
    u = None if signals is None else signals.rows(t)
    M = model.mass(q, parameters=p)[:, root.v]
    if not np.all(np.isfinite(M)):
        return ""
    forces = model.force(q, v, t, u, z=z, parameters=p)
    group = group_named(root.group, root.v_size)
    turned = np.swapaxes(numeric.adjoint(group, numeric.inverse(group, q[:, root.q])), -1, -2)
    momentum = (turned @ np.einsum("nij,nj->ni", M, v)[..., np.newaxis])[..., 0]
    wrench = np.abs((turned @ forces[:, root.v, np.newaxis])[..., 0]).max(axis=0)
    moving = np.max(np.abs(turned) @ np.einsum("nij,nj->ni", np.abs(M), np.abs(v))[..., np.newaxis], axis=0)[:, 0]
    kept = wrench <= _ROUNDING * np.abs(forces).max(initial=0.0)
    sizes = np.repeat([moving[:3].max(), moving[3:].max()], 3)
    drift = np.where(kept & (sizes > 0.0), np.ptp(momentum, axis=0) / np.where(sizes > 0.0, sizes, 1.0), 0.0)
    worst = int(np.argmax(drift))
    if not drift[worst] > REPORTED:
        return ""
    return f"the {_NAMES[worst]}, which nothing changes, drifts by {100.0 * drift[worst]:.2g} % of the momenta at work"


def _floating_root(model: CompiledModel) -> Factor | None:
    """Return the free joint that carries all bodies from a base at rest; None where there is no such joint."""
    if model.multipliers or model.library.layout["facts"]["moving_base"]:
        return None
    roots = [hinge.name for hinge in model.description.drawing.hinges if hinge.parent == BASE]
    found = [factor for factor in model.factors if factor.group == "SE3" and factor.name in roots]
    return found[0] if len(roots) == len(found) == 1 else None
