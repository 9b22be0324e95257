"""The syntax tree of a user's formula: a small closed set of nodes, data only.

Code that walks a formula needs to know only these classes; no text of the user goes further than
``parser.py``.
"""

from __future__ import annotations

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
        ``time``, ``place`` (along a beam), ``local`` (place of a load), ``number`` (one of a list), ``parameter``,
        ``input``, ``state``, ``controller``, ``definition`` (until it is written out), ``q``, ``v``, ``a``,
        ``position``, ``velocity``, ``acceleration``, ``gravity``, ``tau``, ``length``, ``rate``, ``tension``,
        ``load``, ``deflection``, ``reaction``, ``drive_effort``, ``section_load`` or ``energy``.
    name : str
        Name of the parameter, input, state, controller, joint, point, spring, tyre, constraint or reaction; empty for
        time, a place and a number; ``position``, ``velocity``, ``rotation`` or ``angular_velocity`` if ``local``;
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
        In its frame, m, formulas of parameters.
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
        ``add sub mul div pow neg``, ``lt le`` (1.0 or 0.0), ``select`` (condition, then, otherwise), or a function:
        ``sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt abs sign min max``.
    arguments : tuple of Formula
    label : str
        Name of the definition whose expression it is; empty for others. Equal operations may differ in it.
    """

    name: str
    arguments: tuple[Formula, ...]
    label: str = field(default="", compare=False, kw_only=True)


@dataclass(frozen=True)
class Quantity(Operation):
    """A quantity of an entry of a section at given arguments, ``WORD.NAME(x, y)[1]``, by a word of the register.

    Attributes
    ----------
    name : str
        The word.
    arguments : tuple of Formula
        The given ones, and behind them the arguments that the word adds.
    item : object
        Object of the entry.
    """

    word: Word
    item: Any
    component: int = 0


def quantity_of(word: Word, item: Any, arguments: tuple[Formula, ...], component: int = 0) -> Quantity:
    """Return the quantity of an entry's object at given arguments."""
    return Quantity(word.name, (*arguments, *word.added(item)), word, item, component)


@dataclass(frozen=True)
class Application(Node):
    """A curve of the scene at an argument, ``road(20 * t)``, or its derivative, ``derivative.road(20 * t)``."""

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
