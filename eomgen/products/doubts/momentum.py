"""Momentum in directions without an external force, over the samples of a run.

The rows of M v that belong to a free root are the momentum of its whole tree, and the same rows of Q - B^T lam are the
external wrench on it: internal forces do no work in a rigid motion. A component of the momentum in the world along
which there is no wrench in any row is kept (Marsden and Ratiu, Introduction to Mechanics and Symmetry (1999), section
11.4): of one free tree, or of all of them together, as bodies in absolute coordinates are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.compiled.equations import nonzeros
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.products.doubts.places import evenly
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.inputs import InputSignals


REPORTED_MOMENTUM = Limit(
    0.05, "1", "drift of a momentum in parts of the momenta of the bodies", "a choice: half of a large error"
)
_NAMES = (*(f"angular momentum about {axis}" for axis in "xyz"), *(f"momentum along {axis}" for axis in "xyz"))


class Drift(NamedTuple):
    """A component of the momentum that drifts although no external force acts along it.

    Attributes
    ----------
    name : in words
    share : drift as a part of the momenta of the bodies
    """

    name: str
    share: float

    def __str__(self) -> str:
        return f"the {self.name}, which no force changes, drifts by {100.0 * self.share:.2g} % of the momenta at work"


def momentum_drift(
    model: CompiledModel,
    states: tuple[Array, Array, Array, Array],
    p: Array,
    signals: InputSignals | None = None,
    multipliers: Array | None = None,
    sparse: bool = False,
) -> Drift | None:
    """Return the largest drift of a momentum that no external force changes; None below 5 %, for models without free
    joints, without a function of forces, or in water, and if a force may act between two rows.

    Parameters
    ----------
    states : t (rows,) in s, q (rows, nq), v (rows, nv), z (rows, nz)
    p : (np,) parameters
    signals : signals of the inputs; None: the scene's formulas
    multipliers : (rows, number of constraints) if there are constraints
    sparse : whether steps lie between the rows
    """
    (roots, one_frame), (t, q, v, z) = _floating(model), states
    if not roots or len(t) < 2 or "force" not in model.terms or (model.multipliers and multipliers is None):
        return None
    chosen = evenly(len(t), 50)
    t, q, v, z = t[chosen], q[chosen], v[chosen], z[chosen]
    u = None if signals is None else signals.rows(t)
    M = nonzeros(model, "mass", q, parameters=p)
    forces = model.force(q, v, t, u, z=z, parameters=p)
    if multipliers is not None and model.multipliers:
        B = nonzeros(model, "constraint_jacobian", q, t, parameters=p)
        forces = forces - (np.nan if B is None else B.transpose().apply(multipliers[chosen], model.nv))
    if M is None:
        return None
    momenta, sizes = M.apply(v, model.nv), M.magnitudes().apply(np.abs(v), model.nv)
    if not (np.all(np.isfinite(M.values)) and np.all(np.isfinite(forces))):
        return None
    every = np.array([_root_momentum(root, q, momenta, sizes, forces) for root in roots])
    together = every.sum(axis=0)[np.newaxis] if one_frame and len(roots) > 1 else every[:0]
    rounding = COMPUTED * np.abs(forces).max(initial=0.0)
    drifts = np.array([_drifts(parts, rounding, t[-1] - t[0]) for parts in (*every, *together)])
    tree, worst = np.unravel_index(int(np.argmax(drifts)), drifts.shape)
    if not drifts[tree, worst] > REPORTED_MOMENTUM or any(_in_water(M.block(root.v)) for root in roots):
        return None
    between = _interval_of_change([*every, *together][tree][0][:, worst], chosen)
    if between is None or (between.stop == between.start + 2 and not sparse):
        return Drift(_NAMES[worst], float(drifts[tree, worst]))
    held = None if multipliers is None else multipliers[between]
    t, q, v, z = (values[between] for values in states)
    return None if len(t) == 2 else momentum_drift(model, (t, q, v, z), p, signals, held, sparse)


def _interval_of_change(momentum: Array, rows: NDArray[np.intp]) -> slice | None:
    """Return the interval between two examined rows with most of the change of a momentum, with the rows in between;
    None if no interval has: changes by a force are concentrated."""
    way = np.abs(np.diff(momentum))
    first = int(np.argmax(way))
    return slice(rows[first], rows[first + 1] + 1) if way[first] > 0.5 * way.sum() else None


def _in_water(M: Array) -> bool:
    """Return whether the inertia of a free root, (rows, 6, 6), includes added mass: the water takes momentum.

    The inertia of bodies alone against translation is their mass in all directions.
    """
    translation = M[:, 3:, 3:]
    mass = np.trace(translation, axis1=1, axis2=2) / 3.0
    off = np.abs(translation - mass[:, np.newaxis, np.newaxis] * np.eye(3)).max(axis=(1, 2))
    return bool(np.any(off > WRITTEN * np.abs(mass)))


def _root_momentum(root: Factor, q: Array, momenta: Array, sizes: Array, forces: Array) -> Array:
    """Return momentum, wrench and magnitude of the momentum of a free root with its tree, (3, rows, 6), angular first,
    in the world, from values (rows, nv) along all components of v."""
    group = group_named(root.group, root.v_size)
    turned = np.swapaxes(numeric.adjoint(group, numeric.inverse(group, q[:, root.q])), -1, -2)
    momentum, wrench = ((turned @ values[:, root.v, np.newaxis])[..., 0] for values in (momenta, forces))
    size = (np.abs(turned) @ sizes[:, root.v, np.newaxis])[..., 0]
    return np.array([momentum, wrench, size])


def _drifts(parts: Array, rounding: float, span: float) -> Array:
    """Return the change over the rows of each momentum component that no wrench acts on, (6,), relative to the
    magnitude of the momentum; 0 for other components.

    A momentum counts as conserved if the change is at most the accumulated rounding of forces, even if the momentum is
    small.

    Parameters
    ----------
    parts : as of ``_root_momentum``
    rounding : generalized forces that count as none
    span : time between the first and the last row, s
    """
    momentum, wrench, size = parts
    change = np.ptp(momentum, axis=0)
    sizes = np.repeat([size[:, :3].max(), size[:, 3:].max()], 3)
    told = (np.abs(wrench).max(axis=0) <= rounding) & (change > rounding * span) & (sizes > 0.0)
    return np.where(told, change / np.where(sizes > 0.0, sizes, 1.0), 0.0)


def _floating(model: CompiledModel) -> tuple[list[Factor], bool]:
    """Return the factors of free joints to a base at rest, or to bodies fixed to such a base, and whether all have one
    parent frame. In absolute coordinates all bodies are free; there are none if the base moves."""
    if model.library.layout["facts"]["moving_base"]:
        return [], False
    free = [factor for factor in model.factors if factor.group == "SE3"]
    if model.description.joints:  # of bodies in absolute coordinates
        return free, True
    still, parents = {BASE}, {}
    for hinge in model.description.drawing.hinges:  # parents before their children
        if hinge.type == "fixed" and hinge.parent in still:
            still.add(hinge.child)
        parents[hinge.name] = hinge.parent
    free = [factor for factor in free if parents.get(factor.name) in still]
    return free, len({parents[factor.name] for factor in free}) == 1
