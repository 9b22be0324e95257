"""Other values of tunable parameters as the defaults of generated code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from eomgen.compiled.arguments import by_name, check_finite
from eomgen.compiled.requirements import Requirements
from eomgen.errors import Problem, UsageError
from eomgen.pipeline.front_end import Document
from eomgen.scene.scene import Scene
from eomgen.system.description import Description


def with_parameters(document: Document, described: Description, parameters: Mapping[str, float | str]) -> Scene:
    """Return a scene whose tunable parameters have other values.

    Parameters
    ----------
    document : prepared by its front end, so that calibrated gains follow the scene's own values
    parameters : numbers, or texts with units

    Raises
    ------
    UsageError
        Unknown or fixed names, values that the scene would refuse as its own, and documents of other front ends.
    """
    if not isinstance(document, Scene):
        fault = f"{described.name} is no scene, and only scenes are written with other values of their parameters"
        raise UsageError(Problem("parameters", fault, "leave them out"))
    tunable = [item for item in document.parameters if item.tunable]
    names = [item.name for item in tunable]
    fixed = [item.name for item in document.parameters if not item.tunable]
    start = np.array([item.value for item in tunable])
    values = by_name("parameter", parameters, names, start, fixed, {item.name: item.unit for item in tunable})
    if values.ndim != 1:
        raise UsageError(
            Problem("parameters", "one set of parameters is needed, not a batch", "a number for each name")
        )
    check_finite("parameters", values, [f"parameter {name}" for name in names])
    Requirements(described, names).check(values)
    given = dict(zip(names, values.tolist(), strict=True))
    changed = tuple(replace(item, value=given.get(item.name, item.value)) for item in document.parameters)
    return replace(document, parameters=changed)
