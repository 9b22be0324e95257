"""Methods that verbs give to ``Model`` and ``Solution``, each imported on first use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MethodType
from typing import Any

from eomgen.base.calls import UnknownAttribute, checked_call
from eomgen.base.verbs import Verb, methods_of, others, own
from eomgen.errors import UsageError


class _Method:
    """Attribute of a class that imports the function on first use, and then is replaced by the function."""

    def __init__(self, kind: type, name: str, *row: Any) -> None:
        self.kind, self.name, self.row = kind, name, row

    def __get__(self, owner: object, kind: type) -> object:
        setattr(self.kind, self.name, _function(*self.row))
        return getattr(kind if owner is None else owner, self.name)


def _function(verb: Verb, target: str, meant: Mapping[str, str]) -> Any:
    return checked_call(**meant)(verb.imported(target, callable, "function"))


def attach_methods(kind: type, meant: Mapping[str, str]) -> None:
    """Give a class the methods of eomgen's own verbs.

    Parameters
    ----------
    kind : ``Model`` or ``Solution``
    meant : as of ``checked_call``
    """
    for name, *row in methods_of(own(), kind.__name__):
        setattr(kind, name, _Method(kind, name, *row, meant))


def attribute_of_others(
    kind: type, owner: object, name: str, meant: Mapping[str, str], otherwise: Callable[[], object]
) -> object:
    """Return the method that another distribution adds to a class, bound to ``owner``; without one, the result of
    ``otherwise``.

    Parameters
    ----------
    kind : ``Model`` or ``Solution``
    owner : an object of this class
    name : name of the attribute
    meant : as of ``checked_call``
    otherwise : returns another attribute, or raises an error for an unknown one
    """
    row = None if name.startswith("_") else others().methods.get((kind.__name__, name))
    try:
        return MethodType(_function(*row, meant), owner) if row else otherwise()
    except UsageError as error:
        faults = [problem for fault in others().faults.values() for problem in fault.problems]
        raise UnknownAttribute([*error.problems, *faults]) from None
