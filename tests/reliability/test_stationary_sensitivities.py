"""Derivatives of runs with a constant state by one adjoint for each output, against those of whole runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.products.derivatives.equations import StepEquations
from eomgen.products.derivatives.stationary_run import StationaryRun

PUSHED = ("push_z1", "push_z2", "push_z3", "push_z4")
SPAN = 1.5, 0.05


def frame(start: float = 0.25, force: str = "push", **drive: Any) -> eomgen.SceneBuilder:
    """Two masses on springs, the lower one a cubic one, behind a filter of the force; at rest under 0.3 N."""
    scene = eomgen.SceneBuilder("frame", gravity=[0, 0, 0]).simulation(method="trapezoidal", step=0.05, duration=1.5)
    scene.random("push", "squared_exponential", correlation_time=0.7, modes=4, mean=0.3, translation="g + 0.1 * g**2")
    scene.body("lower", 2.0, inertia=[1e-3, 1e-3, 1e-3]).body("upper", 1.0, inertia=[1e-3, 1e-3, 1e-3])
    cubic = 3.0 * start + 8.0 * start**3
    scene.joint("one", "prismatic", "base", "lower", axis=[1, 0, 0], initial={"position": start, **drive})
    scene.joint("two", "prismatic", "lower", "upper", axis=[1, 0, 0], initial={"position": cubic / 5.0})
    scene.state("late", initial=cubic, rate=f"4 * ({force} - late)")
    scene.effort("lower", "one", "late - 3 * q.one - 8 * q.one**3 - 0.4 * v.one")
    scene.effort("upper", "two", "late - 5 * q.two - 0.3 * v.two")
    scene.output("top", formula="q.one + q.two").output("lift", formula="v.two * late")
    return scene


def balanced() -> float:
    """Return the lower spring's deflection under the mean of what the process is translated to."""
    return float(np.real(next(root for root in np.roots([8.0, 0.0, 3.0, -0.309]) if abs(np.imag(root)) < 1e-12)))


def derivatives(scene: eomgen.SceneBuilder, outputs: list[str], **options: Any) -> tuple[Any, StationaryRun | None]:
    model = eomgen.build(scene.build())
    parameters = dict.fromkeys(PUSHED, 0.0)
    given = {"by": list(PUSHED), "parameters": parameters, "settings": {"rtol": 1e-13, "atol": 1e-15}} | options
    found = model.sensitivities(*SPAN, **given)
    return found, found.stationary(outputs)


def hessian_at(scene: eomgen.SceneBuilder, name: str, time: float) -> Array:
    model = eomgen.build(scene.build())
    settings, parameters = {"rtol": 1e-13, "atol": 1e-15}, dict.fromkeys(PUSHED, 0.0)
    found = model.sensitivities(time, SPAN[1], by=list(PUSHED), parameters=parameters, settings=settings)
    return found.hessian(f"final({name})")


@pytest.mark.slow
def test_one_adjoint_of_each_output_gives_all_rows() -> None:
    """Outputs q.one + q.two and v.two late; the lower spring bends by q.one, the second output by v.two and late."""
    scene = frame(balanced())
    found, still = derivatives(scene, ["top", "lift"])
    assert still is not None and still.solutions == 0
    whole = np.stack([found.derivatives["top"], found.derivatives["lift"]], axis=1)
    np.testing.assert_allclose(still.gradients, whole, rtol=0, atol=2e-14 * np.abs(whole).max())
    np.testing.assert_allclose(still.outputs, np.stack(list(found.outputs.values()), axis=1), rtol=0, atol=1e-14)
    np.testing.assert_array_equal(still.t, found.t)
    assert still.solutions == 2
    for number, name in enumerate(("top", "lift")):
        for time in (0.05, 0.7, 1.5):
            expected = hessian_at(scene, name, time)
            exact = still.hessian(number, round(time / SPAN[1]))
            np.testing.assert_allclose(exact, expected, rtol=0, atol=1e-13 * np.abs(whole).max())
    assert still.solutions == 2 + 2  # q.one and late; v.two is the second output's gradient by a constant
    assert np.abs(still.hessian(0, 30)).max() > 1e-3


@pytest.mark.slow
def test_an_output_by_which_the_equations_bend_takes_one_adjoint_in_all() -> None:
    scene = frame(balanced()).output("low", formula="q.one")
    found, still = derivatives(scene, ["low"], of=["low"])
    expected = found.hessian("final(low)")
    np.testing.assert_allclose(still.hessian(0, 30), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    assert still.solutions == 1


@pytest.mark.parametrize(
    "scene",
    [
        frame(balanced() + 1e-6),
        frame(balanced(), velocity=1e-9),
        frame(balanced(), "(push + 1e-6 * sin(9 * t))"),
    ],
    ids=["off balance", "moving", "driven"],
)
def test_states_that_move_are_none(scene: eomgen.SceneBuilder) -> None:
    assert derivatives(scene, ["top"])[1] is None


@pytest.mark.slow
def test_stiffness_that_changes_with_time_is_none() -> None:
    scene = frame(balanced()).effort("soft", "one", f"-0.2 * sin(t) * (q.one - {balanced()!r})")
    assert derivatives(scene, ["top"])[1] is None
    assert derivatives(frame(balanced()), ["top"], by=[*PUSHED, "q.one"])[1] is None


@pytest.mark.slow
def test_the_hessian_takes_directions_that_bend_something_and_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a linear scene it is zero, and takes no matrix of all parameters at all steps; of one that parameters alone
    bend it is the sum over the rows."""
    asked: list[int] = []
    original = StepEquations.second_partials

    def counted(self: StepEquations, values: Any, multipliers: Array, along: Array, *more: Any) -> Array:
        asked.extend(along.shape[2:] if len(along) > 1 else ())  # one row is the start's
        return original(self, values, multipliers, along, *more)

    for translation, directions in (("g", [1]), ("g + 0.1 * g**2", [1, 4])):
        scene = eomgen.SceneBuilder("linear", gravity=[0, 0, 0]).simulation(method="trapezoidal", step=0.05)
        scene.random(
            "push", "squared_exponential", correlation_time=0.7, modes=4, duration=1.5, translation=translation
        )
        scene.body("mass", 2.0, inertia=[1e-3, 1e-3, 1e-3])
        scene.joint("one", "prismatic", "base", "mass", axis=[1, 0, 0])
        scene.effort("all", "one", "push - 3 * q.one - 0.4 * v.one").output("x", formula="q.one")
        still = derivatives(scene, ["x"])[1]
        expected = hessian_at(scene, "x", 1.5)
        asked.clear()
        with monkeypatch.context() as patch:
            patch.setattr(StepEquations, "second_partials", counted)
            exact = still.hessian(0, 30)
        assert asked == directions
        np.testing.assert_allclose(exact, expected, rtol=0, atol=1e-13 * max(1.0, float(np.abs(expected).max())))
        assert (np.abs(exact).max() > 1e-3) == (translation != "g")
