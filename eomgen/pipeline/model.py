"""Model: a compiled scene with its analyses and runs: methods from the register of verbs, imported on first use.

Type checkers read ``model.pyi``, which is generated from the register.
"""

from __future__ import annotations

import inspect
from types import MethodType

from eomgen.base.calls import UnknownAttribute, checked_call, checked_calls, none_to_set
from eomgen.base.verbs import Verb, methods_of, others, own
from eomgen.compiled.model import CompiledModel
from eomgen.errors import UsageError

#: Names that other tools give to arguments, and the names here.
_MEANT = {"inputs": "u", "tau": "u", "states": "z", "time": "t"}


@checked_calls('eomgen.build("scene.toml") or eomgen.build(scene), which make one', **_MEANT)
class Model(CompiledModel):
    """A compiled scene.

    All functions take arrays whose last axis holds the components; leading axes are a batch and broadcast. SI units,
    twists angular first, quaternions (w, x, y, z). ``t`` defaults to 0, ``u`` to the scene's formulas at ``t`` (or 0),
    ``parameters`` (a mapping from names to values, or an array) to the scene's values, ``z`` (likewise) to the internal
    states' initial values, ``base`` to the scene's prescribed motion at ``t``.
    A term that the model was built without raises UsageError, and so does an argument of the wrong shape.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if "initial_z" in vars(self) and not (name.startswith("_") or name in vars(self) or hasattr(type(self), name)):
            options = [*inspect.signature(type(self).simulate).parameters][1:]
            raise none_to_set(self, name, options, self.parameters)
        super().__setattr__(name, value)

    def __getattr__(self, name: str) -> object:
        """Return a method that another distribution adds. Raises UnknownAttribute."""
        if name.startswith("_"):
            return super().__getattr__(name)
        added = others()
        try:
            if name in added.methods:
                return MethodType(_method(*added.methods[name]), self)
            return super().__getattr__(name)
        except UsageError as error:
            faults = [problem for fault in added.faults.values() for problem in fault.problems]
            raise UnknownAttribute([*error.problems, *faults]) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *others().methods]


class _Method:
    """Attribute of ``Model`` that imports the function on first use, and then is replaced by the function."""

    def __init__(self, name: str, verb: Verb, target: str) -> None:
        self.name = name
        self.row = verb, target

    def __get__(self, model: Model | None, owner: type[Model]) -> object:
        setattr(Model, self.name, _method(*self.row))
        return getattr(owner if model is None else model, self.name)


def _method(verb: Verb, target: str) -> object:
    return checked_call(**_MEANT)(verb.imported(target, callable, "function"))


for _row in methods_of(own()):
    setattr(Model, _row[0], _Method(*_row))
