"""A controller of 1 kHz around a robot, in Python and in C, against Pinocchio's forward dynamics in a Runge-Kutta
method."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from benchmarks import stepper_overhead
from benchmarks.robots import driven, pinocchio_model, scene
from tests.codegen.test_stand_alone import compiled, run

pytestmark = pytest.mark.slow

SAMPLES = 1000
DRIVER = (Path(__file__).parent / "controlled_robot.c").read_text(encoding="utf-8")


def listed(values: np.ndarray) -> str:
    return ", ".join(repr(float(value)) for value in values)


def test_a_controller_of_1_khz_around_the_ur5(tmp_path: Path) -> None:
    described = scene(stepper_overhead.ROBOT)
    q, v = stepper_overhead.by_pinocchio(pinocchio_model(stepper_overhead.ROBOT, described), SAMPLES)
    simulator = stepper_overhead.build().start(method="rk4", step=stepper_overhead.STEP)
    stepper_overhead.controlled(simulator, SAMPLES)
    assert np.max(np.abs(simulator.q - q)) < 1e-14 and np.max(np.abs(simulator.v - v)) < 1e-14
    assert np.max(np.abs(q - stepper_overhead.TARGET)) < 0.2, "it moves"
    paths = eomgen.generate(driven(described), tmp_path / "c", method="rk4")
    name = next(path.stem for path in paths if path.name.endswith("_step.c")).removesuffix("_step")
    text = DRIVER.replace("NAME", name)
    for word in ("TARGET", "STIFFNESS", "DAMPING"):
        text = text.replace(word, listed(getattr(stepper_overhead, word)))
    (tmp_path / "c" / "main.c").write_text(text, encoding="utf-8")
    result = run(compiled(tmp_path / "c"))
    assert result.returncode == 0, result.stderr
    found = np.array([[float(word) for word in line.split()] for line in result.stdout.splitlines()])
    assert np.max(np.abs(found[:, 0] - q)) < 1e-14 and np.max(np.abs(found[:, 1] - v)) < 1e-14
