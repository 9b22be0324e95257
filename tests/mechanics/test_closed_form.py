"""The closed form on the Lie group against the recursion and against complex steps along motions: trees, and all
matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.rates.jets import base_rates
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.rates import closed_block, inverse_dynamics_rates
from eomgen.mechanics.tree.base import base_law
from eomgen.scene.scene import Scene
from eomgen.system.system import INPUT_BLOCKS, Block, Facts, Function, System
from eomgen.system.terms import CLOSED_MATRICES
from tests.mechanics.test_internal_states import scene as drone
from tests.oracles import robots
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.motions import along_motion, random_motions
from tests.oracles.random_scenes import random_scene, with_base, with_loads, with_mimics

TREES, CHUNKS = 48, 4
MATRICES = [f"{name}{suffix}" for name in CLOSED_MATRICES for suffix in ("", "_rates_1", "_rates")]


def tree(seed: int) -> Scene:
    """Return a tree of 1 to 12 joints of all types; two of three on a moving base, one of six on one that only
    translates."""
    # all pairs of numbers below 12, so every size up to 12, small ones more often
    links = 1 + min(seed % 12, seed // 12 % 12)
    scene = random_scene(5000 + seed, links)
    return with_base(scene, seed, turning=seed % 6 != 1) if seed % 3 else scene


def both_ways(scene: Scene) -> System:
    """Return a system of nothing but tau and two derivatives, by recursion and in closed form, and of what drives the
    base."""
    derivation = Derivation(scene)
    paths = {
        "rates": inverse_dynamics_rates(derivation, 2),
        "rates_closed": closed_block(derivation, "closed_inverse_dynamics", 2)[1],
    }
    functions = {
        name: Function(
            name, "", INPUT_BLOCKS, tuple(Block(f"tau{k}", (len(of),), tuple(p[k] for p in of)) for k in range(3))
        )
        for name, of in paths.items()
    }
    if scene.base is not None:
        law = base_law(derivation.algebra, scene.base, {})
        functions["base"] = Function("base", "", ("t",), (derivation.block("base", (19,), law, ""),))
        functions["base_rates"] = Function("base_rates", "", ("t",), (base_rates(derivation.tape, law, 2),))
    facts = Facts(False, False, True, scene.base is not None)
    return System(
        name=scene.name,
        tape=derivation.tape,
        factors=derivation.tree.factors,
        functions=functions,
        parameters=(),
        inputs=(),
        outputs=(),
        bodies=(),
        initial_q=(),
        initial_v=(),
        dof_parent=(),
        facts=facts,
        order=2,
    )


@pytest.mark.slow_except("0")
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_closed_form_recursion_and_complex_step_on_random_trees(chunk: int) -> None:
    for seed in range(chunk, TREES, CHUNKS):
        rng = np.random.default_rng(seed)
        system = both_ways(tree(seed))
        run = tape_evaluator(system)
        state = random_motions(system, run, 1, rng)
        recursion, closed = run("rates", state), run("rates_closed", state)
        stepped = along_motion(system, run, "rates", state)
        for k in range(3):
            assert relative_error(recursion[f"tau{k}"], closed[f"tau{k}"]) <= 1e-12, (seed, k)
            if k:
                assert relative_error(recursion[f"tau{k}"], stepped[f"tau{k - 1}"]) <= 1e-12, (seed, k)


def matrix_scenes() -> dict[str, Scene]:
    made = {f"random {seed}": random_scene(seed, 1 + seed % 5) for seed in range(200, 203)}
    made |= {
        "panda": robots.panda(),
        "following": with_mimics(random_scene(31, 6), 31),
        "based": with_base(with_loads(random_scene(230, 4), 230), 230),
        "states": drone(),
    }
    return made


SCENES = matrix_scenes()


@pytest.mark.slow_cases("panda", "following")
@pytest.mark.parametrize("name", SCENES)
def test_matrices_and_their_derivatives(name: str, rng: np.random.Generator) -> None:
    """Derivatives against complex steps of the matrices; the matrices against M, h and what defines them."""
    system = derive(SCENES[name], [*MATRICES, "mass", "mass_rates", "mass_rates_closed", "coupling", "internal_rate"])
    run = tape_evaluator(system)
    state = random_motions(system, run, 2, rng)
    values: dict[str, dict[str, Array]] = {
        term: run(term, state)
        for term in system.functions
        if term not in ("base", "inputs", "base_rates", "input_rates")
    }
    for matrix in CLOSED_MATRICES:
        (block,) = values[matrix]
        rates, first = values[f"{matrix}_rates"], values[f"{matrix}_rates_1"]
        assert np.array_equal(rates[f"{block}_dot"], first[f"{block}_dot"])
        size = 1e-3 * float(np.max(np.abs(values[matrix][block])))  # of one link with one joint most derivatives vanish
        stepped = along_motion(system, run, matrix, state)[block]
        assert relative_error(rates[f"{block}_dot"], stepped, 2, size) <= 1e-12, matrix
        stepped = along_motion(system, run, f"{matrix}_rates", state)[f"{block}_dot"]
        assert relative_error(rates[f"{block}_ddot"], stepped, 2, size) <= 1e-12, matrix
    M, M_dot = values["mass"]["M"], values["mass_rates"]["M_dot"]
    scale = float(np.max(np.abs(M)))
    for block, found in values["mass_rates_closed"].items():
        assert relative_error(found, values["mass_rates"][block], 2, 1e-3 * scale) <= 1e-12
    h, v = values["coupling"]["h"], state["v"][..., np.newaxis]
    C, passive = values["coriolis"]["C"], values["coriolis_skew"]["C"]
    size = max(float(np.max(np.abs(h))), 1e-3 * scale)
    for matrix in (C, passive):
        assert np.max(np.abs((matrix @ v)[..., 0] - h)) <= 1e-13 * size * system.nv
    difference = M_dot - 2.0 * passive
    size = max(float(np.max(np.abs(difference))), 1e-3 * scale)
    assert np.max(np.abs(difference + np.swapaxes(difference, -1, -2))) <= 1e-13 * size


@pytest.mark.slow
def test_system_matrices_are_what_they_are_called(rng: np.random.Generator) -> None:
    """J = A X, twists J v, brackets of them, and J' = A a X - A a J with balls and free joints among the joints."""
    scene = replace(random_scene(3, 6), base=None)
    system = derive(scene, [*MATRICES, "twists"])
    run = tape_evaluator(system)
    state = random_motions(system, run, 1, rng)
    J, A = run("system_jacobian", state)["J"][0], run("adjoints", state)["A"][0]
    X = np.linalg.solve(A, J)
    elsewhere = random_motions(system, run, 1, rng)
    other = np.linalg.solve(run("adjoints", elsewhere)["A"][0], run("system_jacobian", elsewhere)["J"][0])
    assert np.allclose(X, other, atol=1e-12), "motion subspaces are constant"
    a = block_diagonal(run("joint_brackets", state)["ad_joints"][0])
    b = run("link_brackets", state)["ad_links"][0]
    twists = (J @ state["v"][0]).reshape(-1, 6)
    assert np.allclose(b[:, 3:, :3], cross_matrices(twists[:, 3:])) and np.allclose(
        b[:, :3, :3], cross_matrices(twists[:, :3])
    )
    assert np.allclose(b[:, 3:, 3:], b[:, :3, :3]) and not b[:, :3, 3:].any()
    J_dot, A_dot = run("system_jacobian_rates", state)["J_dot"][0], run("adjoints_rates", state)["A_dot"][0]
    assert np.allclose(J_dot, A @ a @ (X - J), atol=1e-12)
    assert np.allclose(A_dot, A @ a - A @ a @ A, atol=1e-12)
    assert np.max(np.abs(a @ X)) > 0.1, "a scene with joints for which a X is not zero"


def cross_matrices(x: Array) -> Array:
    """Return the matrices of the cross products with vectors (n, 3)."""
    return np.cross(x[:, np.newaxis, :], np.eye(3)).swapaxes(-1, -2)


def block_diagonal(blocks: Array) -> Array:
    found = np.zeros((6 * len(blocks), 6 * len(blocks)))
    for k, block in enumerate(blocks):
        found[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = block
    return found


def test_both_ways_bear_applied_wrenches(rng: np.random.Generator) -> None:
    system = derive(SCENES["based"], ["rates", "rates_closed"])
    run = tape_evaluator(system)
    state = random_motions(system, run, 2, rng)
    found = run("rates", state)
    for block, closed in run("rates_closed", state).items():
        assert relative_error(found[block], closed) <= 1e-12, block
