"""Functions for JAX and PyTorch with NumPy in place of these: maps of tangents, products with derivatives, and runs."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import ModelError, UsageError
from eomgen.lie.product import Factor, update
from eomgen.products.optimisers import torch_functions
from eomgen.products.optimisers.arguments import bracket, gradient_in_components, left_trivialised
from eomgen.products.optimisers.runs import Runs
from eomgen.products.optimisers.torch_functions import TorchFunctions, TorchOperators
from tests.derivatives.checks import sixth_order

#: Numbers, two rotations in a row, numbers again, and two poses.
FACTORS = [
    Factor("R", "a", 0, 1, 0, 1), Factor("SO3", "b", 1, 4, 1, 3), Factor("SO3", "c", 5, 4, 4, 3),
    Factor("R", "d", 9, 2, 7, 2), Factor("SE3", "e", 11, 7, 9, 6), Factor("SE3", "f", 18, 7, 15, 6),
]  # fmt: skip
QUATERNIONS = [slice(first, first + 4) for first in (1, 5, 11, 18)]


def test_tangents_of_components_turn_the_body_and_gradients_are_their_transpose(rng: np.random.Generator) -> None:
    """Changes of components by the update with an imaginary increment; lengths of quaternions do not count."""
    unit, d, g = np.zeros((2, 3, 25)), rng.normal(size=(2, 3, 21)), rng.normal(size=(2, 3, 21))
    unit[..., [1, 5, 11, 18]] = 1.0
    unit = update(FACTORS, unit, rng.normal(size=d.shape))
    dq = update(FACTORS, unit.astype(complex), 1e-30j * d).imag / 1e-30
    q = unit.copy()
    for k, part in enumerate(QUATERNIONS):
        length = 1.5 + k if k < 2 else 1.0  # of poses 1, by which they travel
        q[..., part] *= length
        dq[..., part] = length * dq[..., part] + 0.7 * unit[..., part]
    np.testing.assert_allclose(left_trivialised(np, FACTORS, q, dq), d, rtol=1e-13, atol=1e-14)
    change = rng.normal(size=q.shape)
    by_components = np.sum(gradient_in_components(np, FACTORS, q, g) * change, axis=-1)
    np.testing.assert_allclose(by_components, np.sum(g * left_trivialised(np, FACTORS, q, change), -1), rtol=1e-12)


@pytest.mark.parametrize("size", [3, 6])
def test_brackets_are_crosses_of_angular_and_linear_parts(size: int, rng: np.random.Generator) -> None:
    d, x = rng.normal(size=(4, size)), rng.normal(size=(4, size))
    parts = [np.cross(d[:, :3], x[:, :3])]
    parts += [np.cross(d[:, :3], x[:, 3:]) + np.cross(d[:, 3:], x[:, :3])] if size == 6 else []
    np.testing.assert_allclose((bracket(np, d) @ x[..., None])[..., 0], np.concatenate(parts, 1), rtol=1e-13)


class Tensor(np.ndarray):  # type: ignore[type-arg]
    """An array with the methods of tensors that the functions take."""

    is_tensor, device = True, SimpleNamespace(type="cpu")

    def numpy(self, force: bool = False) -> Array:
        assert force
        return np.asarray(self)

    def expand(self, shape: tuple[int, ...]) -> Tensor:
        return np.broadcast_to(self, shape).view(Tensor)

    def new_zeros(self, shape: tuple[int, ...]) -> Tensor:
        return tensor(np.zeros(shape))

    def split(self, sizes: list[int], axis: int) -> list[Array]:
        return np.split(self, np.cumsum(sizes)[:-1], axis)


def tensor(values: Any, dtype: Any = None) -> Tensor:
    return np.array(values, dtype or float).view(Tensor)


def broadcast_shapes(*shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError as error:
        raise RuntimeError from error


@pytest.fixture
def functions(monkeypatch: pytest.MonkeyPatch) -> TorchFunctions:
    """Functions for PyTorch of a ball with a hinge, without autograd."""
    known: list[TorchFunctions] = []
    package = SimpleNamespace(
        **{name: getattr(np, name) for name in ("linalg", "concatenate", "zeros_like", "float64")},
        stack=lambda parts, axis: tensor(np.stack(parts, axis)),
        from_numpy=tensor, as_tensor=tensor, is_tensor=lambda x: isinstance(x, Tensor),
        broadcast_shapes=broadcast_shapes,
        broadcast_tensors=lambda *parts: [tensor(part) for part in np.broadcast_arrays(*parts)],
    )  # fmt: skip

    def run(runs: Any, *tensors: Any) -> Array:
        values = runs.nest(tensors)
        runs.learn_shapes(values)
        return np.asarray(runs.outputs(values))

    operators = TorchOperators(
        package,
        lambda number, name, *tensors: known[number].values(name, tensors),
        lambda number, _, t, p: known[number].scene_inputs(t, p),
        run,
    )
    monkeypatch.setattr(torch_functions, "_operators", lambda: operators)
    monkeypatch.setattr(torch_functions, "_MODELS", known)
    known.append(TorchFunctions(ball()))
    return known[0]


@cache
def ball() -> Any:
    """Return a pendulum on a ball joint whose drag and torque are no linear functions, with a filter."""
    builder = eomgen.SceneBuilder("ball_in_place").parameter("drag", 0.3, tunable=True)
    builder.parameter("gain", 1.5, tunable=True).input("torque", "gain*sin(3*t)")
    builder.body("bob", 1.0, center_of_mass=[0.1, 0.05, -0.4], inertia=[0.1, 0.2, 0.15])
    builder.joint("pivot", "spherical", "base", "bob").state("lag", "2*(torque - lag)")
    builder.effort("motor", "pivot", "lag*torque - drag*v.pivot[1]**3", index=1)
    return eomgen.build(builder.output("speed", formula="v.pivot[1]").build(), profile="instant")


def arguments(rng: np.random.Generator) -> list[Tensor]:
    """Return q, v, a, z, u, p, t of inverse dynamics at three states."""
    q = update(ball().factors, np.tile(ball().initial_q, (3, 1)), rng.normal(size=(3, 3)))
    rest = [rng.normal(size=(3, size)) for size in (3, 3, 1, 1)]
    return [*map(tensor, (q, *rest, rng.uniform(0.5, 1.5, size=(3, 2)), rng.normal(size=3)))]


def at(tensors: list[Tensor], change: Array) -> dict[str, Any]:
    """Return the arguments of the model's methods, changed along the directions of all."""
    d = np.split(change, np.cumsum([3, 3, 3, 1, 1, 2]))
    q, *others, t = (np.asarray(x) for x in tensors)
    v, a, z, u, p = (x + dx for x, dx in zip(others, d[1:6], strict=True))
    return {"q": update(ball().factors, q, np.tile(d[0], (3, 1))), "v": v, "a": a, "z": z, "u": u,
            "parameters": p, "t": t + d[6][0]}  # fmt: skip


def test_products_with_derivatives_are_differences(functions: TorchFunctions, rng: np.random.Generator) -> None:
    """Of values along each direction, and of gradients along a direction, which do not commute on rotations."""
    name, tensors = "inverse_dynamics", arguments(rng)
    weights, along = tensor(rng.normal(size=(3, 3))), tensor(rng.normal(size=(3, 14)))
    assert functions.size(name) == 14
    np.testing.assert_array_equal(functions.values(name, tensors), ball().inverse_dynamics(**at(tensors, np.zeros(14))))
    unit = np.eye(14)
    jacobian = np.stack(
        [sixth_order(lambda h, e=e: ball().inverse_dynamics(**at(tensors, h * e)), 1e-2) for e in unit], axis=-1
    )
    scale = np.max(np.abs(jacobian))
    tangent, gradient = functions.tangent(name, tensors, along), functions.gradient(name, tensors, weights)
    assert np.max(np.abs(tangent - np.einsum("nij,nj->ni", jacobian, along))) < 1e-9 * scale
    assert np.max(np.abs(gradient - np.einsum("nij,ni->nj", jacobian, weights))) < 1e-9 * scale

    def changed(change: Array) -> Array:
        given = at(tensors, change)
        moved = [tensor(given[block]) for block in ("q", "v", "a", "z", "u", "parameters", "t")]
        return np.asarray(np.sum(functions.gradient(name, moved, weights) * along, axis=-1))

    second = np.stack([sixth_order(lambda h, e=e: changed(h * e), 1e-2) for e in unit], axis=-1)
    curvature = functions.curvature(name, tensors, weights, along)
    assert np.max(np.abs(curvature - second)) < 1e-8 * np.max(np.abs(second))


def test_gradients_have_the_shapes_of_arguments(functions: TorchFunctions, rng: np.random.Generator) -> None:
    tensors, gradient = arguments(rng), tensor(rng.normal(size=(3, 14)))
    parts = functions.in_components("inverse_dynamics", tensors, gradient)
    assert [part.shape for part in parts] == [tensor.shape for tensor in tensors]
    np.testing.assert_allclose(np.sum(parts[0] * tensors[0], axis=-1), 0.0, atol=1e-14)
    np.testing.assert_array_equal(np.concatenate([*parts[1:6], parts[6][:, None]], 1), gradient[:, 3:])


def test_arguments_that_are_left_out_are_those_of_the_scene(functions: TorchFunctions) -> None:
    model, q, v = ball(), ball().initial_q, np.array([0.3, -0.2, 0.5])
    times = np.array([[0.0], [0.7]])
    found = functions.forward_dynamics(q, v, times, parameters={"gain": np.array([0.5, 1.0, 2.0])})
    p = np.stack([np.full(3, 0.3), [0.5, 1.0, 2.0]], axis=-1)
    u = (p[:, 1] * np.sin(3.0 * times))[..., None]
    np.testing.assert_allclose(found, model.forward_dynamics(q, v, times, u, z=[0.0], parameters=p), rtol=1e-14)
    assert found.shape == (2, 3, 3)
    with pytest.raises(UsageError, match=r"v has the shape \(2,\), and forward_dynamics takes \(\.\.\., 3\)"):
        functions.forward_dynamics(q, v[:2])
    with pytest.raises(UsageError, match=r"the leading axes do not broadcast: q \(\), v \(2,\), .* t \(3,\)"):
        functions.forward_dynamics(q, np.tile(v, (2, 1)), np.zeros(3))
    with pytest.raises(UsageError, match="there is no parameter 'gian'"):
        functions.forward_dynamics(q, v, parameters={"gian": 1.0})
    for value, text in (("x", "an array of real numbers is needed, not str"),
                        (v.astype(np.float32).view(Tensor), "v has the type float32")):  # fmt: skip
        with pytest.raises(UsageError, match=text):
            functions.forward_dynamics(q, value)


def test_loops_have_no_forward_dynamics(functions: TorchFunctions, monkeypatch: pytest.MonkeyPatch) -> None:
    loop = SimpleNamespace(library_name="torch", model=SimpleNamespace(name="bars", multipliers=["pin"]))
    monkeypatch.setattr(functions, "_scene", loop)
    with pytest.raises(ModelError, match=r"bars has constraints.*; try: inverse_dynamics; simulate, whose gradients"):
        functions.forward_dynamics(np.zeros(3), np.zeros(3))


def test_runs_have_outputs_and_gradients_nested_as_their_arguments(functions: TorchFunctions) -> None:
    """Gradients are differences of the outputs, which are those of runs."""
    options: dict[str, Any] = {"t_end": 0.1, "step": 0.02, "method": "rk4", "of": ["speed"]}
    nest: dict[str, Any] = {"q": ball().initial_q, "v": np.array([0.3, -0.2, 0.5])}
    nest |= {"parameters": {"drag": np.float64(0.4)}, "inputs": {"torque": np.linspace(0.5, 1.0, 6)}}
    run = ball().simulate(0.1, 0.02, initial={"q": nest["q"], "v": nest["v"]}, parameters=nest["parameters"],
                          inputs=nest["inputs"], method="rk4", error_estimate=False)  # fmt: skip
    np.testing.assert_array_equal(functions.simulate(**options, **nest)["speed"], run.outputs["speed"])
    runs, weights = Runs(ball(), options, nest), np.random.default_rng(1).normal(size=(6, 1))
    runs.learn_shapes(nest)
    assert runs.shape == (6, 1) and runs.columns == {"speed": (slice(0, 1), ())}
    gradient = runs.gradient(nest, weights)

    def difference(block: str, change: Array) -> float:
        def total(h: float) -> float:
            moved = {**nest, "parameters": dict(nest["parameters"]), "inputs": dict(nest["inputs"])}
            if block == "q":
                moved["q"] = update(ball().factors, nest["q"], h * change)
            elif block == "v":
                moved["v"] = nest["v"] + h * change
            else:
                group, name = ("parameters", "drag") if block == "drag" else ("inputs", "torque")
                moved[group][name] = nest[group][name] + h * change
            return float(np.sum(weights * runs.outputs(moved)))

        return sixth_order(total, 1e-2)  # type: ignore[no-any-return]

    expected = {block: [difference(block, unit) for unit in np.eye(3)] for block in "qv"}
    expected["torque"] = [difference("torque", unit) for unit in np.eye(6)]
    scale = max(map(np.max, map(np.abs, expected.values())))
    for found, block in ((gradient["q"], "q"), (gradient["v"], "v"), (gradient["inputs"]["torque"], "torque")):
        np.testing.assert_allclose(found, expected[block], rtol=0, atol=1e-8 * scale)
    assert gradient["parameters"]["drag"] == pytest.approx(difference("drag", np.float64(1.0)), abs=1e-8 * scale)
    flat = runs.flat(nest)
    assert [np.shape(part) for part in flat] == [(4,), (3,), (), (6,)]
    again = runs.nest(flat)
    assert again["parameters"] == nest["parameters"] and again["inputs"]["torque"] is nest["inputs"]["torque"]
    for wrong, told in (({"v": np.zeros(2)}, r"v has the shape \(2,\), and simulate takes \(3,\)"),
                        ({"parameters": {"drag": np.zeros(2)}}, r"drag has the shape \(2,\)")):  # fmt: skip
        with pytest.raises(UsageError, match=told):
            Runs(ball(), options, {**nest, **wrong})
