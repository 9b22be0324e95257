"""Memory of runs of large scenes: tables of text, comparison runs and differences of motions in pieces."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from eomgen.base.csv_tables import read_table, write_table
from eomgen.lie import product
from eomgen.lie.product import Factor, difference, update
from eomgen.simulation.accuracy import comparison_runs, motion_size
from eomgen.simulation.accuracy.comparison_runs import ComparedMotion


def peak(work: Callable[[], object]) -> float:
    """Return the largest memory during work, bytes."""
    tracemalloc.start()
    try:
        work()
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_a_wide_table_is_made_text_in_pieces(tmp_path: Path, rng: np.random.Generator) -> None:
    columns = rng.normal(size=(40, 12_000))
    names = [f"x{k}" for k in range(12_000)]
    file = tmp_path / "wide.csv"
    assert peak(lambda: write_table(file, names, columns)) < 3.0 * columns.nbytes
    assert np.array_equal(read_table(file)[1], columns)


def test_increments_between_long_motions_are_found_in_pieces(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    factors = [Factor("SE3", f"{k}", 7 * k, 7, 6 * k, 6) for k in range(10)]
    q = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], (9, 10))
    moved = update(factors, q, 0.5 * rng.normal(size=(9, 60)))
    whole, from_one = difference(factors, q, moved), difference(factors, q[:1], moved)
    monkeypatch.setattr(product, "_LARGE", 100)
    np.testing.assert_allclose(difference(factors, q, moved), whole, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(difference(factors, q[:1], moved), from_one, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(difference(factors, q[0], moved), from_one, rtol=0.0, atol=1e-15)


def test_motions_at_all_rows_are_not_copied() -> None:
    motion = ComparedMotion(np.arange(12.0).reshape(4, 3), {"x": np.arange(4.0)})
    assert motion.at(np.arange(4)) is motion
    some = motion.at(np.array([0, 2]))
    assert np.array_equal(some.rows[:, 0], [0.0, 6.0]) and np.array_equal(some.outputs["x"], [0.0, 2.0])
    assert motion.at(np.array([1, 0, 2, 3])) is not motion


def test_largest_values_are_of_finite_numbers() -> None:
    values = np.array([[1.0, np.nan, np.inf], [-3.0, np.nan, 2.0]])
    assert motion_size._largest(values).tolist() == [3.0, 0.0, 2.0]


def test_comparison_runs_keep_no_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run at half the step has every second row, and none in windows beside these."""
    import eomgen

    run_chunks, kept = comparison_runs.run_chunks, []

    def counted(*given: object, **more: object) -> object:
        result = run_chunks(*given, **more)  # type: ignore[arg-type]
        kept.append((len(result.rows), result.middle, result.end))
        return result

    monkeypatch.setattr(comparison_runs, "run_chunks", counted)
    scene = Path(__file__).parents[2] / "examples" / "spherical_pendulum" / "scene.toml"
    run = eomgen.build(scene, profile="quick").simulate(0.1, 0.01)
    assert run.error.available
    assert kept and all(middle is None and end is None for _, middle, end in kept)
    assert max(rows for rows, _, _ in kept) <= len(run.t)
