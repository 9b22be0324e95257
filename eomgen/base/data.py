"""Dataclasses whose methods are compiled on first use, so that imports take less time; and work without the cyclic
garbage collector.

Compiling takes 0.3 to 0.6 ms for each class. A process uses few of the several hundred classes that it imports, and of
most of these a few instances, such as the rows of a register, which are filled without a compiled constructor.
"""

from __future__ import annotations

import dataclasses
import gc
import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, asdict, field, fields
from functools import cache, partial
from types import FunctionType
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

__all__ = [
    "EvaluatesOnce",
    "asdict",
    "dataclass",
    "field",
    "field_names",
    "fields",
    "is_dataclass",
    "replace",
    "without_garbage_collection",
    "wrap_method",
]

_Quantity = TypeVar("_Quantity")
#: Attributes that ``dataclasses.dataclass`` makes, by the option that asks for the attribute; empty for any options.
_MADE = {
    "": ("__dataclass_fields__", "__dataclass_params__", "__match_args__", "__init__"),
    "repr": ("__repr__",),
    "eq": ("__eq__", "__hash__"),
    "frozen": ("__setattr__", "__delattr__"),
}
_COMPILING = threading.RLock()
#: Annotations of other attributes than fields, and of a field that is an argument of the constructor alone.
_SPECIAL = ("ClassVar", "InitVar", "KW_ONLY")
_SET: Any = object.__setattr__
#: Arguments of a constructor by name, each with its default and the function that makes its default.
_Arguments = Mapping[str, tuple[object, Any]]
#: Attributes that each class has of its own, which are not for another one.
_OF_EVERY_CLASS = ("__dict__", "__weakref__", "__module__", "__abstractmethods__", "_abc_impl")


#: An instance that is filled takes 2 us longer than one by a compiled constructor.
_MOST_FILLED = 50


class _DeferredAttribute:
    """Descriptor in place of an attribute of a dataclass whose methods are not compiled yet: a request compiles the
    methods and returns the attribute."""

    __slots__ = ("filled", "given", "kind", "module", "name", "options", "wrap")

    def __init__(
        self, kind: type, name: str, options: dict[str, Any], declared_fields: Mapping[str, dataclasses.Field[Any]]
    ) -> None:
        self.kind, self.name, self.options, self.module = kind, name, options, kind.__module__
        self.given = declared_fields
        self.filled = 0
        self.wrap: Callable[[Any], Any] = _as_compiled

    def __get__(self, instance: object, owner: type) -> Any:
        if self.name == "__init__" and instance is not None and self.filled < _MOST_FILLED:
            sets = self.options.get("frozen") or owner.__setattr__ is _SET
            if sets and _arguments(cast("Hashable", self.kind)):
                self.filled += 1
                return partial(self._fill, instance)
        return self._compiled_attribute(instance, owner)

    def _fill(self, instance: Any, /, *values: object, **named: object) -> None:
        """Set the fields of an instance as the constructor does, and call ``__post_init__``; for arguments that do not
        fit, the constructor is compiled and called."""
        arguments = _arguments(cast("Hashable", self.kind))
        state = dict(zip(arguments, values, strict=False))
        known = len(state) == len(values) and state.keys().isdisjoint(named) and named.keys() <= arguments.keys()
        for name, (default, factory) in arguments.items() if known else ():
            if name not in state:
                state[name] = named[name] if name in named else default if factory is MISSING else factory()
                known = known and state[name] is not MISSING
        if not known:
            self._compiled_attribute(instance, type(instance))(*values, **named)
            return
        vars(instance).update(state)
        if hasattr(instance, "__post_init__"):
            instance.__post_init__()

    def _compiled_attribute(self, instance: object, owner: type) -> Any:
        """Return the attribute itself, after a compilation."""
        with _COMPILING:
            if vars(self.kind).get(self.name) is self:
                self._compile()
        value: Any = vars(self.kind).get(self.name)  # a signature is the constructor's then
        return value.__get__(instance, owner) if hasattr(type(value), "__get__") else value

    def _compile(self) -> None:
        """Compile a copy of the class and move its attributes: other threads never see the class without methods."""
        kind = self.kind
        attributes = {name: value for name, value in vars(kind).items() if not isinstance(value, _DeferredAttribute)}
        namespace = {name: value for name, value in attributes.items() if name not in ("__dict__", "__weakref__")}
        namespace |= {"__module__": self.module, "__qualname__": kind.__qualname__, **self.given}
        compiled: Any = type(kind)(kind.__name__, kind.__bases__, namespace)
        dataclasses.dataclass(**self.options)(compiled)  # types of fields are looked up in the module
        additions = {name: value for name, value in vars(compiled).items() if attributes.get(name, self) is not value}
        for value in additions.values():  # methods of frozen classes know their class
            for cell in getattr(value, "__closure__", None) or ():
                if cell.cell_contents is compiled:
                    cell.cell_contents = kind
        for name, value in additions.items():
            if name not in _OF_EVERY_CLASS and (name, value) != ("__hash__", None):  # Python's, with an own __eq__
                setattr(kind, name, getattr(vars(kind).get(name), "wrap", _as_compiled)(value))
        for name in [name for name in vars(kind) if name not in vars(compiled)]:
            if name not in _OF_EVERY_CLASS:
                delattr(kind, name)


def _as_compiled(value: Any) -> Any:
    return value


@cache
def _arguments(kind: Any) -> _Arguments:
    """Return the arguments of the constructor of a dataclass by name, each with default and default factory, MISSING
    without; empty if only a compiled constructor has all of them, or if the class has a fault, which the compilation
    reports."""
    arguments: dict[str, tuple[object, Any]] = {}
    if not kind.__dictoffset__:
        return {}
    for base in reversed(kind.__mro__):
        own_fields = _own_fields(base)
        if own_fields is None:
            return {}
        for name, (annotation, value) in own_fields.items():
            if annotation.startswith("ClassVar"):
                continue
            if _is_special(annotation, value) or hasattr(getattr(kind, name, None), "__set__"):
                return {}
            is_field = isinstance(value, dataclasses.Field)
            arguments[name] = (value.default, value.default_factory) if is_field else (value, MISSING)
    needed = [default is MISSING and factory is MISSING for default, factory in arguments.values()]
    return arguments if needed == sorted(needed, reverse=True) else {}


def _own_fields(base: type) -> dict[str, tuple[str, Any]] | None:
    """Return for each field of one class without its bases the annotation as text and the given value, a default or a
    field; None if the class has options that only a compilation heeds."""
    made = vars(base).get("__dataclass_fields__")
    if not isinstance(made, _DeferredAttribute):
        return {name: (str(item.type).removeprefix("typing."), item) for name, item in (made or {}).items()}
    if not made.options.keys() <= {"frozen", "repr", "eq", "order"}:
        return None
    return {
        name: (str(annotation).removeprefix("typing."), made.given.get(name, getattr(base, name, MISSING)))
        for name, annotation in base.__annotations__.items()
    }


def _is_special(annotation: str, value: object) -> bool:
    """Return whether only a compiled constructor treats a field as dataclasses do."""
    special = any(word in annotation for word in _SPECIAL) or isinstance(value, list | dict | set)
    return special or (isinstance(value, dataclasses.Field) and not (value.init and value.kw_only is not True))


def _defer(kind: type, options: dict[str, Any]) -> type:
    asked = {"": True, "repr": True, "eq": True, "frozen": False, **options}
    declared_fields = {name: value for name, value in vars(kind).items() if isinstance(value, dataclasses.Field)}
    for name, value in declared_fields.items():  # a compiled class has defaults alone
        if value.default is MISSING:
            delattr(kind, name)
        else:
            setattr(kind, name, value.default)
    for name in ("__signature__", *(name for option, names in _MADE.items() if asked[option] for name in names)):
        attribute = vars(kind).get(name)
        if attribute is None:  # a class with an own __eq__ has None as its __hash__
            unhashable = name == "__hash__" and not (asked["frozen"] or asked.get("unsafe_hash"))
            setattr(kind, name, None if unhashable else _DeferredAttribute(kind, name, options, declared_fields))
    return kind


@cache
def field_names(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass, in order, without a compilation. Raises TypeError for any other
    class."""
    bases: tuple[type, ...] = kind.__mro__
    if not is_dataclass(kind):
        raise TypeError(f"{kind.__qualname__} is not a dataclass")
    annotations_of_bases = [base.__annotations__ for base in reversed(bases) if "__dataclass_fields__" in vars(base)]
    hints = {name: str(hint) for annotations in annotations_of_bases for name, hint in annotations.items()}
    return tuple(name for name, hint in hints.items() if "ClassVar" not in hint)


def wrap_method(kind: type, name: str, wrap: Callable[[Any], Any]) -> None:
    """Replace a method of a class, in place, by ``wrap`` of the method. A constructor of a dataclass that is not
    compiled yet is wrapped when compiled, so only for calls that it refuses."""
    attribute = vars(kind).get(name)
    if isinstance(attribute, _DeferredAttribute):
        attribute.wrap = wrap
    elif isinstance(method := getattr(kind, name), FunctionType):
        setattr(kind, name, wrap(method))


if TYPE_CHECKING:
    from dataclasses import dataclass, is_dataclass, replace
else:

    def is_dataclass(value: object) -> bool:
        """Return whether a class, or the class of an object, is a dataclass, without a compilation."""
        kind = value if isinstance(value, type) else type(value)
        return any("__dataclass_fields__" in vars(base) for base in kind.__mro__)

    def replace(given: Any, /, **changes: Any) -> Any:
        """Return a copy of an object with other fields as ``dataclasses.replace`` does; methods are not compiled if the
        constructor takes all fields."""
        arguments = _arguments(type(given))
        if not arguments:  # an object of another class among them
            return dataclasses.replace(given, **changes)
        return type(given)(**{name: getattr(given, name) for name in arguments} | changes)

    def dataclass(kind: type | None = None, /, **options: Any) -> Any:
        """Make a dataclass as ``dataclasses.dataclass`` does, with the same options except ``slots``."""
        return _defer(kind, options) if kind is not None else lambda kind: _defer(kind, options)


class EvaluatesOnce:
    """Base of facts from which rows of a register follow: several rows share a quantity that a product defines."""

    def once(self, quantity: Callable[[Self], _Quantity]) -> _Quantity:
        """Return ``quantity(self)``, which is evaluated at the first request."""
        known: dict[object, _Quantity] = self.__dict__.setdefault("_evaluated", {})
        if quantity not in known:
            known[quantity] = quantity(self)
        return known[quantity]


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Disable the cyclic garbage collector within the block, and enable it again if it was enabled before.

    Modules and tapes are up to millions of objects without cycles. The collector looks at all objects each time that
    the number of objects has grown by a quarter, which was a quarter to a third of the time of a model of thousands
    of bodies, and a tenth of the way to a first step. Objects without references are freed as ever.

    All objects are counted as old afterwards: else the next search, for young objects, would look at all that were made
    meanwhile.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            if not gc.get_freeze_count():  # else a caller has objects frozen, which stay so
                gc.freeze()
                gc.unfreeze()
            gc.enable()
