"""Unbalance: which body's centre of mass lies off the axis that it turns about, and by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.analysis.equilibrium_warnings import Measures
from eomgen.base.arrays import Array
from eomgen.lie.numeric import rotated

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Centres of mass nearer to their axis than this part of the scene's length lie on it.
_ON_AXIS = 1e-12


def off_axis_hint(model: CompiledModel, measures: Measures, q: Array, v: Array) -> str:
    """Return a remedy if bodies that turn with v at q are out of balance; empty if none is.

    Half a turn of a single coordinate moves a centre of mass by twice its distance from the axis.
    """
    if "poses" not in model.functions:
        return ""
    worst, result = 0.0, ""
    for factor in model.factors:
        k = factor.v_start
        if factor.group != "R" or factor.v_size != 1 or not v[k] or model.v_units[k] != "rad/s":
            continue
        half = q.copy()
        half[factor.q] += np.pi
        poses = measures.poses(np.array([q, half]))
        for solid in model.description.drawing.solids:
            turn, origin = poses[solid.name]
            center = origin + rotated(turn, measures.vector(solid.center_of_mass))
            off, mass = 0.5 * float(np.linalg.norm(center[1] - center[0])), measures.number(solid.mass)
            if off > _ON_AXIS * measures.length(q) and mass * off > worst:
                worst = mass * off
                result = (
                    f"centres of mass on the axis of {factor.name} (that of {solid.name} is {off:.6g} m off,"
                    f" {worst:.6g} kg m), with gravity and springs that are the same all round it; unbalance acts on"
                    " the balanced rotor as a force that turns (docs/python.md, Rotors)"
                )
    return result
