"""Forward dynamics with light or short links before heavy or long ones: the digits of articulated bodies are kept."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load_toml
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.cancellation import cancellation, largest_cancellation
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


def largest_ratio(tree: PlanarTree, system: System, count: int = 5) -> float:
    """Return the largest ratio of composite to articulated inertias, which the elimination of M loses."""
    size = len(tree.masses)
    at = [{"q": q, "v": v} for q, v in states(size, count)]
    M = [np.reshape(evaluate(system.tape, system.functions["mass"].refs, each), (size, size)) for each in at]
    return float(cancellation(np.array(M), [slice(k, k + 1) for k in range(size)]).max())


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


@pytest.mark.parametrize("seed", [*range(6), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(6, 40))])
def test_random_trees_are_as_exact_as_pinocchio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, int(rng.integers(2, 7)), float(rng.uniform(0, 12)), branched=bool(seed % 2))
    system = derive(tree.scene(), ["forward_dynamics", "mass"])
    lost = 1.0 if system.facts.ill_scaled else largest_ratio(tree, system)
    assert lost < 2e4  # articulated bodies are taken above
    # the elimination of M rounds by eps times the ratio; 120 seeds reach 3 times the sum of both errors at most
    assert worst_error(tree, system) < 30 * (np.finfo(float).eps * lost + worst_error_of_pinocchio(tree))


def test_equal_links_take_what_is_cheaper() -> None:
    for links in (2, 4, 5, 12):
        assert not derive(planar_chain(links), ["forward_dynamics"]).facts.ill_scaled


def test_tunable_masses_count_with_their_defaults() -> None:
    text = PlanarTree.chain([1.0, 1.0, 1e6], [1.0, 1.0, 1.0]).text().replace("mass = 1000000.0", 'mass = "m"')
    for value, expected in ((1.0, False), (1e6, True)):
        system = derive(load_toml(f"{text}\n[parameters.m]\nvalue = {value}\ntunable = true"), ["forward_dynamics"])
        assert system.facts.ill_scaled is expected


def tunable_chain(folder: Path) -> eomgen.Model:
    """Return a chain of three point masses of 1 kg on rods of 1 m; masses and lengths are tunable."""
    text = PlanarTree.chain([1.0] * 3, [1.0] * 3).text()
    for k in range(3):
        text = text.replace("mass = 1.0", f'mass = "m{k}"', 1)
        text = text.replace("center_of_mass = [1.0,", f'center_of_mass = ["l{k}",', 1)
        text = text.replace("position = [1.0,", f'position = ["l{k}",', k < 2)
        text += f"\n[parameters.m{k}]\nvalue = 1\ntunable = true\n[parameters.l{k}]\nvalue = 1\ntunable = true"
    path = folder / "chain.toml"
    path.write_text(text)
    return eomgen.build(path, profile="quick", method="rk4")


@pytest.mark.parametrize("seed", range(12))
def test_ratios_of_inertias_are_those_of_their_definition_and_have_a_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes = rng.choice([1, 1, 3, 6], size=rng.integers(1, 6))
    ends = np.cumsum(sizes)
    joints = [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]
    nv, scales = int(ends[-1]), 10.0 ** rng.uniform(-3.0, 3.0, size=int(ends[-1]))
    root = rng.normal(size=(nv, nv)) * scales
    M = root.T @ root + np.diag(scales**2)
    expected = 1.0
    for joint in joints:
        behind = slice(joint.stop, nv)
        free = M[joint, joint] - M[joint, behind] @ np.linalg.solve(M[behind, behind], M[behind, joint])
        expected = max(expected, float(np.max(np.diag(M)[joint] / np.diag(free))))
    (ratio,) = cancellation(M[np.newaxis], joints)
    assert ratio == pytest.approx(expected, rel=1e-6)
    bound = largest_cancellation(M)
    assert bound >= ratio * (1.0 - 1e-6)
    if nv == len(joints):
        assert bound == pytest.approx(ratio, rel=1e-6)


def test_inertias_that_are_not_positive_have_no_bound() -> None:
    for last in (0.0, -1.0, np.nan, np.inf):
        assert largest_cancellation(np.diag([1.0, last])) == np.inf
        assert largest_cancellation(np.diag([last, 1.0])) == np.inf
    assert largest_cancellation(np.ones((2, 2))) == np.inf
    assert largest_cancellation(np.zeros((0, 0))) == 1.0


def test_parameters_that_cost_digits_are_warned_of_once_with_the_size(tmp_path: Path) -> None:
    model = tunable_chain(tmp_path)
    q, v = np.array([0.3, -0.7, 0.5]), np.array([0.2, 0.4, -0.6])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for lengths in ((1, 1, 1), (0.1, 1, 10), (3, 2, 1)):
            model.forward_dynamics(q, v, parameters={f"l{k}": float(one) for k, one in enumerate(lengths)})
    parameters = {"l0": 1e-3, "l2": 1e3}
    text = "forward_dynamics: at these parameters accelerations keep some 3 digits, since light or short links"
    with pytest.warns(RuntimeWarning, match=text) as told:
        for _ in range(3):
            model.forward_dynamics(q, v, parameters=parameters)
    assert len(told) == 1 and told[0].filename == __file__
    assert "these parameters as defaults of the scene" in str(told[0].message)
    tree = PlanarTree.chain([1.0] * 3, [1e-3, 1.0, 1e3])
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # known from above
        error = tree.error(model.forward_dynamics(q, v, parameters=parameters), q, v)
    assert 1e-8 < error < 10 * model.evaluator.digits_lost.popitem()[1]
    with pytest.warns(RuntimeWarning, match="digits"):
        model.forward_dynamics(np.tile(q, (5, 1)), v, parameters={"l0": 1e-3, "l2": 2e3})


def test_accelerations_without_any_digit_are_refused(tmp_path: Path) -> None:
    """Rounding decides whether a pivot is zero, so that some of these are numbers: each is warned of, and off."""
    model, refused = tunable_chain(tmp_path), 0
    for q, v in states(3, 8):
        model.evaluator.digits_lost.clear()
        with pytest.warns(RuntimeWarning, match="keep some 0 digits"):
            try:
                found = model.forward_dynamics(q, v, parameters={"l0": 1e-9, "l2": 1e9})
            except eomgen.NumericalError as error:
                assert "accelerations are not finite at these parameters, since light or short links" in str(error)
                assert "M loses all digits when it is eliminated" in str(error)
                refused += 1
            else:
                assert np.all(np.isfinite(found))
    assert refused


@pytest.mark.slow
def test_series_keep_their_digits(tmp_path: Path) -> None:
    """Steppers that factored M were wrong by 2e-5 (Taylor)."""
    tree = PlanarTree.chain([1.0, 1.0, 1.0], [1e-3, 1.0, 1e3])
    q, v, end = [-1.2, 0.3, -0.4], [0.1, -0.2, 0.3], 0.05
    reference = [float(x) for x in tree.motion(q, v, end)]
    path = tmp_path / "chain.toml"
    path.write_text(tree.text())
    for method, step, limit in (("taylor", 1e-3, 1e-9), ("rk45", 1e-3, 1e-9), ("rk4", 2e-5, 1e-8)):
        model = eomgen.build(path, profile="quick", method=method)
        run = model.simulate(end, step, initial={"q": q, "v": v}, error_estimate=False)
        assert run.success and np.max(np.abs(run.q[-1] - reference)) < limit, method


@pytest.mark.parametrize(
    ("parents", "heavy"), [((-1, -1, 0, -1, 2), 4), ((-1, 0, 1, -1, -1), 2), ((-1, -1, -1, 2, 3), 4)]
)
def test_chains_that_carry_heavy_links_are_found_beside_single_links(parents: tuple[int, ...], heavy: int) -> None:
    for mass, expected in ((1.0, False), (1e8, True)):
        masses = tuple(mass if k == heavy else 1.0 for k in range(len(parents)))
        forest = PlanarTree(masses, (1.0,) * len(parents), parents)
        assert derive(forest.scene(), ["forward_dynamics"]).facts.ill_scaled is expected
    alone = PlanarTree(masses, (1.0,) * len(parents), (-1,) * len(parents))
    assert not derive(alone.scene(), ["forward_dynamics"]).facts.ill_scaled
