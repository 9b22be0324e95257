"""The part of ``eomgen info`` on contacts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.cli.info import InfoPart
from eomgen.cli.printing import print_table
from eomgen.scene.scene import Scene

_COLUMNS = ("name", "shape", "of", "on", "normal", "tangential")


def _describe(scene: Scene) -> Mapping[str, Any]:
    contacts: list[Any] = [element for element in scene.elements if element.section == "contacts"]
    rows = [
        (
            item.name,
            item.shape,
            item.second.body,
            f"{item.housing or ('surface' if item.surface is not None else 'plane')} of {item.first.body}",
            item.normal.name,
            "" if item.tangential is None else item.tangential.name,
        )
        for item in contacts
    ]
    return {"contacts": [dict(zip(_COLUMNS, row, strict=True)) for row in rows]}


def _show(data: Mapping[str, Any]) -> None:
    if data["contacts"]:
        print_table("contacts", _COLUMNS, [tuple(item.values()) for item in data["contacts"]])


INFO = InfoPart(describe=_describe, show=_show, hidden=lambda _: ())
