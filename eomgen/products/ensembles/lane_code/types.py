"""Types of the translation: values common to all lanes, and values per lane."""

from __future__ import annotations

from dataclasses import dataclass


class Type:
    """A type of an expression or of a variable."""


@dataclass(frozen=True)
class Void(Type):
    """No value."""


@dataclass(frozen=True)
class Real(Type):
    """A number in each lane."""


@dataclass(frozen=True)
class Constant(Type):
    """A number that all lanes have in common: literals, and tables of a method's coefficients."""


@dataclass(frozen=True)
class Whole(Type):
    """A whole number that all lanes have in common: counters of loops, sizes, places."""


@dataclass(frozen=True)
class Wholes(Type):
    """A whole number in each lane."""


@dataclass(frozen=True)
class Truths(Type):
    """The result of a comparison in each lane: all bits set, or none."""


@dataclass(frozen=True)
class Structure(Type):
    """A structure, by its name; all its members are of lanes."""

    name: str


@dataclass(frozen=True)
class Pointer(Type):
    """An address common to all lanes, of values per lane."""

    to: Type


@dataclass(frozen=True)
class Array(Type):
    """An array; ``size`` is the text of its dimension."""

    of: Type
    size: str


@dataclass(frozen=True)
class Other(Type):
    """Values passed through unchanged, such as members that are characters or functions."""

    text: str


def spelled(kind: Type) -> str:
    """Return the C text of a type, arrays aside."""
    match kind:
        case Real():
            return "real"
        case Constant():
            return "double"
        case Whole():
            return "long"
        case Wholes() | Truths():
            return "eg_wholes"
        case Structure(name) | Other(name):
            return name
        case Pointer(Array(of, size)):
            return f"{spelled(of)} (*)[{size}]"
        case Pointer(to):
            return f"{spelled(to)} *"
        case Void():
            return "void"
    raise TypeError(f"no C text of {kind}")


def element(kind: Type) -> Type:
    """Return the type of the elements of a pointer or an array."""
    if isinstance(kind, Array):
        return kind.of
    if isinstance(kind, Pointer):
        return kind.to
    raise TypeError(f"{kind} has no elements")


def leaf(kind: Type) -> Type:
    """Return the innermost element type of an address, or of an array of arrays."""
    while isinstance(kind, Pointer | Array):
        kind = element(kind)
    return kind
