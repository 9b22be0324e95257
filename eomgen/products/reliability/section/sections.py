"""The section of random processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.text import NAME_LENGTH
from eomgen.products.reliability.random_processes import MOST_MODES
from eomgen.products.reliability.section.reading import Processes
from eomgen.products.reliability.section.schema import RandomProcess
from eomgen.scene.reading.values import UNKNOWN
from eomgen.scene.section import Entries, Reading, Section
from eomgen.scene.signals.curves import Curves
from eomgen.system.random_processes import variables_of


def fault_of_variables(
    owner: str, name: str, count: int, document: Entries, rows: Sequence[Section]
) -> tuple[str, str]:
    """Return the fault of the names of ``count`` standard normal variables of ``owner``, "random process" or "sea"."""
    last = variables_of(name, count)[-1]
    if len(last) > NAME_LENGTH:
        return f"the {owner} {name} has parameters such as {last}, whose names are too long", "a shorter name"
    every = set(variables_of(name, count))
    for row in rows:
        for taken in every.intersection(document.section(row.key)) if row.bare else ():
            fault = f"the {owner} {name} has the parameter {taken}, and there is {row.bare} of that name"
            return fault, "another name for one of them"
    return "", ""


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
    entry=RandomProcess,
    scene_field="inputs",
    bare="a random process",
    after=("curves",),
    positional=("type",),
    documentation="""
    Add a stationary random process, which formulas use by its name; its standard normal variables are tunable
    parameters. ``road_class`` is a scene file's ``class``.""",
)
