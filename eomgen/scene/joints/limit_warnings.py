"""Joints that start beyond their own limits: allowed, but their stops push them back from the first moment, which few intend."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.formula.nodes import Formula
from eomgen.scene.joints.model import Joint

#: Penetration that is taken for rounding, in parts of the limit and of 1 rad or 1 m.
_ROUNDING = 1e-9


def beyond_limits(joint: Joint, positions: Sequence[float], value: Callable[[Formula], float]) -> list[str]:
    """Return one sentence for each coordinate of a joint that lies beyond a limit.

    Parameters
    ----------
    positions : coordinates of the joint, rad or m
    value : gives what a formula of parameters comes to
    """
    coordinates = list(joint.kind.coordinates.items())
    if len(positions) != len(coordinates):
        return []
    sentences = []
    for stop in joint.stops:
        meaning, unit = coordinates[stop.index]
        what = "" if len(positions) == 1 else f"the {meaning} of "
        position = positions[stop.index]
        for side, bound, sign in (("lower", stop.lower, -1.0), ("upper", stop.upper, 1.0)):
            if bound is None:
                continue
            limit = value(bound)
            depth = sign * (position - limit)
            if depth > _ROUNDING * (1.0 + abs(limit)):
                effort = f"{value(stop.stiffness) * depth:.3g} {'N m' if unit == 'rad' else 'N'}"
                sentences.append(
                    f"{what}joint {joint.name} starts at {position:.4g} {unit}, beyond its {side} limit {limit:.4g} {unit}: "
                    f"the stop pushes back with up to {effort}; try an initial position within the limits"
                )
    return sentences
