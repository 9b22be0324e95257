"""Sampled controllers whose functions are Python's or C's are the same laws written as formulas."""

from __future__ import annotations

import functools
import math
import subprocess
import tomllib
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.results.solution import Solution
from tests.codegen.test_stand_alone import compiled, run
from tests.simulation.test_sampled_states import CART, ENCODER, part

#: The law in formulas: an encoder, its difference as velocity, an integral, rounding, and 3.2 ms of computing.
FORMULAS = ENCODER + part("formulas.toml")
#: The same, whose function is the caller's or C's.
CALLED = part("called.toml")
LAW_IN_C = part("law.c")
METHODS = ("rk4", "rk45", "taylor", "generalized_alpha", "generalized_alpha_f1")


def law(t: float, signals: Any, memory: Any) -> float:
    error, measured, stiffness = signals
    memory[1] += 0.01 * error
    force = stiffness * error - 6 * (measured - memory[0]) / 0.01 + 3 * memory[1]
    memory[0] = measured
    return float(force)


class Law:
    """The law with a state of its own."""

    def __init__(self, gain: float = 1.0) -> None:
        self.memory, self.gain = [0.0, 0.0], gain

    def __call__(self, t: float, signals: Any) -> list[float]:
        return [self.gain * law(t, signals, self.memory)]


@functools.cache
def model(text: str) -> eomgen.Model:
    return eomgen.build(tomllib.loads(CART + text), profile="quick", method="rk4")


def called(keys: str = "") -> eomgen.Model:
    return model(CALLED.replace("KEYS", keys))


def linked(folder: Path, text: str = LAW_IN_C, keys: str = 'function = "servo_law"\nmemory = 2') -> Path:
    (folder / "servo law.c").write_text(text)
    path = folder / "scene.toml"
    path.write_text(CART + CALLED.replace("KEYS", f'source = "servo law.c"\n{keys}'))
    return path


def position(one: Solution) -> Any:
    return one.q[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_a_function_of_python_moves_as_its_law_in_formulas(name: str) -> None:
    wanted = model(FORMULAS).simulate(0.75, 0.0037, method=name, error_estimate=False)
    functions: list[tuple[eomgen.Model, Any]] = [(called("memory = 2"), law), (called(), Law())]
    for machine, function in functions:
        found = machine.simulate(0.75, 0.0037, method=name, controllers={"servo": function}, error_estimate=False)
        assert found.success, found.message
        assert np.abs(position(found) - position(wanted)).max() <= 1e-14
        held = found.z[:, machine.states.index("servo_held")]
        assert np.array_equal(held, wanted.z[:, model(FORMULAS).states.index("force")])
        assert np.array_equal(held * 8, np.round(held * 8)) and held.max() > 35.0
    assert np.ptp(position(wanted)) > 0.5


@pytest.mark.slow
def test_a_linked_function_of_c_moves_as_its_law_in_formulas(tmp_path: Path) -> None:
    machine = eomgen.build(linked(tmp_path), profile="quick", method="rk4")
    for name in METHODS:
        found = machine.simulate(0.75, 0.0037, method=name)
        wanted = model(FORMULAS).simulate(0.75, 0.0037, method=name)
        assert found.success, found.message
        assert np.abs(position(found) - position(wanted)).max() <= 1e-14
        assert found.error.available == wanted.error.available
        share = found.error.increment_at.max(), wanted.error.increment_at.max()
        assert share[0] == pytest.approx(share[1], rel=1e-6, abs=1e-13)


@pytest.mark.slow_cases("restore", "copy")
@pytest.mark.parametrize("option", ["restore", "copy", "resume"])
def test_what_a_function_keeps_by_itself_is_not_lost_silently(option: str, tmp_path: Path) -> None:
    path, given = tmp_path / "run.ckpt", {"servo": Law()}
    text = "the function of servo may keep something that no state holds"
    if option == "resume":
        text = "the function of servo may keep something that no checkpoint holds; try: memory = 0, or how many"
    with pytest.raises(eomgen.UsageError, match=text):
        if option == "resume":
            called().simulate(0.1, 0.01, method="rk4", error_estimate=False, checkpoint=path, controllers=given)
            called().resume(path, 0.2, error_estimate=False, controllers=given)
        simulator = called().start(method="rk4", step=0.01, controllers=given)
        simulator.step(n=3)
        simulator.restore(simulator.state) if option == "restore" else simulator.copy()


def failing(t: float, signals: Any) -> float:
    if t > 0.045:
        return float(signals["x"])
    return 0.0


FAILING: dict[str, Callable[..., Any]] = {
    "controller servo: the function failed at t = 0.05 s: IndexError: only integers, slices": failing,
    "an array of shape (2,) at t = 0 s, and has to give one number, servo": lambda t, s: [1.0, 2.0],
    "the function gives nothing at t = 0 s, and has to give one number, servo": lambda t, s: None,
    "the function gives str, which is not an array of numbers at t = 0 s": lambda t, s: "full",
    "controller servo: the function gives nan at t = 0 s": lambda t, s: math.nan,
    "does not take the 2 arguments that it is called with; try: def law(t, signals)": lambda t: 0.0,
}


@pytest.mark.slow
def test_states_copies_and_checkpoints_hold_declared_memory(tmp_path: Path) -> None:
    machine, functions = called("memory = 2"), {"servo": law}
    whole = machine.simulate(1.0, 0.004, method="rk4", error_estimate=False, controllers=functions)
    simulator = machine.start(method="rk4", step=0.004, controllers=functions)
    simulator.step(n=100)
    state, other = simulator.state, simulator.copy()
    simulator.step(n=150)
    other.advance(1.0)
    assert np.array_equal(simulator.q, whole.q[-1]) and np.array_equal(other.z, whole.z[-1])
    simulator.restore(state)
    assert simulator.t == state.t
    simulator.step(n=150)
    assert np.array_equal(simulator.q, whole.q[-1])
    path = tmp_path / "run.ckpt"
    machine.simulate(0.4, 0.004, method="rk4", error_estimate=False, checkpoint=path, controllers=functions)
    rest = machine.resume(path, 1.0, error_estimate=False, controllers=functions)
    assert np.array_equal(rest.q[-1], whole.q[-1])


@pytest.mark.slow
def test_the_estimate_calls_again_only_what_can_be_called_again() -> None:
    wanted = called("memory = 2").simulate(0.75, 0.004, method="rk4", controllers={"servo": law})
    assert wanted.error.available
    made = called().simulate(0.75, 0.004, method="rk4", controllers={"servo": functools.partial(Law, gain=1.0)})
    assert made.error.available and made.error.relative == pytest.approx(wanted.error.relative)
    own = Law()
    once = called().simulate(0.75, 0.004, method="rk4", controllers={"servo": own})
    assert not once.error.available and "the function of servo may keep something" in once.error.reason
    assert np.array_equal(once.q, wanted.q)
    calls = []

    def pure(t: float, signals: Any) -> float:
        calls.append(t)
        return float(40 * signals[0])

    again = called("memory = 0").simulate(0.5, 0.01, method="rk4", controllers={"servo": pure})
    assert again.error.available and len(calls) >= 100 and calls[:50] == pytest.approx(np.arange(50) * 0.01)


@pytest.mark.parametrize("text", FAILING)
def test_a_function_that_fails_is_told_with_its_own_traceback(text: str) -> None:
    function = FAILING[text]
    for stepped in (False, True):
        with pytest.raises(eomgen.UsageError) as caught:
            if stepped:
                called().start(method="rk4", step=0.01, controllers={"servo": function}).step(n=10)
            else:
                called().simulate(0.1, 0.01, method="rk4", controllers={"servo": function})
        assert text in str(caught.value)
        if function is failing:
            assert isinstance(caught.value.__cause__, IndexError)
            frames = traceback.extract_tb(caught.value.__cause__.__traceback__)
            assert frames[-1].name == "failing" and frames[-1].line == 'return float(signals["x"])'


REFUSED: dict[str, Any] = {
    "there is no controller 'serve'; try: servo": {"serve": law},
    "controller servo: a function of t and its signals is needed, not float": {"servo": 3.0},
    "controllers: a mapping from names to functions is needed, not a function": law,
    "objects of the class dict cannot be called": {"servo": dict},
    "the class Law makes no object: TypeError": {"servo": functools.partial(Law, gain=1, x=2)},
}


def test_ctrl_c_in_a_function_comes_through() -> None:
    def interrupted(t: float, signals: Any) -> float:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        called().start(method="rk4", step=0.01, controllers={"servo": interrupted}).step(n=10)


@pytest.mark.parametrize("text", REFUSED)
def test_functions_are_checked_before_the_run(text: str) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        called().simulate(0.1, 0.01, method="rk4", controllers=REFUSED[text])
    assert text in str(caught.value)


#: Faults of the law in C: old and new text, and what is said.
FAULTS = {
    "beyond memory": ("memory[2] += t > 0.205; return 0", "wrote beyond memory = 2; try: memory = 3 in the scene"),
    "beyond values": ("if (t > 0.205) values[1] = 1.0; return 0", "wrote beyond its 1 value; try: writes up to"),
    "code": ("return t > 0.205 ? 7 : 0", "returned 7, and only 0 goes on; try: the reason for which it returns 7"),
    "value": ("values[0] /= t < 0.205; return 0", "gave values[0], servo, a value that is not a finite number"),
    "memory": ("memory[1] /= t < 0.205; return 0", "gave memory[1] a value that is not a finite number"),
}


def test_a_slow_function_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.simulation.stepping.controllers._SLOW", 0.0)
    monkeypatch.setattr("eomgen.simulation.stepping.controllers._SLOW_SHARE", 0.0)
    found = called().simulate(0.1, 0.01, method="rk4", controllers={"servo": Law()})
    assert "of the time went into the functions of controllers: 10 calls of" in found.message


TWO = part("two.toml")
TWO_IN_FORMULAS = part("two_in_formulas.toml")


@pytest.mark.slow
def test_several_outputs_and_controllers_that_read_one_another() -> None:
    def both(t: float, signals: Any, memory: Any) -> tuple[float, float]:
        memory[0] += 0.5
        return 2 - signals[0], memory[0]

    functions = {"after": lambda t, s: 3 * s[0] + s[1], "both": both}
    found = model(TWO).simulate(0.5, 0.007, method="rk4", controllers=functions)
    wanted = model(TWO_IN_FORMULAS).simulate(0.5, 0.007, method="rk4")
    assert np.abs(position(found) - position(wanted)).max() <= 1e-14 and np.ptp(position(wanted)) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rk4", "generalized_alpha"])
def test_generated_c_with_the_linked_function_runs_alone_without_warnings(name: str, tmp_path: Path) -> None:
    eomgen.generate(eomgen.load(linked(tmp_path)), tmp_path / "c", method=name)
    sources = sorted(path.name for path in (tmp_path / "c").glob("*.c"))
    assert "cart_user_servo_law.c" in sources
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wmissing-prototypes", "-Werror"]
    command = ["gcc", *flags, "-ffp-contract=off", *sources, "-o", "checked", "-lm"]
    result = subprocess.run(command, cwd=tmp_path / "c", capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    result = run(compiled(tmp_path / "c"), "0.75", "3e-3", "250")
    assert result.returncode == 0, result.stderr
    wanted = model(FORMULAS).simulate(0.75, 0.003, method=name, error_estimate=False)
    assert float(result.stdout.splitlines()[-1].split(",")[1]) == pytest.approx(wanted.q[-1, 0], abs=1e-13)


CALLER_IN_C = (Path(__file__).parent / "caller_of_a_controller.c").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_caller_in_c_gives_the_function(tmp_path: Path) -> None:
    scene = eomgen.load(tomllib.loads(CART + CALLED.replace("KEYS", "memory = 2")))
    eomgen.generate(scene, tmp_path / "c", method="rk4")
    (tmp_path / "c" / "main.c").write_text(CALLER_IN_C)
    result = subprocess.run(compiled(tmp_path / "c"), capture_output=True, text=True, check=True)
    without, calls, x = result.stdout.split()
    wanted = model(FORMULAS).simulate(0.75, 0.003, method="rk4", error_estimate=False)
    assert (without, calls) == ("1", "75") and float(x) == pytest.approx(wanted.q[-1, 0], abs=1e-13)
    readme = " ".join((tmp_path / "c" / "README.md").read_text().split())
    assert "The controller `servo` of the scene has no function in it: without one of yours every run" in readme
    assert "settings.control = control; /* of a simulator: run.settings.control */" in readme
    assert "CART_CONTROLLER_FAILED" in readme


@pytest.mark.slow
def test_the_c_file_is_part_of_the_key_and_its_faults_name_its_lines(tmp_path: Path) -> None:
    path = linked(tmp_path)
    first = eomgen.load(path).digest
    linked(tmp_path, LAW_IN_C.replace("3.0", "2.5"))
    assert eomgen.load(path).digest != first
    linked(tmp_path, LAW_IN_C.replace("0.01 * error;", "0.01 * eror;", 1))
    with pytest.raises(eomgen.ToolchainError) as caught:
        eomgen.build(path, profile="quick", method="rk4")
    assert "servo_law.c:5: the C compiler finds 'eror' undeclared" in str(caught.value)
    linked(tmp_path, LAW_IN_C.replace("int servo_law(double t", "double servo_law(double t"))
    with pytest.raises(eomgen.ToolchainError, match=r"servo_law\.c:2: the C compiler finds conflicting types"):
        eomgen.build(path, profile="quick", method="rk4")


@pytest.mark.slow_except("value", "beyond memory")
@pytest.mark.parametrize("fault", FAULTS)
def test_a_linked_function_that_fails_says_in_which_way(fault: str, tmp_path: Path) -> None:
    new, what = FAULTS[fault]
    law_of_c = LAW_IN_C.replace("return t < 0.0", new)
    machine = eomgen.build(linked(tmp_path, law_of_c), profile="quick", method="rk4")
    found = machine.simulate(0.5, 0.005, method="rk4")
    assert not found.success and found.t[-1] == pytest.approx(0.21)
    who = "the function servo_law of servo law.c, the controller servo,"
    assert f"stopped at t = 0.21 s, after 42 of 100 steps: {who} {what}" in found.message
    simulator = machine.start(method="rk4", step=0.005)
    with pytest.raises(eomgen.NumericalError) as caught:
        simulator.step(n=60)
    assert f"failed: {who} {what}" in str(caught.value)
    simulator = machine.start(method="rk4", step=0.005)
    simulator.step(n=42)
    assert [simulator.statistics[name] for name in ("failed_controller", "controller_returned")] == [0, 0]
