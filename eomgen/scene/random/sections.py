"""The section of random processes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.scene.random.reading import Processes
from eomgen.scene.random.schema import RandomProcess
from eomgen.scene.reading.values import UNKNOWN
from eomgen.scene.section import Reading, Section
from eomgen.scene.signals.curves import Curves


class _Random(Section):
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

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"inputs": tuple(reading.items["random"].values())}


RANDOM = _Random(
    key="random",
    entry=RandomProcess,
    bare="a random process",
    after=("curves",),
    positional=("type",),
    documentation="""
    Add a stationary random process, which formulas use by its name; its standard normal variables are tunable
    parameters. ``road_class`` is a scene file's ``class``.""",
)
