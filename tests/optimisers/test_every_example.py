"""Functions for CasADi of every example with a configuration of plain numbers: Jacobians and Hessians against complex
steps of the C, and sparsity at 1000 random states."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen
from tests.mechanics.test_argument_derivatives import changed, given, of_taken, state_of
from tests.optimisers.test_casadi import derivatives

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Examples whose configurations have rotations, angles over all turns, or that are not scenes.
OTHERS = {"cable_net", "elastic_pendulum", "free_spinning_body", "hanging_chain", "misaligned_four_bar", "rattleback"}
OTHERS |= {"slider_crank_spatial", "spherical_pendulum", "symmetric_top", "unbalanced_shaft"}
SCENES = sorted(path.parent.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.rglob("scene.toml"))
#: Nonzeros that are zero at all random states: of a mode that is off, of a damper that reaches no limit, of laws by
#: cases with zeros in one of the cases, and of products that vanish in outputs.
ZEROS = {
    ("bouncing_ball", "inverse_dynamics", 1): 3,
    ("bouncing_ball", "forward_dynamics", 1): 3,
    ("active_quarter_car", "inverse_dynamics", 1): 2,
    ("active_quarter_car", "inverse_dynamics", 2): 8,
    ("active_quarter_car", "outputs", 1): 1,
    ("active_quarter_car", "outputs", 2): 20,
    ("active_quarter_car", "forward_dynamics", 1): 2,
    ("active_quarter_car", "forward_dynamics", 2): 8,
    ("quarter_car_on_bump", "inverse_dynamics", 2): 15,
    ("quarter_car_on_bump", "forward_dynamics", 2): 15,
    ("quarter_car_on_bump", "outputs", 2): 15,
    ("elastic_vehicle", "outputs", 2): 38,
}


@cache
def model_of(example: str) -> eomgen.Model:
    return eomgen.build(EXAMPLES / example / "scene.toml", profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("example", [name for name in SCENES if name not in OTHERS])
def test_derivatives_are_those_of_complex_steps(example: str, rng: np.random.Generator) -> None:
    """Rounding is relative to the Jacobian where second derivatives of stiff forces cancel."""
    model = model_of(example)
    functions = eomgen.casadi(model, profile="quick")
    for name in (name for name in functions if name != "step"):
        function, state = functions[name], state_of(model, rng)
        taken, own = tuple(function.name_in()), tuple(model.sparsity(name).arguments)
        weights = rng.normal(size=function.size1_out(0))
        jacobian, hessian = derivatives(function, [state[block] for block in taken], weights)
        expected = of_taken(changed(model, name, state), model, taken, state)
        scale = np.max(np.abs(expected), initial=0.0)
        assert np.max(np.abs(jacobian - expected), initial=0.0) <= 1e-12 * scale, name
        sizes = {block: function.size1_in(k) for k, block in enumerate(taken)}
        places = np.concatenate([np.full(size, block in own) for block, size in sizes.items()])
        assert not hessian[~places].any(), name
        pattern, of_nonzeros = model.sparsity(name), changed(model, f"{name}_derivatives", state)
        second = np.zeros((places.sum(), of_nonzeros.shape[1]))
        np.add.at(second, pattern.columns, weights[pattern.rows, np.newaxis] * of_nonzeros)
        second = of_taken(second, model, own, state)
        scale = max(np.max(np.abs(second), initial=0.0), np.max(np.abs(weights @ expected), initial=0.0))
        assert np.max(np.abs(hessian[np.ix_(places, places)] - second), initial=0.0) <= 1e-12 * scale, name


@pytest.mark.slow
@pytest.mark.parametrize("example", [name for name in SCENES if name not in OTHERS])
def test_sparsity_is_exact_at_random_states(example: str, rng: np.random.Generator) -> None:
    model, count = model_of(example), 1000
    states = [state_of(model, rng) for _ in range(count)]
    batch = {name: np.stack([state[name] for state in states]) for name in states[0]}
    batch["t"] = rng.uniform(0.0, 3.0, (count, 1))
    batch["p"] = model.parameter_array() * rng.uniform(0.5, 1.0, batch["p"].shape)
    for name in (name for name in eomgen.casadi(model, profile="quick") if name != "step"):
        arguments: dict[str, Any] = {**given(model, batch, name), "t": batch["t"][:, 0]}
        for order in (1, 2):
            if order == 1:
                values = model.derivatives(name, **arguments, sparse=True)
            else:
                weights = rng.normal(size=(count, model.sparsity(name).shape[0]))
                values = model.hessian(name, weights, **arguments, sparse=True)
            zero = ~np.any(values != 0.0, axis=0)
            pattern = model.sparsity(name, order)
            allowed = ZEROS.get((example, name, order), 0)
            assert zero.sum() <= allowed, (name, order, pattern.rows[zero], pattern.columns[zero])


@pytest.mark.slow
def test_derivatives_of_panda_are_those_of_casadis_symbols(rng: np.random.Generator) -> None:
    """Of forward dynamics by articulated bodies and of inverse dynamics by the recursion of Newton and Euler, in SX."""
    pytest.importorskip("pinocchio")
    from benchmarks.optimisers import Robot  # needs Pinocchio
    from benchmarks.robots import ROBOTS, driven, pinocchio_model, scene

    described = scene(ROBOTS["panda"])
    arm = Robot(pinocchio_model(ROBOTS["panda"], described).model)
    own = eomgen.casadi(driven(described), ["forward_dynamics", "inverse_dynamics"], profile="quick")
    q, v, a = (ca.SX.sym(name, 7) for name in "qva")
    native = {
        "forward_dynamics": ca.Function("native", [q, v, a], [arm.forward_dynamics(q, v, a)]),
        "inverse_dynamics": ca.Function("native", [q, v, a], [arm.inverse_dynamics(q, v, a)]),
    }
    for name, function in native.items():
        for _ in range(3):
            point, weights = [rng.normal(size=7) for _ in range(3)], rng.normal(size=7)
            given_points = point if name == "forward_dynamics" else [*point, np.zeros(7)]
            found = derivatives(own[name], given_points, weights)
            for one, other in zip(found, derivatives(function, point, weights), strict=True):
                part = one[tuple(slice(size) for size in other.shape)]
                assert np.max(np.abs(part - other)) <= 1e-12 * np.max(np.abs(other)), name
