"""FMUs of tests: written once for each scene and version, run by FMPy, compared with the runs of eomgen."""

from __future__ import annotations

import ctypes
import logging
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.logging import addLoggerProxy
from fmu_manipulation_toolbox.checker import get_checkers
from fmu_manipulation_toolbox.operations import FMU
from numpy.typing import NDArray

import eomgen

#: Status of values that cannot be computed.
DISCARD = 2
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


class Unit:
    """An FMU after its initialization, and its messages: in co-simulation, ``cs``, or in model exchange, ``me``.

    Parameters
    ----------
    file : of the FMU, or the folder of an unpacked one
    start : False: the initialization is left to the caller
    values : start values by name
    """

    def __init__(
        self, file: Path, kind: str = "cs", *, start: bool = True, values: Mapping[str, float] | None = None
    ) -> None:
        self.folder = str(file) if file.is_dir() else fmpy.extract(str(file))
        description = fmpy.read_model_description(self.folder)
        self.places = {item.name: item.valueReference for item in description.modelVariables}
        self.version, self.messages = int(description.fmiMajorVersion), list[str]()
        module = fmpy.fmi2 if self.version == 2 else fmpy.fmi3
        self.fmu = getattr(module, f"FMU{self.version}{'Slave' if kind == 'cs' else 'Model'}")(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=(description.coSimulation or description.modelExchange).modelIdentifier,
            instanceName="one",
        )
        if self.version == 2:
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(self.note)
            callbacks.allocateMemory = fmpy.fmi2.defaultCallbacks.allocateMemory
            callbacks.freeMemory = fmpy.fmi2.defaultCallbacks.freeMemory
            addLoggerProxy(ctypes.byref(callbacks))
            self.fmu.instantiate(callbacks=callbacks, loggingOn=True)
            self.fmu.setupExperiment(startTime=0.0)
        else:
            self.fmu.instantiate(loggingOn=True, logMessage=self.note)
        if start:
            self.fmu.enterInitializationMode()
            self.set(values or {})
            self.fmu.exitInitializationMode()

    def note(self, *arguments: Any) -> None:
        self.messages.append(arguments[-1].decode())

    def call(self, name: str, *arguments: Any) -> int:
        """Return the status of a function of FMI, by its name without the prefix."""
        function = getattr(self.fmu.dll, f"fmi{self.version}{name}")
        return int(function(ctypes.c_void_p(self.fmu.component), *arguments))

    def refuses(self, message: str, call: Callable[[], Any]) -> None:
        """Assert that a call fails with an error and a message."""
        with pytest.raises(FMICallException, match=r"\(error\)"):
            call()
        assert message in self.messages[-1], self.messages

    def set(self, values: Mapping[str, float]) -> None:
        if values:
            write = self.fmu.setFloat64 if self.version == 3 else self.fmu.setReal
            write([self.places[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        read = self.fmu.getFloat64 if self.version == 3 else self.fmu.getReal
        return list(read([self.places[name] for name in names]))

    def update(self) -> Any:
        return self.fmu.newDiscreteStates() if self.version == 2 else self.fmu.updateDiscreteStates()

    def continuous(self) -> None:
        """Go to continuous time in model exchange, with the states in ``x``, which ``pointer`` gives to functions."""
        self.update()
        self.fmu.enterContinuousTimeMode()
        self.x = np.zeros(sum(name.startswith("der(") for name in self.places))
        self.pointer = self.x.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        self.fmu.getContinuousStates(self.pointer, len(self.x))

    def state(self) -> Any:
        return self.fmu.getFMUState() if self.version == 3 else self.fmu.getFMUstate()

    def go_back(self, state: Any) -> None:
        (self.fmu.setFMUState if self.version == 3 else self.fmu.setFMUstate)(state)

    def bytes_of(self, state: Any) -> bytes:
        return bytes((self.fmu.serializeFMUState if self.version == 3 else self.fmu.serializeFMUstate)(state))

    def read(self, content: bytes) -> Any:
        return (self.fmu.deserializeFMUState if self.version == 3 else self.fmu.deSerializeFMUstate)(content)

    def rates(self, x: Sequence[float]) -> int:
        """Return the status of the derivatives at a state."""
        numbers = (ctypes.c_double * len(x))(*x)
        self.fmu.setContinuousStates(numbers, len(x))
        name = "GetDerivatives" if self.version == 2 else "GetContinuousStateDerivatives"
        return self.call(name, (ctypes.c_double * len(x))(), ctypes.c_size_t(len(x)))


def messages_of(file: Path | str, kind: str, end: float, **options: Any) -> list[str]:
    """Return the log of a run by FMPy."""
    messages: list[str] = []
    note = {"debug_logging": True, "logger": lambda *words: messages.append(words[-1].decode())}
    fmpy.simulate_fmu(str(file), fmi_type=kind, stop_time=end, **note, **options)
    return messages
