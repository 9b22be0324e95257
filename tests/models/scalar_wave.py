"""The bar of examples/scalar_wave, whose front end is a module beside its demo."""

from __future__ import annotations

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[2] / "examples" / "scalar_wave"


def _module(name: str) -> Any:
    spec = spec_from_file_location(f"scalar_wave_{name}", FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look up the module of their annotations
    spec.loader.exec_module(module)
    return module


bar = _module("bar")
