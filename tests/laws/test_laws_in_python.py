"""Laws in Python, for prototypes: equality with formulas, derivatives, threads, processes, mistakes."""

from __future__ import annotations

import pickle
import re
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.errors import DescriptionError, EomgenError, ModelError, UsageError
from tests.laws.test_laws_in_c import difference, states
from tests.models.c_laws import TYRE_LAW, wheel_scene
from tests.models.toml_text import toml_text

TYRE = """\
import numpy as np


def magic(x, b, c):
    s = b * x - 0.3 * (b * x - np.arctan(b * x))
    return np.sin(c * np.arctan(s))


def tyre(kappa, alpha, load, mu, stiffness):
    x, y = magic(kappa, stiffness, 1.6), magic(alpha, 0.8 * stiffness, 1.3)
    weight = np.sqrt(1 - 0.5 * y * y * x * x)
    return mu * load * x * weight, -mu * load * y * weight
"""
LAW = {key: value for key, value in TYRE_LAW.items() if key not in ("source", "partials")} | {"python": "law.py"}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with the tyre."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.py").write_text(TYRE, encoding="utf-8")
    return tmp_path


def both(**law: Any) -> tuple[eomgen.Model, eomgen.Model]:
    """Return the models of the tyre in Python and of the tyre by definitions."""
    return eomgen.build(wheel_scene(LAW | law), profile="quick"), eomgen.build(wheel_scene(None), profile="quick")


def test_a_tyre_in_python_is_the_tyre_by_definitions(folder: Path) -> None:
    model, formula = both(complex_step=True)
    q, v = states(model)
    a = formula.forward_dynamics(q, v)
    assert difference(model.forward_dynamics(q, v), a) < 1e-13
    assert difference(tuple(model.partials(q, v, a)), tuple(formula.partials(q, v, a))) < 1e-13
    linear, expected = (item.linearize(*(row[0] for row in states(model))) for item in (model, formula))
    assert difference(linear.state_space().A, expected.state_space().A) < 1e-12
    with ThreadPoolExecutor(4) as pool:  # the interpreter's lock orders the calls
        for result in pool.map(lambda _: model.forward_dynamics(q, v), range(8)):
            assert np.array_equal(result, model.forward_dynamics(q, v))
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.forward_dynamics(q, v), model.forward_dynamics(q, v))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_runs_by_a_law_are_runs_by_the_formula(folder: Path, method: str) -> None:
    tight = {"settings": {"rtol": 1e-14, "atol": 1e-16}} if method == "generalized_alpha" else {}
    scenes = wheel_scene(LAW | {"complex_step": True}), wheel_scene(None)
    run, expected = (eomgen.build(item, method=method, profile="quick").simulate(t_end=0.2, **tight) for item in scenes)
    assert difference(run.q, expected.q) < 1e-13
    assert difference(run.v, expected.v) < 1e-13
    assert difference(run.outputs["forces"], expected.outputs["forces"]) < 1e-12


@pytest.mark.slow_cases("False")
@pytest.mark.parametrize("partials", [False, True])
def test_differences_and_functions_of_partials(folder: Path, *, partials: bool) -> None:
    if partials:
        more = (
            "\n\ndef slopes(*x):\n    return [[tyre(*(complex(y, 1e-90 * (k == j)) for k, y in enumerate(x)))[i].imag"
        )
        (folder / "law.py").write_text(
            TYRE + more + " / 1e-90 for j in range(3)] for i in range(2)]\n", encoding="utf-8"
        )
    model, formula = both(**({"partials": "slopes"} if partials else {}))
    q, v = states(model)
    a = formula.forward_dynamics(q, v)
    slopes = difference(tuple(model.partials(q, v, a)), tuple(formula.partials(q, v, a)))
    assert slopes < (1e-13 if partials else 1e-9) and (partials or slopes > 1e-14)


@pytest.mark.slow
def test_profiles_and_ensembles_give_the_numbers_of_the_formula(folder: Path) -> None:
    model = eomgen.build(wheel_scene(LAW | {"complex_step": True}), profile="instant", method="rk4")
    formula = eomgen.build(wheel_scene(None), profile="instant", method="rk4")
    assert difference(model.simulate(t_end=0.1).q, formula.simulate(t_end=0.1).q) < 1e-13
    values = np.linspace(0.5, 1.0, 9)
    many = model.simulate_many(t_end=0.05, table={"mu": values})
    for place in (0, 8):
        single = model.simulate(t_end=0.05, parameters={"mu": values[place]})
        assert many.results["output.forces[0].final"][place] == single.outputs["forces"][-1, 0]


def failing(folder: Path, text: str, **law: Any) -> dict[str, Any]:
    """Return a cart with a drag of the given Python text."""
    (folder / "law.py").write_text(text, encoding="utf-8")
    return {
        "format": 1, "name": "cart", "gravity": [0, 0, 0], "bodies": {"b": {"mass": 2.0}},
        "joints": {
            "x": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], "initial": {"velocity": 1.0}}
        },
        "laws": {
            "drag": {
                "python": "law.py", "function": "drag", "arguments": {"speed": "m/s"}, "results": {"force": "N"}
            } | law
        },
        "efforts": {"air": {"joint": "x", "effort": "-law.drag(v.x)"}},
        "simulation": {"method": "rk4", "step": 0.01, "duration": 1.0},
    }  # fmt: skip  # a table


BROKEN_LATER = "def drag(speed):\n    if 0.4 < speed < 0.5:\n        return 1 / (speed - speed)\n    return 4 * speed\n"


@pytest.mark.slow
def test_an_error_in_python_ends_a_run_with_file_and_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = failing(folder, BROKEN_LATER)
    model = eomgen.build(scene, profile="quick")
    with pytest.raises(ModelError) as caught:
        model.simulate()
    message = str(caught.value)
    assert "laws.drag: law.py:3: ZeroDivisionError: float division by zero, at the arguments 0.4" in message
    assert difference(model.forward_dynamics([0.0], [1.0]), np.array([-2.0])) < 1e-15  # the next call is a new one
    with pytest.raises(ModelError, match=r"law\.py:3: ZeroDivisionError"):
        model.forward_dynamics([0.0], [0.45])
    (folder / "scene.toml").write_text(toml_text(scene), encoding="utf-8")
    assert main(["simulate", "scene.toml", "--out", "results"]) == 4
    told = capsys.readouterr().err
    assert "law.py:3: ZeroDivisionError" in told and "Traceback" not in told
    assert main(["generate", "scene.toml", "--out", "c"]) == 2
    assert "laws.drag: the law is in Python, drag in law.py: export needs C; try: source = " in capsys.readouterr().err
    assert main(["info", "scene.toml"]) == 0
    told = capsys.readouterr().out
    assert "drag in law.py" in told and "partials and second ones by differences" in told


def test_the_file_is_executed_at_a_build_alone(folder: Path) -> None:
    scene = failing(folder, "open('mark', 'a').close()\ndef drag(speed):\n    return 4 * speed\n")
    eomgen.load(scene)
    assert not (folder / "mark").exists()
    eomgen.build(scene, profile="quick")
    assert (folder / "mark").exists()
    first = eomgen.build(scene, profile="quick").forward_dynamics([0.0], [1.0])
    changed = failing(folder, "def drag(speed):\n    return 6 * speed\n")
    assert eomgen.build(changed, profile="quick").forward_dynamics([0.0], [1.0]) == 1.5 * first


def test_numbers_that_are_not_finite_are_told_as_of_a_law_in_c(folder: Path) -> None:
    scene = failing(folder, "def drag(speed):\n    return 4 * speed if speed > 0.5 else float('nan')\n")
    run = eomgen.build(scene, profile="quick").simulate()
    assert not run.success and "law.drag is nan at speed = 0." in run.message


@pytest.mark.parametrize(
    ("text", "law", "error", "message"),
    [
        ("def drag(speed)\n", {}, DescriptionError, "law.py:1: expected ':'; try: a file in Python"),
        ("def darg(speed):\n    return 1\n", {}, DescriptionError, "law.py has no function 'drag'; try: darg"),
        ("x = 1\n", {}, DescriptionError, "law.py has no function 'drag'; try: def drag(...): in the file"),
        ("drag = 1\n", {}, ModelError, "laws.drag: law.py has no function drag"),
        ("import absent_module\ndef drag(s):\n    return 1\n", {}, ModelError, "law.py:1: ModuleNotFoundError"),
        ("raise SystemExit(3)\ndef drag(s):\n    return 1\n", {}, ModelError, "laws.drag: law.py:1: SystemExit: 3"),
        ("def drag(a, b):\n    return 1\n", {}, ModelError, "laws.drag: law.py: TypeError: drag() missing"),
        ("def drag(a, b):\n    return 1\n", {}, ModelError, "try: a function of 1 number: the arguments, then the p"),
        ("def drag(a):\n    return a[0]\n", {}, ModelError, "try: arguments and parameters as numbers, one by one"),
        ("def drag(s):\n    return '3'\n", {}, ModelError, "drag gives '3', and 1 number are needed; try: return"),
        ("def drag(s):\n    return [None]\n", {}, ModelError, "drag gives [None], and 1 number are needed"),
        ("def drag(s):\n    return None\n", {}, ModelError, "drag gives None, and 1 number are needed"),
        ("def drag(s):\n    return [s, s]\n", {}, ModelError, "drag gives 2 numbers, and 1 are needed"),
        ("def drag(s):\n    return 'x'\n", {}, ModelError, "drag gives 'x', and 1 number are needed"),
        ("n = [0]\ndef drag(s):\n    n[0] += 1\n    return n[0]\n", {}, ModelError, "drag gives other values in"),
        ("def drag(s):\n    return abs(s)\n", {"complex_step": True}, ModelError, "complex steps: the derivative of"),
        ("import math\ndef drag(s):\n    return math.sin(s)\n", {"complex_step": True}, ModelError, "numpy or cmath"),
        ("def drag(s):\n    return s*s\ndef d(s):\n    return s\n", {"partials": "d"}, ModelError, "d: the deriv"),
        ("def drag(s):\n    return s\n", {"partials": "d"}, DescriptionError, "has no function 'd'"),
        ("def drag(s):\n    return s\n", {"partials": "drag", "complex_step": True}, DescriptionError, "are the same"),
        ("def drag(s):\n    return s\n", {"python": "absent.py"}, DescriptionError, "cannot be read: No such file"),
        ("def drag(s):\n    return s\n", {"source": "law.c"}, DescriptionError, "source and python are both given"),
        ("", {"python": None, "source": "law.py"}, DescriptionError, "law.py' is a Python file; try: python ="),
        ("def drag(s):\n    return s\n", {"python": None}, DescriptionError, "a file with the function is missing"),
    ],
)  # fmt: skip  # a table
def test_mistakes(folder: Path, text: str, law: dict[str, Any], error: type[EomgenError], message: str) -> None:
    scene = failing(folder, text, **law)
    if law.get("python", "") is None:
        del scene["laws"]["drag"]["python"]
    with pytest.raises(error, match=re.escape(message)):
        eomgen.build(scene, profile="quick")


@pytest.mark.slow
def test_a_function_that_does_not_return_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.laws.checks._LONGEST", 0.2)
    text = "ran = []\ndef drag(s):\n    while True:\n        pass\n"
    with pytest.raises(ModelError, match=r"laws\.drag: drag does not return within 0\.2 s at speed = \S+; try: loops"):
        eomgen.build(failing(folder, text), profile="quick")
    for thread in threading.enumerate():
        if thread is not threading.main_thread() and thread.daemon and "call" in thread.name:
            thread.join(5.0)
            assert not thread.is_alive()


def test_complex_steps_are_of_python(folder: Path) -> None:
    (folder / "law.c").write_text("void drag(const double *a, const double *p, double *r) { r[0] = a[0]; }\n")
    scene = failing(folder, "")
    scene["laws"]["drag"] |= {"source": "law.c", "complex_step": True}
    del scene["laws"]["drag"]["python"]
    with pytest.raises(DescriptionError, match="complex_step belongs to a law in Python"):
        eomgen.load(scene)
    with pytest.raises(UsageError, match="export needs C"):
        eomgen.generate(failing(folder, "def drag(s):\n    return s\n"), folder / "c")
