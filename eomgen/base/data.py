"""Dataclasses whose methods are compiled on first use, so that imports take less time; and work without the cyclic
garbage collector.

Compiling takes 0.3 ms for each class, and a process uses few of the several hundred classes that it imports.
"""

from __future__ import annotations

import dataclasses
import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

__all__ = ["asdict", "dataclass", "field", "fields", "is_dataclass", "replace", "without_garbage_collection"]

#: Attributes that ``dataclasses.dataclass`` makes, by the option that asks for the attribute; empty for any options.
_MADE = {
    "": ("__dataclass_fields__", "__dataclass_params__", "__match_args__", "__init__"),
    "repr": ("__repr__",),
    "eq": ("__eq__", "__hash__"),
    "frozen": ("__setattr__", "__delattr__"),
}
#: The attributes that are compiled on a request for one of them.
_LAST = (*_MADE["repr"], *_MADE["eq"])
_COMPILING = threading.RLock()
#: Attributes that each class has of its own, which are not for another one.
_OF_EVERY_CLASS = ("__dict__", "__weakref__", "__module__", "__abstractmethods__", "_abc_impl")


class _DeferredAttribute:
    """Attribute of a dataclass whose methods are not compiled yet: a request compiles the methods and returns the
    attribute itself."""

    __slots__ = ("kind", "module", "name", "options")

    def __init__(self, kind: type, name: str, options: dict[str, Any]) -> None:
        self.kind, self.name, self.options, self.module = kind, name, options, kind.__module__

    def __get__(self, instance: object, owner: type) -> Any:
        with _COMPILING:
            if vars(self.kind).get(self.name) is self:
                self._compile()
        value: Any = vars(self.kind).get(self.name)  # a signature is the constructor's then
        return value.__get__(instance, owner) if hasattr(type(value), "__get__") else value

    def _compile(self) -> None:
        """Compile the methods that a request for this attribute needs: text and comparisons, which most processes do
        not need, or all the rest."""
        kind = self.kind
        if self.name in _LAST:
            dataclasses.fields(kind)  # compiles the rest
            namespace = {"__module__": self.module, "__qualname__": kind.__qualname__, "__doc__": kind.__doc__}
            compiled = type(kind)(kind.__name__, (kind,), namespace)  # which inherits the fields
            dataclasses.dataclass(**{**self.options, "init": False})(compiled)
            for name in [name for name in _LAST if isinstance(vars(kind).get(name), _DeferredAttribute)]:
                setattr(kind, name, vars(compiled).get(name))
        else:
            self._compile_fields()

    def _compile_fields(self) -> None:
        """Compile a copy of the class and move its attributes: other threads never see the class without methods."""
        kind = self.kind
        own = {name: value for name, value in vars(kind).items() if not isinstance(value, _DeferredAttribute)}
        namespace = {name: value for name, value in own.items() if name not in ("__dict__", "__weakref__")}
        namespace |= {"__module__": self.module, "__qualname__": kind.__qualname__}
        compiled: Any = type(kind)(kind.__name__, kind.__bases__, namespace)
        options = {**self.options, "repr": False, "eq": self.options.get("order", False)}
        dataclasses.dataclass(**options)(compiled)  # types of fields are looked up in the module
        for name in ("repr", "eq"):
            setattr(compiled.__dataclass_params__, name, self.options.get(name, True))
        made = {name: value for name, value in vars(compiled).items() if own.get(name, self) is not value}
        for value in made.values():  # methods of frozen classes know their class
            for cell in getattr(value, "__closure__", None) or ():
                if cell.cell_contents is compiled:
                    cell.cell_contents = kind
        for name, value in made.items():
            if name not in _OF_EVERY_CLASS and (name, value) != ("__hash__", None):  # Python's, with an own __eq__
                setattr(kind, name, value)
        for name in [name for name in vars(kind) if name not in vars(compiled)]:
            if name not in (*_OF_EVERY_CLASS, *_LAST):
                delattr(kind, name)


def _deferred(kind: type, options: dict[str, Any]) -> type:
    given = {"": True, "repr": True, "eq": True, "frozen": False, **options}
    for name in ("__signature__", *(name for option, names in _MADE.items() if given[option] for name in names)):
        own = vars(kind).get(name)
        if own is None:  # a class with an own __eq__ has None as its __hash__
            unhashable = name == "__hash__" and not (given["frozen"] or given.get("unsafe_hash"))
            setattr(kind, name, None if unhashable else _DeferredAttribute(kind, name, options))
    return kind


if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(kind: type | None = None, /, **options: Any) -> Any:
        """Make a dataclass as ``dataclasses.dataclass`` does, with the same options except ``slots``."""
        return _deferred(kind, options) if kind is not None else lambda kind: _deferred(kind, options)


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
