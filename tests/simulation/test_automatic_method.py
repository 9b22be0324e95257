"""``method = "auto"``: chosen before the run by eigenvalues, constraints and smoothness, and said."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.initial_state import initial_state
from eomgen.simulation.automatic_method import largest_eigenvalue
from tests.simulation.rails import on_rail


def oscillator(
    stiffness: float = 400.0, effort: str = "", run: Mapping[str, Any] = {}, **joint: Any
) -> eomgen.SceneBuilder:
    """A mass of 4 kg on a spring: 10 rad/s by default."""
    builder = on_rail(effort, "slide", mass=4.0, stiffness=stiffness, position=0.1, **joint)
    return builder.simulation(step=0.01, duration=0.2, **run)


def loop() -> eomgen.SceneBuilder:
    """Return a rod that a hinge holds in absolute coordinates."""
    builder = eomgen.SceneBuilder("held", coordinates="absolute").simulation(step=0.01, duration=0.2)
    builder.body("rod", 2.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.01])
    return builder.joint("pin", "revolute", "base", "rod", axis=[0, 1, 0])


@pytest.mark.slow
def test_the_eigenvalue_is_exact_and_of_the_motion_that_constraints_leave() -> None:
    for builder, exact in (
        (oscillator(), 10.0),
        (oscillator(damping=400.0), 50.0 + np.sqrt(2400.0)),  # -c/2m +- sqrt((c/2m)^2 - k/m)
        (loop(), np.sqrt(2.0 * 9.81 * 0.5 / (0.1 + 2.0 * 0.25))),
    ):
        model = eomgen.build(builder.build(), profile="instant")
        found = largest_eigenvalue(model, initial_state(model, None), 0.0, model.parameter_array())
        assert found == pytest.approx(exact, rel=1e-9)


STOP = {"upper": 0.3, "stiffness": 100.0, "damping": 1.0}


#: Scene, step, method and why it is chosen.
CHOICES = {
    "smooth": (oscillator(), 0.01, "rk4", "the largest eigenvalue at the start, 10 1/s, is 0.1, so an explicit method"),
    "stiff": (oscillator(4e6), 0.01, "generalized_alpha", "1e+03 1/s, is 10, above 0.5, which asks for an implicit"),
    "loop": (loop(), 0.01, "rk4_partitioned", "so an explicit method resolves the motion"),
    "coarse": (loop(), 0.2, "generalized_alpha", "above 0.5, which asks for an implicit method"),
    "stop": (oscillator(limits=STOP), 0.01, "generalized_alpha", "forces have corners at places met by the motion"),
    # steps end at known times
    "jump": (oscillator(effort="5 if t > 0.1 else 0"), 0.01, "rk4", "so an explicit method resolves the motion"),
}


@pytest.mark.parametrize("kind", CHOICES)
def test_the_choice_is_made_once_and_said(kind: str) -> None:
    builder, step, chosen, why = CHOICES[kind]
    model = eomgen.build(builder.build(), profile="instant")
    found = model.simulate(0.4, step, method="auto")
    assert found.metadata["method"] == chosen
    assert f"method chosen before the run: {chosen}, because" in found.message
    assert why in found.message
    assert any(why in note for note in found.metadata["notes"])
    named = model.simulate(0.4, step, method=chosen)
    assert np.array_equal(found.q, named.q)
    assert "chosen" not in named.message


@pytest.mark.parametrize(
    ("key", "method"), [("alpha", "hht"), ("beta", "newmark"), ("gamma", "newmark"), ("order", "taylor")]
)
@pytest.mark.parametrize("stiffness", [400.0, 4e6])  # which of the methods would be chosen is not asked
def test_parameters_that_no_method_of_the_choice_takes_are_refused(key: str, method: str, stiffness: float) -> None:
    model = eomgen.build(oscillator(stiffness).build())
    given: Any = {key: 1}
    for call in (model.simulate, model.start):
        with pytest.raises(eomgen.UsageError) as caught:
            call(method="auto", **given)
        assert str(caught.value) == (
            f"usage error: {key}: auto chooses between an explicit method and generalized_alpha, which take no {key};"
            f' try: method = "{method}", or without {key}'
        )


def test_parameters_of_the_scene_wait_for_the_method_that_takes_them() -> None:
    model = eomgen.build(oscillator(run={"method": "auto", "alpha": 0.1}).build())
    assert np.array_equal(model.simulate(0.1).q, model.simulate(0.1, method="rk4").q)
