"""The section of doubts of a scene file: names of doubts that are not reported, and whether others are errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from eomgen.products.doubts.settings import fault_of_name
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.section import Reading, Section


class Doubts(Table):
    """Doubts about the scene and its runs."""

    quiet: Annotated[tuple[str, ...], Field(strict=False)] = key(
        "notes, warnings of equilibria and checks of runs that are not reported, by name",
        (),
        kind="list of names",
        example='["unused names"]',
    )
    strict: bool = key("errors in place of all other doubts", False, example="true")


class _Doubts(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        table = reading.document.table(self.key)
        quiet: tuple[str, ...] = () if table is None else table.quiet
        for index, name in enumerate(quiet):
            if fault := fault_of_name(name):
                reading.report.add(f"doubts.quiet[{index}]", *fault)
        strict = table is not None and table.strict
        return {"settings": (quiet, strict) if quiet or strict else ()}

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"parts": {self.key: reading.items[self.key]["settings"]}}


DOUBTS = _Doubts(
    key="doubts",
    entry=Doubts,
    single=True,
    method="doubts",
    documentation="Leave out doubts by name, or make errors of them: notes of the scene, warnings of equilibria and"
    " checks of runs.",
)
