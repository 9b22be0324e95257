"""FMUs of tests: written once for each scene and version, run by FMPy, compared with the runs of eomgen."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import fmpy
import numpy as np
from fmu_manipulation_toolbox.checker import get_checkers
from fmu_manipulation_toolbox.operations import FMU
from numpy.typing import NDArray

import eomgen

Rows = Mapping[str, NDArray[np.float64]]


@cache
def folder() -> Path:
    """Return a folder for the FMUs of this process."""
    return Path(mkdtemp(prefix="eomgen-fmus-"))


def written(scene: Any, version: int, **options: Any) -> Path:
    """Return an FMU of a scene, without reference results."""
    name = f"{len(list(folder().iterdir()))}.fmu"
    return eomgen.fmu(scene, folder() / name, version=version, reference=False, profile="quick", **options)


def names_of(file: Path, causality: str) -> list[str]:
    """Return the names of the variables with a causality."""
    variables = fmpy.read_model_description(str(file)).modelVariables
    return [item.name for item in variables if item.causality == causality]


def recorded(file: Path) -> list[str]:
    """Return the names of states and outputs."""
    states = [name for name in names_of(file, "local") if not name.startswith(("der(", "event."))]
    return [*states, *names_of(file, "output")]


def run(file: Path, kind: str, end: float, interval: float, **options: Any) -> Rows:
    """Return the rows of a simulation by FMPy, ``kind`` being ``CoSimulation`` or ``ModelExchange``."""
    options.setdefault("output", recorded(file))
    return fmpy.simulate_fmu(str(file), fmi_type=kind, stop_time=end, output_interval=interval, **options)


def columns(solution: eomgen.Solution, names: Sequence[str]) -> Rows:
    """Return the rows of a run of eomgen under the names of an FMU, as far as they are known."""
    metadata = solution.metadata
    table = {name: solution.q[:, k] for k, name in enumerate(metadata["names"]["q"])}
    table |= {name: solution.v[:, k] for k, name in enumerate(metadata["names"]["v"])}
    for name, values in solution.outputs.items():
        parts = values.reshape(len(solution.t), -1).T
        labels = [name] if values.ndim == 1 else [f"{name}[{k}]" for k in range(len(parts))]
        table |= dict(zip(labels, parts, strict=True))
    return {name: table[name] for name in names if name in table}


def toolbox_findings(file: Path) -> list[str]:
    """Return the errors that the checkers of the FMU manipulation toolbox report."""
    errors: list[str] = []
    handler = logging.Handler(logging.ERROR)
    handler.emit = lambda record: errors.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("fmu_manipulation_toolbox")
    logger.addHandler(handler)
    try:
        with FMU(str(file)) as archive:
            for checker in get_checkers():
                archive.apply_operation(checker())
    finally:
        logger.removeHandler(handler)
    return errors
