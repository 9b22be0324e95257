"""Units of formulas in SI, which follow from units of quantities and from labels, and terms of units that disagree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from eomgen.formula.nodes import VECTORS, Application, EntryQuantity, Formula, Number, Operation, Symbol, infix
from eomgen.formula.units.parser import Dimension, dimension_of
from eomgen.formula.words import FUNCTIONS
from eomgen.scene.formula.scope import LOCAL, REACTION_PARTS, SceneNames
from eomgen.scene.joint_types import JOINTS

_OF_KINDS = {
    **{"time": "s", "position": "m", "velocity": "m/s", "acceleration": "m/s^2"},
    **{"rotation": "rad", "angular_velocity": "rad/s", "angular_acceleration": "rad/s^2"},
    **{f"{name}_{axis}": "m" for name in ("contact", "bristle", "deflection") for axis in "xyz"},
    **{"gap": "m", "contact_deflection": "m"},
    **dict.fromkeys(("gap_rate", "slip_velocity_x", "slip_velocity_y", "velocity_x", "velocity_y"), "m/s"),
    **dict.fromkeys(("turn_x", "turn_y", "spin", "wheel_speed"), "rad/s"),
    **dict.fromkeys(("friction_force_x", "friction_force_y", "normal_force"), "N"),
    **{"length": "m", "rate": "m/s", "tension": "N", "load": "N", "deflection": "m", "camber": "rad"},
}
_OF_LOCAL = dict(zip(LOCAL, ("m", "m/s", "rad", "rad/s"), strict=True))
_PER_TIME = {"q": "", "v": "/s", "a": "/s^2"}
_EFFORTS = ("gravity", "tau", "drive_effort")
_EFFORT = {"m": "N", "rad": "N m"}
_LABELLED = ("parameter", "input", "state", "controller")
#: Operations on terms of one unit, with words for terms that disagree; the condition of a choice is not a term.
_ALIKE = {
    "add": "the formula adds {} and {} [W0136]",
    "sub": "the formula subtracts {1} from {0} [W0137]",
    "lt": "the formula compares {} with {} [W0138]",
    "le": "the formula compares {} with {} [W0138]",
    "select": "the formula chooses between {} and {} [W0139]",
    **{name: f"{name}() has the arguments {{}} and {{}} [W0282]" for name in ("min", "max", "atan2")},
}
#: Functions of angles, and of plain numbers; ``tanh(v.hinge)`` stands for ``tanh(v.hinge / 1)`` by common use.
_OF_ANGLES = frozenset({"sin", "cos", "tan"})
_GROWING = frozenset({"exp", "log", "sinh", "cosh"})
_OF_COSINES = frozenset({"asin", "acos"})
_OF_NUMBERS = {name for name, count in FUNCTIONS.items() if count == 1} - {"sqrt", "abs", "sign"}
_KEEPING = frozenset({"add", "sub", "min", "max", "select"})
#: Remedy for terms that disagree.
FACTOR = "a factor that turns one unit into the other"
_NO_UNIT = Dimension((0.0,) * 5, None)
SECOND = Dimension((0.0, 0.0, 1.0, 0.0, 0.0))
#: Index of seconds among the powers of a dimension.
_TIME = SECOND.powers.index(1.0)


class UnitDisagreement(NamedTuple):
    """Terms of a formula whose units disagree, as text, and the units of both terms."""

    text: str
    units: tuple[str, str]


def unit_of(formula: Formula, names: SceneNames) -> str:
    """Return the unit in SI of a formula, ``1`` for a plain number; empty if the unit does not follow from the units of
    quantities and labels. Numbers and unlabelled names may have any unit."""
    known = dimension_of_formula(formula, names)
    return "" if known is None else str(known)


def dimension_of_formula(formula: Formula, names: SceneNames) -> Dimension | None:
    """Return the dimension of a formula by the units of quantities and labels in ``names``; None if unknown. Products
    and powers of unlabelled quantities are unknown, too."""
    return _Units(names).term_dimension(formula)


def labelled_dimension(formula: Formula, names: SceneNames) -> Dimension | None:
    """Return the dimension of a formula if labels determine it, of parameters, inputs, states and curves, or units of
    words; None otherwise, and for a single name. The first term of known dimension decides for a sum, minimum, maximum
    or choice: further terms are not compared."""
    return _Units(names).labelled_dimension(formula)


def disagreement(formula: Formula, names: SceneNames) -> UnitDisagreement | None:
    """Return the first two terms of a sum, comparison or choice whose units are known and differ, or a function's
    argument with a unit; None without a disagreement. Terms within definitions are judged in the definitions
    themselves."""
    if not isinstance(formula, Operation | Application):
        return None
    units = _Units(names)
    units.of(formula)
    return units.first


def hidden_unit(formula: Formula, names: SceneNames, expected: Dimension | None, *, by_time: bool = False) -> str:
    """Return the fault of a formula in which a plain number stands for a quantity with a unit, with a remedy; empty
    without such a number, or if units are unknown.

    ``2 * torque`` has such a number as a force, if ``torque`` is labelled N m. Gains of plain numbers, angles, times
    and their rates, as ``100 * throttle`` and ``5 * (wanted - q.hinge)``, may have any unit, and so may numbers of 13
    digits and more if all factors are such numbers: these are gains that a program computed.

    Parameters
    ----------
    expected : Dimension, optional
        Unit that the key with the formula takes; None if unknown.
    by_time : bool
        Whether a number may be a time or a rate, as the time constant in the rate of a state.
    """
    if not isinstance(formula, Operation | Application):
        return ""
    digits = [len(repr(number.value).partition("e")[0].lstrip("-0.").replace(".", "")) for number in _factors(formula)]
    if min(digits, default=0) >= 13:  # of numbers that a program computed
        return ""
    units = _Units(names, plain=True)
    known = units.labelled_dimension(formula)
    if units.first is not None and not by_time:
        return f"{units.first.text} if its numbers have no unit; try: parameters with units in place of these [W0283]"
    if expected is None or known is None or known.powers == expected.powers or _is_of_gains(known):
        return ""
    unit = Dimension(expected.times(known, -1.0).powers, 0.0)
    if by_time and _is_of_gains(unit):
        return ""
    number = next(factors(formula), "")
    remedy = f"a parameter in {unit} in place of {number}" if number else f"a factor in {unit}, as a parameter"
    return f"the formula is in {known} if its numbers have no unit, and not in {expected}; try: {remedy} [W0284]"


def factors(formula: Formula) -> Iterator[str]:
    """Yield the numbers other than 1 that are factors or divisors in a formula, as text."""
    return map(infix, _factors(formula))


def _factors(formula: Formula) -> Iterator[Number]:
    if isinstance(formula, Operation) and not isinstance(formula, EntryQuantity):
        for argument in formula.arguments:
            if formula.name in ("mul", "div") and isinstance(argument, Number) and abs(argument.value) != 1.0:
                yield argument
            elif formula.name not in _OF_NUMBERS:
                yield from _factors(argument)


def unit_of_symbol(symbol: Symbol, joints: Mapping[str, str], labels: Mapping[str, str]) -> str:
    """Return the unit in SI of a quantity that a formula mentions, as text; empty if unknown, and for coordinates of
    joints with a quaternion.

    Parameters
    ----------
    joints : mapping
        Types of joints by name.
    labels : mapping
        Units of parameters, inputs, states and controllers by name.
    """
    if symbol.kind in _OF_KINDS:
        return _OF_KINDS[symbol.kind]
    match symbol.kind:
        case "local":
            return _OF_LOCAL.get(symbol.name, "")
        case "energy":
            return "W" if symbol.name.endswith("power") else "J"
        case "reaction":
            return "N" if symbol.index >= REACTION_PARTS["force"] else "N m"
    if symbol.kind in _LABELLED:
        return labels.get(symbol.name, "")
    kind = JOINTS.get(joints.get(symbol.name, ""))
    if kind is None or symbol.index >= len(kind.units):
        return ""
    if symbol.kind in _EFFORTS:
        return _EFFORT[kind.units[symbol.index]]
    if symbol.kind not in _PER_TIME or (symbol.kind == "q" and kind.q_size != kind.v_size):
        return ""
    return f"{kind.units[symbol.index]}{_PER_TIME[symbol.kind]}"


def _is_of_gains(dimension: Dimension) -> bool:
    """Return whether values are numbers, angles, times, or rates of these, which plain gains are multiplied by."""
    return not any(power for base, power in enumerate(dimension.powers) if base != _TIME)


def _is_place(formula: Formula) -> bool:
    """Return whether a formula is a sum or difference of positions of points and numbers."""
    if isinstance(formula, Symbol):
        return formula.kind == "position"
    if not isinstance(formula, Operation) or formula.name not in ("add", "sub", "neg"):
        return False
    return all(isinstance(argument, Number) or _is_place(argument) for argument in formula.arguments)


class _Units:
    """Dimensions of all parts of one formula, and in ``first`` the first disagreement of units.

    Parameters
    ----------
    names : SceneNames
        Names of the scene with labels of units and types of joints.
    plain : bool
        Whether factors that are numbers, and values of sines and the like, have no unit; else their unit is unknown.
    """

    def __init__(self, names: SceneNames, *, plain: bool = False) -> None:
        self.names = names
        self.plain = plain
        self.first: UnitDisagreement | None = None
        self.inner = 0  # definitions around the present part
        self.known: dict[int, Dimension | None] = {}
        self.labelled: set[int] = set()  # parts with a label of the user

    def of(self, formula: Formula) -> Dimension | None:
        """Return the dimension of a formula, computed once for each part; None if unknown. Disagreements go to
        ``first``."""
        if isinstance(formula, Number):
            return None
        if id(formula) not in self.known:
            self.known[id(formula)] = self.dimension(formula)
            if self.has_label(formula):
                self.labelled.add(id(formula))
        return self.known[id(formula)]

    def term_dimension(self, formula: Formula) -> Dimension | None:
        """Return the dimension of a term; None for products and powers of quantities without a label: ``q.x**2`` next
        to ``q.x`` has an unwritten factor of 1/m."""
        known, unlabelled = self.of(formula), id(formula) not in self.labelled
        if known is None or (known.angle is None and unlabelled) or (self.plain and _is_of_gains(known)):
            return None
        return known

    def labelled_dimension(self, formula: Formula) -> Dimension | None:
        """Return the dimension of a formula as ``labelled_dimension`` does."""
        known = self.of(formula)
        if isinstance(formula, Operation) and (formula.name in _KEEPING or formula.name == "neg"):
            return next(filter(None, map(self.labelled_dimension, formula.arguments[-2:])), None)
        return known if id(formula) in self.labelled and not isinstance(formula, Symbol) else None

    def has_label(self, formula: Symbol | Operation | Application) -> bool:
        """Return whether the unit of a formula depends on labels that the user gave, or on units of words; arguments
        have to be known already."""
        if isinstance(formula, Symbol):
            return formula.kind in _LABELLED
        if isinstance(formula, EntryQuantity | Application):
            return True
        return any(id(argument) in self.labelled for argument in formula.arguments)

    def dimension(self, formula: Symbol | Operation | Application) -> Dimension | None:
        if isinstance(formula, Symbol):
            return dimension_of(unit_of_symbol(formula, self.names.joints, self.names.labels))
        if isinstance(formula, Application):
            return self.curve_dimension(formula)
        self.inner += bool(formula.label)
        of = self.term_dimension if formula.name in _ALIKE or formula.name in _OF_NUMBERS else self.of
        arguments = [of(argument) for argument in formula.arguments]
        if isinstance(formula, EntryQuantity):
            known = dimension_of(formula.word.unit_of(formula.item, formula.component))
        else:
            known = self.operation(formula, arguments)
        self.inner -= bool(formula.label)
        label = dimension_of(self.names.labels.get(formula.label, "")) if formula.label else None
        return label or known if self.plain else known or label

    def curve_dimension(self, formula: Application) -> Dimension | None:
        argument = self.of(formula.argument)
        value = dimension_of(self.names.labels.get(formula.curve.name, ""))
        if value is None or not formula.derivative:
            return value
        return argument and value.times(argument.power(formula.derivative), -1.0)

    def operation(self, formula: Operation, arguments: Sequence[Dimension | None]) -> Dimension | None:
        """Return the dimension of an operation from the dimensions of the arguments; None if unknown. Disagreements of
        terms and arguments of functions with a unit go to ``first``."""
        first, last = arguments[0], arguments[-1]
        if formula.name in _ALIKE:
            terms = formula.arguments[-2:]
            self.compare(formula, terms, arguments[-2:])
            alike = sorted(filter(None, arguments[-2:]), key=lambda each: each.angle is not None)
            known = {each.powers: each for each in alike}
            if formula.name in _KEEPING:
                return next(iter(known.values())) if len(known) == 1 else None
            return Dimension((0.0,) * 5, 1.0) if formula.name == "atan2" else None
        if formula.name in _OF_NUMBERS:
            self.check_number(formula, first)
            return _NO_UNIT if self.plain else None
        if formula.name in ("neg", "abs"):
            return first
        if formula.name == "sqrt":
            return first and first.power(0.5)
        if formula.name == "pow" and isinstance(formula.arguments[1], Number):
            return first and first.power(formula.arguments[1].value)
        return self.product(formula, first, last) if formula.name in ("mul", "div") else None

    def product(self, formula: Operation, first: Dimension | None, last: Dimension | None) -> Dimension | None:
        """Return the dimension of a product or quotient from the dimensions of both arguments; None if unknown, and for
        factors made of positions, which may be direction cosines."""
        numerator, divisor = formula.arguments
        if self.plain and isinstance(divisor, Number) and first is not None:
            return first if id(numerator) in self.labelled else first.power(1.0)
        if self.plain and isinstance(numerator, Number) and last is not None:
            if formula.name == "div":
                return last.power(-1.0)
            return last if id(divisor) in self.labelled else last.power(1.0)
        if first is None or last is None or any(_is_place(argument) for argument in formula.arguments):
            return None  # a point at a distance of 1 m gives direction cosines
        return first.times(last, 1.0 if formula.name == "mul" else -1.0)

    def check_number(self, formula: Operation, unit: Dimension | None) -> None:
        """Note a disagreement in ``first`` if the argument of a function of plain numbers, as sin or exp, has a unit.
        ``unit`` is the argument's dimension. Accepted are angles, times, and single coordinates as by common use."""
        argument = formula.arguments[0]
        known = isinstance(argument, Symbol) and not (formula.name in _GROWING and argument.kind in _LABELLED)
        bare = formula.name not in _OF_ANGLES and known
        cosine = formula.name in _OF_COSINES and id(argument) not in self.labelled
        if unit is not None and not (unit.is_number or bare or cosine or unit.powers == SECOND.powers):
            text = f"{formula.name}() takes a plain number or an angle, not {self.term(argument, unit)} [W0135]"
            self.note(text, (str(unit), "1"))

    def compare(self, formula: Operation, terms: Sequence[Formula], units: Sequence[Dimension | None]) -> None:
        """Note a disagreement in ``first`` if the two ``terms`` of an operation have known, different dimensions
        ``units``."""
        first, second = units
        if first is not None and second is not None and first.powers != second.powers:
            words = [self.term(term, unit) for term, unit in zip(terms, (first, second), strict=True)]
            self.note(_ALIKE[formula.name].format(*words), (str(first), str(second)))

    def note(self, text: str, units: tuple[str, str]) -> None:
        if self.first is None and not self.inner:
            self.first = UnitDisagreement(text, units)

    def term(self, formula: Formula, unit: Dimension) -> str:
        """Return a term and the unit as text for messages, ``m_arm * g in N``; long terms are cut."""
        text = formula.label if isinstance(formula, Operation) and formula.label else infix(formula, self.size)
        text = text if len(text) <= 48 else f"{text[:48]}..."
        if isinstance(formula, Symbol):
            return f"{text} in {unit_of_symbol(formula, self.names.joints, self.names.labels)}"
        return f"{text} in {unit}"

    def size(self, symbol: Symbol) -> int:
        """Return the number of components of a symbol."""
        kind = JOINTS.get(self.names.joints.get(symbol.name, ""))
        return 3 if symbol.kind in VECTORS else kind.v_size if kind else 1
