"""Reading of reactions: their joint or constraint, their point and their axes."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from eomgen.base.text import key_of
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.reaction_model import Reaction
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Point


def read_reaction(
    name: str, entry: written.Reaction, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Reaction:
    """Return a reaction; faults go to the report of ``values``."""
    key, report, names = key_of("reactions", name), values.report, values.names
    if (entry.joint is None) == (entry.constraint is None):
        got = "none" if entry.joint is None else "both"
        report.add(key, f"a reaction needs one of joint and constraint, not {got}", 'joint = "hinge"')
    if entry.joint is not None:
        check_reference(f"{key}.joint", entry.joint, names.joints, "joint", report)
    if entry.constraint is not None:
        check_reference(f"{key}.constraint", entry.constraint, names.constraints, "constraint", report)
    of = entry.joint or entry.constraint or ""
    if of != name and (name in names.joints or name in names.constraints):
        kind = "joint" if name in names.joints else "constraint"
        report.add(key, f"the {kind} {name} has a reaction of that name, and this is one of {of}", "another name")
    if entry.point is not None:
        check_reference(f"{key}.point", entry.point, names.points, "point", report)
    check_reference(f"{key}.axes", entry.axes, [BASE, WORLD, *bodies], "body", report)
    return Reaction(
        name, "constraints" if entry.joint is None else "joints", of, points.get(entry.point or ""), entry.axes
    )
