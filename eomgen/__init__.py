"""Equations of motion in separated form, as readable C, from the description of a mechanical scene.

The public names, each imported at its first use, so that ``import eomgen`` takes hardly any time.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from eomgen.base.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

    from eomgen.errors import (
        DescriptionError,
        EomgenError,
        FileError,
        ModelError,
        NumericalError,
        Problem,
        ToolchainError,
        UsageError,
    )
    from eomgen.pipeline.documents import load
    from eomgen.pipeline.generation import generate
    from eomgen.pipeline.model import Model
    from eomgen.pipeline.pipeline import build, derive
    from eomgen.pipeline.saved_models import load_model
    from eomgen.products import exported
    from eomgen.products.exported import *  # noqa: F403  # a stub with __all__
    from eomgen.results.solution import Solution
    from eomgen.scene.builder import SceneBuilder
    from eomgen.scene.scene import Scene
    from eomgen.system.system import System

    __all__ = [
        "DescriptionError",
        "EomgenError",
        "FileError",
        "Model",
        "ModelError",
        "NumericalError",
        "Problem",
        "Scene",
        "SceneBuilder",
        "Solution",
        "System",
        "ToolchainError",
        "UsageError",
        "__version__",
        "build",
        "derive",
        "generate",
        "load",
        "load_model",
    ]
    __all__ += exported.__all__

#: Other names of the core, each with its module; products register theirs.
_HOMES = {
    **dict.fromkeys(("derive", "build"), "eomgen.pipeline.pipeline"),
    "load": "eomgen.pipeline.documents",
    "generate": "eomgen.pipeline.generation",
    "Model": "eomgen.pipeline.model",
    "Solution": "eomgen.results.solution",
    "SceneBuilder": "eomgen.scene.builder",
    "Scene": "eomgen.scene.scene",
    "System": "eomgen.system.system",
    "load_model": "eomgen.pipeline.saved_models",
    **dict.fromkeys(
        (
            "DescriptionError",
            "EomgenError",
            "FileError",
            "ModelError",
            "NumericalError",
            "Problem",
            "ToolchainError",
            "UsageError",
        ),
        "eomgen.errors",
    ),
}


class _PublicModules:
    """Finder of public modules with files elsewhere, such as ``eomgen.control``; asked last, if there is no file."""

    @staticmethod
    def find_spec(
        fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, name = fullname.partition(".")
        if package != __name__ or not name or name.startswith("_"):
            return None
        from eomgen.base.products import spec_of  # noqa: PLC0415  # most imports are of files

        return spec_of(name)


sys.meta_path.append(_PublicModules)


def __getattr__(name: str) -> object:
    if name in _HOMES:
        from eomgen.base.data import without_garbage_collection  # noqa: PLC0415  # for public names
        from eomgen.base.threads import calm_imports  # noqa: PLC0415

        with without_garbage_collection(), calm_imports():
            value = getattr(import_module(_HOMES[name]), name)
    elif name == "__all__":
        value = __dir__()
    else:
        value = _public_name_of_products(name)
    setattr(sys.modules[__name__], name, value)
    return value


def _public_name_of_products(name: str) -> object:
    """Return the public name or module of a product. Raises AttributeError."""
    text = f"module 'eomgen' has no attribute {name!r}"
    if name.startswith("_"):
        raise AttributeError(text)
    from eomgen.base.products import fault_of_absent, fault_of_removed, import_target, public_modules, public_names  # noqa: PLC0415  # for names of products

    if name in public_modules():
        return import_module(f"{__name__}.{name}")
    if name in public_names():
        return import_target(public_names()[name])
    from eomgen.base.calls import attribute_hint  # noqa: PLC0415  # for a mistake only

    if absent := fault_of_absent(name) or fault_of_removed("name", name):
        raise AttributeError(f"{text}: {absent[0]}; try: {absent[1]}")
    raise AttributeError(f"{text}; try: {attribute_hint(name, __dir__())}")


def __dir__() -> list[str]:
    from eomgen.base.products import public_modules, public_names  # noqa: PLC0415  # for lists only

    return sorted(["__version__", *_HOMES, *public_modules(), *public_names()])
