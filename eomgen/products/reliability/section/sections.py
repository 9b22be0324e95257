"""The section of random processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.products.reliability.random_processes import MOST_MODES
from eomgen.products.reliability.section.reading import Processes
from eomgen.products.reliability.section.schema import RandomProcess
from eomgen.scene.reading.values import UNKNOWN
from eomgen.scene.section import Entries, Reading, Section, fault_of_variables
from eomgen.scene.signals.curves import Curves


class _Random(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        if name in document.section("random"):
            return fault_of_variables("random process", name, MOST_MODES, document, rows)
        return "", ""

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"random": {}}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        entries = reading.document.section("random")
        curves = Curves(reading.values, reading.folder)
        processes = Processes(reading.values, curves, reading.document.simulation.duration)
        inputs, variables = processes.read(entries)
        reading.add_parameters(variables)
        formulas = {item.name: item.formula for item in inputs if item.formula is not None}
        unknown = set(entries) - set(formulas) | reading.refused["random"]
        reading.tables["random"] |= formulas | dict.fromkeys(unknown, UNKNOWN)
        return {item.name: item for item in inputs}


RANDOM = _Random(
    key="random",
    behind="inputs",
    entry=RandomProcess,
    scene_field="inputs",
    bare="a random process",
    after=("curves",),
    before=("bodies",),
    positional=("type",),
    documentation="""
    Add a stationary random process, which formulas use by its name; its standard normal variables are tunable
    parameters. ``road_class`` is a scene file's ``class``.""",
)
