"""Functions for PyTorch against the compiled model, PyTorch's differences, and adjoints of runs.

PyTorch's package for Linux brings gigabytes of libraries of graphics cards, so these tests are of the longest tier,
which installs it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.products.optimisers import torch_functions
from tests.optimisers.test_jax_functions import PENDULUM, _state, floating_scene


@pytest.fixture(scope="module")
def torch() -> Any:
    import torch

    return torch


@pytest.fixture(scope="module")
def floating(torch: Any) -> Any:
    model = eomgen.build(floating_scene().build(), profile="quick")
    return model, eomgen.torch(model)


@pytest.fixture(scope="module")
def pendulum(torch: Any) -> Any:
    model = eomgen.build(PENDULUM, profile="quick")
    return model, eomgen.torch(model)


def _dynamics(torch: Any, functions: Any) -> Any:
    """Return forward dynamics of a configuration whose quaternion is made a unit one, and a point."""

    def vdot(q: Any, v: Any, t: Any, u: Any, load: Any) -> Any:
        turned = q[..., :4] / q[..., :4].norm(dim=-1, keepdim=True)
        q = torch.cat([turned, q[..., 4:]], -1)
        return functions.forward_dynamics(q, v, t, u, parameters={"load": load})

    q, v, _ = _state(functions._model)
    return vdot, [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in (q, v, 0.1, [0.3], 1.2)]


@pytest.mark.long
def test_values_of_batches_have_the_bits_of_the_model(torch: Any, floating: Any) -> None:
    model, functions = floating
    q, v, a = _state(model)
    loads, times = np.array([0.5, 1.0, 2.0])[:, None], np.linspace(0.0, 1.0, 5)
    found = functions.forward_dynamics(
        torch.tensor(q), torch.tensor(v), torch.tensor(times), parameters={"load": torch.tensor(loads)}
    )
    assert np.array_equal(found, model.forward_dynamics(q, v, times, parameters=loads[..., None]))
    assert np.array_equal(functions.inverse_dynamics(q, v, a, 0.1), model.inverse_dynamics(q, v, a, 0.1))


@pytest.mark.long
def test_first_and_second_derivatives_pass_the_checks_of_pytorch(torch: Any, floating: Any) -> None:
    vdot, point = _dynamics(torch, floating[1])
    assert torch.autograd.gradcheck(vdot, point, atol=1e-7)
    assert torch.autograd.gradgradcheck(vdot, point, atol=1e-6)
    q, v, t, u, load = (x.detach() for x in point)
    batch = [x.clone().requires_grad_() for x in (q.expand(3, -1), v * torch.ones(3, 1, dtype=v.dtype), t, u, load)]
    assert torch.autograd.gradcheck(vdot, batch, atol=1e-7)

    def tau(v: Any, a: Any) -> Any:
        return floating[1].inverse_dynamics(q, v, a, t, u)

    states = [v.clone().requires_grad_(), torch.randn_like(v, requires_grad=True)]
    assert torch.autograd.gradcheck(tau, states)
    assert torch.autograd.gradgradcheck(tau, states)


@pytest.mark.long
def test_transforms_of_pytorch_apply(torch: Any, floating: Any) -> None:
    model, functions = floating
    vdot, point = _dynamics(torch, functions)
    q, v, t, u, load = (x.detach() for x in point)
    second = torch.func.jacrev(torch.func.jacrev(lambda v: vdot(q, v, t, u, load)))(v)
    inputs = {"q": q, "v": v, "u": u, "parameters": load[None]}
    found = {name: x.numpy() for name, x in inputs.items()}
    for row, weights in enumerate(np.eye(7)):
        expected = model.hessian("forward_dynamics", weights, **found, t=0.1, of=["v"])
        assert np.allclose(second[row].numpy(), expected, rtol=0.0, atol=1e-12 * float(second[row].abs().max()))

    def gradient(v: Any) -> Any:
        return torch.func.grad(lambda v: vdot(q, v, t, u, load).sin().sum())(v)

    batch = torch.randn(5, 7, dtype=torch.float64)
    one_by_one = torch.stack([gradient(x) for x in batch])
    assert torch.allclose(torch.func.vmap(gradient)(batch), one_by_one, rtol=1e-13, atol=1e-13)
    compiled = torch.compile(lambda v: vdot(q, v, t, u, load).sin().sum(), backend="aot_eager")
    x = v.clone().requires_grad_()
    compiled(x).backward()
    assert torch.allclose(x.grad, gradient(v), rtol=1e-13, atol=1e-13)
    without_gradients = torch.compile(functions.forward_dynamics, backend="aot_eager")(q.detach(), v.detach())
    assert torch.equal(without_gradients, functions.forward_dynamics(q.detach(), v.detach()))
    blocks = functions._broadcast("forward_dynamics", {"q": q, "v": v, "z": q[:0], "u": u, "p": load[None], "t": t})
    torch.library.opcheck(torch.ops.eomgen.value.default, (blocks, functions._number, "forward_dynamics"))
    torch.library.opcheck(torch.ops.eomgen.gradient.default, (blocks, v, functions._number, "forward_dynamics"))


@pytest.mark.long
def test_gradients_of_runs_are_adjoints(torch: Any, pendulum: Any) -> None:
    model, functions = pendulum
    exact = {"rtol": 1e-16, "atol": 1e-18}

    def energy(q: Any, v: Any, m2: Any) -> Any:
        run = functions.simulate(0.05, 1e-3, q=q, v=v, parameters={"m2": m2}, of=["energy"], settings=exact)
        return run["energy"]

    point = [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in ([0.3, -0.2], [0.1, 0.4], 1.0)]
    assert torch.autograd.gradcheck(energy, point, atol=1e-6)
    energy(*point)[-1].backward()
    names = ["m2", *(f"q{name[1:]}" for name in model.v_names), *model.v_names]
    initial = {"q": point[0].detach().numpy(), "v": point[1].detach().numpy()}
    given = {"initial": initial, "parameters": {"m2": 1.0}, "settings": exact}
    found = model.sensitivities(0.05, 1e-3, by=names, of=["energy"], **given)
    weights = np.zeros_like(found.outputs["energy"])
    weights[-1] = 1.0
    assert np.array_equal(
        np.concatenate([x.grad.numpy().ravel() for x in (point[2], *point[:2])]),
        found.gradients([{"energy": weights}])[0],
    )
    compiled = torch.compile(lambda v: energy(point[0].detach(), v, 1.0)[-1], backend="aot_eager")
    assert torch.equal(compiled(point[1].detach()), energy(point[0], point[1], 1.0)[-1])
    batch = torch.randn(3, 2, dtype=torch.float64)

    def last(v: Any) -> Any:
        return energy(point[0].detach(), v, point[2].detach())[-2:]

    jacobian = torch.func.vmap(torch.func.jacrev(last))(batch)
    assert torch.equal(jacobian, torch.stack([torch.autograd.functional.jacobian(last, x) for x in batch]))


@pytest.mark.long
@pytest.mark.parametrize(
    ("call", "text"),
    [
        (
            lambda torch, f: f.forward_dynamics(torch.zeros(8), torch.zeros(7)),
            "q has the type torch.float32.*; try: q.d",
        ),
        (
            lambda torch, f: f.forward_dynamics(torch.zeros(8, dtype=torch.float64, device="meta"), np.zeros(7)),
            "q is on meta, and the compiled C runs on the processor; try: q.cpu()",
        ),
        (lambda torch, f: eomgen.torch("scene.toml"), "torch: a model is needed, not str; try: eomgen.build"),
        (
            lambda torch, f: torch.func.grad(lambda t: f.forward_dynamics(np.eye(8)[3], np.zeros(7), t).sum())(
                torch.tensor(0.0, dtype=torch.float64)
            ),
            "derivatives in t or in parameters, with inputs by the formulas of the scene; try: u=",
        ),
    ],
)
def test_mistakes_in_calls_are_named(torch: Any, floating: Any, call: Any, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        call(torch, floating[1])


@pytest.mark.long
def test_the_example_of_the_page_runs(torch: Any) -> None:
    text = (Path(__file__).parents[2] / "docs" / "optimisers.md").read_text()
    names: dict[str, Any] = {"eomgen": eomgen}
    exec(next(block for block in text.split("```text\n") if block.startswith("import torch")).split("```")[0], names)
    torch.set_default_dtype(torch.float32)
    assert names["q"].grad.shape == (1000, 2)


@pytest.mark.long
def test_third_derivatives_are_refused(torch: Any, floating: Any) -> None:
    vdot, (q, v, t, u, load) = _dynamics(torch, floating[1])
    (first,) = torch.autograd.grad(vdot(q, v, t, u, load).sum(), v, create_graph=True)
    (second,) = torch.autograd.grad(first.sum(), v, create_graph=True)
    with pytest.raises(UsageError, match="third derivatives of forward_dynamics"):
        torch.autograd.grad(second.sum(), v)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    torch_functions._operators.cache_clear()
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(UsageError, match=r"the package torch is not installed; try: pip install 'eomgen\[torch\]'"):
        eomgen.torch(eomgen.build(PENDULUM, profile="quick"))
