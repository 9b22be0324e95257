"""Model: a compiled scene with its analyses and runs: methods from the register of verbs, imported on first use.

Type checkers read the methods in ``products/model_methods.pyi``, which is generated from the register.
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

from eomgen.base.calls import checked_calls, none_to_set
from eomgen.base.verb_methods import attach_methods, attribute_of_others
from eomgen.base.verbs import others
from eomgen.compiled.model import CompiledModel

if TYPE_CHECKING:
    from eomgen.products.model_methods import ModelMethods
else:
    ModelMethods = object

#: Names that other tools give to arguments, and the names here.
_MEANT = {"inputs": "u", "tau": "u", "states": "z", "time": "t"}


@checked_calls('eomgen.build("scene.toml") or eomgen.build(scene), which make one', **_MEANT)
class Model(CompiledModel, ModelMethods):
    """A compiled scene.

    All functions take arrays whose last axis holds the components; leading axes are a batch and broadcast. SI units,
    twists angular first, quaternions (w, x, y, z). ``t`` defaults to 0, ``u`` to the scene's formulas at ``t`` (or 0),
    ``parameters`` (a mapping from names to values, or an array) to the scene's values, ``z`` (likewise) to the internal
    states' initial values, ``base`` to the scene's prescribed motion at ``t``.
    A term that the model was built without raises UsageError, and so does an argument of the wrong shape.
    """

    if not TYPE_CHECKING:  # names that are not there stay errors of type checkers

        def __setattr__(self, name: str, value: object) -> None:
            known = name.startswith("_") or name in vars(self) or hasattr(type(self), name)
            if "initial_z" in vars(self) and not known:
                options = [*inspect.signature(type(self).simulate).parameters][1:]
                raise none_to_set(self, name, options, self.parameters)
            super().__setattr__(name, value)

        def __getattr__(self, name: str) -> object:
            """Return a method that another distribution adds. Raises UnknownAttribute."""
            return attribute_of_others(Model, self, name, _MEANT, lambda: super(Model, self).__getattr__(name))

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for owner, name in others().methods if owner == "Model")]


attach_methods(Model, _MEANT)
