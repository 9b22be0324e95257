"""Values of scene keys: formulas parsed in a scope, numbers at the default parameters; constant orientations; values
that look as if they were in degrees or in percent.
"""

from __future__ import annotations

import contextlib
import copy
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.formula.curves import Curve
from eomgen.formula.discontinuities import applications, knots_along_a_beam
from eomgen.formula.evaluate import OTHER_VALUES, curves, entries, evaluate, quantities, symbols
from eomgen.formula.nodes import EntryQuantity, Formula, Number, Operation, Symbol, Vector, distinct_nodes
from eomgen.formula.substitution import substitute
from eomgen.formula.units.conversion import misplaced_kind, unit_fault
from eomgen.formula.units.parser import Dimension, dimension_of, read_unit
from eomgen.scene.design_poses import Axes, DesignPoses, FramePlacement, UnknownPoseError
from eomgen.scene.formula.namespaces import mentions_any, read_included
from eomgen.scene.formula.scope import ALONG_A_BEAM, FIXED_PARAMETERS, PARAMETERS, SceneNames, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.joint_types import GROUPS, JOINTS
from eomgen.scene.reading.formula_units import FACTOR, disagreement, hidden_unit, labelled_dimension, unit_of
from eomgen.scene.reading.key_metadata import Table, fields_of
from eomgen.scene.reading.kinds import FaultyText, Rotations
from eomgen.scene.reading.kinds import RotationEntry as WrittenRotation
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.reading.requirements import Row, bound_of
from eomgen.scene.rotations import Rotation, is_rotation, rows, sequence, snapped_rotation, unit_axis
from eomgen.system.description import BASE, WORLD, Requirement, Rule

#: Periods of angles in degrees.
_PERIODS_IN_DEGREES = (90.0, 120.0, 180.0, 360.0, 720.0)
_OF_ANGLES = ("sin", "cos", "tan")


def plain_degrees(formula: Formula) -> Iterator[str]:
    """Yield notes on sines, cosines and tangents of whole numbers of more than a turn."""
    for node in distinct_nodes(formula):
        if not (isinstance(node, Operation) and node.name in _OF_ANGLES and isinstance(node.arguments[0], Number)):
            continue
        if abs(angle := node.arguments[0].value) >= 7.0 and angle.is_integer():
            call = f"{node.name}({angle:.0f}"
            fault = f"{call}) takes {angle:.0f} rad, for angles in formulas are radians"
            yield f"{fault}; {call} * pi / 180) takes degrees [W0300]"


#: Ends of keys whose formulas are 0 somewhere, with a hint for an equation in place of a formula.
_ZERO = {
    ".when": "an event is at the roots of its formula",
    "equation": "the formula is 0 on the constraint",
}
#: Two sides of an equation.
_EQUATION = re.compile(r"([^=<>!]+)==?([^=<>!]+)")
UNKNOWN = Number(math.nan)  # in place of refused values, so that reading can go on to the next problem


@dataclass(eq=False)
class Values:
    """Reader of values, which reports faults by key.

    Parameters
    ----------
    names : SceneNames
        Names that formulas may mention.
    parameters : mapping
        Default value of each parameter that is known.
    report : Report
        Takes the problems.
    refused : collection of str
        Names of entries that were left out; mentions of such names in formulas are not reported.
    judged : collection of str
        Keys whose values an importer has judged; such values are not checked again.
    bounds : mapping
        Rules for single values, by key.
    units : mapping
        Units of the values of formulas, by key.

    Attributes
    ----------
    requirements : rules for values that depend on tunable parameters, in order
    mentioned : names in formulas (fixed parameters, too), as pairs of kind and name
    notes : on values without effect, or with an effect that is hardly meant
    place : along a beam, 0 to 1, at which values are read; None if values cannot vary
    varied : formulas of s of the values that do vary there, by key
    design : poses of the bodies at the design position; known once the joints are read
    """

    names: SceneNames
    parameters: Mapping[str, float]
    report: Report
    refused: Collection[str]
    judged: Collection[str]
    bounds: Mapping[str, Row]
    units: Mapping[str, str]

    def __post_init__(self) -> None:
        self.requirements: list[Requirement] = []
        self.mentioned: set[tuple[str, str]] = set()
        self.notes: list[str] = []
        self.place: float | None = None
        self.varied: dict[str, Formula] = {}
        self.read: Mapping[str, Formula] = {}
        self.design = DesignPoses({})

    def at(self, s: float) -> Values:
        """Return a reader at a place along a beam, which adds problems, requirements and notes to this reader."""
        there = copy.copy(self)
        there.place, there.varied = s, {}
        return there

    def again_at(self, s: float, read: Mapping[str, Formula]) -> Values:
        """Return a reader for one more place along a beam, which adds problems alone.

        Parameters
        ----------
        read : formulas of s by key, read at another place
        """
        there = self.at(s)
        there.read, there.requirements = read, []
        return there

    def formula(self, key: str, value: float | str, scope: Scope) -> Formula:
        """Return the formula of a key's value, a number or a text, in the scene's names; ``UNKNOWN``, after a report,
        for a fault. Formulas of parameters are evaluated at their defaults, and have to satisfy the rule of the key,
        which is kept as a requirement if parameters are tunable. Doubtful units and angles become notes."""
        if isinstance(value, FaultyText):
            return UNKNOWN
        if not isinstance(value, str):
            number = Number(value)
            self._require_bound(key, number, scope)
            return number
        known = self.read.get(key)
        try:
            here = scope if self.place is None else ALONG_A_BEAM.get(scope, scope)
            read = read_included(value, self.names, here) if known is None else known
            formula = self._here(key, read, scope)
        except ArithmeticError as error:
            self.report.add(key, f"at s = {self.place:.6g}, {error}", OTHER_VALUES)
            return UNKNOWN
        except FormulaError as error:
            if not self.mentions_refused(value):
                self.report.add(key, error.what, _hint_of(key, value) or error.hint)
            return UNKNOWN
        if known is not None:
            self._require_bound(key, formula, scope)
            return formula
        self._check_arguments(key, formula)
        doubts = *plain_degrees(formula), *self._periods_in_degrees(formula), *self._held_always(formula)
        self.note(f"{key}: {text}" for text in (*doubts, *self._parts_of_quaternions(key, formula)))
        if terms := disagreement(formula, self.names):
            self.note([f"{key}: {terms.text}; try: {FACTOR}"])
        else:
            expected = dimension_of(self.units.get(key, ""))
            if not self.note_unit(key, labelled_dimension(formula, self.names), expected):
                self.note_hidden_unit(key, formula, expected)
        self.mentioned |= {(symbol.kind, symbol.name) for symbol in symbols(formula)}
        self.mentioned |= {("curve", name) for name in curves(formula)}
        self.mentioned |= entries(formula)
        if scope in (PARAMETERS, FIXED_PARAMETERS):
            try:
                self.value(formula)
            except ArithmeticError as error:
                self.report.add(key, f"at the default parameters, {error} [E0292]", OTHER_VALUES)
                return UNKNOWN
        self._require_bound(key, formula, scope)
        return formula

    def note_hidden_unit(
        self, key: str, formula: Formula, expected: Dimension | None, *, by_time: bool = False
    ) -> None:
        """Note a formula in which a plain number stands for a quantity with a unit, at a key with the expected unit.

        ``by_time``: a number may be a time or a rate, as time constants of states are.
        """
        if self.names.labels and (fault := hidden_unit(formula, self.names, expected, by_time=by_time)):
            self.note([f"{key}: {fault}"])

    def note_unit(self, key: str, known: Dimension | None, expected: Dimension | None) -> bool:
        """Add a note on a formula in another unit than the unit of the key, if both dimensions are known; return
        whether a note is added."""
        if expected is None or known is None or known.powers == expected.powers:
            return False

        plain = f"a plain number, a quantity in {expected} is expected"
        fault = plain if known.is_number else misplaced_kind(str(known), str(expected))
        self.note([f"{key}: the formula is {fault}; try: {FACTOR} [W0288]"])
        return True

    def _check_arguments(self, key: str, formula: Formula) -> None:
        """Report curves, and quantities of entries such as maps, in a formula whose argument has another unit than the
        entry declares."""
        taken = []
        if self.names.curve_arguments:
            for used in applications(formula):
                unit = self.names.curve_arguments.get(used.curve.name, "")
                taken.append((f"the argument of {used.curve.name}", unit, used.argument))
        for item in quantities(formula):
            if item.word.signature is not None:
                units = item.word.signature(item.item).arguments.items()
                taken += [
                    (f"the argument {name} of {item.word.name}.{item.item.name}", unit, argument)
                    for (name, unit), argument in zip(units, item.arguments, strict=False)
                ]
                self._check_order(key, item, dict(units))
        for argument, unit, formula_of in taken:
            argument_unit = unit_of(formula_of, self.names)
            if argument_unit in ("", "1", unit) or not unit:
                continue

            if unit_fault(argument_unit, read_unit(argument_unit), unit) is not None:
                fault = f"{argument} is in {unit} by its own entry, and is given here in {argument_unit} [E1797]"
                self.report.add(key, fault, f"the argument in {unit}, or another unit in that entry")

    def _check_order(self, key: str, item: EntryQuantity, units: Mapping[str, str]) -> None:
        """Report arguments of an entry's quantity that seem exchanged: one with a unit stands for a name without a
        unit, and the name with this unit is given a value without a unit. ``units`` has the declared unit of each
        argument by name."""
        argument_units = [unit_of(argument, self.names) for argument in item.arguments]
        for name, here in zip(units, argument_units, strict=False):
            for unit, there in zip(units, argument_units, strict=False):
                if here and here == units[unit] and not units[name] and there in ("", "1"):
                    label = f"{item.word.name}.{item.item.name}"
                    fault = f"{label} takes {unit} in {here}, and {name} is given in {here} [E1798]"
                    self.report.add(key, fault, f"{label}({', '.join(units)}), with both arguments exchanged")

    def _periods_in_degrees(self, formula: Formula) -> Iterator[str]:
        """Yield notes on periodic curves and maps of angles in rad whose period is a number of degrees."""
        for used in applications(formula):
            curve, name = used.curve, used.curve.name.partition(", line ")[0]
            period = curve.end - curve.start if isinstance(curve, Curve) and curve.outside == "periodic" else 0.0
            if period in _PERIODS_IN_DEGREES and unit_of(used.argument, self.names) == "rad":
                hint = 'the unit of degrees: "90 deg" in points, argument_unit or x_unit = "deg" in a table'
                yield f"{name} has a period of {period:g} rad; try: {hint} [W0301]"

    def _held_always(self, formula: Formula) -> Iterator[str]:
        """Yield notes on curves and maps that hold their end values and have a constant argument beyond the ends."""
        for used in applications(formula):
            curve = used.curve
            if not isinstance(curve, Curve) or curve.outside != "hold":
                continue
            if any(symbol.kind != "parameter" for symbol in symbols(used.argument)):
                continue
            with contextlib.suppress(ArithmeticError):
                if not curve.start <= (value := self.value(used.argument)) <= curve.end and math.isfinite(value):
                    name = curve.name.partition(", line ")[0]
                    fault = f"{name} is asked at {value:.6g}, and its points are from {curve.start:.6g} to"
                    remedy = f"try: the argument in the unit of the points, {curve.start:.6g} to {curve.end:.6g}"
                    yield f"{fault} {curve.end:.6g}: the value at an end is taken always; {remedy} [W0302]"

    def _parts_of_quaternions(self, key: str, formula: Formula) -> Iterator[str]:
        """Yield notes on components of quaternions in the equations of constraints."""
        for symbol in symbols(formula) if key.startswith("constraints.") else ():
            kind = JOINTS.get(self.names.joints.get(symbol.name, "")) if symbol.kind == "q" else None
            if kind is not None and kind.group in GROUPS.values() and symbol.index < 4:
                name = f"q.{symbol.name}"
                fault = f"{name}[{symbol.index}] is a component of a quaternion, of the half angle, and no angle"
                yield f"{fault}; try: a joint of angles, such as universal, or 2 * asin({name}[k]) [W0303]"

    def _here(self, key: str, formula: Formula, scope: Scope) -> Formula:
        """Return a formula at the reader's place along a beam: the place s and fixed parameters are replaced by numbers
        if the formula varies along the beam, which is noted in ``varied`` under ``key``; any other formula stays.

        Raises
        ------
        ArithmeticError
            For a formula without value.
        """
        of_place = any(symbol.kind == "place" for symbol in symbols(formula))
        if self.place is None or not (of_place or ("curve" not in scope.kinds and curves(formula))):
            return formula
        self.varied[key] = formula
        self.mentioned |= {(symbol.kind, symbol.name) for symbol in symbols(formula)}
        self.mentioned |= {("curve", name) for name in curves(formula)}

        def known_number(symbol: Symbol) -> float | None:
            return self.place if symbol.kind == "place" else self.fixed_number(symbol)

        return substitute(formula, known_number)

    def fixed_number(self, symbol: Symbol) -> float | None:
        """Return the number of a fixed parameter; None for any other symbol."""
        if symbol.kind != "parameter" or self.names.parameters.get(symbol.name, True):
            return None
        return self.parameters.get(symbol.name)

    def note(self, notes: Iterable[str]) -> None:
        """Keep notes that are not there yet."""
        self.notes += [note for note in dict.fromkeys(notes) if note not in self.notes]

    def _require_bound(self, key: str, formula: Formula, scope: Scope) -> None:
        """Apply the rule of a key to a formula of parameters; without a rule, require a finite value if parameters are
        tunable and the scope is of parameters alone."""
        bound, of_parameters = bound_of(key, self.bounds), scope in (PARAMETERS, FIXED_PARAMETERS)
        if bound is not None and all(symbol.kind == "parameter" for symbol in symbols(formula)):
            self.require(key, bound, [formula])
        elif of_parameters and isinstance(formula, Operation) and self.is_tunable(formula):
            self.requirements.append(Requirement(self.report.where(key), (formula,)))

    def require(self, key: str, rule: Rule, formulas: Sequence[Formula], later: Report | None = None) -> bool:
        """Report values at the default parameters that break a rule; keep the rule as a requirement if tunable
        parameters occur.

        Parameters
        ----------
        key : dotted key for messages; keys judged by an importer are not checked
        formulas : arguments of the rule, formulas of parameters
        later : report of faults that other equations may remedy; rules that are broken so are not kept

        Returns
        -------
        bool
            Whether the rule holds for all values of parameters.
        """
        if key in self.judged:
            return False
        try:
            numbers = [self.value(formula) for formula in formulas]
        except ArithmeticError as error:
            self.report.add(key, f"at the default parameters, {error} [E0292]", OTHER_VALUES)
            return False
        known = not any(math.isnan(number) for number in numbers)
        broken = known and bool(rule.broken(numbers))
        if broken:
            fault, hint = rule.fault(numbers)
            report = self.report if later is None else later
            report.add(key, f"at s = {self.place:.6g}, {fault}" if key in self.varied else fault, hint)
        tunable = self.is_tunable(*formulas)
        if tunable and not (broken and later is not None):
            self.requirements.append(Requirement(self.report.where(key), tuple(formulas), rule))
        return known and not broken and not tunable

    def knots(self, formulas: Iterable[Formula]) -> tuple[float, ...]:
        """Return the places s between 0 and 1 along a beam, in order, at which formulas of s jump or bend."""
        return knots_along_a_beam(formulas, self.fixed_number)

    def is_tunable(self, *formulas: Formula) -> bool:
        """Return whether some of the formulas have a tunable parameter."""
        return any(map(self.tunable_in, formulas))

    def tunable_in(self, formula: Formula) -> str:
        """Return the first tunable parameter of a formula by name; empty without one."""
        names = (symbol.name for symbol in symbols(formula) if symbol.kind == "parameter")
        return min((name for name in names if self.names.parameters.get(name, False)), default="")

    def mentions_refused(self, text: str) -> bool:
        """Return whether a formula mentions a refused entry, by name in the file of the formula."""
        return mentions_any(text, self.refused)

    def point(self, key: str, name: str) -> bool:
        """Report the name of a missing point, or of a body instead; return whether the name is a point."""
        if name in self.names.bodies and name not in self.names.points:
            hint = f'[points.{name}_origin] with body = "{name}", and its name here'
            self.report.add(key, f"{name} is a body, not a point [E1632]", hint)
            return False
        return check_reference(key, name, self.names.points, "point", self.report)

    def check_kind(self, key: str, entry: Table, choice: str, taken: Mapping[str, str], kind: str = "") -> None:
        """Report keys without a meaning for the kind of an entry, and missing keys that the kind needs. A key with its
        default value counts as not given.

        Parameters
        ----------
        key : dotted key of the entry
        choice : key whose value is the kind
        taken : keys that only some kinds have, by kind, separated by blanks; needed keys with an example, in which a
            comma stands for a comma and a blank: ``"lead=0.01 gain"``
        kind : in place of the value of ``choice``
        """
        kind = kind or getattr(entry, choice)
        keys = {kind: dict(word.partition("=")[::2] for word in words.split()) for kind, words in taken.items()}
        for name in dict.fromkeys(name for keys_of_kind in keys.values() for name in keys_of_kind):
            is_set = getattr(entry, name) != type(entry).model_fields[name].default
            example = keys.get(kind, {}).get(name)
            if is_set and example is None:
                hint = f"{choice} = {' or '.join(word for word, of in keys.items() if name in of)}"
                near = [key for key in keys.get(kind, ()) if key.startswith(f"{name}_")]
                fault = f"{name} has no meaning for {kind} [E1417]"
                self.report.add(f"{key}.{name}", fault, f"{near[0]}, or {hint}" if len(near) == 1 else hint)
            elif example and not is_set:
                hint = f"{name} = {example.replace(',', ', ')}"
                self.report.add(key, f"the {choice} {kind} needs the key {name} [E1418]", hint)

    def keys(self, key: str, entry: Table, *names: str) -> dict[str, Any]:
        """Return the values of an entry by its schema: formulas in the scope of each key, numbers of fixed parameters,
        and values without a scope as they are. Keys that the entry does not give are left out.

        Parameters
        ----------
        names : keys in the order of reading; all keys by default
        """
        meanings = fields_of(type(entry))
        fields = {name: value for name in names or meanings if (value := getattr(entry, name)) is not None}
        return {name: self.by_scope(f"{key}.{name}", value, meanings[name][0].names) for name, value in fields.items()}

    def by_scope(self, key: str, value: Any, scope: Scope | None) -> Any:
        """Return a value of an entry as a formula in a scope, or as a number if the scope is fixed parameters; lists
        part by part, as tuples. Without a scope the value stays."""
        if scope is None:
            return value
        if isinstance(value, tuple):
            return tuple(self.by_scope(f"{key}[{index}]", part, scope) for index, part in enumerate(value))
        return self.constant(key, value) if scope is FIXED_PARAMETERS else self.formula(key, value, scope)

    def vector(self, key: str, value: Sequence[float | str], scope: Scope) -> Vector:
        """Return three formulas."""
        x, y, z = (self.formula(f"{key}[{index}]", entry, scope) for index, entry in enumerate(value))
        return x, y, z

    def value(self, formula: Formula) -> float:
        """Return the value of a formula of parameters at their defaults; NaN if unknown."""
        if type(formula) is Number:  # most formulas of large scenes; UNKNOWN is one of NaN
            return formula.value
        if formula is UNKNOWN or any(symbol.name not in self.parameters for symbol in symbols(formula)):
            return math.nan
        return evaluate(formula, lambda symbol: self.parameters[symbol.name])

    def constant(self, key: str, value: float | str) -> float:
        """Return the number for a value of fixed parameters; NaN if unknown."""
        return self.value(self.formula(key, value, FIXED_PARAMETERS))

    def constants(self, key: str, values: Sequence[float | str]) -> list[float]:
        """Return the numbers of a list of constants."""
        return [self.constant(f"{key}[{index}]", value) for index, value in enumerate(values)]

    def axis(self, key: str, value: Sequence[float | str]) -> Array | None:
        """Return the (3,) unit vector along an axis of constants; None for an unknown component, and for an axis
        without direction, which is reported."""
        numbers = self.constants(key, value)
        if not np.all(np.isfinite(numbers)):
            return None
        axis = unit_axis(numbers)
        if axis is None:
            self.report.add(key, "the axis has no direction [E1838]", "an axis such as [0, 0, 1]")
        return axis

    def rotations(self, key: str, value: Sequence[WrittenRotation], scope: Scope) -> tuple[Rotation, ...]:
        """Return a key's rotations in order, each with a unit axis and an angle as a formula, rad; rotations with a
        faulty axis, which is reported, are left out."""
        result = []
        for index, rotation in enumerate(value):
            axis = self.axis(f"{key}[{index}].axis", rotation.axis)
            angle = self.formula(f"{key}[{index}].angle", rotation.angle, scope)
            if axis is not None:
                result.append(Rotation((float(axis[0]), float(axis[1]), float(axis[2])), angle))
        return tuple(result)

    def constant_rotations(self, key: str, value: Sequence[WrittenRotation]) -> list[tuple[Array, float]] | None:
        """Return intrinsic rotations as pairs of unit axis (3,) and constant angle, rad; None if an axis or an angle is
        unknown."""
        rotations = self.rotations(key, value, FIXED_PARAMETERS)
        result = [(np.array(rotation.axis), self.value(rotation.angle)) for rotation in rotations]
        if len(result) < len(value) or any(math.isnan(angle) for _, angle in result):
            return None
        return result


def _hint_of(key: str, text: str) -> str:
    """Return a remedy for an equation as the text of a key whose formula is 0 somewhere: the difference of both sides;
    empty for other keys and texts."""
    zero = next((meaning for end, meaning in _ZERO.items() if key.endswith(end)), "")
    if zero and (equation := _EQUATION.fullmatch(text)):
        sides = equation[1].strip(), equation[2].strip()
        left = sides[0] if sides[1] in ("0", "0.0") else f"{sides[0]} - ({sides[1]})"
        return f'"{left[:80]}": {zero}'
    return ""


def percent_of_critical(ratio: float) -> str:
    """Return a note on a damping ratio above 1, a part of critical; empty for less."""
    if not ratio > 1.0:
        return ""
    hint = f"; try {ratio / 100.0:.6g}" if ratio <= 100.0 else ""
    return f"{ratio:.6g} is {100.0 * ratio:.6g} % of critical{hint} [W0304]"


def read_orientation(
    key: str, rotation: Rotations | None, orientation: Sequence[Sequence[float]] | None, values: Values
) -> tuple[tuple[float, float, float], ...]:
    """Return the (3, 3) rotation matrix from the keys ``rotation`` or ``orientation`` of an entry, as rows, from own
    axes to the carrier's axes, right angles made exact. After a fault, which is reported, the result is the
    identity."""
    if orientation is not None and rotation is not None:
        values.report.add(f"{key}.orientation", "orientation and rotation are both given [E1839]", "one of them")
    if orientation is not None:
        matrix = np.array(orientation)
        if is_rotation(matrix):
            return rows(snapped_rotation(matrix))
        fault, hint = "the matrix is not a rotation: orthonormal and right-handed to 1e-6 [E1840]", "rotation"
        if is_rotation(-matrix):
            fault, hint = "the axes are left-handed: the determinant is -1 [E1841]", "one of the axes reversed"
        values.report.add(f"{key}.orientation", fault, hint)
        return rows(np.eye(3))
    return rows(sequence(values.constant_rotations(f"{key}.rotation", rotation or ()) or []))


def read_placement(
    key: str,
    given_in: str | None,
    positioned: bool,
    body: str,
    position: Vector,
    axes: Axes,
    values: Values,
    name: str = "position",
) -> tuple[Vector, Axes]:
    """Return position, (3,) formulas in m, and axes, (3, 3), of an entry in the frame of a body, if the key ``in`` of
    the entry may name another frame; unchanged without this key, and after a fault, which is reported.

    Parameters
    ----------
    key : dotted key of the entry
    given_in : the frame in which both are given at the design position; None for the frame of the body
    positioned : whether the entry gives a position, which ``in`` needs
    position, axes : as given, own axes to the axes of this frame
    name : key of the position
    """
    if given_in is None:
        return position, axes
    every = [BASE, WORLD, *values.names.bodies, *values.names.beams]
    if given_in not in every:
        check_reference(f"{key}.in", given_in, every, "body", values.report)
        return position, axes
    if not positioned:
        values.report.add(f"{key}.in", f"in needs a {name}, in the axes of {given_in} [E1842]", f"{name} = [0, 0, 0]")
        return position, axes
    try:
        _, position, axes = values.design.placement_in(FramePlacement(given_in, position, axes), body)
    except UnknownPoseError as error:
        problem = error.problems[0]
        values.report.add(f"{key}.in", f"the design position is not known: {problem.what} [E1843]", problem.hint)
    return position, axes
