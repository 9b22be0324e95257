"""Calls of FMUs that a faulty importer makes: modes, sizes, steps without end, numbers that are none, states of other
instances, quaternions without a direction; and what the log says."""

from __future__ import annotations

import ctypes
import re
import subprocess
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.logging import addLoggerProxy

import eomgen
from eomgen.base.files import template_folder
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import written

EXAMPLES = Path(__file__).parents[2] / "examples"
HEADERS = template_folder() / "fmu"
#: Two balls that fall on the ground at one time, bounce, and come to rest.
BALLS = """
format = 1
name = "balls"
gravity = [0, 0, -9.81]

[bodies.one]
mass = 0.2

[bodies.other]
mass = 0.3

[joints.left]
type = "prismatic"
parent = "base"
child = "one"
axis = [0, 0, 1]
initial = { position = 0.5 }

[joints.right]
type = "prismatic"
parent = "base"
child = "other"
axis = [0, 0, 1]
initial = { position = 0.5 }

[events.hit_left]
when = "q.left"
direction = "falling"
action = "impact"
restitution = 0.5

[events.hit_right]
when = "q.right"
direction = "falling"
action = "impact"
restitution = 0.5

[simulation]
method = "rk4"
step = 0.01
duration = 2.0
"""
#: Start of the ball "raised".
RAISED = {"left": {"position": "70 cm", "velocity": 2.0}}
VERSIONS = [pytest.param(2, marks=pytest.mark.slow), 3]


def stopped_ball() -> dict[str, Any]:
    """Return one ball, whose run the ground ends."""
    data = tomllib.loads(BALLS)
    del data["bodies"]["other"], data["joints"]["right"], data["events"]["hit_right"]
    data["events"]["hit_left"] = {"when": "q.left", "direction": "falling", "action": "stop"}
    return data


def ranged_ball() -> dict[str, Any]:
    """Return one ball with a mass, a restitution, an input, an internal state and outputs."""
    data = tomllib.loads(BALLS)
    del data["bodies"]["other"], data["joints"]["right"], data["events"]["hit_right"]
    data["parameters"] = {
        "mass": {"value": 0.2, "unit": "kg", "tunable": True},
        "bounce": {"value": 0.5, "tunable": True},
    }
    data["bodies"]["one"]["mass"] = "mass"
    data["events"]["hit_left"]["restitution"] = "bounce"
    data["inputs"] = {"push": {"unit": "N"}}
    data["efforts"] = {"hand": {"joint": "left", "effort": "push"}}
    data["outputs"] = {"height": {"formula": "q.left", "unit": "m"}}
    return data


def linkage() -> dict[str, Any]:
    """Return the four-bar linkage with a ground link of tunable length."""
    data = tomllib.loads((EXAMPLES / "four_bar" / "scene.toml").read_text(encoding="utf-8"))
    data["parameters"]["ground"]["tunable"] = True
    return data


@cache
def file_of(name: str, version: int) -> Path:
    made: dict[str, Callable[[], Any]] = {
        "balls": lambda: tomllib.loads(BALLS),
        "stopped": stopped_ball,
        "ranged": ranged_ball,
        "raised": ranged_ball,
        "linkage": linkage,
    }
    scene = made[name]() if name in made else eomgen.load(EXAMPLES / name / "scene.toml")
    return written(scene, version, initial=RAISED if name == "raised" else None)


class Logged:
    """An FMU after its initialization, and its messages: in co-simulation or in model exchange."""

    def __init__(self, name: str, version: int, kind: str, *, start: bool = True) -> None:
        self.folder = fmpy.extract(str(self.file(name, version)))
        description = fmpy.read_model_description(self.folder)
        self.places = {item.name: item.valueReference for item in description.modelVariables}
        self.version, self.messages = version, list[str]()
        slave, exchange = (
            (fmpy.fmi2.FMU2Slave, fmpy.fmi2.FMU2Model) if version == 2 else (fmpy.fmi3.FMU3Slave, fmpy.fmi3.FMU3Model)
        )
        self.fmu = (slave if kind == "cs" else exchange)(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=(description.coSimulation or description.modelExchange).modelIdentifier,
            instanceName="one",
        )
        if version == 2:
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
            self.fmu.exitInitializationMode()

    def file(self, name: str, version: int) -> Path:
        """Return the FMU of a scene."""
        return file_of(name, version)

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

    def set(self, values: dict[str, float]) -> None:
        write = self.fmu.setFloat64 if self.version == 3 else self.fmu.setReal
        write([self.places[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        read = self.fmu.getFloat64 if self.version == 3 else self.fmu.getReal
        return list(read([self.places[name] for name in names]))

    def update(self) -> Any:
        return self.fmu.newDiscreteStates() if self.version == 2 else self.fmu.updateDiscreteStates()

    def state(self) -> Any:
        return self.fmu.getFMUState() if self.version == 3 else self.fmu.getFMUstate()

    def go_back(self, state: Any) -> None:
        (self.fmu.setFMUState if self.version == 3 else self.fmu.setFMUstate)(state)

    def bytes_of(self, state: Any) -> bytes:
        return bytes((self.fmu.serializeFMUState if self.version == 3 else self.fmu.serializeFMUstate)(state))

    def read(self, content: bytes) -> Any:
        return (self.fmu.deserializeFMUState if self.version == 3 else self.fmu.deSerializeFMUstate)(content)

    def rates(self, x: list[float]) -> int:
        """Return the status of the derivatives at a state."""
        numbers = (ctypes.c_double * len(x))(*x)
        self.fmu.setContinuousStates(numbers, len(x))
        name = "GetDerivatives" if self.version == 2 else "GetContinuousStateDerivatives"
        return self.call(name, (ctypes.c_double * len(x))(), ctypes.c_size_t(len(x)))


DISCARD = 2


@pytest.mark.slow_cases("nan-3")
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_rates_that_are_not_finite_are_discarded_each_time(version: int, bad: float) -> None:
    unit = Logged("balls", version, "me")
    unit.update()
    unit.fmu.enterContinuousTimeMode()
    for place in (2, 3):
        x = [0.5, 0.5, 0.0, 0.0]
        x[place] = bad
        assert unit.rates(x) == DISCARD
        name = "GetDerivatives" if version == 2 else "GetContinuousStateDerivatives"
        assert unit.call(name, (ctypes.c_double * 4)(), ctypes.c_size_t(4)) == DISCARD
        unit.refuses("no finite solution", lambda: unit.get("der(v.left)"))
    assert unit.rates([0.5, 0.5, 0.0, 0.0]) == 0


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_a_quaternion_without_a_direction_is_named_at_the_end_of_the_initialization(version: int, kind: str) -> None:
    for size in (0.0, 1e200):
        unit = Logged("free_spinning_body", version, kind, start=False)
        unit.fmu.enterInitializationMode()
        unit.set({name: size for name in unit.places if name.startswith("q.") and name.endswith(("[0]", "[1]"))})
        unit.set({name: 0.0 for name in unit.places if name.startswith("q.") and name.endswith(("[2]", "[3]"))})
        unit.refuses("ExitInitializationMode: the quaternion of q.", unit.fmu.exitInitializationMode)
        unit.refuses("cannot be scaled to unit length", unit.fmu.exitInitializationMode)


@pytest.mark.slow_cases("me-3")
@pytest.mark.slow_cases("cs-3")
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_a_start_without_a_solution_names_the_constraint_that_it_misses(version: int, kind: str) -> None:
    """A ground link of a kilometre: no positions close the loop; the importer corrects the parameter and goes on."""
    unit = Logged("linkage", version, kind, start=False)
    unit.set({"ground": 1000.0})
    unit.fmu.enterInitializationMode()
    with pytest.raises(FMICallException, match=r"\(error\)"):
        unit.fmu.exitInitializationMode()
    missed = next(message for message in unit.messages if message.startswith("the start values miss"))
    assert re.fullmatch(
        'the start values miss the constraint "rocker_pin: origins meet along [xyz]" by -978, '
        "and no positions nearby satisfy all constraints",
        missed,
    )
    unit.set({"ground": 0.4})
    unit.fmu.exitInitializationMode()


def test_steps_without_end_and_sizes_that_differ_are_errors() -> None:
    unit = Logged("balls", 3, "cs")
    for size in (np.inf, 1e300, np.nan, -0.01):
        unit.refuses("fmi3DoStep: a step of", lambda size=size: unit.fmu.doStep(0.0, size))
    assert unit.get("time", "q.left") == [0.0, 0.5]
    one = ctypes.c_size_t(1)
    for name in ("GetFloat64", "SetFloat64"):
        assert unit.call(name, None, ctypes.c_size_t(0), (ctypes.c_double * 1)(), one) == 3
        assert unit.messages[-1] == f"fmi3{name}: 1 values, but the variables have 0"


@pytest.mark.slow_cases("cs-3")
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_values_that_cannot_be_set_are_named(version: int, kind: str) -> None:
    unit = Logged("ranged", version, kind, start=False)
    call = "fmi2SetReal" if version == 2 else "fmi3SetFloat64"
    last = max(unit.places.values())
    refusals = {
        "mass": (-1.0, "mass cannot be -1, which is below its min 0"),
        "bounce": (1.5, "bounce cannot be 1.5, which is above its max 1"),
        "push": (np.nan, "push cannot be NaN, which is not a finite number"),
        "q.left": (-np.inf, "q.left cannot be minus infinite, which is not a finite number"),
        "height": (0.1, "height follows from the equations and cannot be set"),
        "der(v.left)": (0.1, "der(v.left) follows from the equations and cannot be set"),
        "time": (0.1, "time cannot be set by a value reference"),
    }
    for name, (value, cause) in refusals.items():
        unit.refuses(f"{call}: {cause}", lambda name=name, value=value: unit.set({name: value}))
    unit.places["nothing"] = 77
    missing = f"no variable has the value reference 77; the last one is {last}"
    unit.refuses(f"{call}: {missing}", lambda: unit.set({"nothing": 1.0}))
    unit.refuses(missing, lambda: unit.get("nothing"))
    unit.refuses("bounce cannot be -0.5", lambda: unit.set({"mass": 0.3, "bounce": -0.5}))
    assert unit.get("mass", "bounce") == [0.2, 0.5]  # a call that is refused changes nothing
    unit.set({"mass": 0.3, "bounce": 1.0, "q.left": 0.7})
    unit.fmu.enterInitializationMode()
    unit.fmu.exitInitializationMode()
    if kind == "cs":
        cause = "q.left is a state, which can be set until the initialization ends"
        unit.refuses(f"{call}: {cause}", lambda: unit.set({"q.left": 1.0}))
    else:
        unit.update()
        unit.fmu.enterContinuousTimeMode()
        unit.set({"mass": 0.4, "q.left": 0.8})  # as CasADi does
        assert unit.get("height") == [0.8]
    assert unit.get("bounce") == [1.0]


@pytest.mark.parametrize("version", VERSIONS)
def test_functions_are_refused_outside_of_their_modes(version: int) -> None:
    fmi = f"fmi{version}"
    unit = Logged("balls", version, "cs", start=False)
    unit.refuses(f"{fmi}DoStep: not allowed in instantiation of co-simulation", lambda: unit.fmu.doStep(0.0, 0.01))
    unit.refuses("ExitInitializationMode: not allowed in instantiation", unit.fmu.exitInitializationMode)
    unit.fmu.enterInitializationMode()
    unit.refuses("EnterInitializationMode: not allowed in initialization mode", unit.fmu.enterInitializationMode)
    unit.fmu.exitInitializationMode()
    assert unit.call("SetTime", ctypes.c_double(1.0)) == 3
    assert unit.messages[-1] == f"{fmi}SetTime: not allowed in step mode of co-simulation"
    assert unit.call("EnterEventMode") == 3
    unit.fmu.terminate()
    unit.refuses("Terminate: not allowed in termination", unit.fmu.terminate)
    unit.refuses("not allowed in termination", lambda: unit.set({"q.left": 1.0}))
    assert unit.get("q.left") == [0.5]
    unit.fmu.reset()
    if version == 2:
        unit.fmu.setupExperiment(startTime=0.0)
    unit.fmu.enterInitializationMode()
    unit.fmu.exitInitializationMode()
    unit.fmu.doStep(0.0, 0.01)
    exchange = Logged("balls", version, "me")
    numbers = (ctypes.c_double * 4)()
    assert exchange.call("SetContinuousStates", numbers, ctypes.c_size_t(4)) == 3
    assert exchange.messages[-1] == f"{fmi}SetContinuousStates: not allowed in event mode of model exchange"
    exchange.fmu.enterContinuousTimeMode()
    exchange.refuses("States: not allowed in continuous-time mode of model exchange", exchange.update)


@pytest.mark.parametrize("version", VERSIONS)
def test_states_hold_the_mode_and_go_on_in_fresh_instances(version: int) -> None:
    unit = Logged("balls", version, "cs")
    for k in range(10):
        unit.fmu.doStep(k * 0.01, 0.01)
    state = unit.state()
    unit.fmu.doStep(0.1, 0.01)
    expected = unit.get("q.left", "v.left")
    unit.fmu.terminate()
    unit.go_back(state)
    unit.fmu.doStep(0.1, 0.01)
    assert unit.get("q.left", "v.left") == expected
    content = unit.bytes_of(state)
    fresh = Logged("balls", version, "cs", start=False)
    fresh.go_back(fresh.read(content))
    fresh.fmu.doStep(0.1, 0.01)
    assert fresh.get("q.left", "v.left") == expected
    changed = bytearray(content)
    changed[-100] ^= 1
    fresh.refuses("or are changed", lambda: fresh.read(bytes(changed)))
    other = Logged("balls", version, "me")
    other.refuses("the state is of an instance of another type", lambda: other.go_back(other.read(content)))


@pytest.mark.parametrize("version", VERSIONS)
def test_the_end_of_a_run_is_part_of_the_state(version: int) -> None:
    unit = Logged("stopped", version, "cs")
    state = unit.state()
    size = ctypes.c_double(1.0)
    outputs = [ctypes.byref(ctypes.c_bool()), *(ctypes.byref(ctypes.c_bool()) for _ in range(2))]
    more = [*outputs, ctypes.byref(ctypes.c_double())] if version == 3 else []
    status = unit.call("DoStep", ctypes.c_double(0.0), size, 1, *more)
    assert status == (DISCARD if version == 2 else 0) and 0.31 < unit.get("time")[0] < 0.33
    assert any("the event hit_left ends the run" in message for message in unit.messages)
    unit.refuses("an event has ended the run at t = 0.319", lambda: unit.fmu.doStep(unit.get("time")[0], 0.01))
    unit.go_back(state)
    unit.fmu.doStep(0.0, 0.01)
    if version == 2:
        flag, outcome = ctypes.c_int(7), ctypes.c_int(7)
        assert unit.call("GetBooleanStatus", 3, ctypes.byref(flag)) == 0 and flag.value == 0
        assert unit.call("GetStatus", 0, ctypes.byref(outcome)) == 0 and outcome.value == 0


@pytest.mark.parametrize("version", VERSIONS)
def test_each_event_is_in_the_log(version: int) -> None:
    unit = Logged("balls", version, "cs")
    unit.fmu.doStep(0.0, 0.5)
    unit.fmu.doStep(0.5, 0.2)
    hits = [message for message in unit.messages if message.startswith("the event hit_")]
    assert [hit.split()[2] for hit in hits] == ["hit_left", "hit_right"] * 2
    times = [float(hit.split()[6]) for hit in hits]
    first = np.sqrt(2 * 0.5 / 9.81)
    assert np.allclose(times, [first, first, 2 * first, 2 * first], atol=1e-8)
    unit = Logged("balls", version, "me")
    messages: list[str] = []
    fmpy.simulate_fmu(
        unit.folder,
        fmi_type="ModelExchange",
        stop_time=0.7,
        logger=lambda *arguments: messages.append(arguments[-1].decode()),
        debug_logging=True,
    )
    hits = [message for message in messages if message.startswith("the event hit_")]
    assert {hit.split()[2] for hit in hits} == {"hit_left", "hit_right"} and len(hits) == 4


@pytest.mark.slow
def test_samples_and_corrections_are_in_the_log() -> None:
    scene = eomgen.load(EXAMPLES / "pi_servo" / "sampled.toml")
    file, step = written(scene, 3), scene.simulation.step
    for kind in ("CoSimulation", "ModelExchange"):
        messages: list[str] = []
        fmpy.simulate_fmu(
            str(file),
            fmi_type=kind,
            stop_time=20 * step,
            output_interval=step,
            logger=lambda *arguments, to=messages: to.append(arguments[-1].decode()),
            debug_logging=True,
        )
        assert messages[0] == "samples of controllers at t = 0 s", kind
        assert len(messages) > 3 and len(set(messages)) == len(messages), kind
    unit = Logged("four_bar", 3, "me")
    unit.update()
    unit.fmu.enterContinuousTimeMode()
    x = np.zeros(len([name for name in unit.places if name.startswith("der(")]))
    pointer = x.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    unit.fmu.getContinuousStates(pointer, len(x))
    start = x.copy()
    met = 0
    for change in (1e-3, -0.3, 0.8, -2.4, -3.0, 2.0):
        x[:] = start
        x[1] += change
        unit.fmu.setContinuousStates(pointer, len(x))
        assert unit.fmu.completedIntegratorStep()[0]
        unit.fmu.enterEventMode()
        try:
            unit.update()
        except FMICallException:
            assert "positions and velocities do not come back onto the constraints" in unit.messages[-1]
            unit.fmu.enterContinuousTimeMode()
            continue
        met += 1
        assert unit.messages[-1] == "positions and velocities are back on the constraints at t = 0 s"
        unit.fmu.enterContinuousTimeMode()
        assert not unit.fmu.completedIntegratorStep()[0], change
    assert met >= 3


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_accumulating_events_end_model_exchange_with_an_error(version: int) -> None:
    unit, messages = Logged("balls", version, "me"), list[str]()
    with pytest.raises(FMICallException, match=r"\(error\)"):
        fmpy.simulate_fmu(
            unit.folder,
            fmi_type="ModelExchange",
            stop_time=1.2,
            relative_tolerance=1e-9,
            logger=lambda *arguments: messages.append(arguments[-1].decode()),
            debug_logging=True,
        )
    assert messages[-1].startswith("at t = 0.95") and messages[-1].endswith("an event comes again and again at once")


@pytest.mark.slow_cases("3-types0")
@pytest.mark.long_except("2-types2", "3-types0")
@pytest.mark.parametrize("types", [("me", "cs"), ("me",), ("cs",)])
@pytest.mark.parametrize("version", [2, 3])
def test_sources_without_outputs_compile_without_warnings(version: int, types: tuple[str, ...], tmp_path: Path) -> None:
    files = fmu_files(
        tomllib.loads(BALLS), version=version, types=types, binary=False, reference=False, profile="quick"
    )
    for name, content in files.files.items():
        if name.startswith("sources/"):
            (tmp_path / name.removeprefix("sources/")).write_text(str(content))
    source = tmp_path / f"balls_fmi{version}.c"
    words = ["cc", "-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-S", "-o", "/dev/null"]
    includes = ["-I", tmp_path, "-I", HEADERS / f"fmi{version}"]
    done = subprocess.run([*words, *includes, source], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_header_of_fmi_2_has_prefixes(tmp_path: Path) -> None:
    source = tmp_path / "prefixed.c"
    source.write_text('#define FMI2_FUNCTION_PREFIX plant_\n#include "fmi2Functions.h"\n')
    words = ["cc", "-E", "-P", "-I", HEADERS / "fmi2", source]
    text = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert "plant_fmi2DoStep;" in text and " fmi2DoStep;" not in text
