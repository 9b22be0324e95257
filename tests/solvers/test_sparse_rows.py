"""Sparse rows of large systems: the same scales, ranks and corrections as whole matrices, and the same assemblies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import eomgen
from eomgen.mechanics.derive import Derivations, derive
from eomgen.pipeline.initial_assembly import NEEDED, SPARSE, constraint_equations, with_initial_assembly
from eomgen.solvers.consistency import assemble
from eomgen.solvers.constraint_rows import ConstrainedSystem, RowsInMetric
from eomgen.solvers.redundancy import redundancy
from eomgen.solvers.sparse_rows import SparseRows, largest_singular_value, smallest_singular_value
from eomgen.symbolic.evaluate import evaluate


def chain(count: int, *, closed: bool = False) -> eomgen.Scene:
    """Return absolute rods on hinges; ``closed``: with both ends on the base."""
    builder = eomgen.SceneBuilder("chain", coordinates="absolute")
    for k in range(count):
        builder.body(f"rod{k}", 1.0 + 0.1 * k, center_of_mass=[0.2, 0.01, 0], inertia=[0.01, 0.02, 0.03])
        parent, place = (f"rod{k - 1}", [0.4, 0, 0]) if k else ("base", [0, 0, 0])
        start = {"position": 0.1 * (-1) ** k, "velocity": 0.3}
        builder.joint(f"joint{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=place, initial=start)
    if closed:
        first, second = {"body": "base", "position": [0.36 * count, 0, 0]}, {"body": f"rod{count - 1}"}
        builder.constraint("end", "spherical", first=first, second=second | {"position": [0.4, 0, 0]})
    return builder.build()


def systems(scene: eomgen.Scene) -> list[ConstrainedSystem]:
    """Return the constraints of a scene with whole and with sparse matrices."""
    return [constraint_equations(derive(scene, terms)) for terms in (NEEDED, SPARSE)]


def test_rows_have_the_scales_and_corrections_of_whole_matrices() -> None:
    scene = chain(6)
    whole, sparse = systems(scene)
    q = np.array(derive(scene, NEEDED).initial_q)
    one, other = (RowsInMetric(system, q, 0.0) for system in (whole, sparse))
    np.testing.assert_array_equal(other.B, one.B)
    speeds = np.random.default_rng(1).uniform(size=one.B.shape[1])
    for name in ("speeds", "natural", "vanishing", "scale"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(other.possible_rates(speeds), one.possible_rates(speeds), rtol=1e-12)
    np.testing.assert_allclose(other.rate_limits(speeds), one.rate_limits(speeds), rtol=1e-12)
    violation = np.random.default_rng(2).normal(size=len(whole.names))
    np.testing.assert_allclose(other.correction(violation), one.correction(violation), rtol=1e-9, atol=1e-12)
    assert other.all_new(1e-3) is True


@pytest.mark.slow_cases("True")
@pytest.mark.parametrize("closed", [False, True])
def test_assemblies_are_equal(closed: bool) -> None:
    scene = chain(8, closed=closed)
    whole, sparse = (
        with_initial_assembly(lambda terms, rows: derive(scene, terms, rows), ["mass"], whole=way)
        for way in (True, False)
    )
    assert sparse.multipliers == whole.multipliers
    assert len(whole.multipliers) == (42 if closed else 40)
    np.testing.assert_allclose(sparse.initial_q, whole.initial_q, atol=1e-12)
    np.testing.assert_allclose(sparse.initial_v, whole.initial_v, atol=1e-12)


@pytest.mark.slow
def test_derivations_on_one_tape_have_the_equations_of_separate_ones() -> None:
    scene = chain(40)
    known: Derivations = {}
    first, alone = derive(scene, SPARSE, known=known), derive(scene, ["residual", "constraint"])
    second = derive(scene, ["residual", "constraint"], known=known)
    assert second.tape is first.tape
    assert derive(scene, SPARSE, (3,), known).tape is not first.tape
    random = np.random.default_rng(4)
    inputs = {"v": random.normal(size=240), "a": random.normal(size=240), "lam": random.normal(size=200)}
    for name, block in (("residual", "r"), ("constraint", "Phi")):
        found, expected = (
            evaluate(system.tape, system.functions[name].outputs[0].refs, inputs | {"q": np.array(system.initial_q)})
            for system in (second, alone)
        )
        assert second.functions[name].outputs[0].name == block
        np.testing.assert_array_equal(found, expected)
    assert (second.initial_q, second.initial_v) == (alone.initial_q, alone.initial_v)


def test_rows_that_follow_from_others_are_found_by_whole_matrices() -> None:
    rows = SparseRows(csr_matrix([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]]), csr_matrix(np.eye(3)))
    assert rows.independent(np.ones(2), 2) is None
    assert rows.independent(np.ones(2), 1) is not None


def test_new_parts_of_rows_are_those_of_an_orthogonalisation() -> None:
    random = np.random.default_rng(3)
    B = random.normal(size=(4, 9)) * (random.uniform(size=(4, 9)) < 0.7)
    roots = [np.tril(random.normal(size=(3, 3))) + 3.0 * np.eye(3) for _ in range(3)]
    L = np.zeros((9, 9))
    for k, root in enumerate(roots):
        L[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = root
    rows = SparseRows(csr_matrix(B), csr_matrix(L @ L.T))
    found = rows.independent(np.ones(4), 4)
    assert found is not None
    weighed = B @ np.linalg.inv(L).T
    new = np.abs(np.diag(np.linalg.qr(weighed.T, mode="r")))
    np.testing.assert_allclose(found.new, new, rtol=1e-9)
    right = random.normal(size=4)
    shortest = np.linalg.lstsq(weighed, right, rcond=None)[0]
    np.testing.assert_allclose(found.correction(right), np.linalg.solve(L.T, shortest), rtol=1e-9)


def test_large_blocks_of_inertia_are_left_to_whole_matrices() -> None:
    assert SparseRows(csr_matrix(np.ones((1, 20))), csr_matrix(np.ones((20, 20)) + np.eye(20))).inverse is None
    assert SparseRows(csr_matrix(np.ones((1, 2))), csr_matrix(-np.eye(2))).inverse is None


def test_redundant_rows_of_large_systems() -> None:
    whole, sparse = systems(chain(6, closed=True))
    q = np.array(derive(chain(6, closed=True), NEEDED).initial_q)
    q = assemble(whole, q, np.zeros(36)).q
    assert redundancy(sparse, q).dependent == redundancy(whole, q).dependent


@pytest.mark.parametrize(("count", "columns"), [(40, 90), (90, 90), (5, 9)])
def test_singular_values_are_those_of_whole_matrices(count: int, columns: int) -> None:
    random = np.random.default_rng(6)
    rows = np.eye(count, columns) + 0.3 * random.normal(size=(count, columns)) * (
        random.uniform(size=(count, columns)) < 0.05
    )
    expected = np.linalg.svd(rows, compute_uv=False)
    assert smallest_singular_value(csr_matrix(rows)) == pytest.approx(expected[-1], rel=1e-6)
    assert largest_singular_value(csr_matrix(rows)) == pytest.approx(expected[0], rel=1e-6)
    rows[count - 1] = rows[0] - rows[1]
    assert smallest_singular_value(csr_matrix(rows)) == pytest.approx(0.0, abs=1e-7)
    rows[count - 1] = 0.0
    assert smallest_singular_value(csr_matrix(rows)) == pytest.approx(0.0, abs=1e-7)
    assert smallest_singular_value(csr_matrix(np.ones((columns + 1, columns)))) == 0.0
