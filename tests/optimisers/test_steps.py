"""One step of each method for CasADi: the end is that of the method's own stepper, derivatives are differences of the
stepper and of gradients, or the derivatives of runs; sparsity is exact at random states."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.integrators.families.register import is_built_in, method_names
from eomgen.lie.product import update
from eomgen.products.optimisers.discrete_steps import chain_of, inverse_pattern
from eomgen.scene.builder import SceneBuilder
from tests.optimisers.test_casadi import derivatives

EXAMPLES = Path(__file__).parents[2] / "examples"
Array = np.ndarray
STEP = 0.02
#: Further methods of the family of generalized-alpha.
KIN = ("hht", "wbz", "newmark", "trapezoidal")
EXPLICIT = ("rk4", "leapfrog", "yoshida4")


def turning() -> eomgen.Scene:
    """Return a free body that carries a body on a ball joint with a hinge, an input, a parameter and a filter."""
    builder = SceneBuilder("turning").parameter("pull", 2.0, tunable=True).input("torque")
    builder.body("hull", 2.0, center_of_mass=[0.1, 0.2, -0.1], inertia=[0.2, 0.3, 0.25])
    builder.body("dish", 1.0, center_of_mass=[0.0, 0.1, 0.4], inertia=[0.02, 0.03, 0.01])
    builder.body("arm", 0.5, center_of_mass=[0.2, 0.0, 0.1], inertia=[0.01, 0.02, 0.03])
    builder.joint("flight", "free", "base", "hull").joint("ball", "spherical", "hull", "dish", position=[0.3, 0.0, 0.1])
    builder.joint("hinge", "revolute", "dish", "arm", axis=[0, 1, 0])
    builder.state("lag", "3 * (torque - lag)")
    return builder.effort("motor", "hinge", "lag - pull * sin(q.hinge) * v.hinge").build()


def hung() -> eomgen.Scene:
    """Return a body on a ball joint whose tip a rod of fixed length holds, with an input and a filter."""
    builder = SceneBuilder("hung").parameter("pull", 2.0, tunable=True).input("torque")
    builder.body("dish", 1.0, center_of_mass=[0.0, 0.1, -0.4], inertia=[0.02, 0.03, 0.01])
    builder.body("arm", 0.5, center_of_mass=[0.2, 0.0, 0.1], inertia=[0.01, 0.02, 0.03])
    builder.joint("ball", "spherical", "base", "dish").joint("hinge", "revolute", "dish", "arm", axis=[0, 1, 0])
    builder.state("lag", "3 * (torque - lag)")
    builder.effort("motor", "hinge", "lag - pull * sin(q.hinge) * v.hinge")
    tip = {"body": "arm", "position": [0.3, 0.1, 0.1]}
    return builder.constraint("rod", "distance", {"body": "base", "position": [0.5, 0.0, 0.3]}, tip).build()


def skating(*, held: bool = False, push: str | None = None) -> eomgen.Scene:
    """Return a body on a plane with an edge that does not slip sideways, a constraint on velocities alone; held: by a
    rod besides, a constraint on positions; push: formula of the input."""
    builder = SceneBuilder("skating", gravity=[0.0, 0.0, 0.0]).parameter("drag", 0.3, tunable=True).input("push", push)
    builder.body("along", 0.1).body("across", 0.1)
    builder.body("body", 2.0, center_of_mass=[0.2, 0.1, 0.0], inertia=[0.1, 0.2, 0.3])
    builder.joint("x", "prismatic", "base", "along", axis=[1, 0, 0])
    builder.joint("y", "prismatic", "along", "across", axis=[0, 1, 0])
    builder.joint("yaw", "revolute", "across", "body", axis=[0, 0, 1])
    builder.point("edge", "body", [0.3, 0.0, 0.0])
    skate = "cos(q.yaw) * velocity.edge[1] - sin(q.yaw) * velocity.edge[0]"
    builder.constraint("skate", "formula", velocity_equation=skate, unit="m/s")
    if held:
        tip = {"body": "body", "position": [-0.2, 0.1, 0.0]}
        builder.constraint("rod", "distance", {"body": "base", "position": [0.1, 0.8, 0.0]}, tip)
    return builder.effort("pushed", "x", "push - drag * v.x").effort("turned", "yaw", "0.1 * push").build()


def spins() -> eomgen.Scene:
    """Return masses on springs, of constant inertia and forces of positions alone."""
    builder = SceneBuilder("spins", gravity=[0.0, 0.0, -9.81]).parameter("k", 40.0, tunable=True)
    for number in range(2):
        builder.body(f"mass_{number}", 1.0 + number)
        parent = "base" if number == 0 else "mass_0"
        builder.joint(f"slide_{number}", "prismatic", parent, f"mass_{number}", axis=[0, 0, 1])
        builder.output(f"place_{number}", formula=f"q.slide_{number}")
        builder.effort(f"spring_{number}", f"slide_{number}", f"-k * q.slide_{number} - 300 * q.slide_{number}**3")
    return builder.build()


SCENES: dict[str, Callable[[], Any]] = {
    "turning": turning,
    "hung": hung,
    "spins": spins,
    "sled": skating,
    "ridge": lambda: skating(held=True),
    "four_bar": lambda: EXAMPLES / "four_bar" / "scene.toml",
    "double_pendulum": lambda: EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml",
}
#: Scene and method.
CASES = [
    ("turning", "rk4"),
    ("turning", "trapezoidal"),
    ("hung", "rattlie"),
    ("four_bar", "rattlie"),
    ("sled", "trapezoidal"),
    ("hung", "generalized_alpha"),
    ("ridge", "hht"),
    ("double_pendulum", "generalized_alpha"),
    ("double_pendulum", "newmark"),
    ("spins", "leapfrog"),
    ("spins", "yoshida4"),
]
#: Of central differences of eighth order.
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)


@cache
def model_of(scene: str, method: str) -> eomgen.Model:
    return eomgen.build(SCENES[scene](), profile="quick", method=method)


@cache
def step_of(scene: str, method: str) -> Any:
    return eomgen.casadi(SCENES[scene](), method=method, profile="quick")["step"]


def start_of(model: eomgen.Model, function: Any, rng: np.random.Generator) -> Array:
    """Return arguments of a step, side by side, from a state that moves and meets the constraints."""
    q, v = update(model.factors, model.initial_q, 0.3 * rng.normal(size=model.nv)), rng.normal(size=model.nv)
    if model.multipliers:
        state = model.consistent(model.initial_q, v)
        q, v = state.q, state.v
    blocks = {"x": np.concatenate([q, v, rng.normal(size=model.nz)]), "u": rng.normal(size=model.nu)}
    blocks |= {"p": model.parameter_array() * 1.2, "t": np.array([0.3]), "h": np.array([STEP])}
    return np.concatenate([blocks[name] for name in function.name_in()])


def parts(function: Any, y: Array) -> dict[str, Array]:
    sizes = [function.size1_in(k) for k in range(function.n_in())]
    return dict(zip(function.name_in(), np.split(y, np.cumsum(sizes)[:-1]), strict=True))


def stepped(model: eomgen.Model, method: str, given: dict[str, Array]) -> Array:
    """Return the end of a step by the method's stepper."""
    q, v, z = np.split(given["x"], [model.nq, model.nq + model.nv])
    start, h = float(given["t"][0]) if "t" in given else 0.0, float(given["h"][0])
    initial = {"q": q, "v": v, **{name.removeprefix("z."): value for name, value in zip(model.z_names, z, strict=True)}}
    names = [item.name for item in model.description.inputs]
    options: dict[str, Any] = {"initial": initial, "parameters": given.get("p"), "t_start": start}
    options |= {"inputs": dict(zip(names, given["u"].tolist(), strict=True))} if "u" in given else {}
    options |= {} if method in EXPLICIT else {"settings": {"rtol": 1e-14}}
    run = model.simulate(start + h, h, method=method, **options)
    return np.concatenate([run.q[-1], run.v[-1], run.z[-1] if model.nz else np.zeros(0)])


def on_sphere(model: eomgen.Model, y: Array) -> tuple[Array, Array]:
    """Return y with unit quaternions, and the derivative of this map."""
    result, rate = y.copy(), np.eye(len(y))
    for factor in (factor for factor in model.factors if factor.group != "R"):
        places = factor.q_start + np.arange(4)
        length = np.linalg.norm(y[places])
        result[places] /= length
        rate[np.ix_(places, places)] = (np.eye(4) - np.outer(result[places], result[places])) / length
    return result, rate


def along(function: Callable[[Array], Array], y: Array, step: float) -> Array:
    """Return the derivative of a function by differences of eighth order, whose error at steps of 5e-4 is below 5e-12
    of the largest derivative here: at 1e-3 it is as small, or larger by the eighth power."""
    rows = []
    for unit in np.eye(len(y)) * step:
        apart = (function(y + k * unit) - function(y - k * unit) for k in (1, 2, 3, 4))
        rows.append(sum(weight * one for weight, one in zip(WEIGHTS, apart, strict=True)) / step)
    return np.stack(rows, axis=-1)


@pytest.mark.slow
@pytest.mark.long_except("spins-leapfrog", "sled-trapezoidal", "double_pendulum-newmark")
@pytest.mark.parametrize(("scene", "method"), CASES)
def test_a_step_ends_as_the_stepper_does(scene: str, method: str, rng: np.random.Generator) -> None:
    model, function = model_of(scene, method), step_of(scene, method)
    given = parts(function, start_of(model, function, rng))
    found, expected = np.array(function(*given.values())).ravel(), stepped(model, method, given)
    scale = np.abs(expected) + STEP * np.max(np.abs(expected[model.nq :]))
    assert np.max(np.abs(found - expected) / scale) < 1e-10  # where the iteration of the stepper ends
    if model.multipliers:
        q, v = found[: model.nq], found[model.nq : model.nq + model.nv]
        assert np.max(np.abs(model.evaluate("constraint_velocity", q, v)["w"])) < 1e-11


@pytest.mark.slow
@pytest.mark.long_cases("hung-rattlie", "turning-rk4", "turning-trapezoidal", "hung-generalized_alpha", "ridge-hht")
@pytest.mark.parametrize(("scene", "method"), CASES)
def test_derivatives_of_a_step_are_differences(scene: str, method: str, rng: np.random.Generator) -> None:
    """The Jacobian of the function itself, whose ends are those of the stepper, and the Hessian of the gradient."""
    model, function = model_of(scene, method), step_of(scene, method)
    y, weights = start_of(model, function, rng), rng.normal(size=function.size1_out(0))
    jacobian, hessian = derivatives(function, list(parts(function, y).values()), weights)

    def value(y: Array) -> Array:
        return np.array(function(*parts(function, on_sphere(model, y)[0]).values())).ravel()

    def gradient(y: Array) -> Array:
        unit, rate = on_sphere(model, y)
        return weights @ derivatives(function, list(parts(function, unit).values()), weights)[0] @ rate

    by_values, by_gradients = along(value, y, 5e-4), along(gradient, y, 5e-4)
    assert np.max(np.abs(jacobian - by_values)) < 1e-11 * np.max(np.abs(by_values))
    assert np.array_equal(hessian, hessian.T)
    assert np.max(np.abs(hessian - by_gradients)) < 2e-11 * np.max(np.abs(by_gradients))


@pytest.mark.slow
@pytest.mark.long_except("four_bar-rattlie", "spins-rk4")
@pytest.mark.parametrize(
    ("scene", "method"), [("four_bar", "rattlie"), ("spins", "trapezoidal"), ("spins", "leapfrog"), ("spins", "rk4")]
)
def test_the_sparsity_of_a_step_is_exact(scene: str, method: str, rng: np.random.Generator) -> None:
    model, function = model_of(scene, method), step_of(scene, method)
    found = []
    for _ in range(30):
        given = list(parts(function, start_of(model, function, rng)).values())
        found.append(derivatives(function, given, rng.normal(size=function.size1_out(0)), sparse=True))
    for matrices in zip(*found, strict=True):
        assert np.all(np.any([np.array(matrix.nonzeros()) != 0.0 for matrix in matrices], axis=0))


def test_the_inverse_of_nonzeros() -> None:
    """Of a matrix whose diagonal is empty, of two diagonals, and of a matrix without an inverse."""
    chain = np.array([[0, 1, 0], [0, 0, 1], [1, 1, 0]], bool)
    assert np.array_equal(inverse_pattern(chain), [[1, 0, 1], [1, 0, 0], [0, 1, 0]])
    assert np.array_equal(inverse_pattern(np.eye(6, dtype=bool) | np.eye(6, k=-1, dtype=bool)), np.tri(6, dtype=bool))
    assert inverse_pattern(np.zeros((2, 2), bool)).all()


@pytest.mark.slow
def test_methods_without_such_steps_are_refused(tmp_path: Path) -> None:
    none = "steps of {} have no derivatives in C for scenes with {}; try: {}"
    loops = "constraints on positions"
    cases = {
        ("four_bar", "rk4"): none.format("rk4", loops, "rattlie"),
        ("double_pendulum", "rattlie"): none.format("rattlie", "no constraints", "rk4"),
        ("four_bar", "hht_index3"): none.format("hht_index3", loops, "rattlie"),
    }
    for (scene, method), text in cases.items():
        with pytest.raises(eomgen.UsageError) as caught:
            eomgen.generate(SCENES[scene](), tmp_path / "c", method=method, target="casadi")
        assert str(caught.value) == f"usage error: method: {text}"
    with pytest.raises(eomgen.ModelError) as kicked:
        eomgen.generate(SCENES["double_pendulum"](), tmp_path / "c", method="leapfrog", target="casadi")
    assert "accelerations of double_pendulum_on_shaking_base depend on velocities" in str(kicked.value)


def test_each_method_has_a_step_or_a_reason() -> None:
    """Of the built-in methods, for a scene without constraints."""
    program = to_program(eomgen.derive(SCENES["spins"](), ["mass"]), functions=["mass"])
    said: dict[str, str] = {}
    for method in (name for name in method_names() if is_built_in(name) and not name.endswith("_index3")):
        try:
            chain_of(program, [], method, ("u", "p", "t", "h"))  # the functions that it needs are not there
        except eomgen.UsageError as error:
            said[method] = str(error).removeprefix(f"usage error: method: steps of {method} ")
    others = {name for name, text in said.items() if text.startswith("are made of other terms; try: terms with")}
    assert others >= {*EXPLICIT, *KIN, "generalized_alpha"}
    no_step = "have no derivatives in C"
    for method in ("rosenbrock", "corrected_predictor", "tdg2"):
        assert said[method] == f"{no_step}; try: rk4"
    assert said["rk45"] == said["taylor"] == f"{no_step}, since its length is chosen; try: rk4"
    assert said["generalized_alpha_f1"] == said["rk4_partitioned"] == f"{no_step}; try: rk4"
    assert said["rattlie"] == f"{no_step} for scenes with no constraints; try: rk4"


def test_scenes_without_a_step_say_why(tmp_path: Path) -> None:
    builder = SceneBuilder("clocked").body("mass", 1.0).joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0])
    scene = builder.state("held", sample=0.01, formula="q.slide").effort("push", "slide", "-held").build()
    why = "the state held is sampled: its value after a step depends on the time of the last sample"
    functions = eomgen.casadi(scene, profile="quick")
    with pytest.raises(KeyError, match=f"there is no CasADi function 'step': {why}; try: inverse_dynamics, forward_d"):
        functions["step"]
    eomgen.generate(scene, tmp_path / "c", target="casadi")
    assert f"\nThere is no `step`: {why}.\n" in (tmp_path / "c" / "README.md").read_text(encoding="utf-8")
    with pytest.raises(eomgen.ModelError, match=f"method: {why}; try: no method, for the other functions"):
        eomgen.casadi(scene, method="rk4", profile="quick")
