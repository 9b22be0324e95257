"""The part of ``eomgen info`` on laws."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.cli.info import InfoPart
from eomgen.cli.printing import print_table
from eomgen.scene.scene import Scene


def _describe(scene: Scene) -> Mapping[str, Any]:
    laws = scene.parts.get("laws", ())
    return {
        "laws": [
            {
                "name": law.name,
                "code": str(law.code),
                "arguments": dict(law.inputs),
                "parameters": list(law.given),
                "results": dict(law.outputs),
                "derivatives": law.derivatives,
            }
            for law in laws
        ]
    }


def _show(data: Mapping[str, Any]) -> None:
    if data["laws"]:
        rows = [
            (
                item["name"],
                item["code"],
                _with_units(item["arguments"]),
                _with_units(item["results"]),
                item["derivatives"],
            )
            for item in data["laws"]
        ]
        print_table("laws", ("law", "function", "arguments", "results", "derivatives"), rows)


def _with_units(names: Mapping[str, str]) -> str:
    return ", ".join(f"{name} [{unit}]" if unit else name for name, unit in names.items())


INFO = InfoPart(describe=_describe, show=_show, hidden=lambda _: ())
