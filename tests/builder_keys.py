"""Writes the types of the keys of the builder's methods, a stub for type checkers:
``python -m tests.builder_keys eomgen/scene/builder_keys.pyi``."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

from eomgen.scene.builder import SceneBuilder
from eomgen.scene.builder_methods import signature_of
from eomgen.scene.section import Section
from eomgen.scene.sections import own_sections

COMMAND = "python -m tests.builder_keys eomgen/scene/builder_keys.pyi"
#: Characters of a line at most.
_WIDTH = 120
_HEAD = f'''"""Methods of SceneBuilder from the register of sections, and keys of other methods, for type checkers, by
``{COMMAND}``."""

from collections.abc import Mapping, Sequence
from typing import Any, Self, TypedDict

from eomgen.scene.builder_methods import Rotations, Value
'''


def stub() -> str:
    """Return the text of the stub: a class of the sections' methods, and a class of keys for each other method."""
    text = _HEAD
    for name in ("include", "simulation"):
        text += f"\nclass {name.title()}Keys(TypedDict, total=False):\n"
        for key in inspect.signature(getattr(SceneBuilder, name)).parameters.values():
            if key.kind is inspect.Parameter.KEYWORD_ONLY:
                text += f"    {key.name}: {key.annotation}\n"
    text += "\nclass SectionMethods:\n"
    return text + "".join(_method(row) for row in own_sections())


def _method(row: Section) -> str:
    lines, by_name = [], False
    for item in signature_of(row).parameters.values():
        if item.kind is inspect.Parameter.KEYWORD_ONLY and not by_name:
            lines.append("*")
            by_name = True
        default = "" if item.default is inspect.Parameter.empty else " = ..."
        lines.append(item.name if item.name == "self" else f"{item.name}: {item.annotation}{default}")
    short = f"    def {row.method_name}({', '.join(lines)}) -> Self: ...\n"
    if len(short) <= _WIDTH:
        return short
    arguments = "".join(f"        {line},\n" for line in lines)
    return f"    def {row.method_name}(\n{arguments}    ) -> Self: ...\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(stub(), encoding="utf-8")
