"""Outputs of the simulator in C are the numbers that a run in Python records."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.codegen.test_stand_alone import compiled, run
from tests.simulation.rails import on_rail

#: Rows of outputs at the start and after each call of two steps.
DRIVER = (Path(__file__).parent / "rows_of_outputs.c").read_text(encoding="utf-8")
#: How a caller gives inputs: none; held; linear within each call, as steps that follow one another, from the first or
#: the second call on.
INPUTS = {
    "formulas": ("NULL", "NULL", "NULL", ""),
    "held": ("push", "push", "NULL", ""),
    "linear": ("push", "push", "last", "push[0] = last[0]; last[0] = 1.0 + 0.2 * k;"),
    "ramps": ("push", "push", "last", "push[0] = last[0]; last[0] = 3.0 + 0.2 * k;"),
}
#: Input at the end of the first call, if it is linear.
FIRST_ENDS = {"linear": 1.0, "ramps": 3.0}


def slider() -> eomgen.SceneBuilder:
    """Return a mass on a spring whose outputs take all that the motion of a tree has."""
    builder = on_rail("push - drag * v.x", name="slider", mass=2.0, stiffness=40.0, position=0.3, velocity=-0.2)
    builder.parameter("drag", 0.4, tunable=True).input("push", "2 * cos(3 * t)", unit="N")
    builder.output("power", formula="push * v.x").output("felt", formula="a.x + 0.1 * t * drag")
    return builder.output("work", formula="push**2 + q.x")


METHODS = ("rk4", "generalized_alpha", "rk45", "rosenbrock", "tdg2", "rattlie", "trapezoidal", "taylor")


def outputs_of_c(
    folder: Path, scene: eomgen.Scene, method: str, inputs: str = "formulas", step: float = 0.01
) -> np.ndarray:
    """Return rows of outputs of the generated simulator."""
    paths = eomgen.generate(scene, folder, method=method)
    name = next(path.stem for path in paths if path.name.endswith("_step.c")).removesuffix("_step")
    first, begin, end, before = INPUTS[inputs]
    given = "".join(f"static eomgen_real {word}[1] = {{1.0}};\n" for word in ("push", "last") if word in (begin, end))
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    size = sum(item["size"] for item in manifest["quantities"]["outputs"])
    text = given + DRIVER.replace("NAME_OK", f"{name.upper()}_OK").replace("NAME_BAD", f"{name.upper()}_BAD")
    words = {
        "NAME": name, "STEP": str(step), "SIZE": str(size), "FIRST": first, "FROM": begin, "UNTIL": end,
        "BEFORE": before,
    }  # fmt: skip  # words
    for key, word in words.items():
        text = text.replace(key, word)
    (folder / "main.c").write_text('#include "eomgen_real.h"\n' + text, encoding="utf-8")
    result = run(compiled(folder))
    assert result.returncode == 0, (result.returncode, result.stderr)
    return np.array([line.split() for line in result.stdout.splitlines()], float)


def recorded(scene: eomgen.Scene, method: str, step: float = 0.01) -> np.ndarray:
    """Return the same rows of a run in Python."""
    model = eomgen.build(scene, method=method, profile="reproducible")
    found = model.simulate(40 * step, step, method=method, error_estimate=False)
    columns: Mapping[str, np.ndarray] = found.outputs
    return np.column_stack(list(columns.values()))[::2]


def stepped(scene: eomgen.Scene, method: str, inputs: str) -> np.ndarray:
    """Return the same rows of a motion that Python steps with inputs."""
    run = eomgen.build(scene, method=method, profile="reproducible").start(step=0.01, inputs={"push": 1.0})
    rows, last, first = [np.hstack([*run.outputs.values()])], 1.0, FIRST_ENDS.get(inputs)
    for k in range(20):
        run.step([last], 2, end=None if first is None else [first + 0.2 * k])
        last = 1.0 if first is None else first + 0.2 * k
        rows.append(np.hstack([*run.outputs.values()]))
    return np.array(rows)


#: Methods whose steps hold their inputs.
HOLDING = ("taylor",)


@pytest.mark.slow_except("formulas-rk4")
@pytest.mark.parametrize(
    ("inputs", "method"),
    [*((inputs, "rk4") for inputs in INPUTS), *(("held" if m in HOLDING else "ramps", m) for m in METHODS[1:])],
)
def test_outputs_are_those_of_python(method: str, inputs: str, tmp_path: Path) -> None:
    scene = slider().build()
    ours = outputs_of_c(tmp_path / "c", scene, method, inputs)
    theirs = recorded(scene, method) if inputs == "formulas" else stepped(scene, method, inputs)
    assert ours.shape == theirs.shape == (21, 3)
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-12)


@pytest.mark.slow
def test_a_start_follows_inputs_that_begin_to_move(tmp_path: Path) -> None:
    """The error of the first steps is of third order in the step; with the accelerations of held inputs of second."""
    scene, errors = slider().build(), []
    for step in (0.01, 0.005):
        first, end = outputs_of_c(tmp_path / f"{step}", scene, "generalized_alpha", "ramps", step)[:2]
        t, slope = 2.0 * step, (3.0 - 1.0) / (2.0 * step)
        solved = solve_ivp(
            lambda t, y, slope=slope: [y[1], 0.5 * (1.0 + slope * t - 0.4 * y[1] - 40.0 * y[0])],
            (0.0, t), [0.3, -0.2], rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        assert first[0] == pytest.approx(-0.2)
        errors.append(abs(end[0] / 3.0 - solved.y[1, -1]))
    assert errors[1] < errors[0] / 6.0


@pytest.mark.slow
def test_outputs_have_the_modes_that_events_left(tmp_path: Path) -> None:
    builder = slider().mode("passed", 0.0).event("middle", "q.x", action="switch", mode="passed", to=1)
    scene = builder.output("mode", formula="mode.passed").build()
    ours, theirs = outputs_of_c(tmp_path / "c", scene, "rk4"), recorded(scene, "rk4")
    assert ours[0, 3] == 0.0 and ours[-1, 3] == 1.0
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-11)
