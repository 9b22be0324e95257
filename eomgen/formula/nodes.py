"""The syntax tree of a user's formula, a small closed set of nodes, data only, and its text in the way that a user
writes it.

Code that walks a formula needs to know only these classes; no text of the user goes further than
``parser.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.formula.curves import AnyCurve
from eomgen.formula.words import Word


class Node:
    """Operators of formulas: they make nodes without simplification."""

    def __add__(self, other: Formula | float) -> Formula:
        return _operation("add", self, other)

    def __radd__(self, other: float) -> Formula:
        return _operation("add", other, self)

    def __sub__(self, other: Formula | float) -> Formula:
        return _operation("sub", self, other)

    def __rsub__(self, other: float) -> Formula:
        return _operation("sub", other, self)

    def __mul__(self, other: Formula | float) -> Formula:
        return _operation("mul", self, other)

    def __rmul__(self, other: float) -> Formula:
        return _operation("mul", other, self)

    def __truediv__(self, other: Formula | float) -> Formula:
        return _operation("div", self, other)

    def __rtruediv__(self, other: float) -> Formula:
        return _operation("div", other, self)

    def __neg__(self) -> Formula:
        return _operation("neg", self)


@dataclass(frozen=True)
class Number(Node):
    """A literal."""

    value: float


@dataclass(frozen=True)
class Symbol(Node):
    """A name: ``t``, a parameter, input, state, controller, or a quantity as ``q.hinge``, ``velocity.tip[2]``.

    Attributes
    ----------
    kind : str
        ``time``, ``place`` (along a beam), ``local`` (place of a load), ``number`` (a number of a list), ``parameter``,
        ``input``, ``state``, ``controller``, ``definition`` (until the definition is written out), ``q``, ``v``, ``a``,
        ``position``, ``velocity``, ``acceleration``, ``rotation``, ``angular_velocity``, ``gravity``, ``tau``,
        ``length``, ``rate``, ``tension``, ``load``, ``deflection``, ``reaction``, ``drive_effort``, ``section_load`` or
        ``energy``.
    name : str
        Name of the parameter, input, state, controller, joint, point, body, spring, tyre, constraint or reaction; empty
        for time, a place and a number; ``position``, ``velocity``, ``rotation`` or ``angular_velocity`` if ``local``;
        ``kinetic``, ``potential``, ``total``, ``base_power`` or ``power`` for energies.
    index : int
        Component in storage order (q of a spherical joint: quaternion; of a free joint: quaternion, position; of a
        reaction: moment, force; of section_load: a number of an element, after the elements before); 0 if
        there is only one.
    reference: str
        Of ``tau``: the reference motion.
    """

    kind: str
    name: str = ""
    index: int = 0
    reference: str = ""


@dataclass(frozen=True)
class LoadSymbol(Symbol):
    """A quantity of the place of a load, with that place.

    Attributes
    ----------
    body : str
        The loaded one.
    point : tuple of Formula
        In the frame of the body, m, formulas of parameters.
    own_axes : bool
        Whether components are in the body's axes, not in the world's.
    """

    body: str = ""
    point: tuple[Formula, ...] = ()
    own_axes: bool = False


@dataclass(frozen=True)
class Operation(Node):
    """An operator or function applied to arguments.

    Attributes
    ----------
    name : str
        ``add sub mul div pow neg``, ``lt le`` (1.0 or 0.0), ``select`` (condition, then, otherwise), or a function
        of ``words.FUNCTIONS``.
    arguments : tuple of Formula
    label : str
        Name of the definition whose expression the operation is; empty for any other operation. Equal operations may
        differ in the label.
    """

    name: str
    arguments: tuple[Formula, ...]
    label: str = field(default="", compare=False, kw_only=True)


@dataclass(frozen=True)
class EntryQuantity(Operation):
    """A quantity of an entry of a section at given arguments, ``WORD.NAME(x, y)[1]``, by a word of the register.

    Attributes
    ----------
    name : str
        The word.
    arguments : tuple of Formula
        The given arguments, and then the arguments that the word adds.
    item : object
        Object of the entry.
    """

    word: Word
    item: Any
    component: int = 0

    def curves(self) -> tuple[Application, ...]:
        """Return the calls of curves that the quantity is made of."""
        return self.word.curves(self.item, self.arguments)


def quantity_of(word: Word, item: Any, arguments: tuple[Formula, ...], component: int = 0) -> EntryQuantity:
    """Return the quantity of an entry's object at given arguments."""
    return EntryQuantity(word.name, (*arguments, *word.added(item)), word, item, component)


@dataclass(frozen=True)
class Application(Node):
    """A curve of the scene at an argument, ``road(20 * t)``, or the derivative of a curve of the order ``derivative``,
    ``derivative.road(20 * t)``."""

    curve: AnyCurve
    argument: Formula
    derivative: int = 0


def _operation(name: str, *arguments: Any) -> Operation:
    """Return an operation on formulas and numbers."""
    return Operation(name, tuple(Number(float(item)) if isinstance(item, float | int) else item for item in arguments))


Formula = Number | Symbol | Operation | Application
#: Three formulas: the components of a vector.
Vector = tuple[Formula, Formula, Formula]
ZERO: Formula = Number(0.0)
ONE: Formula = Number(1.0)
ZERO_VECTOR: Vector = (ZERO, ZERO, ZERO)


#: Operator, precedence of the whole, least precedence of the left and of the right operand without brackets.
_BINARY = {
    "lt": ("<", 1, 2, 2), "le": ("<=", 1, 2, 2),
    "add": ("+", 2, 2, 2), "sub": ("-", 2, 2, 3),
    "mul": ("*", 3, 3, 3), "div": ("/", 3, 3, 4),
    "pow": ("**", 5, 6, 5),
}  # fmt: skip  # a table
#: Precedences of a choice, of a sign, and of all that takes no brackets.
_PRECEDENCE = {"select": 0, "neg": 4, "atom": 9}
#: Operations that jump (0) or bend (1) at an argument of 0, or at two equal arguments.
NON_SMOOTH = {"lt": 0, "le": 0, "sign": 0, "abs": 1, "min": 1, "max": 1}
#: Kinds of symbols with three components, of points and of bodies.
VECTORS = frozenset({"position", "velocity", "acceleration", "rotation", "angular_velocity", "angular_acceleration"})
#: Kinds of symbols that a formula names without a prefix.
_PLAIN = ("parameter", "input", "state", "controller")


def infix(formula: Formula, sizes: Callable[[Symbol], int] = lambda symbol: 1) -> str:
    """Return a formula as text; ``sizes`` gives the number of components of a symbol, so that a single component has no
    index."""
    return _text(formula, sizes)[0]


def _text(formula: Formula, sizes: Callable[[Symbol], int]) -> tuple[str, int]:
    """Return the text of a formula and the precedence of the outermost operation; ``sizes`` as of ``infix``."""
    if isinstance(formula, Number):
        return f"{formula.value:.9g}", _PRECEDENCE["atom"] if formula.value >= 0.0 else _PRECEDENCE["neg"]
    if isinstance(formula, Symbol):
        return _name(formula, sizes), _PRECEDENCE["atom"]
    if isinstance(formula, Application):
        prefix = "derivative." * formula.derivative
        return f"{prefix}{formula.curve.name}({_text(formula.argument, sizes)[0]})", _PRECEDENCE["atom"]
    return _infix(formula, sizes)


def _name(symbol: Symbol, sizes: Callable[[Symbol], int]) -> str:
    if symbol.kind == "time":
        return "t"
    if symbol.kind == "local":  # of the place at which a load acts, with three components
        return f"{symbol.name}.here[{symbol.index}]"
    name = symbol.name if symbol.kind in _PLAIN else f"{symbol.kind}.{symbol.name}"
    return f"{name}[{symbol.index}]" if sizes(symbol) > 1 or symbol.index else name


def _infix(formula: Operation, sizes: Callable[[Symbol], int]) -> tuple[str, int]:
    """Return the text of an operation, and its precedence."""
    parts = [_text(argument, sizes) for argument in formula.arguments]
    if isinstance(formula, EntryQuantity):
        index = f"[{formula.component}]" if formula.word.components > 1 else ""
        argument_text = ", ".join(text for text, _ in parts[: len(formula.word.arguments_of(formula.item))])
        return f"{formula.word.named(formula.item, formula.component)}({argument_text}){index}", _PRECEDENCE["atom"]

    def at_least(part: tuple[str, int], precedence: int) -> str:
        return part[0] if part[1] >= precedence else f"({part[0]})"

    if formula.name in _BINARY:
        sign, own_precedence, left, right = _BINARY[formula.name]
        return f"{at_least(parts[0], left)} {sign} {at_least(parts[1], right)}", own_precedence
    precedence = _PRECEDENCE.get(formula.name, _PRECEDENCE["atom"])
    if formula.name == "neg":
        return f"-{at_least(parts[0], precedence)}", precedence
    if formula.name == "select":
        condition, then, otherwise = (at_least(part, precedence + 1) for part in parts)
        return f"{then} if {condition} else {otherwise}", precedence
    return f"{formula.name}({', '.join(text for text, _ in parts)})", precedence


def distinct_nodes(formula: Formula) -> Iterator[Formula]:
    """Yield a formula and all parts, depth first from left to right; an object that occurs several times is yielded
    once."""
    seen: set[int] = set()
    waiting = [formula]
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        yield node
        if isinstance(node, Operation):
            waiting += node.arguments[::-1]
        elif isinstance(node, Application):
            waiting.append(node.argument)
