"""Writes the types of the keys of the builder's methods, a stub for type checkers:
``python -m tests.builder_keys eomgen/scene/builder_keys.pyi``."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

from eomgen.scene.builder import SceneBuilder

COMMAND = "python -m tests.builder_keys eomgen/scene/builder_keys.pyi"
_HEAD = f'''"""Types of the keys of the methods of SceneBuilder, for type checkers: from the schema, by
``{COMMAND}``."""

from collections.abc import Mapping, Sequence
from typing import Any, Required, TypedDict

from eomgen.scene.builder_methods import Rotations, Value
'''


def stub() -> str:
    """Return the text of the stub: a class for each method that takes keys."""
    text = _HEAD
    for name, method in vars(SceneBuilder).items():
        if name.startswith("_") or name == "build":
            continue
        signature = inspect.signature(method)
        text += f"\nclass {name.title().replace('_', '')}Keys(TypedDict, total=False):\n"
        keys = [item for item in signature.parameters.values() if item.kind is inspect.Parameter.KEYWORD_ONLY]
        for key in keys:
            required = key.default is inspect.Parameter.empty
            text += f"    {key.name}: {f'Required[{key.annotation}]' if required else key.annotation}\n"
        text += "" if keys else "    pass\n"
    return text


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(stub(), encoding="utf-8")
