"""Equations of motion in separated form, as readable C, from the description of a mechanical scene.

The public names, each imported at its first use, so that ``import eomgen`` takes hardly any time.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from eomgen.base.version import __version__

if TYPE_CHECKING:
    from eomgen import control, fields, sampling, spectra, waves
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
    from eomgen.pipeline.controllers import with_controller
    from eomgen.pipeline.model import Model
    from eomgen.pipeline.pipeline import build, derive, generate, load
    from eomgen.products.studies import (
        Extremes,
        Identification,
        RandomVibration,
        RealTime,
        Tradeoff,
        Tuned,
        extremes,
        identify,
        random_vibration,
        tradeoff,
        tune,
    )
    from eomgen.products.studies.savings.study import savings
    from eomgen.results.solution import Solution
    from eomgen.scene.builder import SceneBuilder
    from eomgen.scene.scene import Scene
    from eomgen.system.system import System

#: Rooms that callers use as they are.
_ROOMS = ("control", "fields", "sampling", "spectra", "waves")
_HOMES = {
    **dict.fromkeys(("load", "derive", "generate", "build"), "eomgen.pipeline.pipeline"),
    "Model": "eomgen.pipeline.model",
    "Solution": "eomgen.results.solution",
    "SceneBuilder": "eomgen.scene.builder",
    "Scene": "eomgen.scene.scene",
    "System": "eomgen.system.system",
    **dict.fromkeys(("Extremes", "extremes", "RealTime", "Tradeoff", "Tuned", "tradeoff", "tune"), "eomgen.studies"),
    **dict.fromkeys(("Identification", "RandomVibration", "identify", "random_vibration"), "eomgen.studies"),
    "savings": "eomgen.products.studies.savings.study",
    "with_controller": "eomgen.pipeline.controllers",
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

__all__ = [
    "DescriptionError",
    "EomgenError",
    "Extremes",
    "FileError",
    "Identification",
    "Model",
    "ModelError",
    "NumericalError",
    "Problem",
    "RandomVibration",
    "RealTime",
    "Scene",
    "SceneBuilder",
    "Solution",
    "System",
    "ToolchainError",
    "Tradeoff",
    "Tuned",
    "UsageError",
    "__version__",
    "build",
    "control",
    "derive",
    "extremes",
    "fields",
    "generate",
    "identify",
    "load",
    "random_vibration",
    "sampling",
    "savings",
    "spectra",
    "tradeoff",
    "tune",
    "waves",
    "with_controller",
]


def __getattr__(name: str) -> object:
    if name in _ROOMS:
        return import_module(f"eomgen.{name}")
    if name not in _HOMES:
        text = f"module 'eomgen' has no attribute {name!r}"
        if not name.startswith("_"):
            from eomgen.base.calls import attribute_hint  # noqa: PLC0415  # for a mistake only

            text = f"{text}; try: {attribute_hint(name, __all__)}"
        raise AttributeError(text)
    value = getattr(import_module(_HOMES[name]), name)
    setattr(sys.modules[__name__], name, value)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
