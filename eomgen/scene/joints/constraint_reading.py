"""Reading of constraints: keys permitted for each type, the two frames, shapes and surfaces of rolling and sliding
contacts, and constraints by a formula (equation), with its unit and its linearity in velocities.

Frames never depend on the initial state, which need not close the loop. Formulas of constraints need two derivatives
along a motion, so curves that jump or bend and functions with a corner are refused.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING

from eomgen.base.messages import key_of
from eomgen.base.rounding import COMPUTED
from eomgen.formula.discontinuities import rough_curves
from eomgen.formula.evaluate import symbols
from eomgen.formula.features import changes
from eomgen.formula.nodes import NON_SMOOTH, ZERO, Application, Formula, Operation, Symbol, distinct_nodes
from eomgen.scene.design_poses import UnknownPoseError, attach, size_of
from eomgen.scene.formula.scope import BETWEEN_FRAMES, POSITIONS, SURFACE, VELOCITIES, Scope
from eomgen.scene.joint_types import CONSTRAINTS, TYPES, Need
from eomgen.scene.joints.drives import read_law, read_length, read_smoothing
from eomgen.scene.joints.frames import read_frame, site_of
from eomgen.scene.joints.model import (
    Constraint,
    EquationUnit,
    Frame,
    Shape,
)
from eomgen.scene.reading.formula_units import FACTOR, dimension_of_formula, disagreement
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.system.description import BASE, WORLD, Point

if TYPE_CHECKING:
    from eomgen.scene.joints import constraint_schema as written
    from eomgen.scene.section import Reading

#: Keys that surfaces need besides the shape.
_OF_SHAPES: Mapping[str, str] = {
    "disc": "radius=1.0",
    "sphere": "radius=1.0",
    "ellipsoid": "semi_axes=[0.2,0.03,0.02]",
    "torus": "radius=0.3 tube_radius=0.05",
}
_EQUATION = 'equation = "q.rod - lift(q.cam)", which is 0 on the constraint'
_VELOCITIES = ("v", "velocity")


def read_constraint(name: str, entry: written.ConstraintEntry, reading: Reading) -> Constraint:
    """Return the constraint of an entry of [constraints], with frames on geometrically exact beams moved to nodes.
    Faults are reported, and doubtful contacts noted."""
    key, values, points = key_of("constraints", name), reading.values, reading.items["points"]
    values.check_kind(key, entry, "type", {row.name: row.constraint_keys for row in TYPES.values()})
    shape = entry.shape or Constraint.shape
    if "shape" in CONSTRAINTS[entry.type].keys:
        values.check_kind(key, entry, "shape", _OF_SHAPES, shape)
    framed = entry.type != "formula" or entry.first is not None or entry.second is not None
    first, second = (
        _frame(f"{key}.{side}", entry, getattr(entry, side), need, reading) if framed else Frame(BASE)
        for side, need in zip(("first", "second"), _needs(entry), strict=True)
    )
    equation, unit = read_equation(key, entry, points, values) if entry.type == "formula" else (None, Constraint.unit)
    law = "length" if entry.type == "distance" else "drive"
    smooth = read_smoothing(key, entry.smooth, law if getattr(entry, law) is None else "", values)
    sizes = values.keys(key, entry, "radius", "tube_radius")
    if "shape" in CONSTRAINTS[entry.type].keys:
        radii = sizes.get("radius", ZERO), sizes.get("tube_radius", ZERO)
        values.note(_doubtful_contact(key, shape, second, *radii, values))
    return Constraint(
        name=name,
        type=entry.type,
        first=attach(first, reading.attach, f"{key}.first.position"),
        second=attach(second, reading.attach, f"{key}.second.position"),
        drive=None if entry.drive is None else read_law(f"{key}.drive", entry.drive, values, smooth),
        length=_length(key, entry, first, second, smooth, values) if entry.type == "distance" else ZERO,
        shape=shape,
        **sizes,
        **values.keys(key, entry, "pitch", "semi_axes"),
        surface=read_surface(f"{key}.surface", entry.surface, values) if entry.surface is not None else None,
        equation=equation,
        at_velocity=entry.velocity_equation is not None,
        unit=unit,
        framed=framed,
    )


def _doubtful_contact(
    key: str, shape: Shape, second: Frame, radius: Formula, tube: Formula, values: Values
) -> Iterator[str]:
    """Yield notes on a contact whose frames or radii look exchanged."""
    if second.body == BASE:
        yield f"{key}: second, the base, carries the {shape}, and first the plane; try: the body as second [W0131]"
    if shape == "torus" and (inner := values.value(tube)) >= (outer := values.value(radius)):
        fault = f"a tube of radius {inner:g} about a centre line of radius {outer:g} leaves no hole in the torus"
        yield f"{key}.tube_radius: {fault}; try: the smaller radius in tube_radius [W0132]"


def _length(
    key: str, entry: written.ConstraintEntry, first: Frame, second: Frame, smooth: float | None, values: Values
) -> Formula:
    """Return the length of a distance constraint as a formula, m, by default the distance of both origins at the design
    position; ``UNKNOWN``, after a report, without one. ``smooth`` as of ``read_length``."""
    if entry.length is not None:
        return read_length(f"{key}.length", entry.length, values, smooth)
    if values.report.concerns(f"{key}.first") or values.report.concerns(f"{key}.second"):
        return UNKNOWN
    why = "both places are the same there"
    try:
        length = size_of(values.design.way((first.body, first.position), (second.body, second.position)))
    except UnknownPoseError as error:
        length, why = ZERO, error.problems[0].what
    number = values.value(length)
    if math.isnan(number) or not why:  # other faults
        return UNKNOWN
    if number > COMPUTED:
        return length
    fault = f"a distance constraint needs a length, and the design position gives none: {why} [E1601]"
    values.report.add(key, fault, "length = 1.0")
    return UNKNOWN


def read_surface(
    key: str,
    text: float | str,
    values: Values,
    scope: Scope = SURFACE,
    kinds: Collection[str] = ("parameter", "local"),
    owner: str = "constraint",
    remedy: str = "",
) -> Formula | None:
    """Return the height of a surface over the plane as a formula of x and y, m; None for the plane, and after a report
    for a formula that cannot be read, has symbols of other ``kinds`` or depends on z. Derivatives that the ``owner``
    misses are reported, with a ``remedy`` more."""
    formula = values.formula(key, text, scope)
    if formula is UNKNOWN or formula == ZERO:
        return None
    for symbol in sorted(symbols(formula), key=lambda symbol: (symbol.kind, symbol.index)):
        if symbol.kind not in kinds:
            hint = "a moving body in first, which carries the surface"
            values.report.add(key, "the surface changes over time [E1602]", hint)
            return None
        if symbol.kind == "local" and symbol.index > 1:
            values.report.add(key, "the height of a surface depends on x and y, not on z [E1603]", '"0.1 * x**2"')
            return None
    _check_smooth(key, formula, values, 3, f"a {owner} needs three derivatives of its surface", remedy)
    return formula


def _frame(
    key: str, entry: written.ConstraintEntry, frame: written.FrameEntry | None, need: Need, reading: Reading
) -> Frame:
    """Return the first or the second frame of a constraint, with the key ``key``; a missing frame is reported, and is a
    frame on a body without a name. ``need`` says which axes the constraint uses."""
    if frame is None:
        side = key.rpartition(".")[2]
        reading.report.add(key, f"the key {side} is missing [E1343]", f"{side} = ...")
        return Frame("")
    driven = "driven " if entry.drive is not None and CONSTRAINTS[entry.type].drive else ""
    return read_frame(key, f"{driven}{entry.type} constraint", frame, need, site_of(reading))


def _needs(entry: written.ConstraintEntry) -> tuple[Need, Need]:
    if CONSTRAINTS[entry.type].drive == "angle" and entry.drive is not None:
        return "x and z", "x and z"
    if "shape" in CONSTRAINTS[entry.type].keys and entry.shape in ("sphere", "ellipsoid"):
        return "z", "nothing" if entry.shape == "sphere" else "any"
    return CONSTRAINTS[entry.type].uses


def read_equation(
    key: str, entry: written.ConstraintEntry, points: Mapping[str, Point], values: Values
) -> tuple[Formula | None, EquationUnit]:
    """Return the equation of a constraint and the unit of the equation; faults go to the report of ``values``.

    Returns
    -------
    tuple
        The formula, ``UNKNOWN`` for a refused formula and None for a missing formula, and the unit in SI.
    """
    report, at_velocity = values.report, entry.velocity_equation is not None
    text = entry.velocity_equation if at_velocity else entry.equation
    if text is None or (at_velocity and entry.equation is not None):
        got = "both" if at_velocity else "none"
        fault = f"a formula constraint needs one of equation and velocity_equation, not {got} [E1609]"
        report.add(key, fault, _EQUATION)
        return None, "m"
    framed = entry.first is not None or entry.second is not None
    if at_velocity and framed:
        hint = "velocities of points and joints, and no first and second"
        report.add(f"{key}.velocity_equation", "an equation between two frames holds positions alone [E1610]", hint)
        return UNKNOWN, "m"
    equation_key = f"{key}.velocity_equation" if at_velocity else f"{key}.equation"
    formula = values.formula(equation_key, text, VELOCITIES if at_velocity else BETWEEN_FRAMES if framed else POSITIONS)
    if formula is UNKNOWN:
        return UNKNOWN, "m"
    still = {name for name, point in points.items() if point.body in (BASE, WORLD)}
    if not _holds(equation_key, formula, values, still, framed=framed, at_velocity=at_velocity):
        return UNKNOWN, "m"
    count, needed = (1, "one derivative") if at_velocity else (2, "two derivatives")
    _check_smooth(equation_key, formula, values, count, f"a constraint needs {needed} of its equation")
    return formula, _unit(key, formula, entry.unit, values, at_velocity=at_velocity)


def _holds(
    key: str, formula: Formula, values: Values, still: Collection[str], *, framed: bool, at_velocity: bool
) -> bool:
    """Return whether an equation constrains a motion: the equation names a coordinate (at velocity level a velocity),
    not of fixed points alone, and is linear in velocities. Faults are reported.

    Parameters
    ----------
    still : names of points fixed in the base or the world
    framed : whether the equation is in x, y, z between two frames
    at_velocity : whether the equation is a ``velocity_equation``
    """
    kinds = {symbol.kind for symbol in symbols(formula)}
    report = values.report
    if at_velocity and not kinds.intersection(_VELOCITIES):
        if kinds.intersection(("q", "position")):
            report.add(key, "the equation names no velocity [E1611]", "equation = ... for positions")
        else:
            fault = "the equation names no velocity, so it holds no motion [E1612]"
            report.add(key, fault, "v.JOINT or velocity.POINT[0]")
        return False
    if at_velocity and degree(formula) >= 2:
        hint = "a sum of velocities times factors of positions and time"
        report.add(key, "the equation is not linear in velocities [E1613]", hint)
        return False
    if not at_velocity and not kinds.intersection(("q", "position", "local")):
        hint = "x, y or z" if framed else "q.JOINT or position.POINT[0]"
        report.add(key, "the equation names no coordinate, so it holds no motion [E1614]", hint)
        return False
    named = {symbol for symbol in symbols(formula) if symbol.kind in ("q", "v", "position", "velocity", "local")}
    if all(symbol.kind in ("position", "velocity") and symbol.name in still for symbol in named):
        fault = "the equation names points of the base and of the world alone, so it holds no motion [E1615]"
        report.add(key, fault, "a point of a moving body")
        return False
    return True


def _check_smooth(key: str, formula: Formula, values: Values, derivatives: int, needs: str, remedy: str = "") -> None:
    """Report curves and functions in a formula that have fewer than ``derivatives`` derivatives, which ``needs`` says;
    add a note on choices, whose branches have to fit. ``key`` is the dotted key of the formula."""
    for name, does in rough_curves(formula, derivatives).items():
        values.report.add(key, f"{needs}, and {name} {does} [E1616]", f'interpolation = "quintic"{remedy}')
    for name in dict.fromkeys(_rough(formula)):
        if NON_SMOOTH[name] >= derivatives:
            continue
        hint = f"a smooth function, such as sqrt(x**2 + d**2) for abs(x){remedy}"
        has = "a corner" if NON_SMOOTH[name] else "a jump"
        fault = f"{needs}, and {'a comparison' if name in ('lt', 'le') else name} has {has} [E1617]"
        values.report.add(key, fault, hint)
    operations = [part for part in distinct_nodes(formula) if isinstance(part, Operation)]
    if any(part.name == "select" and changes(part.arguments[0]) for part in operations):
        equal = "values, slopes and curvatures" if derivatives > 1 else "values and slopes"
        values.note([f"{key}: the formula has an if, whose branches have to meet with equal {equal} [W0299]"])


def _rough(formula: Formula) -> Iterator[str]:
    """Yield the names of functions in a formula that jump or have a corner during a motion, except comparisons in
    conditions of choices."""
    if isinstance(formula, Application):
        yield from _rough(formula.argument)
    elif isinstance(formula, Operation):
        if formula.name in NON_SMOOTH and changes(formula):
            yield formula.name
        for argument in formula.arguments[1:] if formula.name == "select" else formula.arguments:
            yield from _rough(argument)


def degree(formula: Formula) -> int:
    """Return the degree of a formula in velocities: 0, 1, or 2 for all that is not linear."""
    if isinstance(formula, Symbol):
        return int(formula.kind in _VELOCITIES)
    if isinstance(formula, Application):
        return 2 if degree(formula.argument) else 0
    if not isinstance(formula, Operation):
        return 0
    degrees = [degree(argument) for argument in formula.arguments]
    match formula.name:
        case "add" | "sub" | "neg":
            return max(degrees)
        case "mul":
            return min(sum(degrees), 2)
        case "div":
            return 2 if degrees[1] else degrees[0]
        case "select":
            return 2 if degrees[0] else max(degrees[1:])
    return 2 if any(degrees) else 0


def _unit(key: str, formula: Formula, label: EquationUnit | None, values: Values, *, at_velocity: bool) -> EquationUnit:
    """Return the unit of a constraint's equation: as ``label``, or by the formula, else m or m/s. Reported are terms
    that disagree, a given unit that does not fit, and a missing unit that does not follow."""
    report = values.report
    choice: tuple[EquationUnit, EquationUnit] = ("m/s", "rad/s") if at_velocity else ("m", "rad")
    field = f"{key}.velocity_equation" if at_velocity else f"{key}.equation"
    if terms := disagreement(formula, values.names):
        report.add(field, terms.text.replace("the formula", "the equation"), FACTOR)
        return label or choice[0]
    dimension = dimension_of_formula(formula, values.names)
    own_unit = "" if dimension is None or dimension.angle is None else str(dimension)  # of a product the user says it
    by_choice = {unit: unit for unit in choice}
    if label is not None and label not in choice:
        level = "velocities" if at_velocity else "positions"
        fault = f"an equation of {level} is in {' or '.join(choice)}, not in {label} [E1618]"
        report.add(f"{key}.unit", fault, choice[0])
    elif own_unit and own_unit not in choice:
        report.add(field, f"the equation is in {own_unit} [E1619]", f"an equation in {' or '.join(choice)}")
    elif label is not None and own_unit and label != own_unit:
        report.add(f"{key}.unit", f"the equation is in {own_unit}, not in {label} [E1620]", f'"{own_unit}"')
    elif label is None and not own_unit:
        fault = "the unit of the equation does not follow from its text [E1621]"
        report.add(key, fault, f'unit = "{choice[0]}", or "{choice[1]}" of angles and numbers')
    return label or by_choice.get(own_unit, choice[0])  # type: ignore[call-overload]  # known is any text
