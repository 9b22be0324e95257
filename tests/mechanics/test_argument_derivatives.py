"""Jacobians and Hessians of terms in all arguments, against complex steps of the compiled terms themselves."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from benchmarks.robots import ROBOTS, pinocchio_model
from benchmarks.robots import scene as scene_of_robot
from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie.product import update
from eomgen.mechanics.derive import derive
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.argument_derivatives import Arguments
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.load import load
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.tape import ZERO
from eomgen.system.system import BASE_SIZE
from eomgen.system.terms import ARGUMENTS, DIFFERENTIATED
from tests.models.checked_scenes import drone, gate

EXAMPLES = Path(__file__).parents[2] / "examples"
Array = np.ndarray
#: An imaginary step, the square of which is lost.
STEP = 1e-40


def gimbal() -> eomgen.Scene:
    """Return a free body that carries a body on a ball joint, on a base that moves, with an input and a parameter."""
    builder = SceneBuilder("gimbal").input("torque", "0.3 * sin(t)").parameter("pull", 2.0, tunable=True)
    builder.parameter("sway", 0.3, tunable=True)
    builder.base(["sway * sin(2 * t)", 0.0, 0.0])
    builder.body("hull", 2.0, center_of_mass=[0.1, 0.2, -0.1], inertia=[0.2, 0.3, 0.25])
    builder.body("dish", 1.0, center_of_mass=[0.0, 0.1, 0.4], inertia=[0.02, 0.03, 0.01])
    builder.body("arm", 0.5, center_of_mass=[0.2, 0.0, 0.1], inertia=[0.01, 0.02, 0.03])
    builder.joint("flight", "free", "base", "hull")
    builder.joint("ball", "spherical", "hull", "dish", position=[0.3, 0.0, 0.1])
    builder.joint("hinge", "revolute", "dish", "arm", axis=[0, 1, 0])
    builder.effort("motor", "hinge", "torque * cos(q.hinge) - pull * sin(q.hinge) * v.hinge**2")
    return builder.build()


def machine() -> eomgen.Scene:
    """Return a tree of many joint types on a base that turns, with two joints that follow others, and a parameter that
    is in the motion of the base and in a mass."""
    builder = SceneBuilder("machine", gravity=[0.4, -0.3, -9.81])
    builder.parameter("size", 0.7, tunable=True).parameter("sway", 0.2, tunable=True)
    builder.base(
        ["size * cos(t)", "sway * sin(t)", 0.0], rotation=[([0, 0, 1], "0.3 * t"), ([1, 0, 0], "0.2 * cos(t)")]
    )
    chain = (
        ("slider", "prismatic", {"axis": [0.6, 0.0, 0.8]}),
        ("cross", "universal", {"axis": [0, 0, 1], "second_axis": [1, 0, 0]}),
        ("plane", "planar", {"axis": [0, 1, 0]}),
        ("nut", "helical", {"axis": [1, 0, 0], "pitch": 0.1}),
        ("follower", "revolute", {"axis": [0, 1, 0], "mimic": {"joint": "nut", "multiplier": -0.7, "offset": 0.2}}),
        ("ball", "spherical", {}),
    )
    parent = "base"
    for k, (name, kind, keys) in enumerate(chain):
        builder.body(f"part_{name}", 1.0 + 0.2 * k, center_of_mass=[0.1, -0.05 * k, 0.2], inertia=[0.02, 0.03, 0.025])
        builder.joint(name, kind, parent, f"part_{name}", position=[0.1 * k, 0.2, -0.1], **keys)
        parent = f"part_{name}"
    builder.body("branch", "size", center_of_mass=[0.0, 0.1, 0.2], inertia=[0.01, 0.02, 0.015])
    mimic = {"joint": "slider", "multiplier": 2.0}
    builder.joint("arm", "revolute", "part_plane", "branch", axis=[0, 0, 1], position=[0.0, 0.1, 0.3], mimic=mimic)
    builder.effort("spring", "slider", "-3 * sin(q.slider) * v.slider")
    return builder.build()


SCENES: Mapping[str, Any] = {
    "double_pendulum": lambda: EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml",
    "gimbal": gimbal,
    "drone": drone,
    "gate": gate,
}
DYNAMICS = ("inverse_dynamics", "forward_dynamics")


def four_bar() -> Path:
    return EXAMPLES / "four_bar" / "scene.toml"


#: Scene and term; the first ones' rotations have more than one axis.
CASES = [
    *(("gimbal", term) for term in DYNAMICS),
    *(
        ("gate", term)
        for term in ("residual", "constraint", "constraint_velocity", "constraint_acceleration", "momenta")
    ),
    *(("drone", term) for term in ("internal_rate", "outputs", "frame_poses")),
]


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name](), profile="quick")


def state_of(model: eomgen.Model, rng: np.random.Generator) -> dict[str, Array]:
    """Return a random state by block."""
    q = update(model.factors, model.initial_q, rng.uniform(-1.0, 1.0, model.nv))
    sizes = {"v": model.nv, "a": model.nv, "u": model.nu, "z": model.nz, "lam": len(model.multipliers)}
    blocks = {name: rng.normal(size=size) for name, size in sizes.items()}
    values = model.parameter_array()
    p = np.where(values == 0.0, 0.1, values) * rng.uniform(0.5, 1.5)  # equal limits of 0 meet at a kink
    return {"q": q, **blocks, "p": p, "t": np.array([0.3])}


def changed(model: eomgen.Model, term: str, state: Mapping[str, Array]) -> Array:
    """Return the derivative of a compiled term in all arguments by complex steps, (outputs, arguments)."""
    functions = model.in_complex((term, "forward_dynamics"))
    columns = []
    for block in [block for block in ARGUMENTS if block in state]:
        for k in range(model.nv if block == "q" else len(state[block])):
            moved = {name: array.astype(complex) for name, array in state.items()}
            if block == "q":
                rate = configuration_rate(model.factors, state["q"], np.eye(model.nv)[k])
                moved["q"] = moved["q"] + 1j * STEP * rate
            else:
                moved[block] = moved[block] + 1j * STEP * (np.arange(len(moved[block])) == k)
            moved["t"] = moved["t"][0]
            if "base" in functions:
                moved["base"] = functions("base", moved)[0]
            taken = {name: moved[name] for name in functions.inputs(term)}
            columns.append(np.concatenate([part.imag.ravel() for part in functions(term, taken)]) / STEP)
    return np.stack(columns, axis=-1)


def given(model: eomgen.Model, state: Mapping[str, Array], term: str) -> dict[str, Any]:
    own = {name: state[name] for name in ("q", "v", "u", "z") if np.size(state[name])}
    own |= {} if term in ("forward_dynamics", "frame_poses") else {"a": state["a"]}
    own |= {"multipliers": state["lam"]} if model.multipliers else {}
    return {**own, "t": state["t"][0], "parameters": state["p"]}


def of_taken(matrix: Array, model: eomgen.Model, taken: tuple[str, ...], state: Mapping[str, Array]) -> Array:
    """Return the columns of the arguments that a term takes."""
    sizes = {block: model.nv if block == "q" else len(state[block]) for block in ARGUMENTS if block in state}
    return matrix[..., np.concatenate([np.full(size, block in taken) for block, size in sizes.items()])]


@pytest.mark.long_cases("gimbal-inverse_dynamics", "gimbal-forward_dynamics", "gate-residual")
@pytest.mark.slow
@pytest.mark.parametrize(("scene", "term"), CASES)
def test_jacobian_and_hessian_are_those_of_complex_steps(scene: str, term: str, rng: np.random.Generator) -> None:
    """The Hessian in local coordinates is the symmetric part of left derivatives of left derivatives."""
    model, state = model_of(scene), state_of(model_of(scene), rng)
    weights = rng.normal(size=model.sparsity(term).shape[0])
    taken = tuple(model.sparsity(term).arguments)
    found = model.derivatives(term, **given(model, state, term))
    expected = of_taken(changed(model, term, state), model, taken, state)
    assert np.max(np.abs(found - expected)) < 1e-12 * np.max(np.abs(expected))
    pattern = model.sparsity(term)
    of_nonzeros = changed(model, f"{term}_derivatives", state)
    second = np.zeros((found.shape[1], of_nonzeros.shape[1]))
    np.add.at(second, pattern.columns, weights[pattern.rows, np.newaxis] * of_nonzeros)
    second = of_taken(second, model, taken, state)
    found = model.hessian(term, weights, **given(model, state, term))
    assert np.array_equal(found, found.T)
    assert np.max(np.abs(found - (second + second.T) / 2.0)) < 1e-12 * np.max(np.abs(found))
    turning = np.max(np.abs(second - second.T)) / np.max(np.abs(second))
    assert scene != "gimbal" or turning > 1e-2  # rotations do not commute


@pytest.mark.parametrize(("scene", "fewer"), [(gimbal, True), (machine, True), (gate, True), (four_bar, False)])
def test_composite_bodies_have_the_hessian_of_the_operations(
    scene: Callable[[], Any], fewer: bool, rng: np.random.Generator
) -> None:
    """Two roads to the second derivatives of inverse dynamics in q, v and a; ``fewer``: whether composites take fewer
    operations, so that they are used."""
    described = scene()
    derivation = Derivation(described if isinstance(described, eomgen.Scene) else load(described))
    values = derivation.residual()[0].refs
    arguments = Arguments(derivation)
    by_composites, by_operations = arguments.by_composites(values), arguments.by_operations(values)
    places = list(by_composites)
    size = 3 * derivation.tree.nv
    assert any(row >= size for row, _ in places) == (scene in (gimbal, machine))  # a base that moves by a law
    refs = [way.get(place, ZERO) for way in (by_composites, by_operations) for place in places]
    sizes = {"q": sum(factor.q_size for factor in derivation.tree.factors), "base": BASE_SIZE, "t": 1, "p": 2, "u": 2}
    for block in ("v", "a", "weights"):
        sizes[block] = derivation.tree.nv
    sizes["lam"] = 0 if derivation.constraints is None else len(derivation.constraints.rows.all)
    inputs = {block: rng.normal(size=count) for block, count in sizes.items()}
    for factor in derivation.tree.factors:
        if factor.group != "R":
            quaternion = inputs["q"][factor.q_start : factor.q_start + 4]
            quaternion /= np.linalg.norm(quaternion)
    found, expected = np.split(np.array(evaluate(derivation.tape, refs, inputs)), 2)
    assert np.max(np.abs(found - expected)) < 1e-13 * np.max(np.abs(expected))
    used = arguments.hessian(values)
    assert any(used.get(place, ZERO) != by_operations.get(place, ZERO) for place in places) == fewer


@pytest.mark.slow
@pytest.mark.parametrize(("name", "operations"), [("panda", 5060), ("talos", 37215)])
def test_hessians_of_robots_are_those_of_casadi(name: str, operations: int, rng: np.random.Generator) -> None:
    """CasADi differentiates a recursion in its own symbols, the free joint's turn by its exponential."""
    pytest.importorskip("pinocchio")
    optimisers = importlib.import_module("benchmarks.optimisers")
    described = scene_of_robot(ROBOTS[name])
    peer, term = pinocchio_model(ROBOTS[name], described), "inverse_dynamics_hessian"
    system, n, order = derive(described, [term]), peer.model.nv, peer.v_order
    assert system.counts[term].flops == operations
    weights, of_symbols = rng.normal(size=n), optimisers.Robot(peer.model).hessian()
    rows, columns = (np.array(places) for places in of_symbols.sparsity_out(0).get_triplet())
    block, place = np.divmod(np.array(system.patterns[term]), n)
    places = (block * n + np.argsort(order)[place]).T
    for theirs, ours in zip(peer.states[:3], peer.states_of_eomgen()[:3], strict=True):
        parts = np.split(theirs, [len(theirs) - 2 * n, len(theirs) - n])
        expected = optimisers.dense(of_symbols(*parts, weights).nonzeros(), (rows, columns), 3 * n)
        inputs = dict(zip("qva", np.split(ours, [len(ours) - 2 * n, len(ours) - n]), strict=True))
        inputs["weights"] = np.empty(n)
        inputs["weights"][order] = weights
        values = evaluate(system.tape, system.functions[term].refs, inputs)
        found = optimisers.dense(values, places, 3 * n)
        assert np.max(np.abs(found - expected)) < 1e-13 * np.max(np.abs(expected))
        assert len(values) == len(rows)


def test_every_term_has_a_case() -> None:
    assert {term for _, term in CASES} == set(DIFFERENTIATED)


def test_arguments_may_be_chosen_in_any_order(rng: np.random.Generator) -> None:
    model, state = model_of("double_pendulum"), state_of(model_of("double_pendulum"), rng)
    fixed = given(model, state, "forward_dynamics")
    whole = model.sparsity("forward_dynamics").arguments
    assert list(whole) == ["q", "v", "p", "t"]
    places = np.concatenate([np.arange(100)[whole[name]] for name in ("p", "q")])
    J, H = model.derivatives("forward_dynamics", **fixed), model.hessian("forward_dynamics", np.ones(2), **fixed)
    assert np.array_equal(model.derivatives("forward_dynamics", **fixed, of=["p", "q"]), J[:, places])
    chosen = model.hessian("forward_dynamics", np.ones(2), **fixed, of=["p", "q"])
    assert np.array_equal(chosen, H[np.ix_(places, places)])


def test_mistakes_are_answered() -> None:
    model = model_of("double_pendulum")
    for call, message in (
        (lambda: model.sparsity("mass"), "there are no derivatives of 'mass' in all arguments; try: "),
        (lambda: model.sparsity("forward_dynamics", 3), "order: there are derivatives of order 1 and 2, not 3; try: "),
        (
            lambda: model.sparsity("forward_dynamics", of=["a"]),
            "of: forward_dynamics of this scene does not take 'a'; try: some of q, v, p, t",
        ),
        (lambda: model.sparsity("forward_dynamics", of=["q", "q"]), "of: q, q has an argument twice; try: each once"),
        (lambda: model.sparsity("forward_dynamics", of="lam"), "of: arguments are a list of names, not the text 'lam'"),
        (lambda: model.sparsity("forward_dynamics", of=3), 'of: arguments are a list of names, not 3; try: of=["q"]'),
        (lambda: model.sparsity(["forward_dynamics"]), "term: there are no derivatives of \"['forward_dynamics']\" in"),
        (lambda: model.derivatives("forward_dynamics", [[1], [2, 3]], [0, 0]), "q: an array of real numbers is needed"),
        (lambda: model.sparsity("residual"), "term: residual has derivatives in scenes with constraints; try: inverse"),
        (lambda: model.sparsity("internal_rate"), "term: internal_rate of this scene has no numbers; try: inverse_dyn"),
        (lambda: model.hessian("forward_dynamics", [1.0], [0, 0], [0, 0]), "weights: the shape is (1,), (..., 2) is"),
    ):
        with pytest.raises(eomgen.UsageError) as caught:
            call()
        assert message in str(caught.value), str(caught.value)
    jacobian = model.derivatives("forward_dynamics", [0.1, 0.2], [0, 0], of=(name for name in ("t", "q")))
    assert np.array_equal(jacobian, model.derivatives("forward_dynamics", [0.1, 0.2], [0, 0], of=["t", "q"]))
    four_bar = eomgen.build(EXAMPLES / "four_bar" / "scene.toml", profile="quick")
    with pytest.raises(eomgen.UsageError, match="a scene with constraints has two results, vdot and multipliers"):
        four_bar.sparsity("forward_dynamics")
