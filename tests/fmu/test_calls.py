"""Calls of FMUs that a faulty importer makes: modes, sizes, steps without end, numbers that are none, states of other
instances, quaternions without a direction; and what the log says."""

from __future__ import annotations

import ctypes
import re
import subprocess
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

import eomgen
from eomgen.base.files import template_folder
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import DISCARD, Unit, messages_of, written
from tests.models.library import scene

EXAMPLES = Path(__file__).parents[2] / "examples"
HEADERS = template_folder() / "fmu"
#: Changes that leave one ball.
_ONE = dict.fromkeys(("bodies__other", "joints__right", "events__hit_right"))
VERSIONS = [pytest.param(2, marks=pytest.mark.slow), 3]


def stopped_ball() -> dict[str, Any]:
    """Return one ball, whose run the ground ends."""
    return scene("balls", **_ONE, events__hit_left__action="stop", events__hit_left__restitution=None)


def ranged_ball() -> dict[str, Any]:
    """Return one ball with a mass, a restitution, an input, an internal state and outputs."""
    mass = {"value": 0.2, "unit": "kg", "tunable": True}
    return scene(
        "balls",
        **_ONE,
        parameters={"mass": mass, "bounce": {"value": 0.5, "tunable": True}},
        bodies__one__mass="mass",
        events__hit_left__restitution="bounce",
        inputs={"push": {"unit": "N"}},
        efforts={"hand": {"joint": "left", "effort": "push"}},
        outputs={"height": {"formula": "q.left", "unit": "m"}},
    )


@cache
def file_of(name: str, version: int) -> Path:
    made: dict[str, Callable[[], Any]] = {
        "balls": lambda: scene("balls"),
        "stopped": stopped_ball,
        "ranged": ranged_ball,
        "linkage": lambda: scene("four_bar/scene", parameters__ground__tunable=True),
    }
    data = made[name]() if name in made else eomgen.load(EXAMPLES / name / "scene.toml")
    return written(data, version)


def unit_of(name: str, version: int, kind: str, *, start: bool = True) -> Unit:
    return Unit(file_of(name, version), kind, start=start)


@pytest.mark.slow_cases("3")
@pytest.mark.parametrize("version", VERSIONS)
def test_rates_that_are_not_finite_are_discarded_each_time(version: int) -> None:
    unit = unit_of("balls", version, "me")
    unit.continuous()
    for place, bad in ((2, np.nan), (3, np.inf)):
        x = [0.5, 0.5, 0.0, 0.0]
        x[place] = bad
        assert [unit.rates(x), unit.rates(x)] == [DISCARD, DISCARD]
        unit.refuses("no finite solution", lambda: unit.get("der(v.left)"))
    assert unit.rates([0.5, 0.5, 0.0, 0.0]) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("version", "kind"), [(2, "cs"), (3, "me")])
def test_a_quaternion_without_a_direction_is_named_at_the_end_of_the_initialization(version: int, kind: str) -> None:
    for size in (0.0, 1e200):
        unit = unit_of("free_spinning_body", version, kind, start=False)
        unit.fmu.enterInitializationMode()
        quaternion = [name for name in unit.places if re.fullmatch(r"q\..*\[[0-3]\]", name)]
        unit.set(dict(zip(quaternion, (size, size, 0.0, 0.0), strict=True)))
        unit.refuses("ExitInitializationMode: the quaternion of q.", unit.fmu.exitInitializationMode)
        unit.refuses("cannot be scaled to unit length", unit.fmu.exitInitializationMode)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "kind"), [(2, "me"), (3, "cs")])
def test_a_start_without_a_solution_names_the_constraint_that_it_misses(version: int, kind: str) -> None:
    """A ground link of a kilometre: no positions close the loop; the importer corrects the parameter and goes on."""
    unit = unit_of("linkage", version, kind, start=False)
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


@pytest.mark.slow
def test_steps_without_end_and_sizes_that_differ_are_errors() -> None:
    unit = unit_of("balls", 3, "cs")
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
    unit = unit_of("ranged", version, kind, start=False)
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
    unit = unit_of("balls", version, "cs", start=False)
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
    exchange = unit_of("balls", version, "me")
    numbers = (ctypes.c_double * 4)()
    assert exchange.call("SetContinuousStates", numbers, ctypes.c_size_t(4)) == 3
    assert exchange.messages[-1] == f"{fmi}SetContinuousStates: not allowed in event mode of model exchange"
    exchange.fmu.enterContinuousTimeMode()
    exchange.refuses("States: not allowed in continuous-time mode of model exchange", exchange.update)


@pytest.mark.parametrize("version", VERSIONS)
def test_states_hold_the_mode_and_go_on_in_fresh_instances(version: int) -> None:
    unit = unit_of("balls", version, "cs")
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
    fresh = unit_of("balls", version, "cs", start=False)
    fresh.go_back(fresh.read(content))
    fresh.fmu.doStep(0.1, 0.01)
    assert fresh.get("q.left", "v.left") == expected
    changed = bytearray(content)
    changed[-100] ^= 1
    fresh.refuses("or are changed", lambda: fresh.read(bytes(changed)))
    other = unit_of("balls", version, "me")
    other.refuses("the state is of an instance of another type", lambda: other.go_back(other.read(content)))


@pytest.mark.parametrize("version", VERSIONS)
def test_the_end_of_a_run_is_part_of_the_state(version: int) -> None:
    unit = unit_of("stopped", version, "cs")
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
    unit = unit_of("balls", version, "cs")
    unit.fmu.doStep(0.0, 0.5)
    unit.fmu.doStep(0.5, 0.2)
    hits = [message for message in unit.messages if message.startswith("the event hit_")]
    assert [hit.split()[2] for hit in hits] == ["hit_left", "hit_right"] * 2
    times = [float(hit.split()[6]) for hit in hits]
    first = np.sqrt(2 * 0.5 / 9.81)
    assert np.allclose(times, [first, first, 2 * first, 2 * first], atol=1e-8)
    messages = messages_of(file_of("balls", version), "ModelExchange", 0.7)
    hits = [message for message in messages if message.startswith("the event hit_")]
    assert {hit.split()[2] for hit in hits} == {"hit_left", "hit_right"} and len(hits) == 4


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_accumulating_events_end_model_exchange_with_an_error(version: int) -> None:
    messages = list[str]()
    with pytest.raises(FMICallException, match=r"\(error\)"):
        fmpy.simulate_fmu(
            file_of("balls", version),
            fmi_type="ModelExchange",
            stop_time=1.2,
            relative_tolerance=1e-9,
            logger=lambda *arguments: messages.append(arguments[-1].decode()),
            debug_logging=True,
        )
    assert messages[-1].startswith("at t = 0.95") and messages[-1].endswith("an event comes again and again at once")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "version", "options"),
    [
        ("balls", 2, {"types": "me"}),
        ("balls", 2, {"types": "cs"}),
        ("balls", 3, {}),
        ("free_spinning_body/scene", 3, {"arrays": True}),
    ],
)
def test_sources_compile_without_warnings(name: str, version: int, options: dict[str, Any], tmp_path: Path) -> None:
    """Also without outputs, which the balls have not."""
    files = fmu_files(scene(name, name="plant"), version=version, binary=False, reference=False, **options)
    for file, content in files.files.items():
        if file.startswith("sources/"):
            (tmp_path / file.removeprefix("sources/")).write_text(str(content))
    source = tmp_path / f"plant_fmi{version}.c"
    words = ["cc", "-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-S", "-o", "/dev/null"]
    includes = ["-I", tmp_path, "-I", HEADERS / f"fmi{version}"]
    done = subprocess.run([*words, *includes, source], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
