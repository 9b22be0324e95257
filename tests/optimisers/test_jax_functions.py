"""Functions for JAX: values, derivatives and batches against the compiled model, differences and adjoints of runs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import ModelError, UsageError
from eomgen.lie.product import update
from eomgen.products.optimisers import jax_functions
from tests.models.library import scene

jax: Any = None


@pytest.fixture(scope="module", autouse=True)
def imported() -> None:
    """Import JAX for the first of these tests: a process with JAX, which has threads, had better not fork."""
    globals()["jax"] = import_module("jax")
    jax.config.update("jax_enable_x64", True)


def floating_scene() -> eomgen.SceneBuilder:
    """Return a body in flight that carries an arm, whose motor follows an input."""
    builder = eomgen.SceneBuilder("floating_arm").parameter("load", 1.0, unit="kg", tunable=True)
    builder.input("torque", "0.5*sin(3*t)", unit="N m")
    builder.body("ship", 3.0, center_of_mass=[0.1, 0.05, -0.2], inertia=[0.3, 0.5, 0.4])
    builder.body("arm", "load", center_of_mass=[0.3, 0, 0], inertia=[0.02, 0.1, 0.1])
    builder.joint("float", "free", "base", "ship")
    builder.joint("elbow", "revolute", "ship", "arm", axis=[0, 1, 0], position=[0.2, 0, 0.1])
    return builder.effort("motor", "elbow", "torque")


PENDULUM = "examples/double_pendulum_on_shaking_base/scene.toml"


@pytest.fixture(scope="module")
def floating() -> Any:
    model = eomgen.build(floating_scene().build())
    return model, eomgen.jax(model)


def _state(model: Any) -> tuple[Any, Any, Any]:
    random = np.random.default_rng(3)
    q = update(model.evaluator.factors, model.evaluator.initial_q, random.normal(size=model.nv) * 0.4)
    return q, random.normal(size=model.nv) * 0.5, random.normal(size=model.nv)


@pytest.mark.slow
def test_values_and_batches_have_the_bits_of_the_model(floating: Any) -> None:
    model, functions = floating
    q, v, a = _state(model)
    u, times = np.array([0.3]), np.linspace(0.0, 1.0, 5)
    assert np.array_equal(functions.forward_dynamics(q, v, 0.1, u), model.forward_dynamics(q, v, 0.1, u))
    assert np.array_equal(functions.inverse_dynamics(q, v, a, 0.1), model.inverse_dynamics(q, v, a, 0.1))
    loads = np.array([0.5, 1.0, 2.0])
    nested = jax.vmap(
        jax.vmap(lambda t, load: functions.forward_dynamics(q, v, t, parameters={"load": load}), (0, None)), (None, 0)
    )
    expected = model.forward_dynamics(q, v, times, parameters=loads[:, None, None])
    assert np.array_equal(jax.jit(nested)(times, loads), expected)


@pytest.mark.long
@pytest.mark.slow
def test_first_and_second_derivatives_along_curves_of_poses(floating: Any) -> None:
    model, functions = floating
    q, v, a = _state(model)
    factors, d, h = model.evaluator.factors, np.random.default_rng(4).normal(size=model.nv), 1e-6
    ahead, back = (update(factors, q, sign * h * d) for sign in (1.0, -1.0))
    dq = (ahead - back) / (2.0 * h)
    for name in ("forward_dynamics", "inverse_dynamics"):
        last = (v, 0.0, np.array([0.3])) if name == "forward_dynamics" else (v, a, 0.0, np.array([0.3]))

        def value(x: Any, name: str = name, last: Any = last) -> Any:
            return getattr(functions, name)(x, *last)

        tangent = jax.jvp(value, (q,), (dq,))[1]
        difference = (value(ahead) - value(back)) / (2.0 * h)
        assert np.allclose(tangent, difference, rtol=0.0, atol=1e-8 * np.abs(difference).max())
        gradient = jax.jacrev(value)
        second = jax.jvp(gradient, (q,), (dq,))[1]
        difference = (gradient(ahead) - gradient(back)) / (2.0 * h)
        assert np.allclose(second, difference, rtol=0.0, atol=1e-8 * np.abs(difference).max())


@pytest.mark.slow
def test_second_derivatives_through_a_scan_are_differences_of_gradients() -> None:
    """JAX drops the rules of ``custom_jvp`` in reverse derivatives of a scan."""
    functions = eomgen.jax(eomgen.build(PENDULUM))
    v = np.array([0.5, -0.2])

    def end(q: Any) -> Any:
        def step(x: Any, _: None) -> Any:
            return (x[0] + 0.1 * x[1], x[1] + 0.1 * functions.forward_dynamics(*x)), None

        return jax.lax.scan(step, (q, v), length=3)[0][0].sum()

    gradient, point = jax.jit(jax.grad(end)), np.array([0.4, -0.3])
    differences = [(gradient(point + h) - gradient(point - h)) / 2e-6 for h in 1e-6 * np.eye(2)]
    np.testing.assert_allclose(jax.jit(jax.hessian(end))(point), differences, rtol=1e-7)


@pytest.mark.slow
def test_lanes_have_the_bits_of_single_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_LANES", "now")
    monkeypatch.setenv("EOMGEN_THREADS", "2")
    monkeypatch.setattr(jax_functions, "_SHARE", 1000)
    model = eomgen.build(PENDULUM)
    functions = eomgen.jax(model)
    q = np.random.default_rng(1).normal(size=(1001, 2))
    batch = jax.vmap(lambda x: functions.forward_dynamics(x, np.ones(2)))(q)
    assert functions.in_lanes == {"forward_dynamics": True, "base": True}
    assert np.array_equal(batch, np.stack([model.forward_dynamics(x, np.ones(2)) for x in q]))


Q, V = np.zeros(8), np.zeros(7)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (
            lambda f: f.forward_dynamics(V[:3], V),
            r"q has the shape \(3,\), and .* takes \(8,\); try: one sample; jax.v",
        ),
        (lambda f: f.forward_dynamics(Q, V, parameters={"lod": 1.0}), "there is no parameter 'lod'; try: load"),
        (lambda f: jax.jacfwd(lambda t: f.forward_dynamics(Q, V, t))(0.0), "with inputs by the formulas of the scene"),
        (lambda f: f.forward_dynamics(1j * Q, V), "q: the numbers are complex; try: real numbers"),
        (lambda f: f.simulate(0.01, 1e-3, q=V[:5]), r"q: q has the shape \(5,\), and simulate takes \(8,\); try: one"),
        (lambda f: f.simulate(0.01, 1e-3, parameters={"load": V}), r"load has the shape \(7,\), and simulate takes"),
        (lambda f: f.simulate(0.01, 1e-3, parameters=[1.0]), "parameters: a mapping from names to values is needed, n"),
        (lambda f: f.forward_dynamics(Q, "x"), "v: an array of real numbers is needed, not str; try: a list"),
        (lambda f: f.forward_dynamics(Q), "forward_dynamics: the argument v is missing; try: v="),
        (lambda _: eomgen.jax("scene.toml"), "jax: a model is needed, not str; try: eomgen.build"),
        (lambda _: eomgen.jax(), "jax: the argument model is missing; try: a model"),
    ],
)
def test_mistakes_in_calls_are_named(floating: Any, call: Any, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        call(floating[1])


@pytest.mark.slow
def test_derivatives_of_higher_orders_are_refused() -> None:
    functions = eomgen.jax(eomgen.build(PENDULUM))
    third = jax.jacfwd(jax.hessian(lambda v: functions.forward_dynamics(np.ones(2), v).sum()))
    with pytest.raises(UsageError, match="forward_dynamics has no third derivatives; try: first and second deriv"):
        jax.make_jaxpr(third)(np.ones(2))

    def end(load: Any) -> Any:
        return functions.simulate(0.01, 1e-3, parameters={"m2": load}, of=["energy"], record_every=5)["energy"][-1]

    difference = (end(1.0 + 1e-6) - end(1.0 - 1e-6)) / 2e-6
    assert jax.grad(end)(1.0) == pytest.approx(float(difference), rel=1e-8)  # of the weights of recorded rows
    with pytest.raises(UsageError, match=r"simulate has first reverse derivatives alone; try: model\.sens"):
        jax.make_jaxpr(jax.hessian(end))(1.0)
    with pytest.raises(UsageError, match=r"scene.toml:20 \(bodies.lower.mass\): the mass -1 is negative at m2 = -1"):
        end(-1.0)


def test_accelerations_of_loops_are_refused() -> None:
    functions = eomgen.jax(eomgen.build("examples/four_bar/scene.toml"))
    with pytest.raises(
        ModelError, match=r"four_bar has constraints.*; try: inverse_dynamics; simulate, whose gradients"
    ):
        functions.forward_dynamics(np.zeros(3), np.zeros(3))


def test_float32_is_refused(floating: Any) -> None:
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(UsageError, match=r"JAX is set to float32; try: jax.config.update"):
            eomgen.jax(floating[0])
        with pytest.raises(UsageError, match=r"JAX is set to float32; try: jax.config.update"):
            floating[1].forward_dynamics(np.zeros(8), np.zeros(7))
    finally:
        jax.config.update("jax_enable_x64", True)


@pytest.mark.slow
def test_gradient_through_a_loop_is_the_adjoint() -> None:
    model = eomgen.build("examples/four_bar/scene.toml")
    functions, start = eomgen.jax(model), model.simulate(1e-3, 1e-3, error_estimate=False)
    output = next(iter(functions.simulate(0.01, 0.001)))
    gradient = jax.grad(lambda v: functions.simulate(0.5, 5e-4, v=v)[output][-1].sum())(start.v[0])
    found = model.sensitivities(0.5, 5e-4, by=list(model.v_names), initial={"v": start.v[0]}, of=[output])
    weights = np.zeros_like(found.outputs[output])
    weights[-1] = 1.0
    assert np.array_equal(gradient, found.gradients([{output: weights}])[0])


@pytest.mark.slow
@pytest.mark.long_cases("linear")
@pytest.mark.parametrize("force", ["-3*q.slide - v.slide", "2.0"], ids=["linear", "constant"])
def test_derivatives_without_nonzeros_are_zeros(force: str) -> None:
    """Second derivatives of a linear oscillator, and first ones of a free fall."""
    data = scene("oscillator", efforts={"pull": {"joint": "slide", "effort": force}}, joints__slide__stiffness=None)
    functions = eomgen.jax(eomgen.build(data, profile="quick"))
    slope = -3.0 if force.startswith("-3") else 0.0

    def acceleration(q: Any) -> Any:
        return functions.forward_dynamics(q, jax.numpy.array([0.2]))[0]

    q = jax.numpy.array([0.5])
    assert jax.grad(acceleration)(q).tolist() == jax.jacfwd(acceleration)(q).tolist() == [slope]
    assert jax.jit(jax.hessian(acceleration))(q).tolist() == [[0.0]]
    assert jax.vmap(jax.hessian(acceleration))(jax.numpy.ones((3, 1))).tolist() == [[[0.0]]] * 3
