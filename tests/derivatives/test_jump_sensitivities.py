"""Derivatives of runs with jumps of the state: samples and events, against closed forms and differences of runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError
from eomgen.pipeline.model import Model
from eomgen.products.derivatives import motion
from eomgen.scene.builder import SceneBuilder
from tests.derivatives.checks import sixth_order

TO_ROUNDING = {"rtol": 1e-16, "atol": 1e-18}
TINY = 1e-30


def tunable(builder: SceneBuilder, values: Mapping[str, float]) -> SceneBuilder:
    for name, value in values.items():
        builder.parameter(name, value, tunable=True)
    return builder


def ball() -> Model:
    """Return a ball that bounces on a floor, with a force of gravity by a parameter."""
    builder = tunable(SceneBuilder("jumps_ball", gravity=[0, 0, 0]), {"e": 0.8, "g": 9.81, "floor": 0.2, "mass": 2.0})
    builder.body("ball", "mass").joint(
        "height", "prismatic", "base", "ball", axis=[0, 0, 1], initial={"position": 1.0, "velocity": 0.3}
    )
    builder.effort("weight", "height", "-mass*g")
    bounce = {"direction": "falling", "action": "impact", "restitution": "e"}
    builder.event("bounce", when="q.height - floor", **bounce)
    return eomgen.build(
        builder.output("y", formula="q.height").output("w", formula="v.height").build(), profile="instant"
    )


def height(t: float, e: Any, g: Any, floor: Any, y: Any, v: Any) -> tuple[Any, Any]:
    """Return height and velocity of a bouncing ball at a time."""
    passed = 0.0
    while True:
        fall = (v + np.sqrt(v * v + 2.0 * g * (y - floor))) / g
        if np.real(passed + fall) > t:
            s = t - passed
            return y + v * s - 0.5 * g * s * s, v - g * s
        y, v, passed = floor, -e * (v - g * fall), passed + fall


@pytest.mark.parametrize("method", ["generalized_alpha", "trapezoidal"])
def test_a_bouncing_ball_has_the_derivatives_of_its_closed_form(method: str) -> None:
    by, at = ["e", "g", "floor", "q.height", "v.height"], np.array([0.8, 9.81, 0.2, 1.0, 0.3])
    found = ball().sensitivities(1.6, 0.01, by=by, method=method)
    for k, step in enumerate(1j * TINY * np.eye(5)):
        exact = np.array([height(t, *(at + step)) for t in found.t]).imag / TINY
        np.testing.assert_allclose(found.derivatives["y"][:, k], exact[:, 0], atol=1e-9)
        np.testing.assert_allclose(found.derivatives["w"][:, k], exact[:, 1], atol=1e-9)
        assert abs(found.gradient("final(w)")[by[k]] - exact[-1, 1]) < 1e-9
    whole = np.trapezoid(found.derivatives["y"], found.t, axis=0)
    np.testing.assert_allclose(list(found.gradient("integral(y)").values()), whole, rtol=1e-12)


def servo(sample: float = 0.02, **keys: Any) -> SceneBuilder:
    """Return a cart with a sampled PD controller."""
    builder = tunable(SceneBuilder("jumps_servo"), {"kp": 40.0, "kd": 6.0, "mass": 2.0})
    builder.body("cart", "mass")
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"position": 0.5})
    builder.state("force", sample=sample, formula="-kp*q.rail - kd*v.rail", **keys).effort("drive", "rail", "force")
    return builder.output("way", formula="q.rail").output("speed", formula="v.rail")


@pytest.mark.parametrize(("sample", "delay"), [(0.025, 0.0), (0.02, 0.007)])
def test_a_sampled_loop_has_the_derivatives_of_its_difference_equation(sample: float, delay: float) -> None:
    """Each hold of the force is solved exactly, also by generalized-alpha: the acceleration is constant."""
    model = eomgen.build(servo(sample, **({"delay": delay} if delay else {})).build())
    by, at = ["kp", "kd", "mass", "q.rail"], np.array([40.0, 6.0, 2.0, 0.5])
    found = model.sensitivities(0.4, 0.01, by=by)
    for k, (kp, kd, mass, x) in enumerate(at + 1j * TINY * np.eye(4)):
        exact = motion_of_servo(found.t, sample, delay, (kp, kd, mass), x)
        for column, name in enumerate(("way", "speed")):
            np.testing.assert_allclose(found.derivatives[name][:, k], exact[:, column], atol=1e-10)
            assert abs(found.gradient(f"sum({name})")[by[k]] - exact[:, column].sum()) < 1e-9


def motion_of_servo(times: np.ndarray, sample: float, delay: float, gains: Sequence[Any], x: Any) -> np.ndarray:
    """Return the imaginary parts of position and velocity at times, of a loop with held forces."""
    kp, kd, mass = gains
    v, u, waiting, rows = 0.0 * x, 0.0 * x, 0.0 * x, []
    samples = np.arange(0.0, times[-1] + sample, sample)
    moments = sorted({*times.round(9), *samples.round(9), *(samples + delay).round(9)})
    now = 0.0
    for t in moments:
        a = u / mass
        x, v, now = x + (t - now) * v + 0.5 * (t - now) ** 2 * a, v + (t - now) * a, t
        if np.min(np.abs(times - t)) < 1e-8:
            rows.append((x, v))
        taken = np.min(np.abs(samples - t)) < 1e-8
        if not delay and taken:
            u = -kp * x - kd * v
        elif delay and np.min(np.abs(samples + delay - t)) < 1e-8:
            u = waiting
        if delay and taken:
            waiting = -kp * x - kd * v
    return np.array(rows).imag / TINY


def switching() -> Model:
    """Return a cart on a shaking base that an event in time drives and another resets."""
    values = {"on": 0.313, "level": 0.2, "k": 40.0, "new": -0.3, "shake": 0.3}
    builder = tunable(SceneBuilder("jumps_switch"), values).base(["shake*sin(5*t)", 0, 0]).body("cart", 1.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"position": 0.5, "velocity": 0.1})
    builder.mode("push", 0).state("lag", "(q.rail - lag)/0.2 + sin(3*t)")
    builder.effort("drive", "rail", "-k*q.rail + (3 + 3*lag + sin(7*t))*mode.push")
    builder.event("start", when="t - on", action="switch", mode="push", to=1)
    reset = {"v.rail": "new*v.rail", "lag": "0.5*lag + k*0.01"}
    builder.event("low", when="q.rail + level", direction="falling", action="reset", reset=reset)
    return eomgen.build(builder.output("y", formula=["q.rail", "a.rail", "lag", "v.rail"]).build(), profile="instant")


def linkage(sample: float = 0.0) -> Model:
    """Return a closed loop with a stop, or with a sampled torque."""
    values = {"mass": 1.3, "length": 0.5, "damping": 0.2, "e": 0.6, "kd": 0.8}
    builder = tunable(SceneBuilder("jumps_loop"), values)
    builder.body("one", "mass", center_of_mass=[0.25, 0, 0], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=["length/2", 0.05, 0], inertia=[0.05, 0.06, 0.02])
    builder.body("three", 0.6, center_of_mass=[0.2, 0, 0], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0, 1, 0], position=["length", 0, 0])
    builder.joint("c", "spherical", "two", "three", position=["length", 0, 0])
    ends = {"body": "three", "position": [0.3, 0, 0]}, {"body": "base", "position": [0.6, 0.1, 0.2]}
    builder.constraint("rod", "distance", *ends, length=0.9)
    if sample:
        builder.state("torque", sample=sample, formula="-kd*v.a - kd*q.b")
        builder.effort("damper", "a", "torque - damping*v.a")
    else:
        builder.effort("damper", "a", "-kd*damping*v.a")
        builder.event("stop", when="q.a - 0.5", direction="rising", action="impact", restitution="e")
    return eomgen.build(builder.output("y", formula=["v.a*v.b", "a.b", "v.c[1]"]).build(), profile="instant")


def hanging() -> Model:
    """Return a ball joint and a free body, joined by a spring; the free body strikes a floor."""
    builder = tunable(SceneBuilder("jumps_turns"), {"k": 30.0, "mass": 1.0, "long": 0.7, "e": 0.5})
    builder.body("one", "mass", center_of_mass=[0.1, 0, -0.4], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.4, center_of_mass=[0.1, 0.05, -0.3], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "spherical", "base", "one").joint("f", "free", "base", "two", position=[0, 0, 1])
    builder.point("tip", "one", [0, 0, -0.5]).point("eye", "two", [0.1, 0, 0])
    builder.spring("rope", "tip", "eye", stiffness="k", length="long", damping=0.3)
    floor = {"direction": "falling", "action": "impact", "restitution": "e"}
    builder.event("floor", when="position.eye[2] - 0.2", **floor)
    return eomgen.build(builder.output("y", formula=["v.a[0]*v.a[1]", "v.f[3]", "a.a[2]"]).build(), profile="instant")


def driven() -> Model:
    """Return a cart that strikes a moving wall under an input that the caller gives."""
    builder = tunable(SceneBuilder("jumps_driven").input("force"), {"e": 0.7, "k": 20.0, "wall": 0.3})
    builder.body("cart", 1.0).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"position": 0.5})
    strike = {"direction": "falling", "action": "impact", "restitution": "e"}
    builder.effort("drive", "rail", "force - k*q.rail").event("strike", when="q.rail - wall*sin(3*t)", **strike)
    return eomgen.build(builder.output("y", formula=["q.rail", "a.rail*force"]).build(), profile="instant")


CASES: dict[str, tuple[Callable[[], Model], Sequence[str], float, str]] = {
    "switch": (switching, ["on", "level", "k", "new", "shake"], 1.2, "newmark"),
    "stop": (linkage, ["mass", "length", "damping", "e"], 0.62, "generalized_alpha"),
    "torque_inside": (lambda: linkage(0.023), ["mass", "length", "kd"], 0.3, "generalized_alpha"),
    "turns": (hanging, ["k", "mass", "long", "e"], 0.8, "generalized_alpha"),
    "driven": (driven, ["e", "k", "wall"], 1.5, "generalized_alpha"),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_derivatives_across_jumps_are_differences_of_runs(case: str) -> None:
    made, by, end, method = CASES[case]
    model, step = made(), 0.01
    rows = round(end / step) + 1
    keys: dict[str, Any] = {"method": method, "settings": TO_ROUNDING}
    if model.nu:
        keys["inputs"] = {"force": np.sin(0.1 * np.arange(rows))}
    found = model.sensitivities(end, step, by=by, **keys)
    table = found.derivatives["y"]

    def outputs(name: str, change: float) -> np.ndarray:
        return model.simulate(end, step, parameters={name: model.parameters[name] + change}, **keys).outputs["y"]

    for k, name in enumerate(by):
        expected = sixth_order(lambda change, name=name: outputs(name, change), 1e-5)
        np.testing.assert_allclose(table[..., k], expected, atol=3e-8 * np.abs(expected).max())
    functionals = [f"integral(y[{place}])" for place in range(table.shape[1])]
    whole = np.trapezoid(table, found.t, axis=0)
    np.testing.assert_allclose(found.gradients(functionals), whole, atol=1e-12 * np.abs(whole).max())


def timed() -> Model:
    """Return a cart that a constant force pushes from a moment on, which is a parameter."""
    builder = tunable(SceneBuilder("jumps_timed", gravity=[0, 0, 0]), {"on": 0.03, "mass": 2.0, "force": 5.0})
    builder.body("cart", "mass").joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).mode("push", 0)
    builder.effort("drive", "rail", "force*mode.push").state("lag", "(q.rail - lag)/0.1 + sin(3*t)")
    builder.event("start", when="t - on", action="switch", mode="push", to=1)
    builder.output("y", formula=["q.rail", "v.rail"]).output("z", formula="lag")
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.parametrize("on", [0.0327, 0.03 + 1e-11, 0.03, 0.04 - 1e-11])
def test_a_force_from_a_moment_on_has_the_derivatives_of_its_motion(on: float) -> None:
    """Also of moments so near to the points of the grid that parts of steps are two terms of a series."""
    by = ["on", "mass", "force"]
    found = timed().sensitivities(0.08, 0.01, by=by, parameters={"on": on}, method="trapezoidal")
    s = np.maximum(found.t - on, 0.0)
    later = found.t > on - 1e-12
    expected = {"on": [-2.5 * s, -2.5 * later], "mass": [-0.625 * s * s, -1.25 * s], "force": [0.25 * s * s, 0.5 * s]}
    for name, columns in expected.items():
        column = found.derivatives["y"][..., found.by.index(name)]
        np.testing.assert_allclose(column, np.stack(columns, axis=-1), atol=1e-9)
        gradient = found.gradient("sum(y[0])")[name]
        assert gradient == pytest.approx(np.sum(columns[0]), abs=1e-9)

    def lag(**changed: float) -> np.ndarray:
        run = timed().simulate(0.08, 0.01, parameters={"on": on, **changed}, method="trapezoidal", error_estimate=False)
        return np.asarray(run.outputs["z"])

    np.testing.assert_allclose(found.derivatives["z"][:, 2], lag(force=6.0) - lag(force=5.0), atol=1e-9)  # linear
    if on == 0.0327:  # between points of the grid
        slope = sixth_order(lambda h: lag(on=on + h), 1e-4)
        np.testing.assert_allclose(found.derivatives["z"][:, 0], slope, atol=1e-7)


@pytest.mark.slow
def test_parts_that_are_stepped_again_have_the_same_gradient(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []
    for kept in (motion.KEPT_BYTES, 0):
        monkeypatch.setattr(motion.ReplayedRun.__init__, "__defaults__", (kept,))
        monkeypatch.setattr(motion, "LONGEST", 32)
        for model, end in ((ball(), 1.6), (eomgen.build(servo(0.023).build(), profile="instant"), 1.2)):
            found = model.sensitivities(end, 0.01)
            runs.append(found.gradients([f"integral({next(iter(found.outputs))})"]))
    assert np.array_equal(runs[0], runs[2])
    assert np.array_equal(runs[1], runs[3])


# -- refusals ----------------------------------------------------------------------------------------------------------


def refused(model: Model, **keys: Any) -> str:
    with pytest.raises((UsageError, NumericalError)) as error:
        found = model.sensitivities(**{"t_end": 1.0, "step": 0.01, **keys})
        found.gradients([f"final({next(iter(found.outputs))})"])
    return str(error.value)


@pytest.mark.slow
def test_second_derivatives_and_gradients_of_all_inputs_are_refused() -> None:
    found = driven().sensitivities(0.1, 0.01, inputs={"force": np.ones(11)})
    with pytest.raises(UsageError, match="the state jumps along the run, at samples or events, and second"):
        found.hessian("final(y[0])")
    with pytest.raises(UsageError, match=r'the state jumps .* rows of inputs together .* by=\["inputs.force\[:\]"\]'):
        found.input_gradient("final(y[0])")


def cart(**event: Any) -> SceneBuilder:
    builder = tunable(SceneBuilder("jumps_cart"), {"at": 0.5, "mass": 1.0}).body("cart", "mass")
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"velocity": 1.0})
    builder.effort("brake", "rail", "-mass").output("way", formula="q.rail")
    return builder.event("first", **event) if event else builder


@pytest.mark.slow
def test_events_without_derivatives_name_their_cause() -> None:
    text = refused(eomgen.build(cart(when="q.rail - 0.3", action="stop").build()))
    assert "the event first ends the run at t = 0.367544468 s, before the last row" in text
    grazing = cart(when="q.rail - at", direction="rising", action="reset", reset={"v.rail": 0.1})
    grazed = refused(eomgen.build(grazing.build()), t_end=1.2, parameters={"at": 0.5 - 1e-15})
    assert "the motion grazes at the event first, t = 0.9999" in grazed
    twice = cart(when="q.rail - at/2", action="reset", reset={"v.rail": 0.1})
    twice.event("second", when="q.rail - at/2", action="reset", reset={"v.rail": 0.2})
    assert "two events change the motion at t = " in refused(eomgen.build(twice.build()))
    moded = cart(when="q.rail - 0.3", action="switch", mode="level", to="at").mode("level", 0)
    text = refused(eomgen.build(moded.effort("push", "rail", "mode.level").build()))
    assert "the event first sets the mode level, whose value depends on the directions" in text
