"""Compiled C against the oracles: Pinocchio for the terms, and complex steps through the same C for the partials."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from eomgen.toolchain.library import Library
from tests.codegen.hand_made import call, compile_system
from tests.oracles.evaluation import Array, Evaluate, relative_error
from tests.oracles.pinocchio_oracle import oracle_from_urdf, robot_file
from tests.oracles.random_scenes import random_scene, with_base, with_loads
from tests.oracles.states import jacobian, on_base, random_states

EXAMPLES = Path(__file__).parents[2] / "examples"
ROBOTS = {
    "panda": ("panda_description/urdf/panda.urdf", "fixed", ("panda_finger_joint1", "panda_finger_joint2")),
    "anymal_b": ("anymal_b_simple_description/robots/anymal.urdf", "free", ()),
}
STATES = 20


def compiled_evaluator(system: System, library: Library) -> Evaluate:
    """Return the compiled functions as the oracles call them."""

    def run(function: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
        blocks = system.functions[function].outputs
        batch = np.broadcast_shapes(*(np.shape(values)[:-1] for values in inputs.values()))
        rows = {
            name: np.broadcast_to(values, (*batch, np.shape(values)[-1])).reshape(-1, np.shape(values)[-1])
            for name, values in inputs.items()
        }
        found = call(library, function, rows)
        return {block.name: part.reshape(*batch, *block.shape) for block, part in zip(blocks, found, strict=True)}

    return run


@pytest.mark.slow_except("panda")
@pytest.mark.parametrize("name", ROBOTS)
def test_compiled_robots_against_pinocchio(name: str, tmp_path: Path, rng) -> None:
    path, root, lock = ROBOTS[name]
    scene = load(robot_file(path), root=root, lock=lock)
    system = derive(scene, ["mass", "coupling", "force", "inverse_dynamics", "forward_dynamics"])
    oracle = oracle_from_urdf(robot_file(path), scene, root, lock)
    evaluate = compiled_evaluator(system, compile_system(system, tmp_path))
    state = random_states(system, STATES, rng)
    damping = np.array([joint.damping.value for joint in scene.joints for _ in range(_size(joint.type))])
    friction = damping * state["v"]
    drag = oracle.inverse_dynamics({**state, "a": np.zeros_like(state["a"])})
    assert relative_error(evaluate("mass", state)["M"], oracle.mass(state), 2) <= 1e-12
    assert relative_error(evaluate("coupling", state)["h"], oracle.coupling(state)) <= 1e-12
    assert relative_error(evaluate("force", state)["Q"] + friction, oracle.coupling(state) - drag) <= 1e-12
    assert (
        relative_error(evaluate("inverse_dynamics", state)["tau"] - friction, oracle.inverse_dynamics(state)) <= 1e-12
    )
    vdot = evaluate("forward_dynamics", state)["vdot"]
    assert relative_error(vdot, oracle.forward_dynamics(state, -friction)) <= 1e-12


def _size(kind: str) -> int:
    return {"fixed": 0, "free": 6, "spherical": 3}.get(kind, 1)


def _scene(name: str) -> Scene:
    if name.startswith("random"):
        seed = int(name.removeprefix("random "))
        return with_base(with_loads(random_scene(seed, 5, tunable=0.3), seed), seed, turning=True)
    return load(EXAMPLES / name / "scene.toml")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robot_arm", "double_pendulum_on_shaking_base", "random 1"])
def test_compiled_partials_against_complex_steps_through_the_compiled_residual(name: str, tmp_path: Path, rng) -> None:
    system = derive(_scene(name), ["residual", "partials"])
    real = compiled_evaluator(system, compile_system(system, tmp_path / "double", real="double"))
    complex_ = compiled_evaluator(system, compile_system(system, tmp_path / "complex", real="complex"))
    state = random_states(system, 5, rng)
    state = on_base(real, state) if "base" in system.functions else state
    found = real("partials", state)
    for block, matrix in (("q", "K"), ("v", "C"), ("a", "M")):
        expected = jacobian(complex_, system.factors, "residual", "r", state, block)
        assert relative_error(found[matrix], expected, 2) <= 1e-12, f"{matrix} of {name}"
