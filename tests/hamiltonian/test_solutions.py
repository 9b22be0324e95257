"""Motions of Hamiltonian systems as tables, files and pictures, of arrays that are given."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.csv_tables import read_table
from eomgen.products.fields.documents.reading import hamiltonian_from_data
from eomgen.products.fields.hamiltonian.methods import method_for
from eomgen.products.fields.hamiltonian.model import _change_of_energy
from eomgen.products.fields.hamiltonian.solution import HamiltonianSolution, StepErrors, by_tolerance, draw
from tests.hamiltonian.systems import OSCILLATOR

N, T = 12, np.linspace(0.0, 2.0, 5)
Q, P = np.random.default_rng(1).normal(size=(2, 5, N))
TOTAL = np.array([2.0, 2.5, 1.0, 2.0, 2.25])


def solution(**changes: Any) -> HamiltonianSolution:
    names = {"q": [f"q{k}" for k in range(N)], "p": [f"p{k}" for k in range(N)], "outputs": ["r"]}
    units = {"q": ["m"] * N, "p": ["kg m/s", ""] * (N // 2), "outputs": [""]}
    metadata = {"name": "chain", "method": "omf4", "step": 0.5, "names": names, "units": units}
    energy = {"kinetic": TOTAL - 1.0, "potential": np.ones(5), "total": TOTAL}
    given: dict[str, Any] = {"energy": energy, "outputs": {"r": T**2}, "stats": {"steps": 4}, "success": True}
    return HamiltonianSolution(T, Q, P, message="reached t = 2", metadata=metadata, **(given | changes))


def test_files_have_a_column_for_each_quantity(tmp_path: Path) -> None:
    run = solution()
    expected = {"t": T, "q3": Q[:, 3], "p11": P[:, 11], "outputs.r": T**2, "energy.kinetic": TOTAL - 1.0}
    names, rows = read_table(run.save(tmp_path / "run.csv"))
    assert names == list(run.columns()) and len(names) == 1 + 2 * N + 1 + 3
    with np.load(run.save(tmp_path / "run.npz")) as stored:
        for name, values in expected.items():
            np.testing.assert_array_equal(rows[:, names.index(name)], values)
            np.testing.assert_array_equal(stored[name], values)
        (told,) = (json.loads(str(stored[name])) for name in stored.files if stored[name].dtype.kind in "US")
    assert told["message"] == "reached t = 2" and told["stats"] == {"steps": 4} and told["step"] == 0.5
    assert told["error_estimate"]["relative"] is None and told["error_estimate"]["lost_at"] is None
    with pytest.raises(eomgen.UsageError, match=r"cannot be saved as \.mat; try: \.npz or \.csv"):
        run.save(tmp_path / "run.mat")


@pytest.mark.parametrize(
    ("total", "error"), [(TOTAL, 0.5), (TOTAL - 2.0, 1.0 / 1.5), (0.0 * TOTAL, 0.0), (-TOTAL, 0.5)]
)
def test_the_error_of_the_energy_is_relative_to_its_start_or_its_largest_part(total: Any, error: float) -> None:
    energy = {"kinetic": 0.0 * total if not np.any(total) else TOTAL - 1.0, "potential": 0.0 * total, "total": total}
    assert solution(energy=energy).energy_error == pytest.approx(error, rel=1e-15)


def test_pictures_have_ten_curves_and_the_change_of_the_energy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of long motions by 4000 rows."""
    figures: list[Any] = []
    saved = "eomgen.products.fields.hamiltonian.solution.save_figure"
    monkeypatch.setattr(saved, lambda figure, path: figures.append(figure.axes) or path)
    assert draw(solution(), Path("folder")) == [Path("folder/motion.png")]
    draw(solution(outputs={}), Path())
    t = np.arange(9000.0)
    draw(
        HamiltonianSolution(t, *2 * (np.tile(t[:, None], N),), {"total": t}, {}, {}, True, "", solution().metadata),
        Path(),
    )
    figure, without, long = figures
    labels = ["coordinates, m", "momenta", "outputs", "change of H"]
    assert [axes.get_ylabel() for axes in figure] == labels
    assert [axes.get_ylabel() for axes in without] == [labels[0], labels[1], labels[3]]
    for axes, values, name in ((figure[0], Q, "q"), (figure[1], P, "p")):
        lines = axes.get_lines()
        assert [line.get_label() for line in lines] == [f"{name}{k}" for k in range(10)]
        assert axes.get_legend().get_title().get_text() == "2 more in the table"
        for number, line in enumerate(lines):
            np.testing.assert_array_equal(line.get_xydata().T, [T, values[:, number]])
    np.testing.assert_array_equal(figure[2].get_lines()[0].get_ydata(), T**2)
    np.testing.assert_array_equal(figure[3].get_lines()[0].get_ydata(), TOTAL - TOTAL[0])
    assert figure[0].get_title() == "chain: omf4, step 0.5"
    x = long[0].get_lines()[0].get_xdata()
    assert len(x) == 4000 and (x[0], x[-1]) == (0.0, 8999.0) and np.diff(x).max() == 3.0


def test_errors_by_a_tolerance_are_differences_as_parts_of_the_range() -> None:
    rows = np.array([[0.0, 5.0], [1.0, 5.0], [4.0, 5.0]])
    finer = rows + np.array([[0.0, 0.0], [0.5, 0.02], [-0.2, 0.01]])
    found = by_tolerance(rows, finer, np.array([0.0, 1.0, 2.0]), 1e-6, ["x", "p_x"])
    assert (found.relative, found.name, found.error, found.lost_at) == pytest.approx((0.125, "x", 0.5, 1.0))
    assert found.relative_at == pytest.approx([0.0, 0.125, 0.05]) and found.method == "a run at tolerance 1e-07"
    assert str(found).startswith("above 10 % of the motion from t = 1 on; by a run at tolerance 1e-07")
    small = by_tolerance(rows, rows + 0.004, np.arange(3.0), 1e-6, ["x", "p_x"])
    assert str(small) == "0.004 of x, 0.1 % of its motion; by a run at tolerance 1e-07"
    failed = by_tolerance(rows, None, np.arange(3.0), 1e-6, ["x", "p_x"])
    assert not failed.available and failed.reason == "a run at tolerance 1e-07 failed"
    assert StepErrors().summary()["lost_at"] is None and StepErrors(order=2.0).summary()["order"] == 2.0


@pytest.mark.parametrize(
    ("sizes", "total", "said", "failed"),
    [
        ([1, 1, 1], [1, 1.29, 1], False, False),
        ([1, 1, 1], [1, 1.31, 1], True, False),
        ([1, 1, 1], [1, 1, -9.5], True, True),
        ([1, 1, 1], [1, 1, -8.5], True, False),
        ([1e-9, 1, 1], [0, 0.29, 0.1], False, False),  # from a hilltop, where all parts of H are next to 0
        ([1, 1000, 1, 1, 1], [-1, 290, -1, -1, -1], False, False),  # through an encounter with parts of 1000
        ([1, 1000, 1, 1, 1], [-1, -1, 290, -1, -1], True, True),
    ],
)
def test_changes_of_energy_are_held_against_its_parts(
    sizes: list[float], total: list[float], said: bool, failed: bool
) -> None:
    parts = {"kinetic": 0.6 * np.array(sizes), "potential": -0.4 * np.array(sizes), "total": np.array(total)}
    document = hamiltonian_from_data(OSCILLATOR)
    text, exploded = _change_of_energy(parts, method_for(document, "leapfrog"), -0.25)
    worst = max(total, key=lambda value: abs(value - total[0]))
    assert (text != "", exploded) == (said, failed)
    assert not said or (f"goes from {total[0]:.6g} to {worst:.6g}:" in text and "a step smaller than 0.25, or" in text)
    adaptive, _ = _change_of_energy(parts, method_for(document, "rk45"), 0.25)
    assert not said or adaptive.endswith("try: a smaller tolerance")


def test_gradients_of_a_step_are_counted_for_compositions_alone() -> None:
    document = hamiltonian_from_data(OSCILLATOR)
    for name, gradients in {"leapfrog": 1, "omf4": 5, "suzuki4": 5, "gauss6": 0, "rk4": 0}.items():
        made = method_for(document, name)
        assert (made.gradients, made.is_composition, made.chooses_steps) == (gradients, gradients > 0, False)
        assert sum(made.fractions) == pytest.approx(2.0 if made.is_composition else 1.0)
    assert method_for(document, "leapfrog").work(3) == 0
    # q and p of each stage with eight vectors and those of Krylov, and a triangle of 36 + 1 by 36 + 3
    assert method_for(document, "gauss6").work(3) == 6 * (1 + 3 * (8 + 36)) + 37 * 39
    assert math.isclose(method_for(document, "rk4").stability_limit ** 2, 8.0)
