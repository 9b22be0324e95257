"""Derivatives of runs in inputs: in the value at each row, against differences of runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.scene.builder import SceneBuilder
from tests.derivatives.checks import sixth_order
from tests.derivatives.test_sensitivities import STEP, TO_ROUNDING, built, tree

STEPS = 20


def driven() -> SceneBuilder:
    """Return a double pendulum with two driven inputs, of which forces and outputs are no linear functions, and one
    with a formula; a filter follows one of them."""
    builder = SceneBuilder("driven_arm").parameter("mass", 1.3, tunable=True).parameter("height", 0.2, tunable=True)
    builder.input("torque").input("road", "height*sin(5*t)").input("command")
    builder.body("one", "mass", center_of_mass=[0, 0, -0.4], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.7, center_of_mass=[0.1, 0, -0.3], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0.3, 1, 0], position=[0, 0, -0.8])
    builder.effort("m", "a", "torque*cos(q.b) + road").effort("n", "b", "command**2 - 0.3*v.b - filtered")
    builder.state("filtered", "(command*torque - filtered)/0.1")
    return builder.output("y", formula=["q.a*torque", "v.b", "a.b*command"])


def test_a_number_for_the_whole_run_and_the_rows_of_a_part(monkeypatch: pytest.MonkeyPatch) -> None:
    _, model = built(driven())
    by, held = ["mass"], {"torque": 0.3, "command": 0.5}
    found = model.sensitivities(2.0, STEP, by=by, inputs=held, method="trapezoidal", settings=TO_ROUNDING)
    gradient = found.input_gradient("mean(y[1])")
    assert list(gradient) == ["torque", "command"]

    def mean(torque: float) -> float:
        given = {"method": "trapezoidal", "settings": TO_ROUNDING, "inputs": {**held, "torque": torque}}
        run = model.simulate(2.0, STEP, error_estimate=False, **given)
        return float(np.trapezoid(run.outputs["y"][:, 1], run.t) / 2.0)

    slope = sixth_order(lambda change: mean(0.3 + change), 1e-3)
    assert gradient["torque"].sum() == pytest.approx(slope, rel=1e-9)
    monkeypatch.setattr("eomgen.products.derivatives.motion.LONGEST", 64)
    parts = model.sensitivities(2.0, STEP, by=by, inputs=held, method="trapezoidal", settings=TO_ROUNDING)
    assert parts._run.motion.parts == 4
    for name, array in parts.input_gradient("mean(y[1])").items():
        np.testing.assert_allclose(array, gradient[name], rtol=1e-12, atol=1e-16)


@pytest.mark.slow
def test_what_has_no_derivatives_in_inputs_is_said() -> None:
    _, model = built(tree())
    with pytest.raises(UsageError, match=r'input_gradient: the scene has no inputs; try: inputs=\{"command": ...\}'):
        model.sensitivities(0.1, STEP, by=["mass"]).input_gradient("final(angle)")
    _, road = built(tree().input("road", "0.1*sin(t)").effort("bump", "a", "road"))
    with pytest.raises(UsageError, match=r"all inputs follow formulas of the scene; try: inputs="):
        road.sensitivities(0.1, STEP, by=["mass"]).input_gradient("final(angle)")
    _, other = built(driven())
    run: dict[str, Any] = {"inputs": {"road": 0.1}, "method": "trapezoidal"}
    with pytest.raises(UsageError) as caught:
        other.sensitivities(0.1, STEP, **run)
    assert str(caught.value) == (
        "usage error: inputs: the input road is given, but derivatives by height belong to its formula; try: by=..."
        " without height, or road by its formula"
    )
    assert other.sensitivities(0.1, STEP, by=["mass"], **run).gradient("final(y[1])")["mass"] != 0.0
