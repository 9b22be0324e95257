"""Forward dynamics with light or short links before heavy or long ones: the digits of articulated bodies are kept."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import load_toml
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System
from tests.oracles.planar_trees import GRAVITY, PlanarTree, random_tree
from tests.oracles.robots import planar_chain

#: Masses, lengths and the largest error that is allowed: about five times what Pinocchio's aba leaves.
LADDER = [
    ((1, 1, 1), (1, 1, 1), 1e-14),
    ((1, 1, 1), (0.1, 1, 10), 1e-13),
    ((1, 1, 1), (0.01, 1, 100), 1e-11),
    ((1, 1, 1), (1e-3, 1, 1e3), 1e-9),
    ((1, 1, 1), (1e-6, 1, 1e6), 1e-3),
    ((1e-4, 1, 1e4), (1, 1, 1), 2e-11),
    ((1e-6, 1, 1e6), (1, 1, 1), 5e-9),
    ((1e-12, 1, 1e12), (1, 1, 1), 2e-3),
    ((1e12, 1, 1e-12), (1, 1, 1), 1e-14),
]


def states(size: int, count: int, seed: int = 1) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(seed)
    return [(rng.uniform(-3, 3, size), rng.uniform(-1, 1, size)) for _ in range(count)]


def worst_error(tree: PlanarTree, system: System, count: int = 5) -> float:
    refs = system.functions["forward_dynamics"].refs
    found = ((evaluate(system.tape, refs, {"q": q, "v": v}), q, v) for q, v in states(len(tree.masses), count))
    return max(tree.error(*each) for each in found)


def worst_error_of_pinocchio(tree: PlanarTree, count: int = 5) -> float:
    model = pinocchio.Model()
    model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
    for k, (mass, length, parent) in enumerate(zip(tree.masses, tree.lengths, tree.parents, strict=True)):
        place = pinocchio.SE3(np.eye(3), np.array([tree.lengths[parent] if parent >= 0 else 0.0, 0.0, 0.0]))
        number = model.addJoint(parent + 1, pinocchio.JointModelRZ(), place, f"j{k}")
        point = pinocchio.Inertia(mass, np.array([length, 0.0, 0.0]), np.zeros((3, 3)))
        model.appendBodyToJoint(number, point, pinocchio.SE3.Identity())
    data = model.createData()
    zero = np.zeros(model.nv)
    found = ((pinocchio.aba(model, data, q, v, zero).copy(), q, v) for q, v in states(len(tree.masses), count))
    return max(tree.error(*each) for each in found)


@pytest.mark.parametrize(("masses", "lengths", "limit"), LADDER)
def test_chains_of_three_keep_their_digits(masses, lengths, limit: float) -> None:
    tree = PlanarTree.chain([float(m) for m in masses], [float(x) for x in lengths])
    assert worst_error(tree, derive(tree.scene(), ["forward_dynamics"])) < limit


@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(12, 120))])
def test_random_trees_are_as_exact_as_pinocchio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, int(rng.integers(2, 7)), float(rng.uniform(0, 12)), branched=bool(seed % 2))
    reached = worst_error(tree, derive(tree.scene(), ["forward_dynamics"]))
    # M is kept up to a ratio of 3000, which costs 3e3 * 1e-16 at most; the factor is for the order of roundings
    assert reached < 2e-12 + 30 * worst_error_of_pinocchio(tree)


def test_equal_links_take_what_is_cheaper() -> None:
    for links in (2, 4, 5, 12):
        assert not derive(planar_chain(links), ["forward_dynamics"]).facts.ill_scaled


def test_tunable_masses_count_with_their_defaults() -> None:
    text = PlanarTree.chain([1.0, 1.0, 1e6], [1.0, 1.0, 1.0]).text().replace("mass = 1000000.0", 'mass = "m"')
    for value, expected in ((1.0, False), (1e6, True)):
        system = derive(load_toml(f"{text}\n[parameters.m]\nvalue = {value}\ntunable = true"), ["forward_dynamics"])
        assert system.facts.ill_scaled is expected
